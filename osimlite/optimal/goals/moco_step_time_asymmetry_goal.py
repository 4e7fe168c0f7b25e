"""How unlike the times of left and right steps are."""

from __future__ import annotations

from osimlite.base.text import did_you_mean
from osimlite.mechanics.multibody.mechanism import GROUND
from osimlite.optimal.point import Formula, GoalTerms, Point, make_integral_terms
from osimlite.optimal.problem import Problem
from osimlite.optimal.steps import find_contact, get_component, smooth_step
from osimlite.schema.moco.goals import MocoStepTimeAsymmetryGoal, MocoStepTimeAsymmetryGoalGroup


def terms(goal: MocoStepTimeAsymmetryGoal, problem: Problem) -> GoalTerms:
    """A hundred times the square of what the asymmetry is off the wanted one; each moment counts as
    one of a step of the foot that is on the ground, and of the one in front if both are.
    """
    groups = goal.right_contact_group, goal.left_contact_group
    feet = [_foot(goal, problem, group) for group in groups]

    def integrand(point: Point) -> Formula:
        pushes = point.output("contact_forces")
        loads, places = [], []
        for paths, foot in feet:
            load = sum(
                get_component(
                    goal.contact_force_direction, [pushes[f"{path}|force_{axis}"] for axis in "xyz"]
                )
                for path in paths
            )
            loads.append(
                smooth_step(
                    load - goal.contact_force_threshold, 0.5, 0.5, goal.contact_detection_smoothing
                )
            )
            places.append(get_component(goal.walking_direction, point.frame(foot).position))
        right, left = loads
        front = smooth_step(places[0] - places[1], 0.0, 1.0, 100.0)
        # Right steps count as negative.
        return smooth_step(
            left - right - 2.0 * left * right * front, 0.0, 1.0, goal.asymmetry_smoothing
        )

    result = make_integral_terms(integrand)
    return GoalTerms(
        lambda ends: 100.0 * (result.value(ends) / ends.duration - goal.target_asymmetry) ** 2,
        integrand,
    )


def _foot(
    goal: MocoStepTimeAsymmetryGoal, problem: Problem, group: MocoStepTimeAsymmetryGoalGroup
) -> tuple[list[str], str]:
    """Paths of the contacts of a foot, and of the body that says where it is."""
    names = [str(name) for name in group.contact_force_paths]
    chosen = group.foot_position_contact_force_path
    if chosen not in names:
        near = did_you_mean(chosen, names)
        raise problem.invalid_error(
            goal, f"contact_force_paths of '{group.name}' have no foot_position '{chosen}'{near}"
        )
    contacts = dict(find_contact(goal, problem, name) for name in names)
    sphere = find_contact(goal, problem, chosen)[1]
    frame = problem.model.tree().target(sphere, "socket_frame", sphere.socket_frame).path
    mechanism = problem.functions.mechanism
    body = mechanism.frames[frame].body
    return [*contacts], "/ground" if body == GROUND else mechanism.bodies[body].path
