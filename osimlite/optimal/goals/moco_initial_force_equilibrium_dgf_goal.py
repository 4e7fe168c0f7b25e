"""Tendons and fibers of De Groote's muscles in balance at the start."""

from __future__ import annotations

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.point import CONSTRAINT_FIRST, Endpoints, Formula, GoalTerms
from osimlite.optimal.problem import Problem
from osimlite.optimal.tendons import EXPLICIT, TendonEquations
from osimlite.schema.moco.goals import MocoInitialForceEquilibriumDGFGoal


def terms(goal: MocoInitialForceEquilibriumDGFGoal, problem: Problem) -> GoalTerms:
    """By how much the force of each tendon of the explicit kind exceeds what the fibers bear, if it does not change."""

    def value(ends: Endpoints) -> Formula:
        tendons = TendonEquations(problem, problem.dynamics.list_forces(), EXPLICIT)
        return tendons.compute_residuals(ends.start, casadi.SX.zeros(len(tendons.paths)))[1]

    return GoalTerms(value, modes=CONSTRAINT_FIRST)
