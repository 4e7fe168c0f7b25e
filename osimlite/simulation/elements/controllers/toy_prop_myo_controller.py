"""A control in proportion to an activation, which osimlite does not compute."""

from __future__ import annotations

from collections.abc import Iterator

from osimlite.schema.examples import ToyPropMyoController
from osimlite.simulation.elements.controls import Drive
from osimlite.simulation.elements.gather import ElementBuilder


def drives(builder: ElementBuilder, controller: ToyPropMyoController) -> Iterator[Drive]:
    """Why its actuator cannot be computed."""
    actuator = builder.target(controller, "socket_actuator", controller.socket_actuator)
    why = f" driven by the ToyPropMyoController '{builder.path(controller)}', which follows an activation"
    yield Drive(actuator, builder.unsupported(actuator, why))
