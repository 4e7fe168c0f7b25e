"""Motion under constraints, whatever computes the motion without them.

What is needed of an engine are the mass matrix M and the forces f of M udot = f. The accelerations fulfil the
constraints, those of a redundant or contradictory kind in the sense of least squares; what integration lets positions
and speeds drift, a projection takes back. When that is done, how exactly, and by which measure of nearness, is as in
Simbody, so that the steps are those of OpenSim: positions and speeds are left alone as long as the root mean square of
the errors of all constraints is below the tolerance, and brought to a tenth of it otherwise; a change of a speed above
1 counts relative to it; and what lies across the constraints counts as no error of the integration.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf, sqrt

import numpy as np

from osimlite.multibody.constraints import Constraint, Lock, Prescribed
from osimlite.multibody.dynamics import constrained_accelerations
from osimlite.multibody.functions import Constant
from osimlite.multibody.kinematics import Kinematics, kinematics
from osimlite.multibody.linear import shortest, stacked
from osimlite.multibody.mechanism import GROUND, Mechanism
from osimlite.multibody.spatial import Array

OVERSHOOT = 0.1
"""The part of the tolerance that a projection aims at."""
FINEST = 2.0 ** (-52.0 * 7.0 / 8.0)
"""What counts as exact."""
REDUNDANT = 2.0**-26
"""Times the number of equations: how nearly one must follow from others to be dropped."""
ITERATIONS = 20
"""Newton's steps of a projection."""


def free_coordinates(mechanism: Mechanism) -> list[int]:
    """Places of the coordinates that are not simply at rest.

    A locked angle of a ball joint whose other angles are free is one of them: the speeds of the joint are not those of
    its angles, so that it takes a constraint to hold it.
    """
    turning = [
        set(motion_places)
        for body in mechanism.bodies
        for motion_places in body.mobilizer.turning
        if not all(mechanism.coordinates[place].locked for place in motion_places)
    ]
    held = set().union(*turning)
    return [place for place, info in enumerate(mechanism.coordinates) if not info.locked or place in held]


States = Callable[[float, Array, Array], Kinematics]
"""The state of some bodies at a time (s), at the coordinates and the speeds of an engine's state."""


