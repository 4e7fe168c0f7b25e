"""Controllers: what sets the controls of actuators."""

from typing import Annotated

from osimlite.schema.base import ModelComponent, Object, made, none
from osimlite.schema.controllers import Controller
from osimlite.schema.fields import Many, Single, Value, Vector, real
from osimlite.schema.functions import FunctionSet
from osimlite.schema.references import LegacyFileName, MaybeFileName, NumberInputs


class PrescribedController(Controller):
    """Controls as functions of time, one for each actuator in order, or as columns of a file."""

    ControlFunctions: Single[FunctionSet] = made(FunctionSet, name="ControlFunctions")
    controls_file: MaybeFileName = None
    interpolation_method: Annotated[int | None, Value("int", "optional")] = None


class ControlSetController(Controller):
    """Controls read from a file of control curves."""

    controls_file: LegacyFileName = "Unassigned"


class TrackingController(Controller, abstract=True):
    """Follows a desired motion."""


class CorrectionController(TrackingController):
    """Tracks with accelerations `kp` times the error plus `kv` times its rate."""

    kp: Annotated[float, real(legacy=True)] = 100.0
    kv: Annotated[float, real(legacy=True)] = 20.0


class CMC(TrackingController):
    """Computed muscle control; the tool of the same name sets it up."""


class InputController(Controller, abstract=True):
    """Computes controls from the outputs of other components."""

    input_controls: NumberInputs = ()


class SynergyVector(Object):
    """The weights with which one synergy drives the actuators, in their order."""

    synergy_weights: Vector = ()


class SynergyController(InputController):
    """Drives many actuators from few inputs, each spread by its synergy vector."""

    synergy_vectors: Many[SynergyVector] = none()


class ControlDistributor(ModelComponent):
    """Hands a vector of controls out as single outputs."""
