"""Where the length of a path jumps: points that come and go, ways around a surface that change."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf
from typing import NamedTuple

import numpy as np

from osimlite.lint.measures import Jump
from osimlite.measuring.sweeps import Sweep, lengths
from osimlite.multibody.spatial import Array
from osimlite.simulation.elements.geometries.paths.geometry_path import ThroughPoints
from osimlite.simulation.kernels.paths import CONDITIONAL
from osimlite.simulation.paths import Paths

LEAST = 1e-3
"""A jump (m) that is told; smaller ones are not looked for."""
ASIDE = 1e-4
"""How far (rad or m) on either side of a jump lengths are taken: OpenSim's conditional points, which come 1e-5 before
their range and go 1e-5 after it, are all there or gone then."""


class Suspect(NamedTuple):
    """An interval of a sweep in which the length of a path may jump.

    Attributes:
        excess: by how much the length changes otherwise than next to the interval, m; infinite at a conditional point.
        usual: the change next to it, m.
        sweep: of a coordinate.
        ends: of the interval.
    """

    excess: float
    usual: float
    sweep: Sweep
    ends: tuple[float, float]


def jumps(paths: Paths, looked_at: Sequence[Sweep]) -> Iterator[Jump]:
    """The greatest jump of the length of each path that has one.

    They are looked for where conditional points come or go, and between values where a length changes otherwise than
    next to them: there a jump can hardly be greater than the difference, so that what is less than a jump that was
    found need not be looked at.
    """
    for place, (name, route) in enumerate(paths.routes.items()):
        if not isinstance(route, ThroughPoints):
            continue
        found: Jump | None = None
        suspects = [suspect for sweep in looked_at for suspect in _suspects(sweep, place, route)]
        for suspect in sorted(suspects, key=lambda item: -item.excess):
            if found is not None and suspect.excess < found.size:
                break
            jump = _jump(suspect.sweep, place, name, route, _narrowed(suspect, place))
            if jump is not None and (found is None or jump.size > found.size):
                found = jump
        if found is not None:
            yield found


def _suspects(sweep: Sweep, place: int, route: ThroughPoints) -> Iterator[Suspect]:
    for point in route.points:
        if point.kind == CONDITIONAL and point.coordinate == sweep.place:
            yield from (Suspect(inf, 0.0, sweep, (end, end)) for end in point.range)
    changes = np.diff(sweep.lengths[:, place])
    if route.surfaces and len(changes) > 2:
        usual = np.convolve(changes, (0.5, 0.0, 0.5), "same")
        usual[0], usual[-1] = 2.0 * changes[1] - changes[2], 2.0 * changes[-2] - changes[-3]
        excess = np.abs(changes - usual)
        for k in np.flatnonzero(excess > LEAST):
            yield Suspect(float(excess[k]), float(usual[k]), sweep, (sweep.values[k], sweep.values[k + 1]))


def _narrowed(suspect: Suspect, place: int) -> float:
    """The value in an interval at which the length of a path changes most, besides the usual change."""
    sweep, (low, high) = suspect.sweep, suspect.ends
    if high - low <= ASIDE:
        return low
    rate = suspect.usual / (high - low)
    before, after = (lengths(sweep.paths, sweep.at(end))[place] for end in suspect.ends)
    while high - low > ASIDE:
        middle = 0.5 * (low + high)
        here, smooth = lengths(sweep.paths, sweep.at(middle))[place], rate * (middle - low)
        if abs(here - before - smooth) > abs(after - here - smooth):
            high, after = middle, here
        else:
            low, before = middle, here
    return 0.5 * (low + high)


def _jump(sweep: Sweep, place: int, name: str, route: ThroughPoints, value: float) -> Jump | None:
    if not sweep.values[0] + ASIDE < value < sweep.values[-1] - ASIDE:
        return None
    sides = [sweep.at(value + aside) for aside in (-ASIDE, ASIDE)]
    before, after = (lengths(sweep.paths, q)[place] for q in sides)
    if not abs(after - before) > LEAST:
        return None
    return Jump(name, abs(after - before), sweep.pose(value), _changed(sweep, name, route, sides))


def _changed(sweep: Sweep, name: str, route: ThroughPoints, sides: list[Array]) -> tuple[str, ...]:
    """Names of the points and surfaces that a path runs through on one side only."""
    before, after = ({number for number, _ in sweep.paths.points(q)[name]} for q in sides)
    count = len(route.points)
    names = [
        route.points[k].name or f"point {k + 1}" if k < count else route.surfaces[(k - count) // 2].tangent.name
        for k in sorted(before ^ after)
    ]
    return tuple(dict.fromkeys(names))
