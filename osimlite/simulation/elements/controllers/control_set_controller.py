"""Controls in a document of control curves, or in a table."""

from __future__ import annotations

from collections.abc import Iterator

from osimlite.base.text import did_you_mean
from osimlite.errors import ModelError
from osimlite.io.tables.storage import beside
from osimlite.schema.controller_types import ControlSetController
from osimlite.simulation.elements.control_sets import ControlCurves
from osimlite.simulation.elements.controls import Drive, actuators_by_name, named
from osimlite.simulation.elements.gather import ElementBuilder


def drives(builder: ElementBuilder, controller: ControlSetController) -> Iterator[Drive]:
    """What it does to the actuators that it names, and to the first of each name in its file.

    Raises:
        ModelError: there is no actuator of a name in the file, or a control has no meaning.
    """
    if controller.controls_file in ("", "Unassigned"):
        return
    path = beside(builder.folder, str(controller.controls_file))
    result = ControlCurves.read(path)
    driven = named(builder, controller)
    actuators = actuators_by_name(builder)
    for name in result.actuators:
        if name not in actuators:
            raise ModelError(
                f"'{builder.path(controller)}' has no actuator for the control '{name}' of its file"
                f"{did_you_mean(name, actuators)}",
                file=str(path),
            )
        if all(item.name != name for item in driven):
            driven.append(actuators[name])
    for actuator in driven:
        curve = result.of(actuator.name)
        if curve is not None:
            yield Drive(actuator, curve)
