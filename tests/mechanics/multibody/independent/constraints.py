"""The equations of constraints: vectors that move with bodies, from one station to another or fixed along an axis."""

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
    """m equations at one state: `errors` e (p,) of positions, `rows` u = `rates`, and `rows` udot = `drifts`."""

    errors: Array
    rows: Array
    rates: Array
    drifts: Array


def bond(constraint: ConstraintEquations, state: Moved) -> Bond:
    """The equations of a constraint."""
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
            # Of a coupler without independent coordinates the Hessian is an empty list.
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
    """The height, and the turn about the normal."""
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
    """The roller's material point at the foot, whose place in the roller changes, moves along with the surface."""
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
    """A vector (3,) along ground's axes, the matrix (3, n) from the speeds to its rate, the rate, and the rest.

    `bias` is its second derivative while all udot are zero.
    """

    value: Array
    jacobian: Array
    rate: Array
    bias: Array

    def minus(self, other: MovingVector) -> MovingVector:
        """The difference of two vectors."""
        return MovingVector(*(mine - its for mine, its in zip(self, other, strict=True)))

    def bond(self) -> Bond:
        """All three components vanish."""
        return Bond(self.value, self.jacobian, np.zeros(3), -self.bias)


def station(state: Moved, place: StationPlacement) -> MovingVector:
    """From ground's origin to a station."""
    body, location = place
    return MovingVector(
        state.point(body, location),
        state.point_jacobian(body, location)[3:],
        state.point_velocity(body, location),
        state.point_bias(body, location),
    )


def meeting(state: Moved, first: StationPlacement, second: StationPlacement) -> MovingVector:
    """From one station to another, and how fast the second leaves the point of the first body that is there.

    This is what Simbody holds still: as the first body sees it, the rate of the vector, and as the
    body sees it that carries both, how that changes.
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
    """A vector fixed in a body."""
    value = state.rotations[body] @ axis
    w = state.velocities[body][:3]
    rate = cross(w, value)
    bias = cross(state.biases[body][:3], value) + cross(w, rate)
    return MovingVector(value, -skew_matrix(value) @ state.jacobians[body][:3], rate, bias)


def product(a: MovingVector, b: MovingVector, wanted: float = 0.0) -> Bond:
    """The scalar product of two vectors has a certain value."""
    return Bond(
        np.array((a.value @ b.value - wanted,)),
        (a.value @ b.jacobian + b.value @ a.jacobian)[None],
        np.zeros(1),
        -np.array((a.value @ b.bias + 2.0 * a.rate @ b.rate + b.value @ a.bias,)),
    )


def joined(*bonds: Bond) -> Bond:
    """All the equations of several bonds."""
    return Bond(*(np.concatenate(parts) for parts in zip(*bonds, strict=True)))
