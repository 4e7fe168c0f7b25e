"""Numbers between functions of time, which controls, states and outputs share."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

from osimlite.derivatives.symbols import casadi
from osimlite.mechanics.multibody.schema_functions import numeric
from osimlite.optimal.bounds import Range
from osimlite.optimal.point import ConstraintRows, Formula, Point
from osimlite.optimal.problem import Problem
from osimlite.optimal.tables import sample_function
from osimlite.schema.moco.path_constraints import (
    MocoControlBoundConstraint,
    MocoOutputBoundConstraint,
    MocoStateBoundConstraint,
)


def rows_between(
    constraint: MocoControlBoundConstraint | MocoStateBoundConstraint | MocoOutputBoundConstraint,
    problem: Problem,
    paths: Sequence[str],
    variable: Callable[[Point, str], Formula],
) -> ConstraintRows:
    """For each of some variables how far it is above each of the functions.

    Args:
        constraint: with the functions.
        problem: it is of.
        paths: of the variables.
        variable: gives one at a point.
    """
    ends = [("lower_bound", (0.0, math.inf)), ("upper_bound", (-math.inf, 0.0))]
    functions = [(getattr(constraint, name), limits) for name, limits in ends]
    functions = [pair for pair in functions if pair[0] is not None]
    if not functions:
        raise problem.invalid_error(constraint, "it has neither a lower_bound nor an upper_bound")
    if constraint.equality_with_lower:
        if constraint.lower_bound is None or constraint.upper_bound is not None:
            raise problem.invalid_error(
                constraint, "equality_with_lower needs a lower_bound and no upper_bound"
            )
        functions = [(constraint.lower_bound, (0.0, 0.0))]
    series = [
        problem.add_time_function(
            partial(sample_function, numeric(function, 1, f"a bound of '{constraint.name}'"))
        )
        for function, _ in functions
    ]
    limits: list[Range] = [limit for _ in paths for _, limit in functions]

    def formula(point: Point) -> Formula:
        return casadi.vertcat(
            *(variable(point, path) - point.evaluate(own) for path in paths for own in series)
        )

    return ConstraintRows(
        [f"{constraint.name} of {path}" for path in paths for _ in functions], formula, limits
    )
