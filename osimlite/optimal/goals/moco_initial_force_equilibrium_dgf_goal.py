"""Tendons and fibers of De Groote's muscles in balance at the start."""

from __future__ import annotations

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.point import CONSTRAINT, Ends, Formula, Terms
from osimlite.optimal.problem import Problem
from osimlite.optimal.tendons import EXPLICIT, Tendons
from osimlite.schema.moco.goals import MocoInitialForceEquilibriumDGFGoal


def terms(goal: MocoInitialForceEquilibriumDGFGoal, problem: Problem) -> Terms:
    """By how much the force of each tendon of the explicit kind exceeds what the fibers bear, if it does not change."""

    def value(ends: Ends) -> Formula:
        tendons = Tendons(problem, problem.dynamics.elements(), EXPLICIT)
        return tendons.residuals(ends.start, casadi.SX.zeros(len(tendons.paths)))[1]

    return Terms(value, modes=CONSTRAINT)
