"""Step map of a walker: the state at a touch-down as a function of the state at the previous one.

The Poincaré section is the moment at which a foot begins to touch the ground. A state on it is
written as if the first foot had just touched down. Where the legs are alike, they are exchanged
after each step, so that the map goes from step to step; otherwise it goes from stride to stride.
"""

from __future__ import annotations

from copy import copy

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.records import dataclass
from osimlite.base.text import format_count, join_words
from osimlite.errors import OsimliteError, UnsupportedError
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.simulation.batches import BatchEngine, Floats, Ints, Watch, run_many
from osimlite.simulation.run import list_constraints
from osimlite.studies.gait.foot_contacts import FootContacts, find_footing
from osimlite.studies.gait.steps import (
    GaitStep,
    estimate_event_count,
    extract_walks,
    make_fall_watches,
    measure_along_slope,
)
from osimlite.studies.gait.symmetry import find_leg_exchange, find_neutral_directions

TIGHT_ACCURACY = 1e-10
"""Accuracy of the integrator for maps that are differentiated by differences of 1e-5."""

MAX_STEP_S = 4.0
"""Longest duration of a step (s); a walker that needs longer makes none."""

STRIKE_WINDOW_S = 1e-6
"""Touch-downs within this time (s) after the start belong to the touch-down that starts the step."""

NEUTRAL_SAMPLES = 9
"""Number of states along a step at which neutral directions must hold."""


def refuse_constraints(mechanism: Mechanism) -> None:
    """Refuse a model with constraints.

    They restrict the directions of the state that a step map varies.

    Raises:
        UnsupportedError: the model has constraints, or prescribed coordinates.
    """
    if constraint_names := list_constraints(mechanism):
        raise UnsupportedError(
            f"a gait cycle cannot be computed with constraints or prescribed coordinates: {join_words(constraint_names)}; set "
            "isEnforced of each constraint and prescribed of each coordinate to false"
        )


@dataclass
class StepImages:
    """Images of W states under the step map.

    Attributes:
        states: states on the section (W, y); NaN where there was no step.
        lengths: length of the step (W,) (m); of a stride the mean of its two steps.
        times: duration of the step (W,) (s); of a stride the mean of its two steps.
        scuffs: number of scuffs (W,).
    """

    states: Floats
    lengths: Floats
    times: Floats
    scuffs: Ints


