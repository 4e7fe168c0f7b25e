"""An output at the start."""

from __future__ import annotations

from osimlite.optimal.outputs import build_output_formula
from osimlite.optimal.point import COST_FIRST, GoalTerms
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.goals import MocoInitialOutputGoal


def terms(goal: MocoInitialOutputGoal, problem: Problem) -> GoalTerms:
    """Its value."""
    value = build_output_formula(goal, problem)
    return GoalTerms(lambda ends: value(ends.start), modes=COST_FIRST)
