"""Constraints between points and directions of two bodies.

All are made of vectors that move with bodies: from one station to another, or fixed along an axis. Stations and axes
are given in the frames of the bodies; -1 stands for ground.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Generic, NamedTuple, TypeVar

import numpy as np

from osimlite.multibody.constraints import Bond, Bonded
from osimlite.multibody.parts import FramePlacement, StationPlacement
from osimlite.multibody.spatial import Array, cross, skew
from osimlite.records import dataclass

if TYPE_CHECKING:
    from osimlite.multibody.kinematics import Kinematics
    from osimlite.multibody.mechanism import Mechanism


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


def station(state: Kinematics, place: StationPlacement) -> MovingVector:
    """From ground's origin to a station."""
    body, location = place
    return MovingVector(
        state.point(body, location),
        state.point_jacobian(body, location)[3:],
        state.point_velocity(body, location),
        state.point_bias(body, location),
    )


def meeting(state: Kinematics, first: StationPlacement, second: StationPlacement) -> MovingVector:
    """From one station to another, and how fast the second leaves the point of the first body that is there.

    This is what Simbody holds still: as the first body sees it, the rate of the vector, and as the body sees it that
    carries both, how that changes.
    """
    end = station(state, second)
    body = first.body
    start = station(state, StationPlacement(body, state.rotations[body].T @ (end.value - state.origins[body])))
    apart = end.minus(start)
    turning = state.velocities[carrier(state.mechanism, (body, second.body))][:3]
    bias = apart.bias - 2.0 * cross(turning, apart.rate)
    return apart._replace(value=end.value - station(state, first).value, bias=bias)


def carrier(mechanism: Mechanism, bodies: Iterable[int]) -> int:
    """The outermost body that carries bodies, or is one of them; -1 for ground."""
    result = set(bodies)
    while len(result) > 1:
        # Bodies follow what carries them.
        outer = max(result)
        result = result - {outer} | {mechanism.bodies[outer].parent}
    return result.pop()


def direction(state: Kinematics, body: int, axis: Array) -> MovingVector:
    """A vector fixed in a body."""
    value = state.rotations[body] @ axis
    w = state.velocities[body][:3]
    rate = cross(w, value)
    bias = cross(state.biases[body][:3], value) + cross(w, rate)
    return MovingVector(value, -skew(value) @ state.jacobians[body][:3], rate, bias)


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


P = TypeVar("P", StationPlacement, FramePlacement)


@dataclass(frozen=True, eq=False)
class _Between(Bonded, Generic[P]):
    first: P
    second: P

    @property
    def bodies(self) -> tuple[int, ...]:
        """The two bodies."""
        return self.first.body, self.second.body


@dataclass(frozen=True, eq=False)
class PointConstraint(_Between[StationPlacement]):
    """Keeps two stations on each other, as a ball joint would."""

    name: str = "point constraint"

    def bond(self, state: Kinematics) -> Bond:
        """The vector between the stations vanishes."""
        return meeting(state, self.first, self.second).bond()


@dataclass(frozen=True, eq=False)
class DistanceConstraint(_Between[StationPlacement]):
    """Keeps two stations at a distance (m), as a rod between ball joints would."""

    distance: float
    name: str = "distance constraint"

    def bond(self, state: Kinematics) -> Bond:
        """The length of the vector between the stations is the distance."""
        arm = station(state, self.second).minus(station(state, self.first))
        length = float(np.linalg.norm(arm.value))
        if length == 0.0:
            # No direction is better than another to leave such a point in.
            along, stretch = np.array((1.0, 0.0, 0.0)), 0.0
        else:
            along = arm.value / length
            stretch = float(arm.rate @ arm.rate - (along @ arm.rate) ** 2) / length
        return Bond(
            np.array((length - self.distance,)),
            (along @ arm.jacobian)[None],
            np.zeros(1),
            -np.array((along @ arm.bias + stretch,)),
        )


