"""States follow a table."""

from __future__ import annotations

import numpy as np

from osimlite.optimal.point import Formula, GoalTerms, Point, make_integral_terms
from osimlite.optimal.problem import Problem
from osimlite.optimal.tables import fit_splines, read_reference
from osimlite.schema.moco.tracking import MocoStateTrackingGoal


def terms(goal: MocoStateTrackingGoal, problem: Problem) -> GoalTerms:
    """The integral of the weighted sum of squares of the states' distances from splines through the table."""
    states, table = problem.functions.states, read_reference(problem, goal, goal.reference)
    weights = dict(
        zip(
            states,
            problem.find_weights(goal, goal.state_weights, None, states, "state"),
            strict=True,
        )
    )
    matches = problem.compile_pattern(goal, goal.pattern if goal.pattern is not None else ".*")
    followed = [name for name in table.columns if name in states and matches(name)]
    for name in table.columns:
        if name not in followed and not goal.allow_unused_references:
            problem.check_name(goal, name, states, "state")
            raise problem.invalid_error(
                goal, f"the column '{name}' does not match the pattern; set allow_unused_references"
            )
    if goal.scale_weights_with_range:
        weights |= {name: weights[name] / float(np.ptp(table[name])) for name in followed}
    pairs = [*zip(followed, fit_splines(problem, table, followed), strict=True)]

    def integrand(point: Point) -> Formula:
        return sum(
            weights[name] * (point.state(name) - point.evaluate(series)) ** 2
            for name, series in pairs
        )

    return make_integral_terms(integrand)
