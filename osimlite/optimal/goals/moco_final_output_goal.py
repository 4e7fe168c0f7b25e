"""An output at the end."""

from __future__ import annotations

from osimlite.optimal.outputs import build_output_formula
from osimlite.optimal.point import COST_FIRST, GoalTerms
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.goals import MocoFinalOutputGoal


def terms(goal: MocoFinalOutputGoal, problem: Problem) -> GoalTerms:
    """Its value."""
    value = build_output_formula(goal, problem)
    return GoalTerms(lambda ends: value(ends.end), modes=COST_FIRST)
