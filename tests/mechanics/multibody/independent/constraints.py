"""Constraint equations from vectors that move with bodies: between stations, or fixed along an axis."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from osimlite.mechanics.multibody import body_constraints as b
from osimlite.mechanics.multibody.body_constraints import find_carrier
from osimlite.mechanics.multibody.constraints import (
    ConstraintEquations,
    Coupler,
    Lock,
    PrescribedCoordinate,
)
from osimlite.mechanics.multibody.parts import StationPlacement
from osimlite.mechanics.multibody.spatial import Array, cross, skew_matrix
from tests.mechanics.multibody.independent.motion import Moved


class Bond(NamedTuple):
    """Equations of a constraint at one state: G u = b for speeds and G udot = d for accelerations, m rows each.

    Attributes:
        errors: position errors (p,).
        rows: constraint matrix G (m, n).
        rates: right-hand side b of the speeds (m,).
        drifts: right-hand side d of the accelerations (m,).
    """

    errors: Array
    rows: Array
    rates: Array
    drifts: Array


def bond(constraint: ConstraintEquations, state: Moved) -> Bond:
    """Return the equations of a constraint at a state."""
    mechanism, q, u = state.mechanism, state.q, state.u
    match constraint:
        case Lock(coordinate):
            rows, drift = (
                mechanism.rate_matrix(q)[[coordinate]],
                -mechanism.rate_bias(q, u)[[coordinate]],
            )
            return Bond(np.zeros(0), rows, np.zeros(1), drift)
        case PrescribedCoordinate(coordinate, function):
            value, first, second = function.evaluate(np.array((state.time,)))
            rows, bias = (
                mechanism.rate_matrix(q)[[coordinate]],
                mechanism.rate_bias(q, u)[[coordinate]],
            )
            return Bond(q[[coordinate]] - value, rows, np.array(first), second[0] - bias)
        case Coupler(dependent, independent, function):
            others, row = list(independent), np.zeros((1, len(q)))
            value, gradient, hessian = function.evaluate(q[others])
            rates = mechanism.coordinate_rates(q, u)[others]
            np.add.at(row[0], others, gradient)
            row[0, dependent] -= 1.0
            # The Hessian of a coupler without independent coordinates is an empty list.
            bends = np.reshape(hessian, (len(others), len(others)))
            drift = -(row @ mechanism.rate_bias(q, u)) - rates @ bends @ rates
            return Bond(
                np.array((value - q[dependent],)),
                row @ mechanism.rate_matrix(q),
                np.zeros(1),
                drift,
            )
        case b.PointEquations():
            return meeting(state, constraint.first, constraint.second).bond()
        case b.DistanceConstraint():
            arm = station(state, constraint.second).minus(station(state, constraint.first))
            length = float(np.linalg.norm(arm.value))
            along = arm.value / length
            stretch = float(arm.rate @ arm.rate - (along @ arm.rate) ** 2) / length
            errors, drift = (
                np.array((length - constraint.distance,)),
                -np.array((along @ arm.bias + stretch,)),
            )
            return Bond(errors, (along @ arm.jacobian)[None], np.zeros(1), drift)
        case b.PointOnLineEquations():
            arm = station(state, constraint.follower).minus(station(state, constraint.line))
            axes = (
                direction(state, constraint.line.body, axis)
                for axis in constraint.find_normal_directions()
            )
            return joined(*(product(axis, arm) for axis in axes))
        case b.WeldEquations():
            (one, inner), (two, outer) = constraint.first, constraint.second
            arm = meeting(
                state, StationPlacement(one, inner[:3, 3]), StationPlacement(two, outer[:3, 3])
            )
            turns = [
                product(
                    direction(state, two, outer[:3, axis]),
                    direction(state, one, inner[:3, (axis + 1) % 3]),
                )
                for axis in range(3)
            ]
            return joined(*turns, arm.bond())
        case b.RollingConstraint():
            contact = rolling(constraint, state)
            return joined(contact, *slips(constraint, state))._replace(errors=contact.errors)
    raise AssertionError(constraint)


def rolling(constraint: b.RollingConstraint, state: Moved) -> Bond:
    """Return the holonomic equations of rolling: height of the centre, and no turn about the normal."""
    surface, roller = constraint.surface, constraint.roller
    centre, foot = (
        station(state, StationPlacement(body, np.zeros(3))) for body in (roller, surface)
    )
    normal = direction(state, surface, constraint.normal / np.linalg.norm(constraint.normal))
    square = product(
        direction(state, surface, np.eye(3)[0]), direction(state, roller, np.eye(3)[2])
    )
    return joined(product(normal, centre.minus(foot), constraint.height), square)


def slips(constraint: b.RollingConstraint, state: Moved) -> list[Bond]:
    """Return the no-slip equations of rolling.

    The material point of the roller at the foot moves with the surface; its station in the roller
    changes.
    """
    surface, roller = constraint.surface, constraint.roller
    centre, foot = (
        station(state, StationPlacement(body, np.zeros(3))) for body in (roller, surface)
    )
    arm, w = foot.minus(centre), state.velocities[roller][:3]
    jacobian = (
        centre.jacobian - skew_matrix(arm.value) @ state.jacobians[roller][:3] - foot.jacobian
    )
    rate = centre.rate + cross(w, arm.value) - foot.rate
    bias = centre.bias + cross(state.biases[roller][:3], arm.value) + cross(w, arm.rate) - foot.bias
    bonds = []
    for axis in (np.eye(3)[0], np.eye(3)[2]):
        along = direction(state, surface, axis)
        drift = -np.array((along.value @ bias + along.rate @ rate,))
        bonds.append(Bond(np.zeros(1), (along.value @ jacobian)[None], np.zeros(1), drift))
    return bonds


class MovingVector(NamedTuple):
    """Vector (3,) in ground axes that moves with bodies.

    Attributes:
        value: the vector.
        jacobian: matrix (3, n) from the speeds to its rate.
        rate: first derivative.
        bias: second derivative while all udot are zero.
    """

    value: Array
    jacobian: Array
    rate: Array
    bias: Array

    def minus(self, other: MovingVector) -> MovingVector:
        """Return the difference of two vectors."""
        return MovingVector(*(mine - its for mine, its in zip(self, other, strict=True)))

    def bond(self) -> Bond:
        """Return the equations by which all three components vanish."""
        return Bond(self.value, self.jacobian, np.zeros(3), -self.bias)


def station(state: Moved, place: StationPlacement) -> MovingVector:
    """Return the vector from ground's origin to a station."""
    body, location = place
    return MovingVector(
        state.point(body, location),
        state.point_jacobian(body, location)[3:],
        state.point_velocity(body, location),
        state.point_bias(body, location),
    )


