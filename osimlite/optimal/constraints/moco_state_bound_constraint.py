"""States between functions of time."""

from __future__ import annotations

from osimlite.optimal.constraints.between import rows_between
from osimlite.optimal.point import ConstraintRows, Point
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.path_constraints import MocoStateBoundConstraint


def rows(constraint: MocoStateBoundConstraint, problem: Problem) -> ConstraintRows:
    """How far each state is above the functions."""
    paths = [str(path) for path in constraint.state_paths]
    for path in paths:
        problem.check_name(constraint, path, problem.functions.states, "state")
    return rows_between(constraint, problem, paths, Point.state)
