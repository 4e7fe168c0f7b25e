"""Tools that track a measured motion: residual reduction (RRA) and computed muscle control (CMC)."""

from typing import Annotated

from osimlite.schema.base import Object, make_empty_list
from osimlite.schema.fields import (
    Consequence,
    LegacyFlag,
    LegacyInteger,
    LegacyMany,
    LegacyNumber,
    LegacyReals,
    Reals,
    Reference,
    Value,
    real,
    reals,
    word,
)
from osimlite.schema.references import (
    BodyName,
    LegacyCoordinateName,
    LegacyInputMotion,
    LegacyInputTable,
    LegacyOutputModel,
    Named,
    Names,
    make_input_file,
    make_name_list,
)
from osimlite.schema.sets import Set
from osimlite.schema.tools.dynamics import AbstractTool

_Direction = Annotated[Reals, reals(least=3, most=3, legacy=True)]
_TaskSetFile = Annotated[str, make_input_file("CMC_TaskSet", legacy=True, required=True)]
_ControlSetFile = Annotated[str, make_input_file("ControlSet", legacy=True)]
_Optimizer = Annotated[str, word("ipopt", "cfsqp", legacy=True)]


def _make_body_reference(*words: str, consequence: Consequence = "refused") -> Reference:
    """Return the mark of a property that holds the name of a body or one of some special words.

    Returns:
        A reference that may be absent.
    """
    return Reference(
        "body-name-or-com",
        "Body",
        required=False,
        legacy=True,
        words=words,
        consequence=consequence,
    )


class TrackingTask(Object, abstract=True):
    """Base class of quantities that a controller follows."""

    on: LegacyFlag = True
    """Whether the task is active."""
    weight: LegacyReals = (1.0, 1.0, 1.0)
    """Weights of its accelerations relative to other tasks, one number for each component."""


class StateTrackingTask(TrackingTask, abstract=True):
    """Task to follow a state."""


class MuscleStateTrackingTask(StateTrackingTask):
    """Task to follow a state of a muscle; the name is that of the muscle and its state."""


class CMC_Task(TrackingTask, abstract=True):
    """Task to follow a point, an orientation or a coordinate."""

    wrt_body: Annotated[Named, _make_body_reference("center_of_mass", "-1")] = ""
    """The body whose motion is followed; coordinates do not need it."""
    express_body: Annotated[Named, _make_body_reference("ground", "-1")] = ""
    """The body along whose axes the motion is given; coordinates do not need it."""
    active: Annotated[tuple[bool, ...], Value("bool", "list", legacy=True)] = (False, False, False)
    """Whether each of the three components counts; a coordinate has the first only."""
    kp: LegacyReals = (1.0, 1.0, 1.0)
    """Acceleration per deviation of position."""
    kv: LegacyReals = (0.5, 0.5, 0.5)
    """Acceleration per deviation of speed; critical damping is at twice the root of `kp`."""
    ka: LegacyReals = (1.0, 1.0, 1.0)
    """Factor of the desired acceleration."""
    r0: _Direction = (0.0, 0.0, 0.0)
    """Direction of the first component; coordinates do not need it."""
    r1: _Direction = (0.0, 0.0, 0.0)
    """Direction of the second component; coordinates do not need it."""
    r2: _Direction = (0.0, 0.0, 0.0)
    """Direction of the third component; coordinates do not need it."""


class CMC_Joint(CMC_Task):
    """Task to follow a coordinate.

    The name selects the column of the desired motion, and must be that of a coordinate, too.
    """

    name_reference = Reference("coordinate-name", "Coordinate")

    wrt_body: Annotated[Named, _make_body_reference(consequence="ignored")] = ""
    express_body: Annotated[Named, _make_body_reference(consequence="ignored")] = ""
    coordinate: LegacyCoordinateName = ""
    """Name of the coordinate."""
    limit: LegacyNumber = 0.0
    """Deviation towards which the weight grows."""


class CMC_Point(CMC_Task):
    """Task to follow a point of a body."""

    point: _Direction = (0.0, 0.0, 0.0)
    """Position of the point in its body."""


