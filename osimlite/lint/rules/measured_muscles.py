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
    "largest accepted distance from equilibrium: fiber length in optimal lengths, tendon force "
    "in max_isometric_force",
)


@rule("OSIM635", "start-off-equilibrium", severity=INFO, thresholds=(OFF,), about=MEASURES)
def report_start_off_equilibrium(subject: Subject, report: FindingCollector) -> None:
    """A muscle starts far from equilibrium.

    Reports muscles with an elastic tendon whose fibers, in the default pose and at their default
    activation, start more than 0.1 optimal fiber lengths from their equilibrium length, or whose
    tension is off by more than 0.1 `max_isometric_force`. A muscle that has no equilibrium in the
    default pose is reported as a warning. Thelen2003Muscle, Millard2012EquilibriumMuscle and
    DeGrooteFregly2016Muscle are checked.

    OpenSim equilibrates muscles only on request (`solve_for_equilibrium_for_auxiliary_states` of
    ForwardTool, Model::equilibrateMuscles); otherwise fibers start with `default_fiber_length`, 0.1
    m if it is missing. The tendon is then slack, or pulls with many times the strength of the
    muscle, and the fibers move at hundreds of lengths per second: the first tenths of a second of
    the motion are meaningless. Where there is no equilibrium OpenSim throws an exception when it is
    asked for one. The equilibrium length of the fibers is a good default.

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
                f"{length:.3g} optimal lengths (in equilibrium {equilibrium_length:.3g}), its tendon force "
                f"{tension:.3g} times max_isometric_force (in equilibrium {equilibrium_tension:.3g})",
                muscle,
                tag="default_fiber_length" if hasattr(muscle, "default_fiber_length") else None,
            )


@rule("OSIM636", "fiber-limit", severity=INFO, thresholds=(LONGEST,), about=MEASURES)
def report_fiber_limit(subject: Subject, report: FindingCollector) -> None:
    """The fibers of a muscle reach a limit within the ranges of the coordinates.

    Reports three kinds of muscles. In the pose with the shortest path, their fully active fibers
    reach the minimum length that pennation (`maximum_pennation_angle`) or the curve of active force
    allows. In the pose with the longest path, their fibers at rest are longer than 2 optimal
    lengths. Or they have no equilibrium in one of these poses. The poses are the default pose and
    five values of each coordinate in the middle half of its range, with the others at their
    defaults: at the ends of wide ranges most muscles reach a limit.

    A muscle whose fibers cannot shorten further has a slack tendon and no force, whatever its
    activation. Real fibers tear beyond twice their length. The lengths may belong to another
    muscle, may not have been scaled, or the range of the coordinate is wider than that of the
    joint.

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
