"""Gait cycles: fixed points of the step map, their Floquet multipliers, and states during a step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from osimlite.base.records import dataclass
from osimlite.errors import OsimliteError
from osimlite.simulation.batches import Floats, run_many
from osimlite.studies.gait.starts import move_along_neutral_directions
from osimlite.studies.gait.stepmap import TIGHT_ACCURACY, StepMap
from osimlite.studies.gait.steps import measure_along_slope

CYCLE_TOLERANCE = 1e-9
"""Norm of the residual of the step map (rad, m, rad/s, m/s) below which a state is a fixed point."""

MAX_NEWTON_STEPS = 30
"""Most steps of Newton's method before the search for a cycle is given up."""
DIFFERENCE_STEP = 3e-5
"""Change of the reduced state (rad, m, rad/s, m/s) in central differences of the step map.

Steps of the integrator that appear and vanish show in the multipliers of a smaller change (half a
percent at 1e-5 for the steady walker), the curvature of the map in those of a larger one (two parts
in a thousand at 1e-4).
"""


@dataclass(frozen=True, eq=False)
class Cycle:
    """Gait that repeats after each step, or after each stride if the legs differ.

    Attributes:
        state: state at the touch-down of the first foot, in the order of the engine (y,).
        length: length of a step along the slope, from foot to foot (m).
        travel: distance that the walker moves along the slope in a step (m); rolling feet take it
            further than `length`.
        period: duration of a step (s).
        multipliers: Floquet multipliers of a step, or of a stride if the legs differ, largest
            magnitude first. Those of neutral directions are left out; that of the direction of
            motion, zero, is among them.
        neutral: number of neutral directions.
        residual: norm of the residual of the step map.
        scuffs: number of scuffs in one step.
        per_stride: whether the legs differ, so that the map is one of strides.
        iterations: number of steps of Newton's method.
    """

    state: Floats
    length: float
    travel: float
    period: float
    multipliers: NDArray[np.complex128]
    neutral: int
    residual: float
    scuffs: int
    per_stride: bool
    iterations: int

    @property
    def speed(self) -> float:
        """Mean speed along the slope (m/s)."""
        return self.travel / self.period

    @property
    def largest(self) -> float:
        """Largest magnitude of the multipliers; the cycle attracts if it is below 1."""
        return float(np.abs(self.multipliers).max())


def differentiate_step_map(
    step_map: StepMap, state: ArrayLike, difference: float = DIFFERENCE_STEP
) -> Floats:
    """Return the Jacobian of the step map in reduced states (r, r), by central differences.

    Args:
        step_map: step map.
        state: state at a touch-down of the first foot (y,).
        difference: change of each reduced entry.

    Returns:
        Matrix, with NaN in the column of a direction in which the walker makes no step.
    """
    reduced = step_map.reduce(state)
    displacements = difference * np.eye(len(reduced))
    # All perturbed walkers are simulated in one call.
    images = step_map(
        step_map.expand(np.concatenate((reduced + displacements, reduced - displacements)))
    ).states
    images_ahead, images_behind = np.split(step_map.reduce(images), 2)
    return (images_ahead - images_behind).T / (2.0 * difference)


