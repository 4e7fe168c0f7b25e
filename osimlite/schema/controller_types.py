"""Controllers, which set the controls of actuators."""

from typing import Annotated

from osimlite.schema.base import ModelComponent, Object, make_default, make_empty_list
from osimlite.schema.facts import Facts
from osimlite.schema.fields import Many, Single, Value, Vector, real
from osimlite.schema.functions import FunctionSet
from osimlite.schema.references import MaybeFileName, NumberInputs
from osimlite.schema.sets import Controller


class PrescribedController(Controller):
    """Controls as functions of time, one for each actuator in order, or as columns of a file."""

    ControlFunctions: Single[FunctionSet] = make_default(FunctionSet, name="ControlFunctions")
    """Controls over time, one for each actuator in the order of `socket_actuators`."""
    controls_file: MaybeFileName = None
    """File of a column for each actuator, labelled with its name or path."""
    interpolation_method: Annotated[int | None, Value("int", "optional")] = None
    """Interpolation between rows: 0 steps, 1 lines (if left out), 3 cubic, 5 quintic splines."""


class TrackingController(Controller, abstract=True):
    """Follows a desired motion."""


class CorrectionController(TrackingController):
    """Applies to every coordinate a force in proportion to the errors of its value and speed."""

    kp: Annotated[float, real(legacy=True)] = 100.0
    """Force per deviation of a coordinate."""
    kv: Annotated[float, real(legacy=True)] = 20.0
    """Force per deviation of the speed of a coordinate."""


class CMC(TrackingController):
    """Computed muscle control; the tool of the same name sets it up."""


class InputController(Controller, abstract=True):
    """Computes controls from the outputs of other components."""

    input_controls: NumberInputs = ()
    """Outputs from which the controls are computed, each as `path|output`."""


class SynergyVector(Object):
    """The weights with which one synergy drives the actuators, in their order."""

    synergy_weights: Vector = ()
    """A weight for each actuator, in the order of `socket_actuators`."""


class SynergyController(InputController):
    """Drives many actuators from few inputs, each spread by its synergy vector."""

    synergy_vectors: Many[SynergyVector] = make_empty_list()
    """A vector for each input, in order; the controls are the sum of inputs times vectors."""


class ControlDistributor(ModelComponent):
    """Makes the elements of a vector of controls available as single outputs."""

    facts = Facts(outputs="controls[]")
