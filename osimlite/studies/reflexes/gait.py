"""Gait measures of a simulated walk: heights, strides, stance phases and ground reaction forces."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.text import format_count
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.link_motion import locate_mass_centers, locate_station

if TYPE_CHECKING:
    from osimlite.studies.reflexes.scenario import Scenario, WalkResult

CONTACT_LOAD = 0.05
"""Ground reaction force over the body weight above which a foot counts as being in contact."""
MIN_CONTACT_S = 0.05
"""Shortest contact and shortest swing (s); briefer ones are scuffs or bounces and are ignored."""


class Strides(NamedTuple):
    """Averages over complete strides, each from one touch-down of a foot to its next.

    The first strides are left out.

    Attributes:
        number: number of strides of both legs.
        time: mean duration of a stride (s).
        length: mean length of a stride (m).
        stance: part of a stride in which the foot is in contact, per leg: left, right.
        both: part of the time in double support.
        humps: mean over stance phases of the ground reaction force over the weight: largest in the
            first half, smallest between the peaks, largest in the second half.
        peak: largest force on one foot over the weight.
        touches: touch-downs of both feet, the first ones included; unlike SCONE's count of steps it
            has no scuffs.
    """

    number: int
    time: float
    length: float
    stance: tuple[float, ...]
    both: float
    humps: tuple[float, ...]
    peak: float
    touches: int


class GaitMeasures(NamedTuple):
    """Gait measures of the first candidate.

    Attributes:
        distance: distance that the mass centre travels along x (m).
        speed: mean speed of the mass centre along x (m/s).
        centre: mean, smallest and largest height of the mass centre (m).
        pelvis: mean, smallest and largest height of the origin of the body that the legs are
            attached to (m).
        strides: averages of strides; None for a walk with fewer than three touch-downs of a leg.
    """

    distance: float
    speed: float
    centre: tuple[float, float, float]
    pelvis: tuple[float, float, float]
    strides: Strides | None

    def describe(self) -> dict[str, str]:
        """Return the measures as lines of text.

        Returns:
            Text with units of each measure by label, in the order of a report.
        """
        names = ("mass centre", self.centre), ("pelvis", self.pelvis)
        height_texts = (
            f"{name} {mean:.3f} m ({lowest:.3f} to {height_texts:.3f})"
            for name, (mean, lowest, height_texts) in names
        )
        texts = {
            "distance": f"{self.distance:.3f} m, {self.speed:.3f} m/s",
            "heights": ", ".join(height_texts),
        }
        if self.strides is not None:
            strides = self.strides
            left, right = (100.0 * fraction for fraction in strides.stance)
            texts["strides"] = (
                f"{strides.number}, of {strides.time:.3f} s and {strides.length:.3f} m; "
                f"{format_count(strides.touches, 'step')} without scuffs"
            )
            texts["stance"] = (
                f"left foot {left:.1f} % of a stride, right foot {right:.1f} %; both feet {100.0 * strides.both:.1f} %"
            )
            first_peak, valley, second_peak = strides.humps
            texts["ground"] = (
                f"{first_peak:.2f}, {valley:.2f}, {second_peak:.2f} body weights (peak, valley, peak); maximum {strides.peak:.2f}"
            )
        return texts


def measure_gait(scenario: Scenario, walked: WalkResult) -> GaitMeasures | None:
    """Return the gait of the first candidate of a walk; None for a model without two legs.

    Args:
        scenario: scenario whose candidates were simulated.
        walked: result of the simulation.
    """
    walkers = scenario.get_walkers(1)
    if len(walkers.legs) != 2:
        return None
    states = np.empty_like(walked.states.rows)
    # The table has the order of the model's file, the kernels have that of the mechanism.
    states[:, [walkers.offsets[path] for path in walked.states.columns]] = walked.states.rows
    moments = list(zip(walked.states.times.tolist(), states.tolist(), strict=True))
    centre = locate_mass_centers(walkers.engine, moments)[:, :3]
    pelvis = locate_station(walkers.engine, moments, walkers.legs[0].base, np.zeros(3))[:, :3]
    distance = centre[-1, 0] - centre[0, 0]
    times = walked.states.times
    centre_heights, pelvis_heights = (
        (float(y.mean()), float(y.min()), float(y.max())) for y in (centre[:, 1], pelvis[:, 1])
    )
    return GaitMeasures(
        float(distance),
        float(distance / times[-1]),
        centre_heights,
        pelvis_heights,
        measure_strides(times, centre[:, 0], walked.loads.rows),
    )


def measure_strides(times: Array, positions: Array, loads: Array) -> Strides | None:
    """Return averages over the strides of a walk; None with fewer than three touch-downs of a leg.

    Args:
        times: times of the samples (n,) (s).
        positions: position of the walker along x (n,) (m).
        loads: ground reaction force on each leg over the body weight (n, 2).
    """
    touches: Any = loads > CONTACT_LOAD
    stride_starts = []
    for is_touching in touches.T:
        _remove_brief_contacts(is_touching, times)
        begins = np.flatnonzero(is_touching[1:] & ~is_touching[:-1]) + 1
        # One stride needs two touch-downs after the first.
        if len(begins) < 3:
            return None
        # The stride after the first touch-down still depends on the initial state.
        stride_starts.append(begins[1:])
    humps, stance = [], []
    for is_touching, load, begins in zip(touches.T, loads.T, stride_starts, strict=True):
        stance.append(float(is_touching[begins[0] : begins[-1]].mean()))
        for start_row, end_row in pairwise(begins):
            stance_loads = load[start_row:end_row][is_touching[start_row:end_row]]
            # The ground reaction of walking has two humps: at loading and at push-off.
            middle_row = len(stance_loads) // 2
            first_peak = int(np.argmax(stance_loads[: middle_row or 1]))
            second_peak = middle_row + int(np.argmax(stance_loads[middle_row:]))
            humps.append(
                (
                    stance_loads[first_peak],
                    stance_loads[first_peak : second_peak + 1].min(),
                    stance_loads[second_peak],
                )
            )
    start = min(begins[0] for begins in stride_starts)
    end = max(begins[-1] for begins in stride_starts)
    count = sum(len(begins) - 1 for begins in stride_starts)
    time, length = (
        sum(row[begins[-1]] - row[begins[0]] for begins in stride_starts) / count
        for row in (times, positions)
    )
    # Double support and peak cover the time in which both legs have complete strides.
    double_support = float(touches[start:end].all(axis=1).mean())
    peak = float(loads[start:end].max())
    mean_humps = tuple(np.mean(humps, axis=0).tolist())
    return Strides(
        count,
        float(time),
        float(length),
        tuple(stance),
        double_support,
        mean_humps,
        peak,
        count + 2 * len(stride_starts),
    )


def _remove_brief_contacts(is_touching: Any, times: Array) -> None:
    """Remove contacts, and then swings, that are shorter than `MIN_CONTACT_S`, in place."""
    for contact in (True, False):
        edges = np.flatnonzero(is_touching[1:] != is_touching[:-1]) + 1
        for start_row, end_row in pairwise(edges):
            if (
                is_touching[start_row] == contact
                and times[end_row] - times[start_row] < MIN_CONTACT_S
            ):
                is_touching[start_row:end_row] = not contact
