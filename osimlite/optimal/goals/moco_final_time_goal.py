"""The time at the end."""

from __future__ import annotations

from osimlite.optimal.point import GoalTerms
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.goals import MocoFinalTimeGoal


def terms(goal: MocoFinalTimeGoal, problem: Problem) -> GoalTerms:
    """The final time, s."""
    return GoalTerms(lambda ends: ends.end.t[0])
