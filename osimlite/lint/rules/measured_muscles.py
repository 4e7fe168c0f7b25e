"""OSIM635 and following: muscle fibers at the start and over the ranges of the coordinates."""

from __future__ import annotations

from osimlite.lint.measures import MEASURES, get_measures
from osimlite.lint.registry import INFO, WARNING, FindingCollector, Threshold, rule
from osimlite.lint.rules.muscles import LONGEST
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object

OFF = Threshold(
    "off-equilibrium",
    0.1,
    "",
    "largest accepted difference from equilibrium: of the fiber length, in optimal fiber "
    "lengths, and of the tendon force, in max_isometric_force",
)


@rule("OSIM635", "start-off-equilibrium", severity=INFO, thresholds=(OFF,), about=MEASURES)
def report_start_off_equilibrium(subject: Subject, report: FindingCollector) -> None:
    """A muscle starts far from equilibrium.

    Checks muscles with an elastic tendon in the default pose and at their default activation.
    Reports a muscle whose fiber length differs from that in equilibrium by more than 0.1 optimal
    fiber lengths. Also reports a muscle whose tendon force differs from that in equilibrium by more
    than 0.1 `max_isometric_force`. A muscle without an equilibrium in this pose is a warning. The
    rule checks Thelen2003Muscle, Millard2012EquilibriumMuscle and DeGrooteFregly2016Muscle.

    OpenSim equilibrates muscles only on request (`solve_for_equilibrium_for_auxiliary_states` of
    ForwardTool, Model::equilibrateMuscles). Without such a request, fibers start with
    `default_fiber_length`, or with 0.1 m if it is missing. The tendon is then slack, or pulls with
    many times the strength of the muscle. The fibers move at hundreds of lengths per second: the
    first tenths of a second of the motion are meaningless. If a muscle has no equilibrium, the
    request ends with an exception. As `default_fiber_length`, use the fiber length in equilibrium.

    ```xml
      <Millard2012EquilibriumMuscle name="flexor">
    -     <default_fiber_length>0.1</default_fiber_length>
    +     <default_fiber_length>0.128</default_fiber_length>
      </Millard2012EquilibriumMuscle>
    ```
    """
    max_difference = subject.config.value_of(OFF)
    for start in get_measures(subject).starts:
        muscle = subject.tree.find(start.owner)
        (length, equilibrium_length), (tension, equilibrium_tension) = start.lengths, start.tensions
        # Only NaN differs from itself.
        if equilibrium_length != equilibrium_length:
            report(
                f"{describe_object(muscle)} has no equilibrium in the default pose: OpenSim fails "
                "when asked to equilibrate it",
                muscle,
                severity=WARNING,
            )
        elif (
            abs(length - equilibrium_length) > max_difference
            or abs(tension - equilibrium_tension) > max_difference
        ):
            report(
                f"{describe_object(muscle)} does not start in equilibrium: its fiber length is "
                f"{length:.3g} times its optimal length (in equilibrium {equilibrium_length:.3g}), its tendon force "
                f"{tension:.3g} times max_isometric_force (in equilibrium {equilibrium_tension:.3g})",
                muscle,
                tag="default_fiber_length" if hasattr(muscle, "default_fiber_length") else None,
            )


@rule("OSIM636", "fiber-limit", severity=INFO, thresholds=(LONGEST,), about=MEASURES)
def report_fiber_limit(subject: Subject, report: FindingCollector) -> None:
    """The fibers of a muscle reach a limit within the ranges of the coordinates.

    Checks the default pose, and five values of each coordinate with all other coordinates at their
    defaults. The values are in the middle half of the range, because at the ends of wide ranges
    most muscles reach a limit. In the pose with the shortest path, reports fully active fibers at
    their minimum length. Pennation (`maximum_pennation_angle`) or the curve of active force
    determines this length. In the pose with the longest path, reports fibers at rest that are
    longer than 2 optimal lengths. Also reports a muscle without an equilibrium in one of these two
    poses.

    If the fibers of a muscle cannot shorten further, its tendon is slack and it has no force,
    whatever its activation. Real fibers tear beyond twice their optimal length. Often the lengths
    belong to another muscle or were not scaled, or the range of the coordinate is wider than that
    of the real joint.

    ```xml
      <Millard2012EquilibriumMuscle name="flexor">
    -     <default_fiber_length>0.065</default_fiber_length> <tendon_slack_length>0.165</tendon_slack_length>
    +     <default_fiber_length>0.128</default_fiber_length> <tendon_slack_length>0.1</tendon_slack_length>
      </Millard2012EquilibriumMuscle>
    ```
    """
    longest = subject.config.value_of(LONGEST)
    for reach in get_measures(subject).reaches:
        muscle = subject.tree.find(reach.owner)
        lengths = f"{reach.length:.3g} optimal lengths"
        if reach.length != reach.length:
            report(f"{describe_object(muscle)} has no equilibrium {reach.pose}", muscle)
        elif reach.is_active and reach.is_limit:
            report(
                f"the fully active fibers of {describe_object(muscle)} reach their minimum length, "
                f"{lengths}, {reach.pose}",
                muscle,
                tag="tendon_slack_length",
            )
        elif not reach.is_active and reach.length > longest:
            report(
                f"at rest, the fibers of {describe_object(muscle)} are {lengths} long {reach.pose}",
                muscle,
                tag="optimal_fiber_length",
            )
