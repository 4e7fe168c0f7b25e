"""Studies of Moco: an optimal control problem and its solver; and the tools that make studies."""

from typing import Annotated

from osimlite.schema.base import Object, make_default, make_empty_list
from osimlite.schema.facts import Facts
from osimlite.schema.fields import (
    Flag,
    Integer,
    Many,
    MaybeFlag,
    NamesOf,
    Number,
    Reals,
    Reference,
    Single,
    Value,
    maybe,
    real,
    reals,
    word,
)
from osimlite.schema.moco.goals import MocoGoal
from osimlite.schema.moco.parts import (
    ControlWeights,
    MarkerWeights,
    MaybeOfStates,
    MocoBounds,
    MocoFinalBounds,
    MocoInitialBounds,
    MocoParameter,
    MocoVariableInfo,
    MocoWeightSet,
    OfControls,
    OfMarkers,
    OfStates,
    PatternOfControls,
    PatternOfStates,
)
from osimlite.schema.moco.path_constraints import MocoPathConstraint
from osimlite.schema.model import Model
from osimlite.schema.references import InputTable, OutputFolder
from osimlite.schema.tools.processors import ModelProcessor, TableProcessor


class MocoPhase(Object):
    """Period in which one model moves under one set of goals."""

    model: Single[ModelProcessor] = make_default(
        ModelProcessor, name="model", model=lambda: Model.build({"name": "model"}, set())
    )
    """Model that moves."""
    time_initial_bounds: Single[MocoInitialBounds] = make_default(
        MocoInitialBounds, name="time_initial_bounds"
    )
    """Bounds of the initial time."""
    time_final_bounds: Single[MocoFinalBounds] = make_default(
        MocoFinalBounds, name="time_final_bounds"
    )
    """Bounds of the final time."""
    default_speed_bounds: Single[MocoBounds] = make_default(
        MocoBounds, name="default_speed_bounds", bounds=(-50.0, 50.0)
    )
    """Bounds of speeds without bounds of their own."""
    bound_activation_from_excitation: Flag = True
    """Whether activations without bounds have those of their excitations."""
    state_infos: Annotated[Many[MocoVariableInfo], OfStates] = make_empty_list()
    """Bounds of states by path."""
    state_infos_pattern: Annotated[Many[MocoVariableInfo], PatternOfStates] = make_empty_list()
    """Bounds of states by patterns of paths."""
    control_infos: Annotated[Many[MocoVariableInfo], OfControls] = make_empty_list()
    """Bounds of controls by path."""
    control_infos_pattern: Annotated[Many[MocoVariableInfo], PatternOfControls] = make_empty_list()
    """Bounds of controls by patterns of paths."""
    input_control_infos: Many[MocoVariableInfo] = make_empty_list()
    """Bounds of inputs of controllers by path."""
    input_control_infos_pattern: Many[MocoVariableInfo] = make_empty_list()
    """Bounds of inputs of controllers by patterns of paths."""
    parameters: Many[MocoParameter] = make_empty_list()
    """Properties of the model that are optimized."""
    goals: Many[MocoGoal] = make_empty_list()
    """Costs and constraints at the ends."""
    path_constraints: Many[MocoPathConstraint] = make_empty_list()
    """Constraints that must hold at every time of the motion."""
    kinematic_constraint_bounds: Single[MocoBounds] = make_default(
        MocoBounds, name="kinematic_constraint_bounds", bounds=(0.0,)
    )
    """Bounds of the errors of the model's constraints."""
    multiplier_bounds: Single[MocoBounds] = make_default(
        MocoBounds, name="multiplier_bounds", bounds=(-1000.0, 1000.0)
    )
    """Bounds of the multipliers of the model's constraints."""


class MocoProblem(Object):
    """An optimal control problem."""

    phases: Single[MocoPhase] = make_default(MocoPhase, name="phases")
    """Phases of the problem; one is supported so far."""


class MocoSolver(Object, abstract=True):
    """Solver of an optimal control problem."""


