"""Contact forces follow measured ones."""

from __future__ import annotations

import numpy as np

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.contacts import compute_model_weight, read_contact_groups
from osimlite.optimal.point import Formula, GoalTerms, Point, make_integral_terms
from osimlite.optimal.problem import Problem
from osimlite.optimal.projection import make_projection
from osimlite.schema.moco.tracking import MocoContactTrackingGoal


def terms(goal: MocoContactTrackingGoal, problem: Problem) -> GoalTerms:
    """The integral of the squares of the missing force of each group, over the weight of the model."""
    along, groups = make_projection(goal, problem), read_contact_groups(goal, problem)

    def integrand(point: Point) -> Formula:
        pushes, total = point.output("contact_forces"), casadi.SX(0.0)
        for paths, measured, greatest in groups:
            parts = []
            for axis, series, by in zip(
                "xyz",
                measured,
                greatest if goal.normalize_tracking_error else np.ones(3),
                strict=True,
            ):
                push = sum(pushes[f"{path}|force_{axis}"] for path in paths)
                parts.append((push - point.evaluate(series)) / by)
            total += casadi.sumsqr(along(casadi.vertcat(*parts)))
        return total

    result, weight = make_integral_terms(integrand), compute_model_weight(problem)
    return GoalTerms(lambda ends: result.value(ends) / weight, integrand)
