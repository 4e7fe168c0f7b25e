"""An output at the start."""

from __future__ import annotations

from osimlite.optimal.outputs import output_value
from osimlite.optimal.point import BOTH, Terms
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.goals import MocoInitialOutputGoal


def terms(goal: MocoInitialOutputGoal, problem: Problem) -> Terms:
    """Its value."""
    value = output_value(goal, problem)
    return Terms(lambda ends: value(ends.start), modes=BOTH)
