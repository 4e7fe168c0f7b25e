"""Goals of Moco: quantities that an optimization minimizes, or keeps at given values."""

from typing import Annotated

from osimlite.schema.base import Object, make_default, make_empty_list
from osimlite.schema.facts import Facts
from osimlite.schema.fields import (
    Flag,
    Integer,
    Many,
    Number,
    Reference,
    Single,
    Text,
    Unnamed,
    Value,
    Vec3,
    real,
    vec3,
    word,
)
from osimlite.schema.moco.parts import (
    ControlWeights,
    MocoConstraintInfo,
    MocoParameter,
    MocoScaleFactor,
    MocoWeightSet,
    OfControls,
    OfOutputs,
    OfStates,
    PatternOfControls,
    StatePattern,
    StateWeights,
    Strings,
)
from osimlite.schema.references import Named, Names

DIRECTIONS = ("positive-x", "positive-y", "positive-z", "negative-x", "negative-y", "negative-z")

MEASURES = tuple(f"{load}-{axis}" for load in ("moment", "force") for axis in "xyz")
OutputPath = Annotated[str, Reference("input", "Output"), OfOutputs]
SecondOutputPath = Annotated[str, Reference("input", "Output", required=False), OfOutputs]
Operation = Annotated[str, word("", "addition", "subtraction", "multiplication", "division")]
Variable = Annotated[str, Reference("state-path", "state or control variable")]
FramePath = Annotated[Named, Reference("model-path", "Frame")]
FramePaths = Annotated[Names, Reference("model-path", "Frame", "list", required=False)]
FootFrame = Annotated[Named, Reference("model-path", "PhysicalFrame")]
ContactForcePaths = Annotated[Names, Reference("model-path", "SmoothSphereHalfSpaceForce", "list")]
Direction = Annotated[str, word(*DIRECTIONS)]


class MocoGoal(Object, abstract=True):
    """Base class of costs and endpoint constraints of a motion."""

    enabled: Flag = True
    """Whether the goal is part of the problem."""
    weight: Number = 1.0
    """Weight of a cost relative to others."""
    mode: Annotated[
        str | None, Value("string", "optional", choices=("cost", "endpoint_constraint"))
    ] = None
    """Whether it is a cost or a constraint; left out, the default of the goal."""
    moco_constraint_info: Unnamed[MocoConstraintInfo] = make_default(MocoConstraintInfo)
    """Bounds of the values if it is a constraint."""
    scale_factors: Many[MocoScaleFactor] = make_empty_list()
    """Factors that the optimization finds for reference data."""
    divide_by_displacement: Flag = False
    """Whether the value is divided by the displacement of the center of mass."""
    divide_by_duration: Flag = False
    """Whether the value is divided by the duration."""
    divide_by_mass: Flag = False
    """Whether the value is divided by the mass of the model."""


class MocoFinalTimeGoal(MocoGoal):
    """Final time of the motion."""


class MocoAverageSpeedGoal(MocoGoal):
    """Deviation of the average speed of the center of mass from a desired one."""

    desired_average_speed: Annotated[float, real("m/s")] = 0.0
    """Desired average speed."""


class MocoInitialActivationGoal(MocoGoal):
    """Activations equal to excitations at the start."""


class MocoInitialForceEquilibriumDGFGoal(MocoGoal):
    """Muscles of DeGroote and Fregly in equilibrium of forces at the start."""


class MocoInitialVelocityEquilibriumDGFGoal(MocoGoal):
    """Muscles of DeGroote and Fregly in equilibrium of velocities at the start."""


class MocoControlGoal(MocoGoal):
    """Controls, each to a power, over the motion."""

    facts = Facts(refused="exponent")

    control_weights: ControlWeights = make_default(MocoWeightSet, name="control_weights")
    """Weights by paths of controls."""
    control_weights_pattern: Annotated[Single[MocoWeightSet], PatternOfControls] = make_default(
        MocoWeightSet, name="control_weights_pattern"
    )
    """Weights by patterns of paths, for controls that have none by path."""
    exponent: Annotated[int, Value("int", domain=">= 2")] = 2
    """Power of the controls, at least two."""
    ignore_controlled_actuators: Flag = False
    """Whether controls that controllers of the model set are left out."""
    ignore_input_controls: Flag = False
    """Whether controls that are inputs of controllers are left out."""


class MocoSumSquaredStateGoal(MocoGoal):
    """Squares of states over the motion."""

    state_weights: StateWeights = make_default(MocoWeightSet, name="state_weights")
    """Weights by paths of states."""
    pattern: StatePattern = None
    """Regular expression for the paths of the states that are included."""


class MocoExpressionBasedParameterGoal(MocoGoal):
    """An expression of parameters."""

    expression: Text = ""
    """The expression, in names of `variables`."""
    parameters: Many[MocoParameter] = make_empty_list()
    """Parameters in the expression."""
    variables: Strings = ()
    """The name of each parameter in the expression."""