class MocoDirectCollocationSolver(MocoSolver, abstract=True):
    """Transcribes the problem into a nonlinear program of the values at the points of a mesh."""

    facts = Facts(
        refused="num_mesh_intervals optim_max_iterations optim_convergence_tolerance optim_constraint_tolerance"
    )

    num_mesh_intervals: Annotated[int, Value("int", domain="> 0")] = 100
    """Number of equal intervals of the mesh."""
    mesh: Annotated[Reals, reals()] = ()
    """Nodes of a mesh of unequal intervals, from 0 to 1."""
    verbosity: Annotated[int, Value("int", choices=(0, 1, 2))] = 2
    """Amount of output of the solver."""
    transcription_scheme: Annotated[
        str,
        word(
            "trapezoidal",
            "hermite-simpson",
            *(f"legendre-gauss-{degree}" for degree in range(1, 10)),
            *(f"legendre-gauss-radau-{degree}" for degree in range(1, 10)),
        ),
    ] = "hermite-simpson"
    """Collocation scheme for the equations of motion."""
    interpolate_control_mesh_interior_points: Flag = True
    """Whether controls within intervals lie on lines between nodes."""
    enforce_constraint_derivatives: MaybeFlag = True
    """Whether the derivatives of the model's constraints are met too."""
    multibody_dynamics_mode: Annotated[str, word("explicit", "implicit")] = "explicit"
    """Whether accelerations are computed, or are variables."""
    optim_solver: Annotated[str, word("ipopt", "snopt")] = "ipopt"
    """Optimizer of the nonlinear program."""
    optim_max_iterations: Annotated[int, Value("int", domain=">= 0 or -1")] = -1
    """Largest number of iterations of the optimizer; -1 for its own default."""
    optim_convergence_tolerance: Annotated[float, real(domain="> 0 or -1")] = -1.0
    """Convergence tolerance of the optimizer; -1 for its own default."""
    optim_constraint_tolerance: Annotated[float, real(domain="> 0 or -1")] = -1.0
    """Constraint tolerance of the optimizer; -1 for its own default."""
    optim_hessian_approximation: Annotated[str, word("limited-memory", "exact")] = "limited-memory"
    """Source of the optimizer's second derivatives."""
    optim_ipopt_print_level: Integer = -1
    """Amount of output of Ipopt, from 0 to 12; -1 for its own default."""
    guess_file: InputTable = ""
    """File of the initial guess."""
    velocity_correction_bounds: Single[MocoBounds] = make_default(
        MocoBounds, name="velocity_correction_bounds", bounds=(-0.1, 0.1)
    )
    """Bounds of the corrections that constraints make to velocities."""
    implicit_multibody_acceleration_bounds: Single[MocoBounds] = make_default(
        MocoBounds, name="implicit_multibody_acceleration_bounds", bounds=(-1000.0, 1000.0)
    )
    """Bounds of accelerations that are variables."""
    implicit_auxiliary_derivative_bounds: Single[MocoBounds] = make_default(
        MocoBounds, name="implicit_auxiliary_derivative_bounds", bounds=(-1000.0, 1000.0)
    )
    """Bounds of derivatives of auxiliary states that are variables."""
    minimize_lagrange_multipliers: Flag = False
    """Whether multipliers of constraints are a cost."""
    lagrange_multiplier_weight: Number = 1.0
    """Weight of the cost of multipliers."""
    kinematic_constraint_method: Annotated[str, word("Posa2016", "Bordalba2023")] = "Posa2016"
    """Method for the model's constraints, by the names of its authors."""


class MocoCasADiSolver(MocoDirectCollocationSolver):
    """Solves a problem with CasADi."""

    scale_variables_using_bounds: Flag = False
    """Whether variables are scaled by their bounds."""
    parameters_require_initsystem: Flag = True
    """Whether the model is initialized anew for each value of the parameters."""
    optim_sparsity_detection: Annotated[str, word("none", "random", "initial-guess")] = "none"
    """Method for detecting derivatives that are always zero."""
    optim_write_sparsity: Annotated[str, Value("string")] = ""
    """Beginning of the names of files for sparsity patterns; left out, none are written."""
    optim_finite_difference_scheme: Annotated[str, word("central", "forward", "backward")] = (
        "central"
    )
    """Scheme of finite differences for derivatives."""
    parallel: Annotated[int | None, Value("int", "optional")] = None
    """Number of threads: 0 for one, 1 for the number of processors."""
    output_interval: Integer = 0
    """Number of iterations between two written motions; 0 for none."""
    minimize_implicit_multibody_accelerations: Flag = False
    """Whether accelerations that are variables are a cost."""
    implicit_multibody_accelerations_weight: Number = 1.0
    """Weight of the cost of accelerations."""
    minimize_implicit_auxiliary_derivatives: Flag = False
    """Whether derivatives of auxiliary states that are variables are a cost."""
    implicit_auxiliary_derivatives_weight: Number = 1.0
    """Weight of the cost of derivatives of auxiliary states."""
    enforce_path_constraint_mesh_interior_points: Flag = False
    """Whether path constraints are met within intervals too."""
    minimize_state_projection_distance: Flag = True
    """Whether the distance by which states are projected onto the constraints is a cost."""
    state_projection_distance_weight: Number = 1e-6
    """Weight of the cost of the projection distance."""
    projection_slack_variable_bounds: Single[MocoBounds] = make_default(
        MocoBounds, name="projection_slack_variable_bounds", bounds=(-0.001, 0.001)
    )
    """Bounds of the variables that project states onto the constraints."""


