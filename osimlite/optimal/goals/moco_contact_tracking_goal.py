"""Contact forces follow measured ones."""

from __future__ import annotations

import numpy as np

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.contacts import measured_groups, weight_of
from osimlite.optimal.point import Formula, Point, Terms, integral
from osimlite.optimal.problem import Problem
from osimlite.optimal.projection import projected
from osimlite.schema.moco.tracking import MocoContactTrackingGoal


def terms(goal: MocoContactTrackingGoal, problem: Problem) -> Terms:
    """The integral of the squares of the missing force of each group, over the weight of the model."""
    along, groups = projected(goal, problem), measured_groups(goal, problem)

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
                parts.append((push - point.at(series)) / by)
            total += casadi.sumsqr(along(casadi.vertcat(*parts)))
        return total

    result, weight = integral(integrand), weight_of(problem)
    return Terms(lambda ends: result.value(ends) / weight, integrand)
