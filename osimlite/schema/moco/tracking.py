"""Goals of Moco that compare a motion with measured data."""

from typing import Annotated

from osimlite.schema.base import Object, make_default, make_empty_list
from osimlite.schema.fields import (
    Flag,
    Integer,
    Many,
    MaybeFlag,
    NamesOf,
    Optional,
    Reference,
    Single,
    Text,
    Value,
    Vec3,
    word,
)
from osimlite.schema.moco.goals import ContactForcePaths, FramePaths, MocoGoal
from osimlite.schema.moco.parts import (
    ControlWeights,
    FrameWeights,
    MaybeOfStates,
    MocoWeightSet,
    OfControls,
    OfForces,
    OfMarkers,
    OfStates,
    PatternOfForces,
    StatePattern,
    StateWeights,
)
from osimlite.schema.prescribed import ExternalLoads
from osimlite.schema.references import InputTable, Names, make_input_file
from osimlite.schema.tools.inverse_kinematics import MarkersReference
from osimlite.schema.tools.processors import TableProcessor

LoadsFile = Annotated[str, make_input_file("ExternalLoads")]
Projection = Annotated[str, word("none", "vector", "plane")]
ExternalForceName = Annotated[str, Reference("external-force-name", "ExternalForce")]


class MocoStateTrackingGoal(MocoGoal):
    """States follow a table."""

    reference: Annotated[Single[TableProcessor], OfStates] = make_default(
        TableProcessor, name="reference"
    )
    """The table, a column for each state by its path."""
    state_weights: StateWeights = make_default(MocoWeightSet, name="state_weights")
    """Weights by paths of states."""
    pattern: StatePattern = None
    """Regular expression for the paths of the states that are included."""
    allow_unused_references: Flag = False
    """Whether the table may have columns that are no states."""
    scale_weights_with_range: Flag = False
    """Whether deviations are divided by the ranges of the coordinates."""


class MocoControlTrackingGoalReference(Object):
    """The column that a control follows; the name is the path of the control. OpenSim does not read it again."""

    reference: Text = ""
    """Label of the column."""


class MocoControlTrackingGoal(MocoGoal):
    """Controls follow a table."""

    reference: Annotated[Single[TableProcessor], OfControls] = make_default(
        TableProcessor, name="reference"
    )
    """The table, a column for each control."""
    allow_unused_references: Flag = False
    """Whether the table may have columns that are no controls."""
    control_weights: ControlWeights = make_default(MocoWeightSet, name="control_weights")
    """Weights by paths of controls."""
    reference_labels: Annotated[Many[MocoControlTrackingGoalReference], OfControls] = (
        make_empty_list()
    )
    """Columns for controls that are not followed by a column of their own path."""
    ignore_controlled_actuators: Flag = False
    """Whether controls that controllers of the model set are left out."""
    ignore_input_controls: Flag = False
    """Whether controls that are inputs of controllers are left out."""


class MocoMarkerTrackingGoal(MocoGoal):
    """Markers follow measured ones."""

    markers_reference: Annotated[Single[MarkersReference], OfMarkers] = make_default(
        MarkersReference, name="markers_reference"
    )
    """The measured markers and their weights."""
    allow_unused_references: Flag = False
    """Whether there may be measured markers that the model lacks."""


class MocoTranslationTrackingGoal(MocoGoal):
    """Origins of frames follow reference positions."""

    states_reference: Annotated[Single[TableProcessor], MaybeOfStates] = make_default(
        TableProcessor, name="states_reference"
    )
    """Motion of the model from which the positions are computed."""
    translation_reference_file: InputTable = ""
    """File of the positions, a column of vectors for each frame by its path."""
    frame_paths: FramePaths = ()
    """Paths of the frames; left out, all of the table."""
    translation_weights: FrameWeights = make_default(MocoWeightSet, name="translation_weights")
    """Weights by paths of frames."""


class MocoOrientationTrackingGoal(MocoGoal):
    """Frames follow reference orientations."""

    states_reference: Annotated[Single[TableProcessor], MaybeOfStates] = make_default(
        TableProcessor, name="states_reference"
    )
    """A motion of the model, from which the orientations are computed."""
    rotation_reference_file: InputTable = ""
    """The orientations themselves, a column of quaternions for each frame by its path."""
    frame_paths: FramePaths = ()
    """Paths of the frames; left out, all of the table."""
    rotation_weights: FrameWeights = make_default(MocoWeightSet, name="rotation_weights")
    """Weights by paths of frames."""


