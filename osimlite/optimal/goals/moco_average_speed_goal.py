"""How far the average speed of the mass centre is from a given one."""

from __future__ import annotations

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.point import CONSTRAINT_FIRST, Endpoints, Formula, GoalTerms
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.goals import MocoAverageSpeedGoal


def terms(goal: MocoAverageSpeedGoal, problem: Problem) -> GoalTerms:
    """The wanted speed less the way of the mass centre over the duration, m/s."""

    def value(ends: Endpoints) -> Formula:
        way = casadi.norm_2(ends.end.mass_center() - ends.start.mass_center())
        return goal.desired_average_speed - way / ends.duration

    return GoalTerms(value, modes=CONSTRAINT_FIRST)
