"""The time at the end."""

from __future__ import annotations

from osimlite.optimal.point import Terms
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.goals import MocoFinalTimeGoal


def terms(goal: MocoFinalTimeGoal, problem: Problem) -> Terms:
    """The final time, s."""
    return Terms(lambda ends: ends.end.t[0])
