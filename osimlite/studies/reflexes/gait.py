"""What a walk looks like, in the numbers by which gaits are compared: heights, strides, stance, loads."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.link_motion import locate_mass_centers, locate_station

if TYPE_CHECKING:
    from osimlite.studies.reflexes.scenario import Scenario, Walked

TOUCHES = 0.05
"""Load over the weight with which a foot is on the ground."""
BRIEF = 0.05
"""S; a foot that scuffs the ground, or leaves it, for less does not."""


class Strides(NamedTuple):
    """Of whole strides, from one foot's touch to the next of the same, without the first ones of a walk.

    Attributes:
        number: of strides of both legs.
        touches: of the ground by both feet, the first ones included; SCONE counts scuffs among its
            steps, too.
        time,
        length: of one, s and m, on average.
        stance: part of a stride in which a foot is on the ground; left, right.
        both: part of the time in which both are.
        humps: largest force in the first half of a stance, least between, and largest in the second
            half; over the weight, on average.
        peak: largest force on a foot, over the weight.
    """

    number: int
    time: float
    length: float
    stance: tuple[float, ...]
    both: float
    humps: tuple[float, ...]
    peak: float
    touches: int


class Gait(NamedTuple):
    """The walk of a first candidate.

    Attributes:
        distance: that the mass centre went, m.
        speed: of it, m/s.
        centre,
        pelvis: height on average, least, and largest, m; of the mass centre, and of the origin of
            the body that the legs hang on.
        strides: None of a walk that has not three of each leg.
    """

    distance: float
    speed: float
    centre: tuple[float, float, float]
    pelvis: tuple[float, float, float]
    strides: Strides | None

    def describe(self) -> dict[str, str]:
        """In words."""
        names = ("mass centre", self.centre), ("pelvis", self.pelvis)
        high = (
            f"{name} {mean:.3f} m ({low:.3f} to {high:.3f})" for name, (mean, low, high) in names
        )
        words = {
            "distance": f"{self.distance:.3f} m, {self.speed:.3f} m/s",
            "heights": ", ".join(high),
        }
        if self.strides is not None:
            each = self.strides
            left, right = (100.0 * part for part in each.stance)
            words["strides"] = (
                f"{each.number}, of {each.time:.3f} s and {each.length:.3f} m; {each.touches} steps without scuffs"
            )
            words["stance"] = (
                f"{left:.1f} % of a stride left, {right:.1f} % right; both feet {100.0 * each.both:.1f} %"
            )
            first, dip, second = each.humps
            words["ground"] = (
                f"{first:.2f}, {dip:.2f}, {second:.2f} body weights (peak, valley, peak); maximum {each.peak:.2f}"
            )
        return words


def gait_of(scenario: Scenario, walked: Walked) -> Gait | None:
    """The gait of a walk of the scenario's; None of a model without two legs."""
    walkers = scenario.walkers(1)
    if len(walkers.legs) != 2:
        return None
    states = np.empty_like(walked.states.rows)
    states[:, [walkers.places[path] for path in walked.states.columns]] = walked.states.rows
    moments = list(zip(walked.states.times.tolist(), states.tolist(), strict=True))
    centre = locate_mass_centers(walkers.engine, moments)[:, :3]
    pelvis = locate_station(walkers.engine, moments, walkers.legs[0].base, np.zeros(3))[:, :3]
    far, times = centre[-1, 0] - centre[0, 0], walked.states.times
    upper, lower = (
        (float(y.mean()), float(y.min()), float(y.max())) for y in (centre[:, 1], pelvis[:, 1])
    )
    return Gait(
        float(far),
        float(far / times[-1]),
        upper,
        lower,
        strides_of(times, centre[:, 0], walked.loads.rows),
    )


def strides_of(times: Array, way: Array, loads: Array) -> Strides | None:
    """The strides of a walk; None if there are not three of each leg.

    Args:
        times: of the moments (n,), s.
        way: that the walker has gone (n,), m.
        loads: on both legs over the weight (n, 2).
    """
    touches: Any = loads > TOUCHES
    spans = []
    for on in touches.T:
        _remove_brief_contacts(on, times)
        begins = np.flatnonzero(on[1:] & ~on[:-1]) + 1
        if len(begins) < 3:
            return None
        spans.append(begins[1:])
    humps, stance = [], []
    for on, load, begins in zip(touches.T, loads.T, spans, strict=True):
        stance.append(float(on[begins[0] : begins[-1]].mean()))
        for first, last in pairwise(begins):
            there = load[first:last][on[first:last]]
            middle = len(there) // 2
            one, two = int(np.argmax(there[: middle or 1])), middle + int(np.argmax(there[middle:]))
            humps.append((there[one], there[one : two + 1].min(), there[two]))
    start, end = min(begins[0] for begins in spans), max(begins[-1] for begins in spans)
    count = sum(len(begins) - 1 for begins in spans)
    time, length = (
        sum(row[begins[-1]] - row[begins[0]] for begins in spans) / count for row in (times, way)
    )
    both, peak = float(touches[start:end].all(axis=1).mean()), float(loads[start:end].max())
    found = tuple(np.mean(humps, axis=0).tolist())
    return Strides(
        count, float(time), float(length), tuple(stance), both, found, peak, count + 2 * len(spans)
    )


def _remove_brief_contacts(on: Any, times: Array) -> None:
    """Take brief times on the ground, and then those off it, for none."""
    for what in (True, False):
        edges = np.flatnonzero(on[1:] != on[:-1]) + 1
        for first, last in pairwise(edges):
            if on[first] == what and times[last] - times[first] < BRIEF:
                on[first:last] = not what
