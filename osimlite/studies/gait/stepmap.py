"""The step map: from one heel strike to the next.

The Poincaré section is the moment at which a foot begins to touch the ground. A state in it is
written for the first foot as the one that has just touched down; where the legs are alike, they
change parts after every step, so that the map goes from step to step, and otherwise from stride to
stride.
"""

from __future__ import annotations

from copy import copy

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.records import dataclass
from osimlite.base.text import join_words
from osimlite.errors import OsimliteError, UnsupportedError
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.simulation.batches import BatchEngine, Floats, Ints, Watch, run_many
from osimlite.simulation.run import list_constraints
from osimlite.studies.gait.foot_contacts import FootContacts, find_footing
from osimlite.studies.gait.steps import (
    Step,
    make_fall_watches,
    measure_along_slope,
    room_for,
    walks_of,
)
from osimlite.studies.gait.symmetry import leg_exchange, neutral_directions

TIGHT = 1e-10
"""Accuracy of the integrator for maps that are differentiated."""

LONGEST = 4.0
"""A step takes at most so long, s."""

AT_ONCE = 1e-6
"""What happens within so short a time belongs to the heel strike, s."""

ALONG_A_STEP = 9
"""At so many moments of a step the neutral directions are looked for."""


def refuse_constraints(mechanism: Mechanism) -> None:
    """Stop where constraints act, which no step map is made for.

    Raises:
        UnsupportedError: some do.
    """
    if kept := list_constraints(mechanism):
        raise UnsupportedError(
            f"gaits are looked for in all directions of the state, some of which {join_words(kept)} takes away; set "
            "isEnforced of a constraint and prescribed of a coordinate to false"
        )


@dataclass
class Images:
    """Where the step map takes W states."""

    states: Floats  # on the section (W, y); not a number where there was no step
    lengths: Floats  # of the step, m (W,); of a stride of two steps, the mean
    times: Floats  # that the step takes, s (W,); of a stride of two steps, the mean
    scuffs: Ints  # how many there were on the way (W,)