class MocoPeriodicityGoalPair(Object):
    """Two variables whose values at the start (first) and at the end (second) must be equal."""

    initial_variable: Variable = ""
    """Path of the state or control at the start."""
    final_variable: Variable = ""
    """Path of the state or control at the end; left out, that at the start."""
    negate: Flag = False
    """Whether one value must be the negative of the other."""


class MocoPeriodicityGoal(MocoGoal):
    """A motion that ends as it began."""

    state_pairs: Annotated[Many[MocoPeriodicityGoalPair], OfStates] = make_empty_list()
    """Pairs of states."""
    control_pairs: Annotated[Many[MocoPeriodicityGoalPair], OfControls] = make_empty_list()
    """Pairs of controls."""


class MocoMarkerFinalGoal(MocoGoal):
    """Distance of a point from a target position at the end of the motion."""

    point_name: Annotated[Named, Reference("model-path", "Point")] = ""
    """Path of the point."""
    reference_location: Annotated[Vec3, vec3()] = (0.0, 0.0, 0.0)
    """Target position of the point in ground."""


class MocoJointReactionGoal(MocoGoal):
    """The load that a joint carries."""

    joint_path: Annotated[Named, Reference("model-path", "Joint")] = ""
    """Path of the joint."""
    loads_frame: Annotated[str, word("parent", "child")] = "parent"
    """Frame of the joint on which the load acts: parent or child."""
    expressed_in_frame_path: Annotated[Named, Reference("model-path", "Frame", required=False)] = ""
    """Frame along whose axes the load is expressed; left out, that of `loads_frame`."""
    reaction_measures: Annotated[tuple[str, ...], Value("string", "list", choices=MEASURES)] = ()
    """Components of the load in the cost, such as force-x or moment-z; left out, all six."""
    reaction_weights: Single[MocoWeightSet] = make_default(MocoWeightSet, name="reaction_weights")
    """Weights by components."""


class MocoOutputBase(MocoGoal, abstract=True):
    """Base class of goals that are functions of outputs of components."""

    output_path: OutputPath = ""
    """The output, as `path|output`."""
    second_output_path: SecondOutputPath = ""
    """Second output, which `operation` combines with the first."""
    operation: Operation = ""
    """Operation that combines the two outputs."""
    exponent: Integer = 1
    """Power to which the result is raised."""
    output_index: Integer = -1
    """Index of the component of an output of several numbers; -1 for its length."""


class MocoOutputGoal(MocoOutputBase):
    """An output over the motion."""


class MocoInitialOutputGoal(MocoOutputBase):
    """An output at the start."""


class MocoFinalOutputGoal(MocoOutputBase):
    """An output at the end."""


class MocoStepTimeAsymmetryGoalGroup(Object):
    """The contacts of a foot; OpenSim writes it and does not read it again."""

    contact_force_paths: Strings = ()
    """Paths of the contact forces that show whether the foot is on the ground."""
    foot_position_contact_force_path: Text = ""
    """Path of the contact force whose sphere gives the position of the foot."""


class MocoStepTimeAsymmetryGoal(MocoGoal):
    """Deviation of the asymmetry of step times from a desired one."""

    left_contact_group: Single[MocoStepTimeAsymmetryGoalGroup] = make_default(
        MocoStepTimeAsymmetryGoalGroup, name="left_contact_group"
    )
    """Contacts of the left foot."""
    right_contact_group: Single[MocoStepTimeAsymmetryGoalGroup] = make_default(
        MocoStepTimeAsymmetryGoalGroup, name="right_contact_group"
    )
    """Contacts of the right foot."""
    target_asymmetry: Number = 0.0
    """Difference of step times over their sum, right less left."""
    contact_force_threshold: Annotated[float, real("N")] = 25.0
    """Force above which a foot is on the ground."""
    contact_force_direction: Direction = "positive-y"
    """Direction of that force, in ground."""
    walking_direction: Direction = "positive-x"
    """Direction of walking in ground."""
    contact_detection_smoothing: Number = 0.25
    """Sharpness of the detection of contact; greater is sharper."""
    asymmetry_smoothing: Number = 10.0
    """Sharpness of the detection of the front foot; greater is sharper."""


class MocoStepLengthAsymmetryGoal(MocoGoal):
    """Deviation of the asymmetry of step lengths from a desired one."""

    left_foot_frame: FootFrame = ""
    """Path of the frame of the left foot."""
    right_foot_frame: FootFrame = ""
    """Path of the frame of the right foot."""
    walking_direction: Direction = "positive-x"
    """Direction of walking in ground."""
    asymmetry_smoothing: Number = 5.0
    """Sharpness of the detection of the front foot; greater is sharper."""
    target_asymmetry: Number = 0.0
    """Difference of step lengths over their sum, right less left."""
    stride_length: Annotated[float, real("m")] = -1.0
    """Length of a stride; if negative, that of the motion."""
