"""States that fulfil the constraints: the nearest pose, the nearest speeds.

OpenSim assembles a model by minimising half the sum of squared changes of the coordinates under the
constraints; coordinates that depend on others and those free to satisfy constraints do not count,
locked ones keep their values, and clamped ones stay in their range. Here Newton's method leads to
the constraints and then along them to the minimum.

OpenSim's optimizer (IPOPT, to `assembly_accuracy`) ends within that of the minimum, but for clamped
coordinates: of these a barrier of about 1e-10 keeps it off, by 1e-10 / d from an end at distance d,
by 1e-5 where the minimum is at an end. Where exactly depends on the whole way there, which is not
followed here.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

import numpy as np

from osimlite.base.text import join_words
from osimlite.errors import SimulationError
from osimlite.mechanics.multibody.constraints import Coupler
from osimlite.mechanics.multibody.kinematics import Kinematics
from osimlite.mechanics.multibody.linear import solve_with_null_space, stack_equations
from osimlite.mechanics.multibody.spatial import Array

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.mechanism import Mechanism

_STEPS = 100
_EASE = 100.0
"""How much more readily coordinates move that do not count."""
_FURTHEST = 0.5
"""The longest step of a coordinate (m or rad)."""
_FINEST = 1e-12
"""What a constraint may be off for rounding (m or rad)."""


class UnmetConstraintsError(SimulationError):
    """No pose fulfils the constraints of a model.

    Args:
        model: name of the model.
        errors: for each constraint that is not met, by its path, how far the best pose is from
            meeting it (m, or rad for constraints of angles).
    """

    def __init__(self, model: str, errors: Mapping[str, float]) -> None:
        self.errors = dict(errors)
        super().__init__(
            f"no pose of '{model}' near the given one fulfils {join_words([*self.errors])}; change the "
            "coordinate values, unlock or unclamp coordinates, or set isEnforced of a constraint "
            "to false"
        )


def assemble_pose(mechanism: Mechanism, q: Array, time: float, kept: Collection[int] = ()) -> Array:
    """The coordinate values (n,) nearest to `q` (n,) that fulfil the constraints at `time` (s).

    The coordinates with indices `kept` keep their values, as locked ones do. Where no pose within
    the ranges of the clamped coordinates fulfils the constraints, the ranges give way, as in
    OpenSim.

    Raises:
        SimulationError: there are none, or they are too far to be found.
    """
    infos = mechanism.coordinates
    held = {
        place: float(q[place]) for place, info in enumerate(infos) if info.locked or place in kept
    }
    unclamped: Array | None = None
    while True:
        try:
            result = _find_nearest_pose(mechanism, q, time, held)
        except SimulationError:
            if unclamped is None:
                raise
            # OpenSim logs an error, relaxes the constraints, and its integrator then projects onto
            # them without ranges.
            return unclamped
        outside = {
            place: float(np.clip(result[place], *mechanism.coordinates[place].range))
            for place in find_unclamped(mechanism, result)
            if place not in held
        }
        if not outside:
            return result
        if unclamped is None:
            unclamped = result
        # Whichever would leave its range furthest stays at the end of it; then the others may fit.
        worst = max(outside, key=lambda place: abs(outside[place] - result[place]))
        held[worst] = outside[worst]


def find_unclamped(mechanism: Mechanism, q: Array) -> list[int]:
    """Return the indices of the clamped coordinates whose values (n,) lie outside their ranges.

    Prescribed coordinates are left out: no clamp binds them in OpenSim.
    """
    return [
        index
        for index, info in enumerate(mechanism.coordinates)
        if info.clamped
        and info.prescribed is None
        and not info.range[0] - 1e-12 <= q[index] <= info.range[1] + 1e-12
    ]


def project_speeds(state: Kinematics, kept: Collection[int] = ()) -> Array:
    """The generalized speeds (n,) nearest to those of `state` that fulfil the constraints.

    As in Simbody, the change of a speed that is greater than 1 counts relative to it.

    Raises:
        SimulationError: there are none in which the speeds with indices `kept` are as they were.
    """
    constraints = state.mechanism.constraints
    if not constraints:
        return state.u
    rows, wanted = stack_equations([item.velocity_equations(state) for item in constraints])
    scales = np.maximum(np.abs(state.u), 1.0)
    scales[list(kept)] = 0.0
    missing = wanted - rows @ state.u
    change, _ = solve_with_null_space(rows * scales, missing)
    u: Array = state.u + scales * change
    if kept and np.abs(rows @ u - wanted).max(initial=0.0) > 1e-9 * (
        1.0 + np.abs(missing).max(initial=0.0)
    ):
        names = [state.mechanism.coordinates[place].name for place in kept]
        raise SimulationError(
            f"the constraints of '{state.mechanism.name}' do not allow the speeds given for {join_words(names)}; "
            "leave some of them out"
        )
    return u


def _find_nearest_pose(
    mechanism: Mechanism, wanted: Array, time: float, held: Mapping[int, float]
) -> Array:
    """The nearest pose with some coordinates held at given values, whatever their ranges."""
    search = _Search(mechanism, wanted, time, held)
    q = search.restore_pose(search.start)
    if search.assembled:
        return q
    for _ in range(_STEPS):
        if search.compute_cost(q) < search.tolerance**2:
            # Nothing that counts has moved.
            return q
        step = search.compute_step(q)
        if np.abs(step).max(initial=0.0) < 1e-13 * (1.0 + float(np.abs(q).max(initial=0.0))):
            return q
        before, size = search.compute_cost(q), 1.0
        while True:
            trial = search.restore_pose(q + size * step)
            if search.compute_cost(trial) < before:
                break
            size *= 0.5
            if size < 1e-3:
                # Nothing nearer within rounding.
                return q
        q = trial
    return q


def tolerance_of(mechanism: Mechanism) -> float:
    """Return what an equation of an assembled pose may be off (m or rad)."""
    return max(mechanism.assembly_accuracy / 10.0, _FINEST)


class _Search:
    """Half the sum of squared changes of the coordinates that count, on the surface where the constraints hold."""

    def __init__(
        self, mechanism: Mechanism, wanted: Array, time: float, held: Mapping[int, float]
    ) -> None:
        self.mechanism, self.wanted, self.time = mechanism, wanted, time
        self.counted = np.array([0.0 if info.yielding else 1.0 for info in mechanism.coordinates])
        self.free = [index for index in range(len(wanted)) if index not in held]
        self.start = wanted.copy()
        self.start[list(held)] = list(held.values())
        self.tolerance = tolerance_of(mechanism)
        # OpenSim leaves such a pose as it is; its integrator takes the shortest way to the
        # constraints.
        self.assembled = bool(
            np.abs(_compute_position_errors(self._compute_state(self.start))).max(initial=0.0)
            <= self.tolerance
        )
        # Otherwise what does not count gives way first; what depends on others follows them.
        if not self.assembled:
            for item in mechanism.constraints:
                if (
                    isinstance(item, Coupler)
                    and item.dependent in self.free
                    and not self.counted[item.dependent]
                ):
                    self.start[item.dependent] = item.function.evaluate(
                        self.start[list(item.independent)]
                    )[0]
        self.ease = np.where(self.assembled | (self.counted[self.free] > 0.0), 1.0, _EASE)

    def compute_cost(self, q: Array) -> float:
        """What is to be as small as possible."""
        return 0.5 * float(np.sum(self.counted * (q - self.wanted) ** 2))

    def compute_step(self, q: Array) -> Array:
        """Newton's step (n,) along the surface, with the curvature of the constraints."""
        rows = self._compute_rows(self._compute_state(q))
        gradient, weights = (self.counted * (q - self.wanted))[self.free], self.counted[self.free]
        multipliers = np.asarray(
            np.linalg.lstsq(rows.T, -gradient, rcond=1e-9)[0], dtype=np.float64
        )
        _, along = solve_with_null_space(rows, np.zeros(len(rows)))
        curvature = along.T @ (weights[:, None] * along)
        if np.abs(multipliers).max(initial=0.0) > 1e-12:
            bends = [self._differentiate_pull(q, direction, multipliers) for direction in along.T]
            curvature = curvature + along.T @ np.array(bends).T.reshape(len(self.free), -1)
        values, vectors = np.linalg.eigh(0.5 * (curvature + curvature.T))
        slopes = np.asarray(vectors.T @ (along.T @ gradient), dtype=np.float64)
        # Downhill where the surface bends away; not at all along what does not count.
        flat = np.abs(values) < 1e-7
        lengths: Array = np.where(flat, 0.0, slopes / np.where(flat, 1.0, np.abs(values)))
        return self._spread_over_coordinates(-(along @ (vectors @ lengths)))

    def restore_pose(self, q: Array) -> Array:
        """The pose on the surface that Newton's method leads to, in the shortest steps.

        Raises:
            SimulationError: it leads nowhere.
        """
        state = self._compute_state(q)
        errors = _compute_position_errors(state)
        for _ in range(_STEPS):
            step, _ = solve_with_null_space(self._compute_rows(state) * self.ease, -errors)
            step *= self.ease
            # Far away the equations say little about where to go; small steps, even to worse
            # places, find out.
            size = min(1.0, _FURTHEST / float(np.abs(step).max(initial=_FURTHEST)))
            trial = q + size * self._spread_over_coordinates(step)
            state = self._compute_state(trial)
            new = _compute_position_errors(state)
            near = np.abs(errors).max(initial=0.0) <= self.tolerance
            if near and np.abs(new).max(initial=0.0) >= 0.5 * np.abs(errors).max(initial=0.0):
                break
            q, errors = trial, new
        if np.abs(errors).max(initial=0.0) <= self.tolerance:
            return q
        state = self._compute_state(q)
        broken = {
            item.name: float(np.abs(item.position_errors(state)).max(initial=0.0))
            for item in self.mechanism.constraints
        }
        raise UnmetConstraintsError(
            self.mechanism.name,
            {name: error for name, error in broken.items() if not error <= self.tolerance},
        )

    def _compute_state(self, q: Array) -> Kinematics:
        return Kinematics(self.mechanism, q, np.zeros(len(q)), self.time)

    def _compute_rows(self, state: Kinematics) -> Array:
        """Derivatives of the errors by the free coordinates (p, f)."""
        by_speeds = _compute_constraint_matrix(state)
        by_values = np.linalg.solve(self.mechanism.rate_matrix(state.q).T, by_speeds.T).T
        return np.asarray(by_values[:, self.free], dtype=np.float64)

    def _differentiate_pull(self, q: Array, direction: Array, multipliers: Array) -> Array:
        """How the multipliers' pull on the free coordinates changes along a direction of them (f,)."""
        change = 1e-6 * self._spread_over_coordinates(direction)
        ahead, behind = (
            self._compute_rows(self._compute_state(place)).T @ multipliers
            for place in (q + change, q - change)
        )
        return (ahead - behind) / 2e-6

    def _spread_over_coordinates(self, step: Array) -> Array:
        full = np.zeros(len(self.wanted))
        full[self.free] = step
        return full


def _compute_position_errors(state: Kinematics) -> Array:
    parts = [item.position_errors(state) for item in state.mechanism.constraints]
    return np.concatenate([np.zeros(0), *parts])


def _compute_constraint_matrix(state: Kinematics) -> Array:
    """Matrix (p, n) from the speeds to the rates of all position errors."""
    rows = [np.zeros((0, len(state.q)))]
    for item in state.mechanism.constraints:
        count = len(item.position_errors(state))
        if count:
            rows.append(item.velocity_equations(state)[0][:count])
    return np.concatenate(rows)
