"""Markers follow measured ones."""

from __future__ import annotations

from osimlite.backends.symbols import casadi
from osimlite.fitting.marker_data import MarkerData
from osimlite.optimal.point import Formula, Point, Terms, integral
from osimlite.optimal.problem import Problem
from osimlite.optimal.tables import splines
from osimlite.schema.markers import Marker
from osimlite.schema.moco.tracking import MocoMarkerTrackingGoal
from osimlite.simulation.files.storage import StoTable


def terms(goal: MocoMarkerTrackingGoal, problem: Problem) -> Terms:
    """The integral of the weighted sum of squares of the markers' distances from splines through what was measured."""
    reference = goal.markers_reference
    if not reference.marker_file.strip():
        raise problem.wrong(goal, "its markers_reference names no marker_file")
    measured = MarkerData.of(problem.place(reference.marker_file))
    known = {part.name: path for path, part in problem.components.items() if isinstance(part, Marker)}
    known |= {path: path for path in known.values()}
    followed = [name for name in measured.names if name in known or not goal.allow_unused_references]
    for name in followed:
        problem.expect(goal, name, known, "marker")
    own = {item.name: item.weight for item in reference.marker_weights.objects}
    weights = [own.get(name, reference.default_weight) for name in followed]
    labels = [f"{name}|{axis}" for name in followed for axis in "xyz"]
    places = [measured.names.index(name) for name in followed]
    rows = measured.positions[:, places].reshape(len(measured.times), -1)
    table = StoTable("", measured.times, tuple(labels), rows, file=reference.marker_file)
    series = splines(problem, table, labels)

    def integrand(point: Point) -> Formula:
        found, total = point.output("stations"), casadi.SX(0.0)
        for number, (name, weight) in enumerate(zip(followed, weights, strict=True)):
            for axis, own in zip("xyz", series[3 * number : 3 * number + 3], strict=True):
                total += weight * (found[f"{known[name]}|{axis}"] - point.at(own)) ** 2
        return total

    return integral(integrand)
