"""States that fulfil the constraints: the nearest pose and the nearest speeds.

OpenSim assembles a model by minimising half the sum of squared changes of the coordinates under the
constraints. Coordinates that depend on others, and those free to satisfy constraints, do not count;
locked ones keep their values, and clamped ones stay in their range. Here Newton's method leads to
the constraints and then along them to the minimum.

OpenSim's optimizer is IPOPT with the tolerance `assembly_accuracy`, so that its result is within
that of the minimum. Clamped coordinates are an exception: a barrier term of about 1e-10 keeps them
away from an end of their range, by 1e-10 / d at the distance d, and by 1e-5 if the minimum is at
the end. The exact distance depends on all iterates of IPOPT, which are not reproduced here.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

import numpy as np

from osimlite.base.text import join_words
from osimlite.errors import SimulationError
from osimlite.mechanics.multibody.constraints import Coupler
from osimlite.mechanics.multibody.kinematics import MechanismKinematics
from osimlite.mechanics.multibody.linear import solve_with_null_space, stack_equations
from osimlite.mechanics.multibody.spatial import Array

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.mechanism import Mechanism

_MAX_STEPS = 100
"""Largest number of Newton steps."""
_UNCOUNTED_MOBILITY = 100.0
"""Factor by which coordinates that do not count move more easily."""
_MAX_CHANGE = 0.5
"""Largest change of a coordinate in one step (m or rad)."""
_ROUNDING_ERROR = 1e-12
"""Error of a constraint that counts as rounding (m or rad)."""


class UnmetConstraintsError(SimulationError):
    """Error of constraints that no pose of a model fulfils.

    Args:
        model: name of the model.
        errors: error of the best pose for each violated constraint, by its path (m, or rad for
            constraints of angles).
    """

    def __init__(self, model: str, errors: Mapping[str, float]) -> None:
        self.errors = dict(errors)
        super().__init__(
            f"no pose of '{model}' near the requested pose fulfils {join_words([*self.errors])}; change the "
            "coordinate values, unlock or unclamp coordinates, or set isEnforced of a constraint "
            "to false"
        )


def assemble_pose(
    mechanism: Mechanism, q: Array, time: float, fixed: Collection[int] = ()
) -> Array:
    """Return the coordinate values (n,) nearest to a pose that fulfil the constraints.

    Where no pose within the ranges of the clamped coordinates fulfils the constraints, the ranges
    are ignored, as in OpenSim.

    Args:
        mechanism: mechanism.
        q: pose to start from (n,).
        time: time of prescribed coordinates (s).
        fixed: indices of coordinates that keep their values, as locked ones do.

    Raises:
        SimulationError: no pose near `q` fulfils the constraints.
    """
    infos = mechanism.coordinates
    fixed_values = {
        index: float(q[index]) for index, info in enumerate(infos) if info.locked or index in fixed
    }
    unclamped: Array | None = None
    while True:
        # First without ranges: if that fails, no range can help.
        try:
            result = _find_nearest_pose(mechanism, q, time, fixed_values)
        except SimulationError:
            if unclamped is None:
                raise
            # OpenSim logs an error, relaxes the constraints, and its integrator then projects onto
            # them without ranges.
            return unclamped
        beyond_range = {
            index: float(np.clip(result[index], *mechanism.coordinates[index].range))
            for index in find_unclamped(mechanism, result)
            if index not in fixed_values
        }
        if not beyond_range:
            return result
        if unclamped is None:
            unclamped = result
        # Fix the coordinate that leaves its range furthest at the end of it; then the others may
        # fit.
        worst = max(beyond_range, key=lambda index: abs(beyond_range[index] - result[index]))
        fixed_values[worst] = beyond_range[worst]


def find_unclamped(mechanism: Mechanism, q: Array) -> list[int]:
    """Return the indices of the clamped coordinates whose values are outside their ranges.

    Prescribed coordinates are omitted, because OpenSim does not clamp them.

    Args:
        mechanism: mechanism.
        q: coordinate values (n,).
    """
    return [
        index
        for index, info in enumerate(mechanism.coordinates)
        if info.clamped
        and info.prescribed is None
        and not info.range[0] - 1e-12 <= q[index] <= info.range[1] + 1e-12
    ]


def project_speeds(state: MechanismKinematics, kept: Collection[int] = ()) -> Array:
    """Return the generalized speeds (n,) nearest to those of a state that fulfil the constraints.

    As in Simbody, a change of a speed that is greater than 1 counts relative to the speed.

    Args:
        state: state with the speeds to project.
        kept: indices of coordinates whose speeds do not change.

    Raises:
        SimulationError: the constraints do not allow the speeds of `kept`.
    """
    constraints = state.mechanism.constraints
    if not constraints:
        return state.u
    rows, rhs = stack_equations([item.velocity_equations(state) for item in constraints])
    scales = np.maximum(np.abs(state.u), 1.0)
    # A scale of 0 takes the speed out of the unknowns.
    scales[list(kept)] = 0.0
    missing = rhs - rows @ state.u
    # In the scaled unknowns the shortest solution is Simbody's weighted one.
    change, _ = solve_with_null_space(rows * scales, missing)
    u: Array = state.u + scales * change
    if kept and np.abs(rows @ u - rhs).max(initial=0.0) > 1e-9 * (
        1.0 + np.abs(missing).max(initial=0.0)
    ):
        names = [state.mechanism.coordinates[index].name for index in kept]
        raise SimulationError(
            f"the constraints of '{state.mechanism.name}' do not allow the requested speeds of {join_words(names)}; "
            "leave some of them out"
        )
    return u


def _find_nearest_pose(
    mechanism: Mechanism, target: Array, time: float, fixed_values: Mapping[int, float]
) -> Array:
    """Return the nearest pose with some coordinates fixed, whatever their ranges.

    Args:
        mechanism: mechanism.
        target: pose to start from (n,).
        time: time of prescribed coordinates (s).
        fixed_values: value of each fixed coordinate, by its index.
    """
    search = _Search(mechanism, target, time, fixed_values)
    q = search.restore_pose(search.start)
    if search.assembled:
        return q
    for _ in range(_MAX_STEPS):
        if search.compute_cost(q) < search.tolerance**2:
            # No coordinate that counts has moved.
            return q
        step = search.compute_step(q)
        if np.abs(step).max(initial=0.0) < 1e-13 * (1.0 + float(np.abs(q).max(initial=0.0))):
            return q
        cost = search.compute_cost(q)
        size = 1.0
        while True:
            trial = search.restore_pose(q + size * step)
            if search.compute_cost(trial) < cost:
                break
            size *= 0.5
            if size < 1e-3:
                # Rounding: no pose is measurably nearer.
                return q
        q = trial
    return q


def tolerance_of(mechanism: Mechanism) -> float:
    """Return the accepted error of an equation of an assembled pose (m or rad).

    OpenSim's tolerance is a tenth of the assembly accuracy.
    """
    return max(mechanism.assembly_accuracy / 10.0, _ROUNDING_ERROR)


class _Search:
    """Search for the nearest pose on the surface where the constraints hold.

    The cost is half the sum of squared changes of the coordinates that count.
    """

    def __init__(
        self, mechanism: Mechanism, target: Array, time: float, fixed_values: Mapping[int, float]
    ) -> None:
        self.mechanism, self.target, self.time = mechanism, target, time
        self.coordinate_weights = np.array(
            [0.0 if info.yielding else 1.0 for info in mechanism.coordinates]
        )
        self.free = [index for index in range(len(target)) if index not in fixed_values]
        self.start = target.copy()
        self.start[list(fixed_values)] = list(fixed_values.values())
        self.tolerance = tolerance_of(mechanism)
        # OpenSim leaves an assembled pose unchanged; its integrator then projects it by the
        # shortest way onto the constraints.
        self.assembled = bool(
            np.abs(_compute_position_errors(self._compute_state(self.start))).max(initial=0.0)
            <= self.tolerance
        )
        # Otherwise coordinates that do not count move first: dependent ones follow their couplers.
        if not self.assembled:
            for item in mechanism.constraints:
                if (
                    isinstance(item, Coupler)
                    and item.dependent in self.free
                    and not self.coordinate_weights[item.dependent]
                ):
                    self.start[item.dependent] = item.function.evaluate(
                        self.start[list(item.independent)]
                    )[0]
        self.ease = np.where(
            self.assembled | (self.coordinate_weights[self.free] > 0.0), 1.0, _UNCOUNTED_MOBILITY
        )

    def compute_cost(self, q: Array) -> float:
        """Return half the sum of squared changes of the coordinates that count."""
        return 0.5 * float(np.sum(self.coordinate_weights * (q - self.target) ** 2))

    def compute_step(self, q: Array) -> Array:
        """Return Newton's step (n,) along the surface, with the curvature of the constraints."""
        rows = self._compute_rows(self._compute_state(q))
        gradient = (self.coordinate_weights * (q - self.target))[self.free]
        weights = self.coordinate_weights[self.free]
        # Multipliers by least squares, so that redundant constraints do no harm.
        multipliers = np.asarray(
            np.linalg.lstsq(rows.T, -gradient, rcond=1e-9)[0], dtype=np.float64
        )
        _, null_space = solve_with_null_space(rows, np.zeros(len(rows)))
        curvature = null_space.T @ (weights[:, None] * null_space)
        if np.abs(multipliers).max(initial=0.0) > 1e-12:
            derivatives = [
                self._differentiate_pull(q, direction, multipliers) for direction in null_space.T
            ]
            # Second derivatives of the constraints times their multipliers, by finite differences.
            curvature = curvature + null_space.T @ np.array(derivatives).T.reshape(
                len(self.free), -1
            )
        values, vectors = np.linalg.eigh(0.5 * (curvature + curvature.T))
        slopes = np.asarray(vectors.T @ (null_space.T @ gradient), dtype=np.float64)
        # Where the surface bends away (negative curvature) the step leads downhill; directions
        # without curvature do not change the cost, and are left alone.
        flat = np.abs(values) < 1e-7
        lengths: Array = np.where(flat, 0.0, slopes / np.where(flat, 1.0, np.abs(values)))
        return self._spread_over_coordinates(-(null_space @ (vectors @ lengths)))

    def restore_pose(self, q: Array) -> Array:
        """Return the pose on the surface that Newton's method with shortest steps reaches.

        Args:
            q: pose to start from (n,).

        Raises:
            UnmetConstraintsError: the search does not converge.
        """
        state = self._compute_state(q)
        errors = _compute_position_errors(state)
        for _ in range(_MAX_STEPS):
            step, _ = solve_with_null_space(self._compute_rows(state) * self.ease, -errors)
            step *= self.ease
            # Far from the surface the linearization is poor: take short steps, even where errors
            # grow.
            size = min(1.0, _MAX_CHANGE / float(np.abs(step).max(initial=_MAX_CHANGE)))
            trial = q + size * self._spread_over_coordinates(step)
            state = self._compute_state(trial)
            new_errors = _compute_position_errors(state)
            # Within the tolerance, continue only while errors at least halve; then rounding is
            # reached.
            is_within_tolerance = np.abs(errors).max(initial=0.0) <= self.tolerance
            if is_within_tolerance and np.abs(new_errors).max(initial=0.0) >= 0.5 * np.abs(
                errors
            ).max(initial=0.0):
                break
            q, errors = trial, new_errors
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

    def _compute_state(self, q: Array) -> MechanismKinematics:
        return MechanismKinematics(self.mechanism, q, np.zeros(len(q)), self.time)

    def _compute_rows(self, state: MechanismKinematics) -> Array:
        """Return the derivatives of the errors by the free coordinates (p, f)."""
        by_speeds = _compute_constraint_matrix(state)
        # Derivatives by speeds and coordinates differ for ball joints: G = E N⁻¹, with qdot = N u.
        by_values = np.linalg.solve(self.mechanism.rate_matrix(state.q).T, by_speeds.T).T
        return np.asarray(by_values[:, self.free], dtype=np.float64)

    def _differentiate_pull(self, q: Array, direction: Array, multipliers: Array) -> Array:
        """Return the derivative of the multipliers' generalized force on the free coordinates.

        It is a central difference along a direction.

        Args:
            q: pose (n,).
            direction: direction in the free coordinates (f,).
            multipliers: multipliers of the equations (p,).
        """
        change = 1e-6 * self._spread_over_coordinates(direction)
        ahead, behind = (
            self._compute_rows(self._compute_state(pose)).T @ multipliers
            for pose in (q + change, q - change)
        )
        return (ahead - behind) / 2e-6

    def _spread_over_coordinates(self, step: Array) -> Array:
        complete_step = np.zeros(len(self.target))
        complete_step[self.free] = step
        return complete_step


def _compute_position_errors(state: MechanismKinematics) -> Array:
    errors = [item.position_errors(state) for item in state.mechanism.constraints]
    return np.concatenate([np.zeros(0), *errors])


def _compute_constraint_matrix(state: MechanismKinematics) -> Array:
    """Return the matrix (p, n) from the speeds to the rates of all position errors."""
    rows = [np.zeros((0, len(state.q)))]
    for item in state.mechanism.constraints:
        count = len(item.position_errors(state))
        if count:
            rows.append(item.velocity_equations(state)[0][:count])
    return np.concatenate(rows)
