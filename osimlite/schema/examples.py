"""Components of OpenSim's own examples; files made with them exist."""

from osimlite.schema.base import ModelComponent
from osimlite.schema.controllers import Controller
from osimlite.schema.fields import Number
from osimlite.schema.references import NumberInput, PathActuatorPath, ScalarActuatorSocket


class HopperDevice(ModelComponent):
    """A device with a cable, for a jumping leg."""

    actuator_name: PathActuatorPath = "cableAtoB"


class ToyPropMyoController(Controller):
    """Drives an actuator in proportion to an activation."""

    socket_actuator: ScalarActuatorSocket = ""
    input_activation: NumberInput = ""
    gain: Number = 1.0


class ToyReflexController(Controller):
    """Drives muscles in proportion to how far they are stretched."""

    gain: Number = 1.0
