"""Documents of control curves, which a ControlSetController reads."""

from typing import Annotated

from osimlite.schema.base import Object, make_empty_list
from osimlite.schema.fields import (
    LegacyFlag,
    LegacyMany,
    LegacyNumber,
    real,
)
from osimlite.schema.references import make_input_file
from osimlite.schema.sets import Controller, Set


class Control(Object, abstract=True):
    """A control over time; its name is that of an actuator, which `.excitation` may follow."""

    is_model_control: LegacyFlag = True
    """Whether the control belongs to the model; others have no effect."""
    extrapolate: LegacyFlag = True
    """Whether straight lines continue before the first node and after the last."""
    default_min: LegacyNumber = 0.02
    """Smallest value that tools choose without `min_nodes`; a simulation does not clip to it."""
    default_max: LegacyNumber = 1.0
    """Largest value that tools choose without `max_nodes`; a simulation does not clip to it."""
    filter_on: LegacyFlag = False
    """Whether CMC smooths the control while it computes it."""


class ControlConstant(Control):
    """Constant control."""

    is_model_control: LegacyFlag = False
    value: LegacyNumber = 0.0
    """Value of the control."""


class ControlLinearNode(Object):
    """A point of a control curve."""

    t: Annotated[float, real(legacy=True)] = 0.0
    """Time at which the control has the value, in seconds."""
    value: LegacyNumber = 0.0
    """Value of the control at that time."""


class ControlLinear(Control):
    """Straight lines between nodes, or steps."""

    use_steps: LegacyFlag = False
    """Whether each value applies from after the time of the previous node up to its own time."""
    x_nodes: LegacyMany[ControlLinearNode] = make_empty_list()
    """The nodes of the control."""
    min_nodes: LegacyMany[ControlLinearNode] = make_empty_list()
    """Nodes of the smallest value that tools choose."""
    max_nodes: LegacyMany[ControlLinearNode] = make_empty_list()
    """Nodes of the largest value that tools choose."""
    kp: LegacyNumber = 100.0
    """Gain with which CMC's smoothing follows the value."""
    kv: LegacyNumber = 20.0
    """Gain with which CMC's smoothing damps changes."""


class ControlSet(Set):
    """The controls of a model over time."""

    objects: LegacyMany[Control] = make_empty_list()
    """The controls, each with the name of an actuator."""


class ControlSetController(Controller):
    """Controls read from a file of control curves."""

    # If the file is missing, OpenSim writes a line to its log and simulates without controls.
    controls_file: Annotated[str, make_input_file("ControlSet or table", legacy=True)] = (
        "Unassigned"
    )
    """File of control curves (.xml) or of columns (.sto)."""