class MocoAngularVelocityTrackingGoal(MocoGoal):
    """Frames follow reference angular velocities."""

    states_reference: Annotated[Single[TableProcessor], MaybeOfStates] = make_default(
        TableProcessor, name="states_reference"
    )
    """A motion of the model, from which the angular velocities are computed."""
    angular_velocity_reference_file: InputTable = ""
    """The angular velocities themselves, a column of vectors for each frame by its path."""
    frame_paths: FramePaths = ()
    """Paths of the frames; left out, all of the table."""
    angular_velocity_weights: FrameWeights = make_default(
        MocoWeightSet, name="angular_velocity_weights"
    )
    """Weights by paths of frames."""


class MocoAccelerationTrackingGoal(MocoGoal):
    """Origins of frames follow reference accelerations."""

    acceleration_reference_file: InputTable = ""
    """The accelerations, a column of vectors for each frame by its path."""
    frame_paths: FramePaths = ()
    """Paths of the frames; left out, all of the table."""
    acceleration_weights: FrameWeights = make_default(MocoWeightSet, name="acceleration_weights")
    """Weights by paths of frames."""
    gravity_offset: Flag = False
    """Whether gravity is subtracted from the accelerations of the model, as in accelerometers."""
    express_accelerations_in_tracking_frames: Flag = False
    """Whether accelerations are along the axes of the frames; otherwise of ground."""


class MocoGeneralizedForceTrackingGoal(MocoGoal):
    """Generalized forces follow a table."""

    reference: Annotated[Single[TableProcessor], OfForces] = make_default(
        TableProcessor, name="reference"
    )
    """The table, a column for each coordinate with the ending _moment or _force."""
    force_paths: Annotated[
        Names,
        Reference("model-path", "Force", "list", required=False),
        NamesOf(Reference("pattern", "Force", consequence="left out")),
    ] = ()
    """Paths or patterns of the forces that are added up."""
    generalized_force_weights: Annotated[Single[MocoWeightSet], OfForces] = make_default(
        MocoWeightSet, name="generalized_force_weights"
    )
    """Weights by names of generalized forces."""
    generalized_force_weights_pattern: Annotated[Single[MocoWeightSet], PatternOfForces] = (
        make_default(MocoWeightSet, name="generalized_force_weights_pattern")
    )
    """Weights by patterns of names."""
    allow_unused_references: Flag = False
    """Whether the table may have columns that are no generalized forces."""
    normalize_tracking_error: MaybeFlag = False
    """Whether deviations are divided by the largest value of the column."""
    ignore_constrained_coordinates: Flag = True
    """Whether coordinates that others determine are left out."""


class MocoContactTrackingGoalGroup(Object):
    """Contact forces whose sum follows a measured force."""

    contact_force_paths: ContactForcePaths = ()
    """Paths of the contact forces."""
    external_force_name: ExternalForceName = ""
    """Name of the measured force."""
    alternative_frame_paths: FramePaths = ()
    """Frames, other than that of the measured force, in which contact spheres may be fixed."""


class MocoContactTrackingGoal(MocoGoal):
    """Contact forces follow measured ones."""

    contact_groups: Many[MocoContactTrackingGoalGroup] = make_empty_list()
    """Groups of contact forces, each with the measured load that it tracks."""
    external_loads: Optional[ExternalLoads] = None
    """The measured forces."""
    external_loads_file: LoadsFile = ""
    """Measured forces in a separate document."""
    projection: Projection = "none"
    """Whether only the part along a vector counts, or in the plane across it."""
    projection_vector: Annotated[Vec3 | None, Value("double", "Vec3", optional=True)] = None
    """That vector, in ground."""
    normalize_tracking_error: MaybeFlag = False
    """Whether deviations are divided by the largest measured force."""


class MocoContactImpulseTrackingGoalGroup(Object):
    """Contact forces whose impulse follows that of a measured force."""

    contact_force_paths: ContactForcePaths = ()
    """Paths of the contact forces."""
    external_force_name: ExternalForceName = ""
    """Name of the measured force."""
    alternative_frame_paths: FramePaths = ()
    """Frames, other than that of the measured force, in which contact spheres may be fixed."""


class MocoContactImpulseTrackingGoal(MocoGoal):
    """Impulses of contact forces follow measured ones."""

    contact_groups: Many[MocoContactImpulseTrackingGoalGroup] = make_empty_list()
    """Groups of contact forces, each with the measured load that it tracks."""
    external_loads: Optional[ExternalLoads] = None
    """The measured forces."""
    external_loads_file: LoadsFile = ""
    """Measured forces in a separate document."""
    impulse_axis: Integer = -1
    """Axis of ground along which the impulse is computed: 0, 1 or 2."""