class SMC_Joint(CMC_Joint):
    """Task to follow a coordinate by sliding mode control."""

    surface_error_boundary: LegacyNumber = 100.0
    """Thickness of the layer around the sliding surface."""


class CMC_TaskSet(Set):
    """Tasks that RRA and CMC follow."""

    objects: LegacyMany[TrackingTask] = make_empty_list()
    """Tasks in any order."""


class CMCTool(AbstractTool):
    """Finds excitations of muscles that make a model follow a measured motion."""

    solve_for_equilibrium_for_auxiliary_states: LegacyFlag = True
    actuators_to_exclude: Annotated[
        Names, make_name_list("actuator-name", "Actuator", consequence="left out")
    ] = ()
    """Actuators and groups of them that are not controlled."""
    desired_points_file: LegacyInputTable = ""
    """Measured points that tasks follow."""
    desired_kinematics_file: LegacyInputMotion = ""
    """The measured motion."""
    task_set_file: _TaskSetFile = ""
    """File of the tasks to follow, with their gains and weights."""
    constraints_file: _ControlSetFile = ""
    """Bounds of the controls over time."""
    rra_controls_file: _ControlSetFile = ""
    """Controls that RRA computed; controls of residuals stay near them."""
    lowpass_cutoff_frequency: Annotated[float, real("Hz", legacy=True)] = -1.0
    """Cut-off frequency of the filter of the motion; negative for no filter."""
    cmc_time_window: Annotated[float, real("s", "> 0", legacy=True)] = 0.01
    """Time in which muscles reach the requested force."""
    use_fast_optimization_target: LegacyFlag = True
    """Whether accelerations must be met exactly, which is faster and can fail."""
    optimizer_algorithm: _Optimizer = "ipopt"
    """Optimizer that distributes forces over actuators."""
    numerical_derivative_step_size: LegacyNumber = 1e-4
    """Step of the optimizer's numerical derivatives."""
    optimization_convergence_tolerance: LegacyNumber = 1e-4
    """Convergence tolerance of the optimizer."""
    optimizer_max_iterations: Annotated[int, Value("int", domain="> 0", legacy=True)] = 1000
    """Largest number of iterations of the optimizer."""
    optimizer_print_level: LegacyInteger = 0
    """Amount of output of the optimizer, from 0 to 3."""
    use_verbose_printing: LegacyFlag = False
    """Whether the tool prints its progress."""


class RRATool(AbstractTool):
    """Changes a motion and the mass distribution of a model to reduce residual forces."""

    desired_points_file: LegacyInputTable = ""
    """Measured points that tasks follow."""
    desired_kinematics_file: LegacyInputMotion = ""
    """The measured motion."""
    task_set_file: _TaskSetFile = ""
    """File of the tasks to follow, with their gains and weights."""
    constraints_file: _ControlSetFile = ""
    """Bounds of the controls over time."""
    lowpass_cutoff_frequency: Annotated[float, real("Hz", legacy=True)] = -1.0
    """Cut-off frequency of the filter of the motion; negative for no filter."""
    optimizer_algorithm: _Optimizer = "ipopt"
    """Optimizer that distributes forces over actuators."""
    numerical_derivative_step_size: LegacyNumber = 1e-4
    """Step of the optimizer's numerical derivatives."""
    optimization_convergence_tolerance: LegacyNumber = 1e-5
    """Convergence tolerance of the optimizer."""
    adjust_com_to_reduce_residuals: LegacyFlag = False
    """Whether a center of mass is moved, and the model written with it."""
    initial_time_for_com_adjustment: LegacyNumber = -1.0
    """Start of the time over which residuals are averaged; -1 for the start of the run."""
    final_time_for_com_adjustment: LegacyNumber = -1.0
    """End of the time over which residuals are averaged; -1 for the end of the run."""
    adjusted_com_body: BodyName = ""
    """Body whose center of mass is moved, usually the heaviest."""
    output_model_file: LegacyOutputModel = ""
    """File for the changed model; adjusted_model.osim if there is no name."""
    use_verbose_printing: LegacyFlag = False
    """Whether the tool prints its progress."""
