"""Where the length of a path jumps: points that come and go, ways around a surface that change."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from osimlite.lint.measures import Jump
from osimlite.measuring.sweeps import Sweep, lengths
from osimlite.multibody.spatial import Array
from osimlite.simulation.elements.geometries.paths.geometry_path import ThroughPoints
from osimlite.simulation.kernels.paths import CONDITIONAL

LEAST = 5e-4
"""A jump (m) that is told; smaller ones are not looked for."""
ASIDE = 1e-4
"""How far (rad or m) on either side of a jump lengths are taken: OpenSim's conditional points, which come 1e-5 before
their range and go 1e-5 after it, are all there or gone then."""


def jumps(sweep: Sweep) -> Iterator[Jump]:
    """The jumps of the lengths of paths along a sweep.

    They are looked for where conditional points come or go, and between values where a length changes otherwise than
    between their neighbours.
    """
    for place, (name, route) in enumerate(sweep.paths.routes.items()):
        if not isinstance(route, ThroughPoints):
            continue
        ends = [
            end
            for point in route.points
            if point.kind == CONDITIONAL and point.coordinate == sweep.place
            for end in point.range
        ]
        if ends or route.surfaces:
            low, high = sweep.values[0] + ASIDE, sweep.values[-1] - ASIDE
            found = {round(value, 3): value for value in (*_suspects(sweep, place), *ends) if low < value < high}
            yield from filter(None, (_jump(sweep, place, name, route, value) for value in found.values()))


def _suspects(sweep: Sweep, place: int) -> Iterator[float]:
    """Values at which the length of a path may jump."""
    row, values = sweep.lengths[:, place], sweep.values
    changes = np.diff(row)
    if len(changes) < 3:
        return
    usual = np.convolve(changes, (0.5, 0.0, 0.5), "same")
    usual[0], usual[-1] = 2.0 * changes[1] - changes[2], 2.0 * changes[-2] - changes[-3]
    for k in np.flatnonzero(np.abs(changes - usual) > LEAST):
        yield _narrowed(sweep, place, (values[k], values[k + 1]), (row[k], row[k + 1]), usual[k])


def _narrowed(sweep: Sweep, place: int, values: tuple[float, float], ends: tuple[float, float], usual: float) -> float:
    """The value between two at which the length changes most, besides the `usual` change."""
    (low, high), (before, after) = values, ends
    rate = usual / (high - low)
    while high - low > ASIDE:
        middle = 0.5 * (low + high)
        here, smooth = lengths(sweep.paths, sweep.at(middle))[place], rate * (middle - low)
        if abs(here - before - smooth) > abs(after - here - smooth):
            high, after = middle, here
        else:
            low, before = middle, here
    return 0.5 * (low + high)


def _jump(sweep: Sweep, place: int, name: str, route: ThroughPoints, value: float) -> Jump | None:
    sides = [sweep.at(value + aside) for aside in (-ASIDE, ASIDE)]
    before, after = (lengths(sweep.paths, q)[place] for q in sides)
    if not abs(after - before) > LEAST:
        return None
    return Jump(name, abs(after - before), sweep.pose(value), _changed(sweep, name, route, sides))


def _changed(sweep: Sweep, name: str, route: ThroughPoints, sides: list[Array]) -> tuple[str, ...]:
    """Names of the points and surfaces that a path runs through on one side only."""
    before, after = ({number for number, _ in sweep.paths.points(q)[name]} for q in sides)
    count = len(route.points)
    nodes = [route.points[k] if k < count else route.surfaces[(k - count) // 2].tangent for k in sorted(before ^ after)]
    return tuple(dict.fromkeys(node.name for node in nodes))
