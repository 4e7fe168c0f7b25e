"""An output over the motion."""

from __future__ import annotations

from osimlite.optimal.outputs import output_value
from osimlite.optimal.point import BOTH, Terms, integral
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.goals import MocoOutputGoal


def terms(goal: MocoOutputGoal, problem: Problem) -> Terms:
    """Its integral."""
    return integral(output_value(goal, problem), BOTH)
