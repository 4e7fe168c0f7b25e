"""Where a point is at the end."""

from __future__ import annotations

from osimlite.optimal.point import Endpoints, Formula, GoalTerms
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.goals import MocoMarkerFinalGoal


def terms(goal: MocoMarkerFinalGoal, problem: Problem) -> GoalTerms:
    """The square of the distance of a marker, or another station, from a place in ground."""
    point = str(goal.point_name)
    problem.check_name(goal, point, problem.functions.mechanism.stations, "marker or station")

    def value(ends: Endpoints) -> Formula:
        found = ends.end.output("stations")
        pairs = zip("xyz", goal.reference_location, strict=True)
        return sum((found[f"{point}|{axis}"] - wanted) ** 2 for axis, wanted in pairs)

    return GoalTerms(value)