def meeting(state: Moved, first: StationPlacement, second: StationPlacement) -> MovingVector:
    """Return the vector from one station to another.

    Its rate is the velocity of the second station relative to the coincident point of the first
    body. Simbody keeps this velocity at zero: the rate of the vector as seen from the first body,
    and its change as seen from the body that carries both.
    """
    end = station(state, second)
    body = first.body
    start = station(
        state, StationPlacement(body, state.rotations[body].T @ (end.value - state.origins[body]))
    )
    apart = end.minus(start)
    turning = state.velocities[find_carrier(state.mechanism, (body, second.body))][:3]
    bias = apart.bias - 2.0 * cross(turning, apart.rate)
    return apart._replace(value=end.value - station(state, first).value, bias=bias)


def direction(state: Moved, body: int, axis: Array) -> MovingVector:
    """Return a vector that is fixed in a body.

    Args:
        state: kinematics of the mechanism.
        body: index of the body.
        axis: the vector in the frame of the body.
    """
    value = state.rotations[body] @ axis
    w = state.velocities[body][:3]
    rate = cross(w, value)
    bias = cross(state.biases[body][:3], value) + cross(w, rate)
    return MovingVector(value, -skew_matrix(value) @ state.jacobians[body][:3], rate, bias)


def product(a: MovingVector, b: MovingVector, wanted: float = 0.0) -> Bond:
    """Return the equation by which the scalar product of two vectors has the value `wanted`."""
    return Bond(
        np.array((a.value @ b.value - wanted,)),
        (a.value @ b.jacobian + b.value @ a.jacobian)[None],
        np.zeros(1),
        -np.array((a.value @ b.bias + 2.0 * a.rate @ b.rate + b.value @ a.bias,)),
    )


def joined(*bonds: Bond) -> Bond:
    """Concatenate the equations of several constraints."""
    return Bond(*(np.concatenate(parts) for parts in zip(*bonds, strict=True)))