class StepMap:
    """Step map of a walker.

    Args:
        engine: engine of the model.
        near: state (y,) from which the walker makes a step, preferably at a touch-down.
        footing: contacts of the feet; found automatically by default.
        accuracy: accuracy of the integrator.
        longest: longest duration of a step (s).
        threads: number of threads; by default one per core.

    Attributes:
        start: state at the first touch-down after `near`, exchanged to the first foot (y,).
        exchange: permutation of the state that exchanges the legs, see `find_leg_exchange`; None if
            the legs differ.
        neutral: orthonormal directions that do not change the motion (y, m).
        basis: orthonormal basis (y, y - m) of the complement of `neutral`.

    Raises:
        OsimliteError: there are not two feet, or the walker makes no step from there.
    """

    def __init__(
        self,
        engine: BatchEngine,
        near: ArrayLike,
        *,
        footing: FootContacts | None = None,
        accuracy: float = TIGHT_ACCURACY,
        longest: float = MAX_STEP_S,
        threads: int | None = None,
    ) -> None:
        self.engine = engine
        self.footing = footing or find_footing(engine)
        self.accuracy = accuracy
        self.longest = longest
        self.threads = threads
        self.exchange: Ints | None = None
        start_state = np.array(near, dtype=float)
        step, moments = self._simulate_first_step(start_state)
        self.exchange = find_leg_exchange(engine, self.footing, moments)
        self.neutral = find_neutral_directions(engine, moments)
        # The QR decomposition completes the neutral directions to an orthonormal basis of the state
        # space.
        complete_basis, _ = np.linalg.qr(np.hstack((self.neutral, np.eye(len(start_state)))))
        self.basis: Floats = complete_basis[:, self.neutral.shape[1] :]
        self.start = self.move_to_strike(step.state, step.foot)
        if step.foot != 0:
            self.start = self._switch_legs(self.start)

    def rebuild_for_model(
        self, engine: BatchEngine, near: ArrayLike, accuracy: float | None = None
    ) -> StepMap:
        """Return the step map of a model with other numbers.

        Its reduced states are as comparable as possible with those of this map.

        The new basis is the old one, projected onto the complement of the new neutral directions
        and made orthonormal by a polar decomposition, which changes it least.

        Args:
            engine: engine of that model, of the same structure.
            near: state (y,) from which it makes a step, and which defines the position along
                neutral directions.
            accuracy: accuracy of the integrator; by default the same.

        Raises:
            OsimliteError: the walker makes no step from there, or the number of neutral directions
                differs.
        """
        rebuilt = copy(self)
        rebuilt.engine = engine
        rebuilt.start = np.array(near, dtype=float)
        rebuilt.accuracy = self.accuracy if accuracy is None else accuracy
        rebuilt.neutral = find_neutral_directions(
            engine, rebuilt._simulate_first_step(rebuilt.start)[1]
        )
        if rebuilt.neutral.shape != self.neutral.shape:
            raise OsimliteError(
                f"'{engine.mechanism.name}' has {format_count(rebuilt.neutral.shape[1], 'neutral direction')} where it had "
                f"{self.neutral.shape[1]} before its numbers changed"
            )
        projected_basis = self.basis - rebuilt.neutral @ (rebuilt.neutral.T @ self.basis)
        left_vectors, _, right_vectors = np.linalg.svd(projected_basis, full_matrices=False)
        rebuilt.basis = left_vectors @ right_vectors
        return rebuilt

    def _simulate_first_step(self, state: Floats) -> tuple[GaitStep, Floats]:
        """Return the first step from a state, and states during this step (k, y).

        Raises:
            OsimliteError: the walker makes no step from this state.
        """
        runs = run_many(
            self.engine,
            state[None],
            self.longest,
            accuracy=self.accuracy,
            watches=make_fall_watches(self.footing),
            most_events=estimate_event_count(self.longest),
            event_states=True,
            threads=1,
        )
        (walk,) = extract_walks(self.engine, state[None], runs, self.footing)
        if not walk.steps:
            reason = f" (it fell on {walk.fell_on})" if walk.fell_on else ""
            raise OsimliteError(
                f"'{self.engine.mechanism.name}' makes no step within {walk.end:.3g} s{reason}; give another initial state"
            )
        # The ends are left out: a foot that just touches has a contact force without a derivative.
        times = np.linspace(0.0, walk.steps[0].time, NEUTRAL_SAMPLES + 2)[1:-1].tolist()
        runs = run_many(self.engine, state[None], walk.steps[0].time, report_times=times, threads=1)
        return walk.steps[0], runs.reports[0]

    def _switch_legs(self, state: Floats) -> Floats:
        """Return a state after a touch-down of the second foot as one of the first foot.

        Raises:
            OsimliteError: the legs differ, and the walker makes no step with the first foot.
        """
        if self.exchange is not None:
            return state[self.exchange]
        images = self._make_step(state[None], 1)
        if np.isnan(images.states).any():
            raise OsimliteError(
                f"'{self.engine.mechanism.name}' makes one step only; give another initial state"
            )
        return images.states[0]

    def move_to_strike(self, state: Floats, foot: int) -> Floats:
        """Return the state (y,) at a touch-down near a state, by one Newton step in time.

        Args:
            state: state at the event of a touch-down (y,).
            foot: index of the foot that touches down.
        """
        contacts = [self.engine.contacts.index(name) for name in self.footing.feet[foot]]
        rate = np.array(self.engine.compute_derivative(0.0, state.tolist()))
        dt = 1e-7
        _, depths = measure_along_slope(self.engine, np.array([state, state + dt * rate]))
        contact = contacts[int(np.argmin(np.abs(depths[0, contacts])))]
        speed = (depths[1, contact] - depths[0, contact]) / dt
        # The contact depth is zero on the section; its rate gives the time by which the event is
        # off.
        return state - depths[0, contact] / speed * rate

    # ----------------------------------------------------------------------------------------------- images
    def __call__(self, states: ArrayLike) -> StepImages:
        """Return the images of states (W, y) in which the first foot has just touched down."""
        first_step = self._make_step(np.asarray(states, dtype=float), 0)
        if self.exchange is not None:
            return StepImages(
                first_step.states[:, self.exchange],
                first_step.lengths,
                first_step.times,
                first_step.scuffs,
            )
        second_step = self._make_step(first_step.states, 1)
        return StepImages(
            second_step.states,
            (first_step.lengths + second_step.lengths) / 2.0,
            (first_step.times + second_step.times) / 2.0,
            first_step.scuffs + second_step.scuffs,
        )

    def _make_step(self, states: Floats, leading_foot: int) -> StepImages:
        """Return the images of states after one step of the trailing foot."""
        count = len(states)
        trailing_foot = 1 - leading_foot
        result = StepImages(
            np.full(states.shape, np.nan),
            np.full(count, np.nan),
            np.full(count, np.nan),
            np.zeros(count, dtype=np.int64),
        )
        rows = np.flatnonzero(np.isfinite(states).all(axis=1))
        if not len(rows):
            return result
        # A foot of several contacts may touch with one while it stands on another, so that only a foot
        # of one contact can end the run early.
        foot = self.footing.feet[trailing_foot]
        stops = [Watch("strike", contact=foot[0], stops=1)] if len(foot) == 1 else []
        runs = run_many(
            self.engine,
            states[rows],
            self.longest,
            accuracy=self.accuracy,
            watches=[*make_fall_watches(self.footing), *stops],
            most_events=estimate_event_count(self.longest),
            event_states=True,
            threads=self.threads,
        )
        walks = extract_walks(self.engine, states[rows], runs, self.footing)
        for row, walk in zip(rows.tolist(), walks, strict=True):
            step = next((step for step in walk.steps if step.foot == trailing_foot), None)
            if step is not None:
                result.states[row] = self.move_to_strike(step.state, trailing_foot)
                result.lengths[row], result.times[row] = step.length, step.time
                # The first foot touches down at the start, or a rounding error later: no scuff.
                result.scuffs[row] = sum(
                    STRIKE_WINDOW_S < scuff.time < step.time for scuff in walk.scuffs
                )
        return result

    # -------------------------------------------------------------------------------------------- coordinates
    def reduce(self, states: ArrayLike) -> Floats:
        """Return states without their neutral directions (..., y - m)."""
        return np.asarray(states, dtype=float) @ self.basis

    def expand(self, reduced: ArrayLike) -> Floats:
        """Return states (..., y) from reduced ones.

        Along neutral directions they are where `start` is.
        """
        return np.asarray(reduced) @ self.basis.T + self.start @ self.neutral @ self.neutral.T
