"""An output at the end."""

from __future__ import annotations

from osimlite.optimal.outputs import output_value
from osimlite.optimal.point import BOTH, Terms
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.goals import MocoFinalOutputGoal


def terms(goal: MocoFinalOutputGoal, problem: Problem) -> Terms:
    """Its value."""
    value = output_value(goal, problem)
    return Terms(lambda ends: value(ends.end), modes=BOTH)
