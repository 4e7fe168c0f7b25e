"""OSIM62x: muscles."""

from __future__ import annotations

import math
from itertools import pairwise

from osimlite.lint.placement import compute_default_poses, locate_frame
from osimlite.lint.registry import ERROR, REFUSES, WARNING, FindingCollector, Threshold, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object, format_quantity
from osimlite.mechanics.laws.vectors import Vector
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.paths import ConditionalPathPoint, GeometryPath, PathPoint

PENNATION = Threshold(
    "largest-pennation",
    math.pi / 2,
    "rad",
    "fibers with a larger pennation angle cannot pull on the tendon",
)
SHORTEST = Threshold("shortest-fiber", 0.2, "optimal lengths", "smallest plausible fiber length")
LONGEST = Threshold("longest-fiber", 2.0, "optimal lengths", "largest plausible fiber length")


@rule("OSIM621", "doubtful-muscle", severity=WARNING, thresholds=(PENNATION, SHORTEST, LONGEST))
def report_doubtful_muscle(subject: Subject, report: FindingCollector) -> None:
    """The fibers of a muscle have an implausible length or angle.

    Reports a pennation angle of 90 degrees or more. Also reports a `default_fiber_length` in the
    file that is less than 0.2 or more than 2 optimal fiber lengths. For numbers that OpenSim
    rejects, see OSIM206.

    Fibers perpendicular to the tendon do not pull on it; often such an angle is in degrees. A
    muscle tears beyond twice its optimal length, and has no force below a fifth of it. A default
    length beyond these limits makes the search for equilibrium start far away. Often the two
    lengths belong to different muscles.

    ```xml
      <Millard2012EquilibriumMuscle name="flexor">
    -     <optimal_fiber_length>0.1</optimal_fiber_length> <default_fiber_length>0.5</default_fiber_length>
    +     <optimal_fiber_length>0.1</optimal_fiber_length> <default_fiber_length>0.12</default_fiber_length>
      </Millard2012EquilibriumMuscle>
    ```
    """
    steepest, shortest, longest = (
        subject.config.value_of(threshold) for threshold in (PENNATION, SHORTEST, LONGEST)
    )
    for muscle in subject.find_by_class("Muscle"):
        angle = muscle.pennation_angle_at_optimal
        if steepest <= angle < math.inf:
            report(
                f"the pennation angle of {describe_object(muscle)} is "
                f"{format_quantity(angle, 'rad')}"
                + (", a quarter turn or more" if angle >= math.pi / 2 else "")
                + ("; is it in degrees?" if angle > math.pi else ""),
                muscle,
                tag="pennation_angle_at_optimal",
            )
        length = getattr(muscle, "default_fiber_length", None)
        optimal = muscle.optimal_fiber_length
        # 0.1, the default, is what OpenSim prints of every muscle that does not say.
        is_explicit = "default_fiber_length" in muscle.model_fields_set and length != 0.1
        if is_explicit and length is not None and optimal > 0 and 0 < length < math.inf:
            ratio = length / optimal
            if not shortest <= ratio <= longest:
                report(
                    f"the default fiber length of {describe_object(muscle)}, "
                    f"{format_quantity(length, 'm')}, is {ratio:.3g} times its optimal length",
                    muscle,
                    tag="default_fiber_length",
                )


@rule("OSIM622", "control-below-activation", severity=ERROR, consequences=(REFUSES,))
def report_control_below_activation(subject: Subject, report: FindingCollector) -> None:
    """The minimum control of a muscle is below its minimum activation.

    Reports Thelen and Millard muscles whose `min_control` is smaller than their
    `minimum_activation`.

    OpenSim rejects the model. The activation must not fall below its minimum, since the equations
    of the muscle divide by it. A smaller control would contradict this.

    ```xml
      <Millard2012EquilibriumMuscle name="flexor">
    -     <min_control>0</min_control> <minimum_activation>0.01</minimum_activation>
    +     <min_control>0.01</min_control> <minimum_activation>0.01</minimum_activation>
      </Millard2012EquilibriumMuscle>
    ```
    """
    for muscle in subject.find_by_class("Muscle"):
        if muscle.min_control < getattr(muscle, "minimum_activation", -math.inf):
            report(
                f"min_control of {describe_object(muscle)} is "
                f"{format_quantity(muscle.min_control)}, less than its minimum_activation, "
                f"{format_quantity(muscle.minimum_activation)}: OpenSim rejects the model",
                muscle,
                tag="min_control"
                if "min_control" in muscle.model_fields_set
                else "minimum_activation",
            )