def find_cycle(
    step_map: StepMap,
    state: ArrayLike | None = None,
    *,
    tolerance: float = CYCLE_TOLERANCE,
    max_steps: int = MAX_NEWTON_STEPS,
    warm_up_steps: int = 0,
) -> Cycle:
    """Return a fixed point of the step map, found by Newton's method with a line search.

    Args:
        step_map: step map of the walker.
        state: initial guess (y,), at a touch-down of the first foot; by default the state in which
            the step map was made.
        tolerance: largest norm of the residual.
        max_steps: most steps of Newton's method.
        warm_up_steps: number of steps that the walker makes before the first step of Newton's
            method.

    Raises:
        OsimliteError: the method does not converge from there, or the walker makes no step.
    """
    present = np.array(step_map.start if state is None else state, dtype=float)
    name = step_map.engine.mechanism.name
    # A stable cycle often attracts walkers from farther away than Newton's method converges.
    for _ in range(warm_up_steps):
        next_state = step_map(present[None]).states[0]
        if np.isnan(next_state).any():
            break
        present = next_state
    reduced = step_map.reduce(present)
    residual, size = _compute_residual(step_map, reduced)
    step_count, slope = 0, None
    while size > tolerance:
        if step_count == max_steps:
            raise OsimliteError(
                f"no gait cycle of '{name}' was found in {step_count} Newton steps: the state after a step "
                f"still differs by {size:.2g}"
            )
        slope = differentiate_step_map(step_map, step_map.expand(reduced))
        if not np.isfinite(slope).all():
            raise OsimliteError(
                f"'{name}' makes no step from a state near the initial state; give an initial state from which it walks"
            )
        # Newton's method for P(x) - x = 0, whose Jacobian is dP/dx - I.
        move = np.linalg.solve(slope - np.eye(len(reduced)), -residual)
        # Halve the step until the residual decreases; a change of 1e-4 of it is hopeless.
        step_fraction, previous_size = 1.0, size
        while True:
            next_state, trial_size = _compute_residual(step_map, reduced + step_fraction * move)
            if trial_size < previous_size or step_fraction < 1e-4:
                break
            step_fraction /= 2.0
        if not trial_size < previous_size:
            raise OsimliteError(
                f"no gait cycle of '{name}' was found from this initial state: the state after a step differs "
                f"by at least {previous_size:.2g}"
            )
        reduced = reduced + step_fraction * move
        residual = next_state
        size = trial_size
        step_count += 1
    cycle_state = step_map.expand(reduced)
    images = step_map(cycle_state[None])
    engine = step_map.engine
    per_stride = step_map.exchange is None
    feet = [engine.contacts.index(name) for foot in step_map.footing.feet for name in foot]
    # All contacts of the feet together move by as much as the walker does in a complete cycle.
    position_before, position_after = (
        measure_along_slope(engine, np.array([cycle_state, images.states[0]]))[0][:, feet]
        .mean(axis=1)
        .tolist()
    )
    # Floquet multipliers are the eigenvalues of the Jacobian of the map at the fixed point.
    values = np.linalg.eigvals(differentiate_step_map(step_map, cycle_state)).astype(np.complex128)
    return Cycle(
        cycle_state,
        float(images.lengths[0]),
        (position_after - position_before) / (1 + per_stride),
        float(images.times[0]),
        values[np.argsort(-np.abs(values))],
        step_map.neutral.shape[1],
        size,
        int(images.scuffs[0]),
        per_stride,
        step_count,
    )


def _compute_residual(step_map: StepMap, reduced: Floats) -> tuple[Floats, float]:
    """Return the residual of the step map, and its norm; infinity where the walker makes no step."""
    residual = step_map.reduce(step_map(step_map.expand(reduced)[None]).states[0]) - reduced
    size = float(np.linalg.norm(residual))
    return residual, size if np.isfinite(size) else np.inf


def sample_states_of_step(step_map: StepMap, cycle: Cycle, fractions: Sequence[float]) -> Floats:
    """Return states (k, y) of a cycle at parts of a step.

    The walker is at the origin with its trunk as built, as far as neither changes the motion.

    Args:
        step_map: step map of the walker.
        cycle: gait cycle.
        fractions: parts of a step after touch-down (k,), increasing.
    """
    times = [fraction * cycle.period for fraction in fractions]
    runs = run_many(
        step_map.engine,
        cycle.state[None],
        cycle.period,
        report_times=times,
        accuracy=TIGHT_ACCURACY,
        threads=step_map.threads,
    )
    return move_along_neutral_directions(runs.reports[0], step_map.neutral)