class Constrained:
    """The constraints of a mechanism on the coordinates of an engine's state.

    Args:
        mechanism: whose constraints.
        order: place in the mechanism of each coordinate of the state; the others are locked, and stay at their
            defaults.
        states: gives the state of the bodies in :attr:`bodies` for time, x and u; by default osimlite's recursion.

    Attributes:
        bodies: indices of the bodies that constraints look at.
        constraints: on coordinates of the state.
        locks: how many coordinates are locked besides.
    """

    def __init__(self, mechanism: Mechanism, order: Sequence[int], states: States | None = None) -> None:
        self.mechanism = mechanism
        self._state = self.state if states is None else states
        self.order = tuple(order)
        self._order = np.array(order, dtype=int)
        self._q = np.array([info.default_value for info in mechanism.coordinates])
        self.constraints: list[Constraint] = []
        # Simbody's mean is over the equations of locks too, which have no errors.
        self.locks = 0
        for item in mechanism.constraints:
            if not isinstance(item, Lock):
                self.constraints.append(item)
            elif item.coordinate in order:
                self.constraints.append(Prescribed(item.coordinate, Constant(self._q[item.coordinate]), item.name))
            else:
                self.locks += 1
        self.bodies = sorted({body for item in self.constraints for body in item.bodies} - {GROUND})

    @property
    def names(self) -> list[str]:
        """Of what is kept up, apart from coordinates at rest."""
        return [item.name for item in self.constraints]

    def accelerations(
        self, t: float, x: Array, u: Array, matrix: Array, right: Array, state: Kinematics | None = None
    ) -> Array:
        """Udot (n,) at coordinates x (n,) and speeds u (n,), for M (n, n) and f (n,) of the motion without constraints.

        Args:
            t: time, s.
            x: coordinates.
            u: generalized speeds.
            matrix: M.
            right: f.
            state: of the bodies that constraints look at, if it is known already.

        Raises:
            SimulationError: a motion that nothing forbids moves no mass.
        """
        if not self.constraints:
            return constrained_accelerations(self.mechanism, matrix, right, None, self.order)
        state = self._state(t, x, u) if state is None else state
        rows, values = stacked([item.acceleration_equations(state) for item in self.constraints])
        return constrained_accelerations(self.mechanism, matrix, right, (rows[:, self._order], values), self.order)

    # -------------------------------------------------------------------------------------------- projection
    def project(
        self, t: float, y: list[float], errors: list[float] | None, tolerance: float, limit: float = inf
    ) -> tuple[list[float], list[float] | None] | None:
        """The nearest state where the constraints hold, see :class:`osimlite.simulation.integrators.Projection`."""
        if not self.constraints:
            return y, errors
        size = len(self._order)
        x, u, others = np.array(y[:size]), np.array(y[size : 2 * size]), y[2 * size :]
        off = None if errors is None else (np.array(errors[:size]), np.array(errors[size : 2 * size]))
        if not (
            self._project_values(t, x, off and off[0], tolerance, limit)
            and self._project_speeds(t, x, u, off and off[1], tolerance, limit)
        ):
            return None
        rest = None if errors is None or off is None else [*off[0].tolist(), *off[1].tolist(), *errors[2 * size :]]
        return x.tolist() + u.tolist() + others, rest

    def _project_values(self, t: float, x: Array, off: Array | None, tolerance: float, limit: float) -> bool:
        """Change x, and the errors with it; tell whether that worked."""
        still = np.zeros(len(x))

        def errors_at(x: Array) -> tuple[Kinematics, Array]:
            state = self._state(t, x, still)
            return state, np.concatenate([item.position_errors(state) for item in self.constraints])

        state, errors = errors_at(x)
        norm = self._norm(errors)
        if norm <= tolerance:
            return True
        if not norm <= limit:
            return False
        rows = np.zeros((0, len(x)))
        for iteration in range(ITERATIONS):
            rows = self._rows_by_values(state)
            step = shortest(rows, errors, REDUNDANT * len(errors))
            state, errors = errors_at(x - step)
            before, norm = norm, self._norm(errors)
            if iteration > 0 and not norm <= before:
                norm = before
                break
            x -= step
            if norm <= max(OVERSHOOT * tolerance, FINEST):
                break
        if not norm <= tolerance:
            return False
        if off is not None:
            off -= shortest(rows, rows @ off, REDUNDANT * len(errors))
        return True

    def _project_speeds(self, t: float, x: Array, u: Array, off: Array | None, tolerance: float, limit: float) -> bool:
        """Change u, and the errors with it; tell whether that worked."""
        state = self._state(t, x, u)
        all_rows, wanted = stacked([item.velocity_equations(state) for item in self.constraints])
        rows = all_rows[:, self._order]
        errors = rows @ u - wanted
        norm = self._norm(errors)
        if norm <= tolerance:
            return True
        if not norm <= limit:
            return False
        scales = np.maximum(np.abs(u), 1.0)
        rank = REDUNDANT * len(errors)
        # The rows do not depend on the speeds: one step does, a second one mends its rounding.
        for _ in range(2):
            u -= scales * shortest(rows * scales, errors, rank)
            errors = rows @ u - wanted
            norm = self._norm(errors)
            if norm <= max(OVERSHOOT * tolerance, FINEST):
                break
        if not norm <= tolerance:
            return False
        if off is not None:
            off -= scales * shortest(rows * scales, rows @ off, rank)
        return True

    # --------------------------------------------------------------------------------------------- helpers
    def state(self, t: float, x: Array, u: Array) -> Kinematics:
        """State of the bodies that constraints look at, by osimlite's recursion."""
        return kinematics(self.mechanism, *self.spread(x, u), t, bodies=self.bodies)

    def spread(self, x: Array, u: Array) -> tuple[Array, Array]:
        """Values and speeds of all coordinates of the mechanism."""
        q, speeds = self._q.copy(), np.zeros(len(self._q))
        q[self._order], speeds[self._order] = x, u
        return q, speeds

    def _rows_by_values(self, state: Kinematics) -> Array:
        """Derivatives (p, n) of the errors of the positions by the coordinates."""
        rows = []
        for item in self.constraints:
            count = len(item.position_errors(state))
            rows.append(item.velocity_equations(state)[0][:count])
        by_speeds = np.concatenate(rows)
        if not all(body.mobilizer.speeds_are_rates for body in self.mechanism.bodies):
            by_speeds = np.asarray(np.linalg.solve(self.mechanism.rate_matrix(state.q).T, by_speeds.T).T)
        return by_speeds[:, self._order]

    def _norm(self, errors: Array) -> float:
        """Root mean square over all equations, those of locked coordinates included."""
        return sqrt(float(errors @ errors) / max(len(errors) + self.locks, 1))


def kept_state(
    mechanism: Mechanism, q: Sequence[float], u: Sequence[float], set_values: Sequence[int], set_speeds: Sequence[int]
) -> tuple[Array, Array]:
    """The state at time 0 nearest to q (n,) and u (n,) in which the constraints hold.

    Args:
        mechanism: whose state.
        q: values of all coordinates.
        u: generalized speeds of all coordinates.
        set_values: places of the coordinates whose values stay.
        set_speeds: places of those whose speeds do.

    Raises:
        SimulationError: there is none.
    """
    values = mechanism.assemble(np.array(q), kept=set_values)
    return values, mechanism.project_speeds(values, np.array(u), kept=set_speeds)
