"""A motion that ends as it began."""

from __future__ import annotations

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.point import CONSTRAINT_FIRST, Endpoints, Formula, GoalTerms
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.goals import MocoPeriodicityGoal


def terms(goal: MocoPeriodicityGoal, problem: Problem) -> GoalTerms:
    """For each pair the value at the start less that at the end, or their sum where one is to be the negative."""
    functions, pairs = problem.functions, []
    for given, known, what in (
        (goal.state_pairs, functions.states, "state"),
        (goal.control_pairs, problem.controls, "control"),
    ):
        for pair in given:
            first, last = pair.initial_variable, pair.final_variable
            for name in (first, last):
                problem.check_name(pair, name, known, what)
            pairs.append((what, first, last, -1.0 if pair.negate else 1.0))

    def value(ends: Endpoints) -> Formula:
        differences = [
            sign * getattr(ends.start, what)(first) - getattr(ends.end, what)(last)
            for what, first, last, sign in pairs
        ]
        return casadi.vertcat(*differences) if differences else casadi.SX(0, 1)

    return GoalTerms(value, modes=CONSTRAINT_FIRST)
