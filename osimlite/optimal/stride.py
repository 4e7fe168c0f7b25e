"""A motion and the same once more behind it, which a MocoPeriodicityGoal makes a whole stride of half a one."""

from __future__ import annotations

import numpy as np

from osimlite.optimal.problem import Problem
from osimlite.optimal.trajectory import MocoTrajectory
from osimlite.schema.moco.goals import MocoPeriodicityGoal


def append_next_period(problem: Problem, trajectory: MocoTrajectory) -> MocoTrajectory | None:
    """The motion and what follows it; None unless a goal says that it ends as it began, or as its mirror image.

    The variable that at the end is what another was at the start goes on as that did. What no goal
    speaks of, such as the way, goes on from where it has come. Multipliers, slacks and derivatives
    are left out.

    Args:
        problem: with the goals.
        trajectory: of its variables.
    """
    goals = [goal for goal, _ in problem.goals if isinstance(goal, MocoPeriodicityGoal)]
    pairs = [pair for goal in goals for pair in (*goal.state_pairs, *goal.control_pairs)]
    if not pairs:
        return None
    start, end = trajectory.times[[0, -1]]
    follows = {pair.final_variable: pair for pair in pairs}
    names = {kind: trajectory.names[kind] for kind in ("states", "controls")}
    columns = {}
    for name in (*names["states"], *names["controls"]):
        column, pair = trajectory.columns[name], follows.get(name)
        if pair is None:
            more = column + (column[-1] - column[0])
        else:
            more = (-1.0 if pair.negate else 1.0) * trajectory.columns[pair.initial_variable]
        columns[name] = np.concatenate([column, more[1:]])
    times = np.concatenate([trajectory.times, trajectory.times[1:] + (end - start)])
    return MocoTrajectory(times, columns, names, trajectory.parameters)
