"""Goals on the asymmetry of a walk: durations and lengths of left and right steps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from osimlite.base.text import suggest_name
from osimlite.derivatives.symbols import casadi
from osimlite.mechanics.multibody.mechanism import GROUND
from osimlite.optimal.goals.contact_tracking import find_contact
from osimlite.optimal.point import Formula, GoalTerms, PointSymbols, make_integral_terms
from osimlite.schema.moco.goals import (
    MocoStepLengthAsymmetryGoal,
    MocoStepTimeAsymmetryGoal,
    MocoStepTimeAsymmetryGoalGroup,
)

if TYPE_CHECKING:
    from osimlite.optimal.problem import Problem

FRONT_FOOT_SHARPNESS_PER_M = 100.0
"""Sharpness of the smooth step that decides which foot is in front, as in OpenSim."""


def build_step_time_asymmetry_goal(goal: MocoStepTimeAsymmetryGoal, problem: Problem) -> GoalTerms:
    """Return 100 times the squared difference of the step time asymmetry from its target, as OpenSim.

    Each moment counts to a step of the foot that is on the ground; if both feet are, to a step of
    the foot in front. Moments of right steps count -1, of left steps +1, so that their mean over
    time is the asymmetry.

    Args:
        goal: goal of the study.
        problem: problem with the contacts.

    Raises:
        DocumentError: a contact does not exist, or a group lacks the contact of its position.
    """
    groups = goal.right_contact_group, goal.left_contact_group
    feet = [_find_foot(goal, problem, group) for group in groups]

    def integrand(point: PointSymbols) -> Formula:
        """Return -1 in a right step, 1 in a left step, with smooth transitions."""
        forces = point.output("contact_forces")
        contacts = []
        positions = []
        for paths, foot in feet:
            load = sum(
                get_component(
                    goal.contact_force_direction, [forces[f"{path}|force_{axis}"] for axis in "xyz"]
                )
                for path in paths
            )
            excess_load = load - goal.contact_force_threshold
            # 1 on the ground and 0 in the air.
            contacts.append(smooth_step(excess_load, 0.5, 0.5, goal.contact_detection_smoothing))
            positions.append(get_component(goal.walking_direction, point.frame(foot).position))
        right, left = contacts
        front = smooth_step(positions[0] - positions[1], 0.0, 1.0, FRONT_FOOT_SHARPNESS_PER_M)
        return smooth_step(
            # With one foot on the ground `left - right` is 1 or -1; with both it is 0, and the
            # product gives -front.
            left - right - 2.0 * left * right * front,
            0.0,
            1.0,
            goal.asymmetry_smoothing,
        )

    result = make_integral_terms(integrand)
    return GoalTerms(
        lambda ends: 100.0 * (result.value(ends) / ends.duration - goal.target_asymmetry) ** 2,
        integrand,
    )


def build_step_length_asymmetry_goal(
    goal: MocoStepLengthAsymmetryGoal, problem: Problem
) -> GoalTerms:
    """Return 100 times the time, s, in which the feet are further apart than their step lengths, as OpenSim.

    Args:
        goal: goal of the study.
        problem: problem with the frames.

    Raises:
        DocumentError: a frame does not exist, or the stride length is not positive.
    """
    feet = str(goal.right_foot_frame), str(goal.left_foot_frame)
    for foot in feet:
        problem.check_name(goal, foot, problem.functions.mechanism.frames, "frame")
    if goal.stride_length <= 0.0:
        raise problem.invalid_error(goal, "stride_length must be positive, as in OpenSim")
    sharpness = 100.0 * goal.asymmetry_smoothing
    half_stride = 0.5 * goal.stride_length
    lengths = (
        half_stride * (1.0 + goal.target_asymmetry),
        half_stride * (1.0 - goal.target_asymmetry),
    )

    def integrand(point: PointSymbols) -> Formula:
        right, left = (
            get_component(goal.walking_direction, point.frame(foot).position) for foot in feet
        )
        leads = right - left, left - right
        return sum(
            smooth_step(distance - length, 0.5, 0.5, sharpness)
            for distance, length in zip(leads, lengths, strict=True)
        )

    result = make_integral_terms(integrand)
    return GoalTerms(lambda ends: 100.0 * result.value(ends), integrand)


def get_component(direction: str, vector: Sequence[Formula] | Formula) -> Formula:
    """Return the component of a vector in ground along a direction.

    Args:
        direction: "positive-" or "negative-" and the axis, such as "negative-x".
        vector: components along x, y and z.
    """
    sign, _, axis = direction.partition("-")
    return vector["xyz".index(axis)] * (1.0 if sign == "positive" else -1.0)


def smooth_step(value: Formula, center: float, half_height: float, sharpness: float) -> Formula:
    """Return ``center + half_height * tanh(sharpness * value)``, a smooth step at zero.

    Args:
        value: argument of the step.
        center: result at zero.
        half_height: half of the height of the step.
        sharpness: factor of the argument; the larger, the steeper the step.
    """
    return center + half_height * casadi.tanh(sharpness * value)


def _find_foot(
    goal: MocoStepTimeAsymmetryGoal, problem: Problem, group: MocoStepTimeAsymmetryGoalGroup
) -> tuple[list[str], str]:
    """Find the contacts of a foot.

    Args:
        goal: goal, for messages.
        problem: problem with the contacts.
        group: contacts of the foot.

    Returns:
        Paths of the contact forces of the foot, and path of the body whose origin is its position.
    """
    names = [str(name) for name in group.contact_force_paths]
    selected = group.foot_position_contact_force_path
    if selected not in names:
        suggestion = suggest_name(selected, names)
        raise problem.invalid_error(
            goal,
            f"contact_force_paths of '{group.name}' do not contain foot_position_contact_force_path '{selected}'{suggestion}",
        )
    contacts = dict(find_contact(goal, problem, name) for name in names)
    sphere = find_contact(goal, problem, selected)[1]
    frame = problem.model.tree().target(sphere, "socket_frame", sphere.socket_frame).path
    mechanism = problem.functions.mechanism
    body = mechanism.frames[frame].body
    return [*contacts], "/ground" if body == GROUND else mechanism.bodies[body].path
