"""Tendons and fibers of De Groote's muscles that stay in balance at the start."""

from __future__ import annotations

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.point import CONSTRAINT_FIRST, Endpoints, Formula, GoalTerms
from osimlite.optimal.problem import Problem
from osimlite.optimal.tendons import EXPLICIT, IMPLICIT, TendonEquations
from osimlite.schema.moco.goals import MocoInitialVelocityEquilibriumDGFGoal


def terms(goal: MocoInitialVelocityEquilibriumDGFGoal, problem: Problem) -> GoalTerms:
    """By how much the rate (N/s) of the force of the fibers of each muscle exceeds that of its tendon."""
    both = [
        TendonEquations(problem, problem.dynamics.list_forces(), mode)
        for mode in (IMPLICIT, EXPLICIT)
    ]

    def value(ends: Endpoints) -> Formula:
        return casadi.vertcat(*(tendons.compute_rate_errors(ends.start) for tendons in both))

    return GoalTerms(value, modes=CONSTRAINT_FIRST)
