"""Markers follow measured ones."""

from __future__ import annotations

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.point import Formula, GoalTerms, Point, make_integral_terms
from osimlite.optimal.problem import Problem
from osimlite.optimal.tables import fit_splines, read_table
from osimlite.schema.markers import Marker
from osimlite.schema.moco.tracking import MocoMarkerTrackingGoal


def terms(goal: MocoMarkerTrackingGoal, problem: Problem) -> GoalTerms:
    """The integral of the weighted sum of squares of the markers' distances from splines through what was measured."""
    reference, table = goal.markers_reference, problem.tables.get(goal.name)
    if table is None:
        if not reference.marker_file.strip():
            raise problem.invalid_error(goal, "its markers_reference names no marker_file")
        table = read_table(problem.locate_file(reference.marker_file))
    measured = [*dict.fromkeys(label[:-2] for label in table.columns)]
    known = {
        part.name: path for path, part in problem.components.items() if isinstance(part, Marker)
    }
    known |= {path: path for path in known.values()}
    followed = [name for name in measured if name in known or not goal.allow_unused_references]
    for name in followed:
        problem.check_name(goal, name, known, "marker")
    own = {item.name: item.weight for item in reference.marker_weights.objects}
    weights = [own.get(name, reference.default_weight) for name in followed]
    labels = [f"{name}_{k}" for name in followed for k in (1, 2, 3)]
    series = fit_splines(problem, table, labels)

    def integrand(point: Point) -> Formula:
        found, total = point.output("stations"), casadi.SX(0.0)
        for number, (name, weight) in enumerate(zip(followed, weights, strict=True)):
            for axis, own in zip("xyz", series[3 * number : 3 * number + 3], strict=True):
                total += weight * (found[f"{known[name]}|{axis}"] - point.evaluate(own)) ** 2
        return total

    return make_integral_terms(integrand)