class StepMap:
    """The step map of a walker.

    Args:
        engine: of the model.
        near: a state (y,) from which it makes a step, best one at a heel strike.
        footing: its feet; looked for if left out.
        accuracy: of the integrator.
        longest: a step takes at most so long, s.
        threads: how many work.

    Attributes:
        start: the first heel strike after `near`, written for the first foot (y,).
        exchange: see `leg_exchange`.
        neutral: orthonormal directions in which nothing acts (y, m).
        basis: orthonormal directions of all others (y, y - m).

    Raises:
        OsimliteError: there are no two feet, or the walker makes no step from there.
    """

    def __init__(
        self,
        engine: BatchEngine,
        near: ArrayLike,
        *,
        footing: FootContacts | None = None,
        accuracy: float = TIGHT,
        longest: float = LONGEST,
        threads: int | None = None,
    ) -> None:
        self.engine = engine
        self.footing = footing or find_footing(engine)
        self.accuracy = accuracy
        self.longest = longest
        self.threads = threads
        self.exchange: Ints | None = None
        here = np.array(near, dtype=float)
        step, moments = self._first_step(here)
        self.exchange = leg_exchange(engine, self.footing, moments)
        self.neutral = neutral_directions(engine, moments)
        full, _ = np.linalg.qr(np.hstack((self.neutral, np.eye(len(here)))))
        self.basis: Floats = full[:, self.neutral.shape[1] :]
        self.start = self.land(step.state, step.foot)
        if step.foot != 0:
            self.start = self._other_leg(self.start)

    def with_model(
        self, engine: BatchEngine, near: ArrayLike, accuracy: float | None = None
    ) -> StepMap:
        """The step map of a model with other numbers, whose reduced states are as near to these as they can be.

        Args:
            engine: of that model, of the same structure.
            near: a state from which it makes a step, and where reduced states are along the neutral
                directions (y,).
            accuracy: of the integrator; by default the same.

        Raises:
            OsimliteError: it makes no step from there, or has more or fewer neutral directions.
        """
        other = copy(self)
        other.engine = engine
        other.start = np.array(near, dtype=float)
        other.accuracy = self.accuracy if accuracy is None else accuracy
        other.neutral = neutral_directions(engine, other._first_step(other.start)[1])
        if other.neutral.shape != self.neutral.shape:
            raise OsimliteError(
                f"'{engine.mechanism.name}' has {other.neutral.shape[1]} neutral directions where it had "
                f"{self.neutral.shape[1]} before its numbers changed"
            )
        turned = self.basis - other.neutral @ (other.neutral.T @ self.basis)
        left, _, right = np.linalg.svd(turned, full_matrices=False)
        other.basis = left @ right
        return other

    def _first_step(self, near: Floats) -> tuple[Step, Floats]:
        """The first step from a state, and states on the way there (k, y)."""
        runs = run_many(
            self.engine,
            near[None],
            self.longest,
            accuracy=self.accuracy,
            watches=make_fall_watches(self.footing),
            most_events=room_for(self.longest),
            event_states=True,
            threads=1,
        )
        (walk,) = walks_of(self.engine, near[None], runs, self.footing)
        if not walk.steps:
            how = f"it fell on {walk.fell_on}" if walk.fell_on else "none"
            raise OsimliteError(
                f"'{self.engine.mechanism.name}' makes no step within {walk.end:.3g} s ({how}); give another start"
            )
        # At its ends a foot only just touches, where the force has no derivative.
        times = np.linspace(0.0, walk.steps[0].time, ALONG_A_STEP + 2)[1:-1].tolist()
        runs = run_many(self.engine, near[None], walk.steps[0].time, report_times=times, threads=1)
        return walk.steps[0], runs.reports[0]

    def _other_leg(self, state: Floats) -> Floats:
        if self.exchange is not None:
            return state[self.exchange]
        images = self._make_step(state[None], 1)
        if np.isnan(images.states).any():
            raise OsimliteError(
                f"'{self.engine.mechanism.name}' makes one step only; give another start"
            )
        return images.states[0]

    def land(self, state: Floats, foot: int) -> Floats:
        """A state (y,) a billionth of a second from a heel strike, moved onto it."""
        contacts = [self.engine.contacts.index(name) for name in self.footing.feet[foot]]
        rate = np.array(self.engine.compute_derivative(0.0, state.tolist()))
        dt = 1e-7
        _, depths = measure_along_slope(self.engine, np.array([state, state + dt * rate]))
        touching = contacts[int(np.argmin(np.abs(depths[0, contacts])))]
        speed = (depths[1, touching] - depths[0, touching]) / dt
        return state - depths[0, touching] / speed * rate

    # ----------------------------------------------------------------------------------------------- images
    def __call__(self, states: ArrayLike) -> Images:
        """Map states (W, y) in which the first foot has just touched down."""
        first = self._make_step(np.asarray(states, dtype=float), 0)
        if self.exchange is not None:
            return Images(first.states[:, self.exchange], first.lengths, first.times, first.scuffs)
        second = self._make_step(first.states, 1)
        return Images(
            second.states,
            (first.lengths + second.lengths) / 2.0,
            (first.times + second.times) / 2.0,
            first.scuffs + second.scuffs,
        )

    def _make_step(self, states: Floats, leading: int) -> Images:
        """One step of the foot behind."""
        count, trailing = len(states), 1 - leading
        result = Images(
            np.full(states.shape, np.nan),
            np.full(count, np.nan),
            np.full(count, np.nan),
            np.zeros(count, dtype=np.int64),
        )
        rows = np.flatnonzero(np.isfinite(states).all(axis=1))
        if not len(rows):
            return result
        # A foot of several contacts may touch with one of them while it stands on another.
        foot = self.footing.feet[trailing]
        stops = [Watch("strike", contact=foot[0], stops=1)] if len(foot) == 1 else []
        runs = run_many(
            self.engine,
            states[rows],
            self.longest,
            accuracy=self.accuracy,
            watches=[*make_fall_watches(self.footing), *stops],
            most_events=room_for(self.longest),
            event_states=True,
            threads=self.threads,
        )
        walks = walks_of(self.engine, states[rows], runs, self.footing)
        for row, walk in zip(rows.tolist(), walks, strict=True):
            step = next((step for step in walk.steps if step.foot == trailing), None)
            if step is not None:
                result.states[row] = self.land(step.state, trailing)
                result.lengths[row], result.times[row] = step.length, step.time
                # The first foot touches down at the start, or a rounding later.
                result.scuffs[row] = sum(AT_ONCE < scuff.time < step.time for scuff in walk.scuffs)
        return result

    # -------------------------------------------------------------------------------------------- coordinates
    def reduce(self, states: ArrayLike) -> Floats:
        """States without the neutral directions (..., y - m)."""
        return np.asarray(states, dtype=float) @ self.basis

    def expand(self, reduced: ArrayLike) -> Floats:
        """States (..., y) from reduced ones; along the neutral directions they are where `start` is."""
        return np.asarray(reduced) @ self.basis.T + self.start @ self.neutral @ self.neutral.T
