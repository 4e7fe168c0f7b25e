"""An actuator with six controls, which does nothing as long as nothing drives it."""

from typing import Any

from osimlite.schema.actuators import BodyActuator
from osimlite.simulation.elements.controls import controllers
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.geometries.geometry import NOTHING
from osimlite.simulation.elements.kind import Kind


def _refuse_controls(builder: ElementBuilder, force: Any) -> None:
    """A PrescribedController has one function for the six controls; OpenSim 4.6 takes the others from the memory."""
    for controller in controllers(builder):
        named = (builder.target(controller, "socket_actuators", item) for item in controller.socket_actuators)
        if any(item is force for item in named):
            raise builder.unsupported(force, f" driven by '{builder.path(controller)}'")


KIND = Kind(BodyActuator, NOTHING, check=_refuse_controls)
