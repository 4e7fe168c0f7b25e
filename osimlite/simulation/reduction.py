"""Joints of one axis whose values are any functions of a few coordinates.

A robot's joints follow q = F(x) with x the coordinates of the state; with the generalized speeds u their rates are
J u, and their accelerations J udot + b. So the equations of motion of the coordinates are those of the joints,
projected: M = Jᵀ M_joints J, and the bias is Jᵀ of the forces that the joints need at accelerations b.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from osimlite.multibody.functions import IDENTITY, Function, Univariate
from osimlite.multibody.joints import Mobilizer
from osimlite.multibody.mechanism import Mechanism
from osimlite.multibody.motions import AccelerationErrorAngle
from osimlite.multibody.spatial import Array
from osimlite.robot.lines import as_line
from osimlite.robot.robot import RobotJoint


class Reduced(NamedTuple):
    """The m joints at one state of n coordinates.

    Attributes:
        values: of the joints (m,).
        rates: of the joints (m,).
        jacobian: J (m, n), from the generalized speeds to these rates.
        bias: b (m,), what the rates change by while all udot are zero.
        coordinate_rates: of the coordinates (n,).
    """

    values: Array
    rates: Array
    jacobian: Array
    bias: Array
    coordinate_rates: Array


class Reduction:
    """How joints follow from coordinates.

    Args:
        mechanism: whose coordinates.
        joints: of its robot, in any order.
        order: place in the mechanism of each coordinate of the state; the others stay at their defaults.
    """

    def __init__(self, mechanism: Mechanism, joints: Sequence[RobotJoint], order: Sequence[int]) -> None:
        number = {place: column for column, place in enumerate(order)}
        self._still = np.array([info.default_value for info in mechanism.coordinates])
        self._order = list(order)
        # Where a joint is a multiple of a coordinate, its row never changes.
        self._lines = np.zeros((len(joints), len(order)))
        self._single: list[tuple[int, Univariate, int]] = []
        self._several: list[tuple[int, Function, list[int], list[int], list[int]]] = []
        # The three angles of one CustomJoint at once; the last list has their rows.
        self._drifts: dict[object, tuple[AccelerationErrorAngle, list[int], list[int], list[int], list[int]]] = {}
        for row, joint in enumerate(joints):
            places = list(joint.coordinates)
            moving = [k for k, place in enumerate(places) if place in number]
            columns = [number[places[k]] for k in moving]
            line = as_line(joint.function) if len(places) == 1 else None
            if isinstance(joint.function, AccelerationErrorAngle):
                key = (id(joint.function.drift), joint.coordinates)
                drift = self._drifts.setdefault(key, (joint.function, places, moving, columns, [0, 0, 0]))
                drift[-1][joint.function.component] = row
            elif joint.function == IDENTITY:
                self._lines[row, columns[0]] = 1.0
            elif line is not None and line.start == 0.0:
                self._lines[row, columns[0]] = line.slope
            elif isinstance(joint.function, Univariate):
                self._single.append((row, joint.function, columns[0]))
            else:
                self._several.append((row, joint.function, places, moving, columns))
        self._turning = [
            (body.mobilizer, *_moving(body.mobilizer, number))
            for body in mechanism.bodies
            if not body.mobilizer.speeds_are_rates and any(place in number for place in body.mobilizer.coordinates)
        ]

    def at(self, x: Array, u: Array) -> Reduced:
        """The joints at coordinates x (n,) and generalized speeds u (n,).

        Raises:
            SimulationError: speeds are not defined in the pose.
        """
        values, jacobian = self._lines @ x, self._lines
        xdot, rate_matrix, bias = u, None, None
        q = self._still
        if self._several or self._turning or self._drifts:
            q = q.copy()
            q[self._order] = x
        if self._turning:
            rate_matrix, rest = self._rate_matrix(q, u)
            xdot = rate_matrix @ u
            bias = self._lines @ rest
        if self._single or self._several or self._drifts:
            jacobian = jacobian.copy()
            bias = np.zeros(len(values)) if bias is None else bias
            for row, function, column in self._single:
                rate = xdot[column]
                values[row], slope, bend = function.derivatives(float(x[column]))
                jacobian[row, column] = slope
                bias[row] = bend * rate * rate
                if rate_matrix is not None:
                    bias[row] += slope * rest[column]
            for row, each, places, moving, columns in self._several:
                values[row], gradient, hessian = each.evaluate(q[places])
                rates = xdot[columns]
                jacobian[row, columns] = gradient[moving]
                bias[row] = rates @ hessian[np.ix_(moving, moving)] @ rates
                if rate_matrix is not None:
                    bias[row] += gradient[moving] @ rest[columns]
            for angle, places, moving, columns, several in self._drifts.values():
                rates = np.zeros(len(places))
                rates[moving] = xdot[columns]
                bias[several] = angle.all_components(q[places], rates)
        if rate_matrix is not None:
            jacobian = jacobian @ rate_matrix
        return Reduced(values, jacobian @ u, jacobian, np.zeros(len(values)) if bias is None else bias, xdot)

    def coordinate_rates(self, x: Array, u: Array) -> Array:
        """Rates of the coordinates (n,)."""
        if not self._turning:
            return u
        q = self._still.copy()
        q[self._order] = x
        rates: Array = self._rate_matrix(q, u)[0] @ u
        return rates

    def _rate_matrix(self, q: Array, u: Array) -> tuple[Array, Array]:
        """N (n, n) with xdot = N u, and Ndot u (n,)."""
        matrix, rest = np.eye(len(u)), np.zeros(len(u))
        for mobilizer, moving, columns in self._turning:
            own = list(mobilizer.coordinates)
            speeds = np.zeros(len(own))
            speeds[moving] = u[columns]
            matrix[np.ix_(columns, columns)] = mobilizer.rate_matrix(q[own])[np.ix_(moving, moving)]
            rest[columns] = mobilizer.rate_bias(q[own], speeds)[moving]
        return matrix, rest


def _moving(mobilizer: Mobilizer, number: dict[int, int]) -> tuple[list[int], list[int]]:
    """Which coordinates of a joint are in the state, and their numbers there."""
    moving = [k for k, place in enumerate(mobilizer.coordinates) if place in number]
    return moving, [number[mobilizer.coordinates[k]] for k in moving]
