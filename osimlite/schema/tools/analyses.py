"""Analyses: what tools compute and write along a motion."""

from typing import Annotated

from osimlite.schema.base import make_default
from osimlite.schema.fields import (
    Flag,
    LegacyFlag,
    LegacyInteger,
    LegacyNumber,
    LegacyText,
    LegacyUnnamed,
    NamesOf,
    Reals,
    Reference,
    Value,
    real,
    reals,
)
from osimlite.schema.references import (
    LegacyInputTable,
    LegacyJointNames,
    Named,
    Names,
    make_name_list,
)
from osimlite.schema.sets import ConstraintSet
from osimlite.schema.tools.base import Analysis


class Actuation(Analysis):
    """Force, speed and power of the actuators."""


class BodyKinematics(Analysis):
    """Positions, velocities and accelerations of bodies."""

    # OpenSim compares with `all` in lower case here; `ALL` is an error.
    bodies: Annotated[
        Names, make_name_list("body-name-or-com", "Body", "all", "center_of_mass")
    ] = ("all",)
    """Names of bodies, `all`, or center_of_mass."""
    express_results_in_body_local_frame: LegacyFlag = False
    """Whether velocities and accelerations are along the axes of the body; otherwise of ground."""


class ForceReporter(Analysis):
    """Table of the records of all forces."""

    include_constraint_forces: LegacyFlag = False
    """Whether the forces of constraints are written, too."""


class IMUDataReporter(Analysis):
    """Simulated measurements of inertial sensors."""

    report_orientations: Flag = True
    """Whether orientations are written."""
    report_gyroscope_signals: Flag = True
    """Whether angular velocities are written."""
    report_accelerometer_signals: Flag = True
    """Whether accelerations, gravity included, are written."""
    compute_accelerations_without_forces: Flag = False
    """Whether accelerations follow from the motion alone, and not from the model's forces."""
    frame_paths: Annotated[
        Names, Reference("model-path", "PhysicalFrame", "list", required=False)
    ] = ()
    """Frames with sensors; without any, all sensors of the model."""


class InducedAccelerations(Analysis):
    """Contribution of each force to accelerations."""

    coordinate_names: Annotated[
        Names, make_name_list("coordinate-name", "Coordinate", "all", any_case=True)
    ] = ()
    """Coordinates whose accelerations are decomposed, or `all`."""
    body_names: Annotated[
        Names, make_name_list("body-name-or-com", "Body", "all", "center_of_mass", any_case=True)
    ] = ("center_of_mass",)
    """Bodies whose accelerations are decomposed, `all`, or center_of_mass."""
    constraint_set: LegacyUnnamed[ConstraintSet] = make_default(ConstraintSet)
    """Constraints that represent the contact with the ground."""
    force_threshold: Annotated[float, real("N", legacy=True)] = 6.0
    """Measured force above which the constraints are active."""
    compute_potentials_only: LegacyFlag = False
    """Whether each force is taken as one newton."""
    report_constraint_reactions: LegacyFlag = False
    """Whether contributions of each force to the forces of constraints are written."""


class JointReaction(Analysis):
    """Forces and moments in joints."""

    # OpenSim reads as many columns as the model has actuators, and ignores those after them.
    forces_file: LegacyInputTable = ""
    """File of the actuator forces; without it they follow from the states."""
    joint_names: LegacyJointNames = ("ALL",)
    """Joints that are written, or ALL."""
    apply_on_bodies: Annotated[tuple[str, ...], Value("string", "list", legacy=True)] = ("child",)
    """Side of the joints on which the loads act: child or parent, one word for all or for each."""
    express_in_frame: Annotated[
        Names, make_name_list("frame-path-or-member", "Frame", "child", "parent", any_case=True)
    ] = ("ground",)
    """Frames along whose axes the loads are given: child, parent or a frame, one for all or one for each joint."""


# OpenSim's accelerations follow from the forces of the model at each state, not from the motion.
class Kinematics(Analysis):
    """Values, speeds and accelerations of coordinates."""

    coordinates: Annotated[
        Names, make_name_list("coordinate-name", "Coordinate", "all", legacy=False)
    ] = ("all",)
    """Coordinates that are written, or `all`."""


# Without equilibrium, which the tool has a switch for, all quantities of fibers depend on their
# default lengths.
class MuscleAnalysis(Analysis):
    """Lengths, speeds, forces and moment arms of muscles."""

    # OpenSim leaves unknown muscles out silently, and warns of unknown coordinates.
    muscle_list: Annotated[
        Names, make_name_list("muscle-name", "Muscle", "all", consequence="left out")
    ] = ("all",)
    """Muscles that are written, or `all`."""
    moment_arm_coordinate_list: Annotated[
        Names,
        make_name_list(
            "coordinate-name", "Coordinate", "all", any_case=True, consequence="left out"
        ),
    ] = ("all",)
    """Coordinates about which moment arms are computed, or `all`."""
    compute_moments: LegacyFlag = True
    """Whether moments are computed in addition to moment arms."""


class OutputReporter(Analysis):
    """Outputs of components."""

    output_paths: Annotated[
        tuple[str, ...],
        Reference("input", "Output", "list", required=False),
        NamesOf(Reference("state-path", "output")),
    ] = ()
    """The outputs, each as `path|output`."""


# OpenSim labels the columns state_0 to state_2, whatever the name of the point.
class PointKinematics(Analysis):
    """Position, velocity and acceleration of a point."""

    # An unknown body makes OpenSim crash, while an unknown `relative_to_body_name` silently means
    # ground.
    body_name: Annotated[
        Named, Reference("frame-path-or-body-name", "PhysicalFrame", legacy=True)
    ] = "ground"
    """Name of the body in which the point is fixed."""
    relative_to_body_name: Annotated[
        Named,
        Reference(
            "frame-path-or-body-name",
            "PhysicalFrame",
            required=False,
            legacy=True,
            words=("none",),
            consequence="left out",
        ),
    ] = "none"
    """Name of the body along whose axes the results are given; none for ground."""
    point_name: LegacyText = "NONAME"
    """Name of the point, for the names of the results."""
    point: Annotated[Reals, reals(least=3, most=3, legacy=True)] = (0.0, 0.0, 0.0)
    """Position of the point in its body."""


class ProbeReporter(Analysis):
    """Table of the values of the model's probes."""


class StatesReporter(Analysis):
    """Table of the states."""


class StaticOptimization(Analysis):
    """Distributes the generalized forces of a motion among the actuators, at each time separately."""

    # OpenSim 4.6 crashes if this is false (segmentation fault).
    use_model_force_set: LegacyFlag = True
    """Whether the actuators are those of the model."""
    # With 1 the solution is not unique, and OpenSim's optimizer fails.
    activation_exponent: LegacyNumber = 2.0
    """Power of the activations whose sum is minimized."""
    # Passive forces of fibers are left out in both cases.
    use_muscle_physiology: LegacyFlag = True
    """Whether forces of muscles depend on their lengths and speeds."""
    # At this default, activations of OpenSim are up to 0.005 away from the exact solution.
    optimizer_convergence_criterion: LegacyNumber = 1e-4
    """Convergence tolerance of the optimizer."""
    # Where the optimizer fails, OpenSim warns and writes the point at which it stopped.
    optimizer_max_iterations: LegacyInteger = 100
    """Largest number of iterations of the optimizer."""
