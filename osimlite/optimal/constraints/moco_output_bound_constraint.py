"""An output between functions of time."""

from __future__ import annotations

from osimlite.optimal.constraints.between import rows_between
from osimlite.optimal.outputs import output_value
from osimlite.optimal.point import Rows
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.path_constraints import MocoOutputBoundConstraint


def rows(constraint: MocoOutputBoundConstraint, problem: Problem) -> Rows:
    """How far the output is above the functions."""
    value = output_value(constraint, problem)
    return rows_between(
        constraint, problem, [constraint.output_path], lambda point, _: value(point)
    )
