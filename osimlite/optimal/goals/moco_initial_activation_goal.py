"""Activations equal to excitations at the start."""

from __future__ import annotations

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.point import CONSTRAINT_FIRST, Endpoints, Formula, GoalTerms
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.goals import MocoInitialActivationGoal


def terms(goal: MocoInitialActivationGoal, problem: Problem) -> GoalTerms:
    """For each muscle with an activation, excitation less activation."""
    muscles = [
        name for name in problem.controls if f"{name}/activation" in problem.functions.states
    ]

    def value(ends: Endpoints) -> Formula:
        start = ends.start
        differences = [start.control(name) - start.state(f"{name}/activation") for name in muscles]
        return casadi.vertcat(*differences) if differences else casadi.SX(0, 1)

    return GoalTerms(value, modes=CONSTRAINT_FIRST)
