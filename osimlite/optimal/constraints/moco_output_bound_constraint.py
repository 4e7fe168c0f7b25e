"""An output between functions of time."""

from __future__ import annotations

from osimlite.optimal.constraints.between import rows_between
from osimlite.optimal.outputs import build_output_formula
from osimlite.optimal.point import ConstraintRows
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.path_constraints import MocoOutputBoundConstraint


def rows(constraint: MocoOutputBoundConstraint, problem: Problem) -> ConstraintRows:
    """How far the output is above the functions."""
    value = build_output_formula(constraint, problem)
    return rows_between(
        constraint, problem, [constraint.output_path], lambda point, _: value(point)
    )
