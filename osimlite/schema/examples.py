"""Components of OpenSim's own examples; files made with them exist."""

from osimlite.schema.base import ModelComponent
from osimlite.schema.facts import Facts
from osimlite.schema.fields import Number
from osimlite.schema.references import NumberInput, PathActuatorPath, ScalarActuatorSocket
from osimlite.schema.sets import Controller


class HopperDevice(ModelComponent):
    """A device with a cable, for a jumping leg."""

    facts = Facts(outputs="com_height height length power speed tension")

    actuator_name: PathActuatorPath = "cableAtoB"
    """Path, from the device, of the actuator to which its outputs refer."""


class ToyPropMyoController(Controller):
    """Drives an actuator in proportion to an activation."""

    facts = Facts(outputs="myo_control")

    socket_actuator: ScalarActuatorSocket = ""
    """The actuator that is controlled."""
    input_activation: NumberInput = ""
    """The output that the control follows, as `path|output`."""
    gain: Number = 1.0
    """Control per activation; below an activation of 0.31 there is no control."""


class ToyReflexController(Controller):
    """Drives muscles in proportion to their lengthening speed."""

    gain: Number = 1.0
    """Control of a muscle that lengthens at its maximum contraction velocity."""
