"""Tendons and fibers of De Groote's muscles that stay in balance at the start."""

from __future__ import annotations

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.point import CONSTRAINT, Ends, Formula, Terms
from osimlite.optimal.problem import Problem
from osimlite.optimal.tendons import EXPLICIT, IMPLICIT, Tendons
from osimlite.schema.moco.goals import MocoInitialVelocityEquilibriumDGFGoal


def terms(goal: MocoInitialVelocityEquilibriumDGFGoal, problem: Problem) -> Terms:
    """By how much the rate (N/s) of the force of the fibers of each muscle exceeds that of its tendon."""
    both = [Tendons(problem, problem.dynamics.elements(), mode) for mode in (IMPLICIT, EXPLICIT)]

    def value(ends: Ends) -> Formula:
        return casadi.vertcat(*(tendons.drifts(ends.start) for tendons in both))

    return Terms(value, modes=CONSTRAINT)
