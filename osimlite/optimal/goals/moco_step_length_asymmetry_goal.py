"""How unlike the lengths of left and right steps are."""

from __future__ import annotations

from osimlite.optimal.point import Formula, GoalTerms, Point, make_integral_terms
from osimlite.optimal.problem import Problem
from osimlite.optimal.steps import get_component, smooth_step
from osimlite.schema.moco.goals import MocoStepLengthAsymmetryGoal


def terms(goal: MocoStepLengthAsymmetryGoal, problem: Problem) -> GoalTerms:
    """A hundred times the time in which the feet are further apart than each of their steps is to be, as OpenSim."""
    feet = str(goal.right_foot_frame), str(goal.left_foot_frame)
    for foot in feet:
        problem.check_name(goal, foot, problem.functions.mechanism.frames, "frame")
    if goal.stride_length <= 0.0:
        raise problem.invalid_error(goal, "it needs a stride_length above zero, as in OpenSim")
    sharpness, half = 100.0 * goal.asymmetry_smoothing, 0.5 * goal.stride_length
    lengths = half * (1.0 + goal.target_asymmetry), half * (1.0 - goal.target_asymmetry)

    def integrand(point: Point) -> Formula:
        right, left = (
            get_component(goal.walking_direction, point.frame(foot).position) for foot in feet
        )
        ahead = right - left, left - right
        return sum(
            smooth_step(way - length, 0.5, 0.5, sharpness)
            for way, length in zip(ahead, lengths, strict=True)
        )

    result = make_integral_terms(integrand)
    return GoalTerms(lambda ends: 100.0 * result.value(ends), integrand)