@rule("OSIM623", "out-of-reach", severity=WARNING, thresholds=(LONGEST,))
def report_out_of_reach(subject: Subject, report: FindingCollector) -> None:
    """The path of a muscle requires an impossible fiber length.

    Reports muscles whose path in the default pose is shorter than `tendon_slack_length`, or exceeds
    it by more than 2 optimal fiber lengths. Paths around surfaces count as straight, which is their
    minimum length. Paths with a moving point are not checked. Neither are paths with a point on
    a body beyond a prescribed coordinate, or beyond a joint with a function that the linter does
    not evaluate, such as a GCVSpline.

    If a path is too short, the tendon is slack and the muscle has no force. If a path is too long,
    real fibers would tear. OpenSim finds no equilibrium of such a muscle, computes NaN, or computes
    wrong forces. Often the lengths belong to another muscle, or were not scaled with the bones.

    ```xml
      <Millard2012EquilibriumMuscle name="flexor">
    -     <optimal_fiber_length>0.1</optimal_fiber_length> <tendon_slack_length>0.01</tendon_slack_length>
    +     <optimal_fiber_length>0.1</optimal_fiber_length> <tendon_slack_length>0.1</tendon_slack_length>
      </Millard2012EquilibriumMuscle>
    ```
    """
    longest = subject.config.value_of(LONGEST)
    for muscle in subject.find_by_class("Muscle"):
        path = muscle.geometry_path
        slack = muscle.tendon_slack_length
        optimal = muscle.optimal_fiber_length
        points = (
            _locate_path_points(subject, path)
            if isinstance(path, GeometryPath) and optimal > 0
            else []
        )
        if len(points) < 2:
            continue
        length = sum(math.dist(*pair) for pair in pairwise(points))
        length_text = (
            f"the path of {describe_object(muscle)} is {length:.4g} m long in the default pose"
        )
        # A path around a surface is longer than its straight line.
        if length < slack and not path.path_wrap_set.objects:
            report(
                f"{length_text}, less than its tendon_slack_length, {slack:.4g} m",
                muscle,
                tag="tendon_slack_length",
            )
        elif (ratio := (length - slack) / optimal) > longest:
            report(
                f"{length_text}: with a tendon of tendon_slack_length, its fibers are {ratio:.3g} optimal fiber "
                "lengths long",
                muscle,
                tag="optimal_fiber_length",
            )


@rule("OSIM624", "shared-time-constants", severity=WARNING)
def report_shared_time_constants(subject: Subject, report: FindingCollector) -> None:
    """Muscles differ in time constants that OpenSim shares among all of them.

    Reports each DeGrooteFregly2016Muscle whose `activation_time_constant`,
    `deactivation_time_constant` or `activation_dynamics_smoothing` differs from that of the first
    such muscle. Only muscles whose activation is a state count.

    OpenSim stores these three numbers once per process. It uses the numbers of the muscle that it
    computes first, even if that muscle belongs to a model loaded earlier. If the first muscle has
    15 ms and this one 30 ms, this one is activated twice as fast as its file says. Muscles of other
    classes have separate numbers.

    ```xml
      <DeGrooteFregly2016Muscle name="fast">
          <activation_time_constant>0.015</activation_time_constant>
      </DeGrooteFregly2016Muscle>
      <DeGrooteFregly2016Muscle name="slow">
    -     <activation_time_constant>0.03</activation_time_constant>
    +     <activation_time_constant>0.015</activation_time_constant>
      </DeGrooteFregly2016Muscle>
    ```
    """
    first_muscle = None
    for muscle in subject.find_by_class("DeGrooteFregly2016Muscle"):
        # Without activation dynamics the constants are not used.
        if muscle.ignore_activation_dynamics:
            continue
        # OpenSim 4.6 shares the constants by mistake: the first such muscle sets them.
        first_muscle = first_muscle or muscle
        for tag in _SHARED_CONSTANTS:
            declared_value, used_value = getattr(muscle, tag), getattr(first_muscle, tag)
            if declared_value != used_value:
                report(
                    f"{tag} of {describe_object(muscle)} is {format_quantity(declared_value)}, but OpenSim "
                    f"computes with {format_quantity(used_value)}, the value of {describe_object(first_muscle)}",
                    muscle,
                    tag=tag if tag in muscle.model_fields_set else None,
                )


_SHARED_CONSTANTS = (
    "activation_time_constant",
    "deactivation_time_constant",
    "activation_dynamics_smoothing",
)


def _locate_path_points(subject: Subject, path: GeometryPath) -> list[Vector]:
    """Return the positions of the active points of a path in the default pose; empty if one is unknown."""
    poses = compute_default_poses(subject)
    positions = []
    for point in path.path_point_set.objects:
        location = locate_frame(subject, subject.target_of(point, "socket_parent_frame"))
        if not isinstance(point, PathPoint) or location is None or id(location[0]) not in poses:
            return []
        if isinstance(point, ConditionalPathPoint):
            coordinate = subject.target_of(point, "socket_coordinate")
            if not isinstance(coordinate, Coordinate):
                return []
            # A point outside its range is not a part of the path.
            if not point.range[0] <= coordinate.default_value <= point.range[1]:
                continue
        positions.append(
            poses[id(location[0])].transform_point(location[1].transform_point(point.location))
        )
    return positions
