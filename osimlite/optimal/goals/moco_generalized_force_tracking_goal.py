"""Generalized forces follow a table."""

from __future__ import annotations

from typing import Any

import numpy as np

from osimlite.optimal.point import Formula, GoalTerms, Point, make_integral_terms
from osimlite.optimal.problem import Problem
from osimlite.optimal.tables import fit_splines, read_reference
from osimlite.schema.constraint_types import CoordinateCouplerConstraint
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.forces import Force
from osimlite.schema.moco.tracking import MocoGeneralizedForceTrackingGoal
from osimlite.schema.states import variables


def terms(goal: MocoGeneralizedForceTrackingGoal, problem: Problem) -> GoalTerms:
    """The integral of the weighted sum of squares of the distances of what the motion takes beyond
    gravity and the forces of `force_paths` (N, N m) from splines through the table.
    """
    pushing = _pushing(goal, problem)
    coordinates: dict[str, Any] = {**variables(problem.model.tree(), "generalized force")}
    known = {
        label: coordinate.path
        for label, coordinate in coordinates.items()
        if not (goal.ignore_constrained_coordinates and _is_constrained(problem, coordinate))
    }
    table = read_reference(problem, goal, goal.reference)
    followed = [name for name in table.columns if name in known or not goal.allow_unused_references]
    for name in followed:
        problem.check_name(goal, name, known, "free generalized force")
    given = goal.generalized_force_weights, goal.generalized_force_weights_pattern
    weights = dict(
        zip(
            known,
            problem.find_weights(goal, *given, [*known], "free generalized force"),
            strict=True,
        )
    )
    rows: list[Any] = []
    for name, series in zip(followed, fit_splines(problem, table, followed), strict=True):
        if weights[name] < 0.0:
            raise problem.invalid_error(
                goal, f"the weight of '{name}' is negative, which OpenSim refuses, too"
            )
        greatest = float(np.abs(table[name]).max()) if goal.normalize_tracking_error else 1.0
        if not greatest:
            raise problem.invalid_error(
                goal,
                f"the column '{name}' is zero, so that no error can be divided by its greatest",
            )
        rows.append((series, weights[name] / greatest**2))
    missing = problem.dynamics.make_generalized_forces(pushing, [known[name] for name in followed])

    def integrand(point: Point) -> Formula:
        found = missing(point)
        return sum(
            weight * (found[k] - point.evaluate(series)) ** 2
            for k, (series, weight) in enumerate(rows)
        )

    return make_integral_terms(integrand)


def _pushing(goal: MocoGeneralizedForceTrackingGoal, problem: Problem) -> list[str]:
    """The forces that the patterns match, each of which may be matched once, as in OpenSim."""
    forces = [path for path, part in problem.components.items() if isinstance(part, Force)]
    result: list[str] = []
    for pattern in map(str, goal.force_paths):
        found = [*filter(problem.compile_pattern(goal, pattern), forces)]
        if not found:
            problem.check_name(goal, pattern, forces, "force")
        if twice := [path for path in found if path in result]:
            raise problem.invalid_error(goal, f"its force_paths match '{twice[0]}' twice")
        result += found
    return result


def _is_constrained(problem: Problem, coordinate: Coordinate) -> bool:
    """Whether its motion is given, or is that of others."""
    couplers = (
        part
        for part in problem.components.values()
        if isinstance(part, CoordinateCouplerConstraint)
    )
    dependent = {str(part.dependent_coordinate_name) for part in couplers if part.isEnforced}
    return (
        coordinate.prescribed
        or coordinate.is_free_to_satisfy_constraints
        or coordinate.name in dependent
    )
