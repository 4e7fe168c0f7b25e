"""Controls, each to a power, over the motion."""

from __future__ import annotations

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.point import Formula, GoalTerms, Point, make_integral_terms
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.goals import MocoControlGoal


def terms(goal: MocoControlGoal, problem: Problem) -> GoalTerms:
    """The integral of the weighted sum of powers of the controls' sizes."""
    controls = [*problem.controls]
    weights = problem.find_weights(
        goal, goal.control_weights, goal.control_weights_pattern, controls, "control"
    )
    power = goal.exponent

    def integrand(point: Point) -> Formula:
        own = casadi.vertcat(*map(point.control, controls))
        sizes = own if power % 2 == 0 else casadi.fabs(own)
        return casadi.dot(casadi.DM(weights), sizes**power)

    return make_integral_terms(integrand)