class MocoStudy(Object):
    """A problem with its solver."""

    write_solution: Flag = False
    """Whether the solution is written."""
    results_directory: OutputFolder = "./"
    """Folder for the solution."""
    problem: Single[MocoProblem] = make_default(MocoProblem, name="problem")
    """Optimal control problem."""
    solver: Single[MocoSolver] = make_default(MocoCasADiSolver, name="solver")
    """Solver of the problem."""


class MocoTool(Object, abstract=True):
    """Base class of tools that make a study for a common task."""

    initial_time: Annotated[float | None, maybe("s")] = None
    """Initial time of the motion; left out, that of the data."""
    final_time: Annotated[float | None, maybe("s")] = None
    """Final time of the motion; left out, that of the data."""
    mesh_interval: Annotated[float, real("s", "> 0")] = 0.02
    """Length of an interval of the mesh."""
    clip_time_range: Flag = False
    """Whether the times are moved slightly into the data."""
    model: Single[ModelProcessor] = make_default(ModelProcessor, name="model")
    """Model with its operators."""


class MocoInverse(MocoTool):
    """Finds controls of muscles for a prescribed motion."""

    kinematics: Annotated[Single[TableProcessor], OfStates] = make_default(
        TableProcessor, name="kinematics"
    )
    """Prescribed motion."""
    kinematics_allow_extra_columns: Flag = False
    """Whether the table may have columns that are no states."""
    minimize_sum_squared_activations: Flag = False
    """Whether squares of activations are a cost."""
    max_iterations: Annotated[int | None, Value("int", "optional")] = None
    """Largest number of iterations of the optimizer."""
    convergence_tolerance: Number = 1e-3
    """Convergence tolerance of the optimizer."""
    constraint_tolerance: Number = 1e-3
    """Constraint tolerance of the optimizer."""
    output_paths: Annotated[
        tuple[str, ...],
        Reference("input", "Output", "list", required=False),
        NamesOf(Reference("pattern", "output", consequence="left out")),
    ] = ()
    """Outputs that are computed for the solution, as patterns of `path|output`."""
    reserves_weight: Number = 1.0
    """Weight of the controls of reserve actuators in the cost."""


class MocoTrack(MocoTool):
    """Finds a motion that follows measured states or markers."""

    states_reference: Annotated[Single[TableProcessor], MaybeOfStates] = make_default(
        TableProcessor, name="states_reference"
    )
    """States to follow."""
    states_global_tracking_weight: Number = 1.0
    """Weight of deviations of states."""
    states_weight_set: Annotated[
        Single[MocoWeightSet],
        NamesOf(Reference("state-path", "state variable", consequence="left out")),
    ] = make_default(MocoWeightSet, name="states_weight_set")
    """Weights by paths of states."""
    scale_state_weights_with_range: Flag = False
    """Whether deviations are divided by the ranges of the coordinates."""
    track_reference_position_derivatives: Flag = False
    """Whether speeds are followed that are derivatives of the measured values."""
    markers_reference: Annotated[Single[TableProcessor], OfMarkers] = make_default(
        TableProcessor, name="markers_reference"
    )
    """Markers to follow."""
    markers_global_tracking_weight: Number = 1.0
    """Weight of deviations of markers."""
    markers_weight_set: MarkerWeights = make_default(MocoWeightSet, name="markers_weight_set")
    """Weights by names of markers."""
    allow_unused_references: Flag = False
    """Whether tables may have columns that the model lacks."""
    guess_file: InputTable = ""
    """File of the initial guess."""
    apply_tracked_states_to_guess: Flag = False
    """Whether the measured states are part of the initial guess."""
    minimize_control_effort: Flag = True
    """Whether squares of controls are a cost."""
    control_effort_weight: Number = 0.001
    """Weight of the cost of controls."""
    controls_weight_set: ControlWeights = make_default(MocoWeightSet, name="controls_weight_set")
    """Weights by paths of controls."""
