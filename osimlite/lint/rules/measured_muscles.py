"""OSIM635 and on: fibers of muscles, where they start and over the ranges of the coordinates."""

from __future__ import annotations

from osimlite.lint.measures import MEASURES, measures_of
from osimlite.lint.registry import INFO, WARNING, FindingSink, Threshold, rule
from osimlite.lint.rules.muscles import LONGEST
from osimlite.lint.subject import Subject
from osimlite.lint.words import called

OFF = Threshold(
    "off-equilibrium",
    0.1,
    "",
    "of the optimal fiber length, and of the strength: so far may a muscle start off",
)


@rule("OSIM635", "start-off-equilibrium", severity=INFO, thresholds=(OFF,), about=MEASURES)
def start_off_equilibrium(subject: Subject, report: FindingSink) -> None:
    """A muscle starts far from equilibrium.

    Reports muscles with an elastic tendon whose fibers, in the default pose and at their default
    activation, start more than 0.1 optimal fiber lengths from where they would be in equilibrium,
    or whose tension is off by more than 0.1 `max_isometric_force`. A muscle without an equilibrium
    there is a warning. Thelen2003Muscle, Millard2012EquilibriumMuscle and DeGrooteFregly2016Muscle
    are looked at.

    OpenSim brings muscles into equilibrium only where it is asked to
    (`solve_for_equilibrium_for_auxiliary_states` of ForwardTool, Model::equilibrateMuscles); else
    fibers begin with `default_fiber_length`, which is 0.1 m where a file does not say. The tendon
    is slack then or pulls with many times the muscle's strength, and the fibers snap into place
    with hundreds of lengths per second: the motion of the first tenths of a second is that of no
    muscle. Where there is no equilibrium OpenSim throws an exception when it is asked for one. The
    fibers' length in equilibrium is a good default.

    ```xml
      <Millard2012EquilibriumMuscle name="flexor">
    -     <default_fiber_length>0.1</default_fiber_length>
    +     <default_fiber_length>0.128</default_fiber_length>
      </Millard2012EquilibriumMuscle>
    ```
    """
    most = subject.config.value_of(OFF)
    for start in measures_of(subject).starts:
        muscle = subject.tree.at(start.owner)
        (length, settled), (tension, settled_tension) = start.lengths, start.tensions
        if settled != settled:
            report(
                f"{called(muscle)} has no equilibrium in the default pose: OpenSim fails where it is asked to find it",
                muscle,
                severity=WARNING,
            )
        elif abs(length - settled) > most or abs(tension - settled_tension) > most:
            report(
                f"{called(muscle)} starts with fibers of {length:.3g} optimal lengths and a tension of {tension:.3g} "
                f"max_isometric_force; in equilibrium these are {settled:.3g} and {settled_tension:.3g}",
                muscle,
                tag="default_fiber_length" if hasattr(muscle, "default_fiber_length") else None,
            )


@rule("OSIM636", "fiber-limit", severity=INFO, thresholds=(LONGEST,), about=MEASURES)
def fiber_limit(subject: Subject, report: FindingSink) -> None:
    """The fibers of a muscle reach a limit within the ranges of the coordinates.

    Reports muscles whose fibers in equilibrium, fully active, are as short as pennation
    (`maximum_pennation_angle`) or the curve of active force lets them be where the path is
    shortest; those whose fibers at rest are longer than 2 optimal lengths where it is longest; and
    muscles that have no equilibrium in one of these poses. The poses are the default one and five
    values of each coordinate in the middle half of its range, the others as in the default pose: at
    the ends of wide ranges there are few muscles that have reached no limit.

    A muscle whose fibers can shorten no further has a slack tendon and no force, whatever its
    activation. Fibers beyond twice their length are torn in life. The lengths may be those of
    another muscle, a scaling may have forgotten them, or the range of the coordinate is wider than
    the joint.

    ```xml
      <Millard2012EquilibriumMuscle name="flexor">
    -     <default_fiber_length>0.065</default_fiber_length> <tendon_slack_length>0.165</tendon_slack_length>
    +     <default_fiber_length>0.128</default_fiber_length> <tendon_slack_length>0.1</tendon_slack_length>
      </Millard2012EquilibriumMuscle>
    ```
    """
    longest = subject.config.value_of(LONGEST)
    for reach in measures_of(subject).reaches:
        muscle = subject.tree.at(reach.owner)
        lengths = f"{reach.length:.3g} optimal lengths"
        if reach.length != reach.length:
            report(f"{called(muscle)} has no equilibrium {reach.pose}", muscle)
        elif reach.is_active and reach.is_limit:
            report(
                f"fully active, the fibers of {called(muscle)} are as short as they can be, {lengths}, {reach.pose}",
                muscle,
                tag="tendon_slack_length",
            )
        elif not reach.is_active and reach.length > longest:
            report(
                f"at rest, the fibers of {called(muscle)} are {lengths} long {reach.pose}",
                muscle,
                tag="optimal_fiber_length",
            )
