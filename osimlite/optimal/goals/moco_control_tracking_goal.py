"""Controls follow a table."""

from __future__ import annotations

from osimlite.optimal.point import Formula, GoalTerms, Point, make_integral_terms
from osimlite.optimal.problem import Problem
from osimlite.optimal.tables import fit_splines, read_reference
from osimlite.schema.moco.tracking import MocoControlTrackingGoal


def terms(goal: MocoControlTrackingGoal, problem: Problem) -> GoalTerms:
    """The integral of the weighted sum of squares of the controls' distances from splines through the table."""
    controls, table = [*problem.controls], read_reference(problem, goal, goal.reference)
    columns = {item.name: item.reference for item in goal.reference_labels}
    if not columns:
        columns = {
            name: name
            for name in table.columns
            if name in controls or not goal.allow_unused_references
        }
    for name, label in columns.items():
        problem.check_name(goal, name, controls, "control")
        if label not in table.columns:
            raise problem.invalid_error(
                goal, f"its reference has no column '{label}', which '{name}' is to follow"
            )
    weights = dict(
        zip(
            controls,
            problem.find_weights(goal, goal.control_weights, None, controls, "control"),
            strict=True,
        )
    )
    pairs = [*zip(columns, fit_splines(problem, table, [*columns.values()]), strict=True)]

    def integrand(point: Point) -> Formula:
        return sum(
            weights[name] * (point.control(name) - point.evaluate(series)) ** 2
            for name, series in pairs
        )

    return make_integral_terms(integrand)