@dataclass(frozen=True, eq=False)
class PointOnLineConstraint(Bonded):
    """Keeps a station of the follower on a line fixed in a body."""

    line: StationPlacement  # a point of the line
    along: Array  # direction (3,) of the line in the frame of its body
    follower: StationPlacement  # the station on the line
    name: str = "point on line constraint"

    @property
    def bodies(self) -> tuple[int, ...]:
        """The two bodies."""
        return self.line.body, self.follower.body

    def bond(self, state: Kinematics) -> Bond:
        """Two directions across the line see no distance of the station from it."""
        arm = station(state, self.follower).minus(station(state, self.line))
        return joined(*(product(direction(state, self.line.body, axis), arm) for axis in self.across()))

    def across(self) -> list[Array]:
        """Two unit directions (3,) across the line, in the frame of its body."""
        start = np.eye(3)[int(np.argmin(np.abs(self.along)))]
        across = cross(self.along, start)
        return _units(across, cross(self.along, across))


@dataclass(frozen=True, eq=False)
class WeldConstraint(_Between[FramePlacement]):
    """Keeps two frames on each other."""

    name: str = "weld constraint"

    def bond(self, state: Kinematics) -> Bond:
        """The origins coincide, and each axis of one frame is square to the next axis of the other."""
        (one, inner), (two, outer) = self.first, self.second
        arm = meeting(state, StationPlacement(one, inner[:3, 3]), StationPlacement(two, outer[:3, 3]))
        turns = [
            product(direction(state, two, outer[:3, axis]), direction(state, one, inner[:3, (axis + 1) % 3]))
            for axis in range(3)
        ]
        return joined(*turns, arm.bond())


@dataclass(frozen=True, eq=False)
class RollingConstraint(Bonded):
    """OpenSim's RollingOnSurfaceConstraint: a roller on a plane that neither slips nor turns about the normal.

    The roller's origin stays at `height` along `normal` (3,) of the surface's frame, its Z axis square to the
    surface's X axis; and along the surface's X and Z axes the two bodies have the same velocity at the origin of the
    surface (which is where OpenSim puts the point of contact, wherever the roller is). The accelerations are those
    that keep all this up; Simbody's do not, because it compares material points and leaves out that the roller has
    another one at the contact every moment.
    """

    surface: int
    roller: int
    normal: Array
    height: float
    name: str = "rolling constraint"

    @property
    def bodies(self) -> tuple[int, ...]:
        """Surface and roller."""
        return self.surface, self.roller

    def position_errors(self, state: Kinematics) -> Array:
        """The height and the turn about the normal."""
        return self._contact(state).errors

    def bond(self, state: Kinematics) -> Bond:
        """The contact persists and does not slip, which binds only the speeds."""
        return joined(self._contact(state), *self._slips(state))

    def _contact(self, state: Kinematics) -> Bond:
        centre, foot = (station(state, StationPlacement(body, np.zeros(3))) for body in (self.roller, self.surface))
        normal = direction(state, self.surface, _units(self.normal)[0])
        square = product(direction(state, self.surface, np.eye(3)[0]), direction(state, self.roller, np.eye(3)[2]))
        return joined(product(normal, centre.minus(foot), self.height), square)

    def _slips(self, state: Kinematics) -> list[Bond]:
        foot = station(state, StationPlacement(self.surface, np.zeros(3)))
        centre = station(state, StationPlacement(self.roller, np.zeros(3)))
        arm, w = foot.minus(centre), state.velocities[self.roller][:3]
        # The roller's material point at the foot; its place in the roller changes.
        jacobian = centre.jacobian - skew(arm.value) @ state.jacobians[self.roller][:3] - foot.jacobian
        rate = centre.rate + cross(w, arm.value) - foot.rate
        bias = centre.bias + cross(state.biases[self.roller][:3], arm.value) + cross(w, arm.rate) - foot.bias
        bonds = []
        for axis in (np.eye(3)[0], np.eye(3)[2]):
            along = direction(state, self.surface, axis)
            drift = -np.array((along.value @ bias + along.rate @ rate,))
            bonds.append(Bond(np.zeros(1), (along.value @ jacobian)[None], np.zeros(1), drift))
        return bonds


def _units(*vectors: Array) -> list[Array]:
    return [vector / np.linalg.norm(vector) for vector in vectors]
