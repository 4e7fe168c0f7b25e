"""Squares of states over the motion."""

from __future__ import annotations

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.point import GoalTerms, make_integral_terms
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.goals import MocoSumSquaredStateGoal


def terms(goal: MocoSumSquaredStateGoal, problem: Problem) -> GoalTerms:
    """The integral of the weighted sum of squares of those states whose paths match the pattern."""
    states = problem.functions.states
    weights = problem.find_weights(goal, goal.state_weights, None, states, "state")
    if goal.pattern is not None:
        matches = problem.compile_pattern(goal, goal.pattern)
        weights = [
            weight if matches(name) else 0.0 for weight, name in zip(weights, states, strict=True)
        ]
    return make_integral_terms(lambda point: casadi.dot(casadi.DM(weights), point.x**2))
