"""States follow a table."""

from __future__ import annotations

import numpy as np

from osimlite.optimal.point import Formula, Point, Terms, integral
from osimlite.optimal.problem import Problem
from osimlite.optimal.tables import splines, table_of
from osimlite.schema.moco.tracking import MocoStateTrackingGoal


def terms(goal: MocoStateTrackingGoal, problem: Problem) -> Terms:
    """The integral of the weighted sum of squares of the states' distances from splines through the table."""
    states, table = problem.functions.states, table_of(problem, goal, goal.reference)
    weights = dict(
        zip(states, problem.weights(goal, goal.state_weights, None, states, "state"), strict=True)
    )
    matches = problem.pattern(goal, goal.pattern if goal.pattern is not None else ".*")
    followed = [name for name in table.columns if name in states and matches(name)]
    for name in table.columns:
        if name not in followed and not goal.allow_unused_references:
            problem.expect(goal, name, states, "state")
            raise problem.wrong(
                goal, f"the column '{name}' does not match the pattern; set allow_unused_references"
            )
    if goal.scale_weights_with_range:
        weights |= {name: weights[name] / float(np.ptp(table[name])) for name in followed}
    pairs = [*zip(followed, splines(problem, table, followed), strict=True)]

    def integrand(point: Point) -> Formula:
        return sum(
            weights[name] * (point.state(name) - point.at(series)) ** 2 for name, series in pairs
        )

    return integral(integrand)
