"""An output over the motion."""

from __future__ import annotations

from osimlite.optimal.outputs import build_output_formula
from osimlite.optimal.point import COST_FIRST, GoalTerms, make_integral_terms
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.goals import MocoOutputGoal


def terms(goal: MocoOutputGoal, problem: Problem) -> GoalTerms:
    """Its integral."""
    return make_integral_terms(build_output_formula(goal, problem), COST_FIRST)
