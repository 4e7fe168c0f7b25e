"""Cycles: fixed points of the step map, and whether they attract."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from osimlite.base.records import dataclass
from osimlite.errors import OsimliteError
from osimlite.simulation.batches import Floats
from osimlite.studies.gait.stepmap import StepMap
from osimlite.studies.gait.steps import measure_along_slope

CONVERGED = 1e-9
"""A fixed point is found when the map moves it by less than this (rad, m and per second, as a norm)."""

MOST_STEPS = 30
DIFFERENCE = 3e-5
"""By how much the reduced state is moved to differentiate the map.

With less, steps of the integrator that come and go show in the multipliers (half a percent at 1e-5
for the steady walker); with more, the map's curvature does (two parts in a thousand at 1e-4).
"""


@dataclass(frozen=True, eq=False)
class Cycle:
    """A walk that repeats itself with every step, or every stride if the legs differ."""

    state: Floats  # at the heel strike of the first foot, in the engine's order (y,)
    length: float  # of a step along the slope, from foot to foot, m
    # of the walker in a step, along the slope; feet that roll while they stand take it further than
    # `length`, m
    way: float
    period: float  # of a step, s
    # Floquet multipliers (of a step, or of a stride if the legs differ) without those of the
    # neutral directions, the largest first; that of the direction of the motion itself, zero, is
    # among them
    multipliers: NDArray[np.complex128]
    neutral: int  # how many directions are neutral
    residual: float  # how far the map moves the state
    scuffs: int  # in one step
    per_stride: bool  # whether the legs differ
    iterations: int  # of Newton's method

    @property
    def speed(self) -> float:
        """Along the slope, m/s."""
        return self.way / self.period

    @property
    def largest(self) -> float:
        """Largest magnitude of the multipliers; the cycle attracts if it is below 1."""
        return float(np.abs(self.multipliers).max())


def step_matrix(step_map: StepMap, state: ArrayLike, difference: float = DIFFERENCE) -> Floats:
    """Derivative of the step map in reduced states, by central differences; not a number where no step is made."""
    reduced = step_map.reduce(state)
    moves = difference * np.eye(len(reduced))
    images = step_map(step_map.expand(np.concatenate((reduced + moves, reduced - moves)))).states
    ahead, back = np.split(step_map.reduce(images), 2)
    return (ahead - back).T / (2.0 * difference)


def find_cycle(
    step_map: StepMap,
    state: ArrayLike | None = None,
    *,
    converged: float = CONVERGED,
    most_steps: int = MOST_STEPS,
    settle: int = 0,
) -> Cycle:
    """Find a fixed point of the step map by Newton's method, with steps halved until they help.

    Args:
        step_map: of the walker.
        state: where to begin (y,), at a heel strike of the first foot; by default where the map was
            made.
        converged: largest residual.
        most_steps: Newton steps.
        settle: walk so many steps first.

    Raises:
        OsimliteError: no fixed point is found from there.
    """
    here = np.array(step_map.start if state is None else state, dtype=float)
    name = step_map.engine.mechanism.name
    for _ in range(settle):
        there = step_map(here[None]).states[0]
        if np.isnan(there).any():
            break
        here = there
    reduced = step_map.reduce(here)
    miss, size = _compute_residual(step_map, reduced)
    taken, slope = 0, None
    while size > converged:
        if taken == most_steps:
            raise OsimliteError(
                f"no cycle of '{name}' is found after {taken} steps of Newton; still {size:.2g} off"
            )
        slope = step_matrix(step_map, step_map.expand(reduced))
        if not np.isfinite(slope).all():
            raise OsimliteError(
                f"'{name}' makes no step from near the start; give a start that walks"
            )
        move = np.linalg.solve(slope - np.eye(len(reduced)), -miss)
        part, last = 1.0, size
        while True:
            there, off = _compute_residual(step_map, reduced + part * move)
            if off < last or part < 1e-4:
                break
            part /= 2.0
        if not off < last:
            raise OsimliteError(
                f"no cycle of '{name}' is found from there; the best is {last:.2g} off"
            )
        reduced, miss, size = reduced + part * move, there, off
        taken += 1
    state_found = step_map.expand(reduced)
    images = step_map(state_found[None])
    engine, per_stride = step_map.engine, step_map.exchange is None
    feet = [engine.contacts.index(name) for foot in step_map.footing.feet for name in foot]
    before, after = (
        measure_along_slope(engine, np.array([state_found, images.states[0]]))[0][:, feet]
        .mean(axis=1)
        .tolist()
    )
    values = np.linalg.eigvals(step_matrix(step_map, state_found)).astype(np.complex128)
    return Cycle(
        state_found,
        float(images.lengths[0]),
        (after - before) / (1 + per_stride),
        float(images.times[0]),
        values[np.argsort(-np.abs(values))],
        step_map.neutral.shape[1],
        size,
        int(images.scuffs[0]),
        per_stride,
        taken,
    )


def _compute_residual(step_map: StepMap, reduced: Floats) -> tuple[Floats, float]:
    """How far the map moves a state, and the norm of that; infinite where it makes no step."""
    miss = step_map.reduce(step_map(step_map.expand(reduced)[None]).states[0]) - reduced
    size = float(np.linalg.norm(miss))
    return miss, size if np.isfinite(size) else np.inf
