"""Elementary motions: what the transform of every joint is a product of.

A motion moves its outgoing frame in its incoming frame as a few generalized coordinates and speeds
say. The numbers in `coordinates` are places among the coordinates of the joint; `q` (k,) and `u`
(k,) always are all those of the joint.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import reduce
from typing import Any, Literal

import numpy as np

from osimlite.base.records import dataclass, field
from osimlite.errors import SimulationError
from osimlite.mechanics.kernels.ball_joint import angle_acceleration_bias, angle_rate_row
from osimlite.mechanics.laws.rotations import X, Y, Z
from osimlite.mechanics.multibody.functions import (
    IDENTITY,
    Arguments,
    Constant,
    Evaluated,
    Function,
    make_zero_derivatives,
)
from osimlite.mechanics.multibody.spatial import (
    Array,
    make_transform,
    rotation_about,
)
from osimlite.mechanics.multibody.spatial import invert_transform as inverse_transform


class Motion(ABC):
    """One factor of a joint's transform."""

    coordinates: tuple[int, ...]

    @abstractmethod
    def elementary(self) -> tuple[Fixed | AxisMotion, ...]:
        """The same transform as a product of fixed transforms and motions about or along one axis."""

    def placed(self, q: Array) -> Array:
        """The outgoing frame in the incoming frame (4, 4)."""
        return reduce(np.matmul, (part.placed(q) for part in self.elementary()), np.eye(4))

    def rates(self, q: Array) -> Array | None:
        """N (k, k) with qdot = N u for these `coordinates`; None if the speeds are the rates."""
        return None

    def rate_bias(self, q: Array, u: Array) -> Array | None:
        """Ndot u (k,), so that qddot = N udot + Ndot u; None if it is zero."""
        return None


@dataclass(frozen=True, eq=False)
class Fixed(Motion):
    """A transform that never changes; `matrix` (4, 4) is the outgoing frame in the incoming frame."""

    matrix: Array
    coordinates: tuple[int, ...] = ()

    def placed(self, q: Array) -> Array:
        """The frame as it is."""
        return self.matrix

    def elementary(self) -> tuple[Fixed | AxisMotion, ...]:
        """Itself."""
        return (self,)

    def inverse(self) -> Fixed:
        """The motion of the incoming frame in the outgoing frame."""
        return Fixed(inverse_transform(self.matrix))


@dataclass(frozen=True, eq=False)
class AxisMotion(Motion):
    """Rotation about (rad) or translation along (m) a fixed unit axis, by a function of coordinates."""

    kind: Literal["rotate", "translate"]
    axis: Array
    coordinates: tuple[int, ...]
    function: Function = IDENTITY

    @property
    def coordinate(self) -> int | None:
        """The coordinate that *is* the amount, or None if the amount is any other function."""
        return self.coordinates[0] if self.function == IDENTITY else None

    def amount(self, q: Array) -> float:
        """How far the motion goes (rad or m)."""
        return self.function.evaluate(q[list(self.coordinates)])[0]

    def placed(self, q: Array) -> Array:
        """The outgoing frame turned about or moved along the axis."""
        amount = self.amount(q)
        if self.kind == "rotate":
            return make_transform(rotation_about(self.axis, amount))
        return make_transform(None, amount * self.axis)

    def elementary(self) -> tuple[Fixed | AxisMotion, ...]:
        """Itself."""
        return (self,)

    def inverse(self) -> AxisMotion:
        """The motion of the incoming frame in the outgoing frame: the same about the opposite axis."""
        return AxisMotion(self.kind, -self.axis, self.coordinates, self.function)


@dataclass(frozen=True, eq=False)
class SimbodyAccelerationError(Motion):
    """No motion, but the error of Simbody's angular acceleration of a CustomJoint with these three `turns` after it.

    The angular velocity is W r with the rates r of the three angles and the axes W, each turned by
    the angles before it. In the rate of W Simbody takes for the rate of the first angle what the
    first coordinate does to all three angles, and for that of the first two what the first two
    coordinates do. That is right only if each coordinate drives the angle of the same number.
    """

    turns: tuple[AxisMotion, ...]
    coordinates: tuple[int, ...] = ()

    def elementary(self) -> tuple[Fixed | AxisMotion, ...]:
        """Three turns that stay at zero and accelerate all the same; nothing where there is no error."""
        turned = [
            set() if isinstance(turn.function, Constant) else set(turn.coordinates)
            for turn in self.turns
        ]
        if (
            not turned[1] or (turned[0] <= {0} and not turned[1] & {0} and not turned[2] & {0})
        ) and (not turned[2] or (turned[0] | turned[1] <= {0, 1} and not turned[2] & {0, 1})):
            return ()
        places = tuple(sorted(set().union(*(turn.coordinates for turn in self.turns))))
        return tuple(
            AxisMotion("rotate", np.array(axis), places, AccelerationErrorAngle(self, places, row))
            for row, axis in enumerate((X, Y, Z))
        )


@dataclass(frozen=True, eq=False)
class AccelerationErrorAngle(Function):
    """An angle of zero with a rate of zero; its acceleration is a component of a `SimbodyAccelerationError`."""

    drift: SimbodyAccelerationError
    places: tuple[int, ...]  # of its arguments among the coordinates of the joint
    component: int

    def evaluate(self, arguments: Arguments) -> Evaluated:
        """Zero and zeros: what it accelerates by is no derivative of these."""
        return make_zero_derivatives(len(arguments))


@dataclass(frozen=True, eq=False)
class SphericalMotion(Motion):
    """Rotation by three body-fixed X-Y-Z angles, whose generalized speeds are the angular velocity.

    The angular velocity is that of the outgoing frame in the incoming frame F, expressed in F, so
    the speeds are not the rates of the angles. With `radii` (m) the origin moves on an ellipsoid:
    it lies where the outgoing Z axis, stretched by the radii along F, ends.
    """

    coordinates: tuple[int, ...]
    radii: Array = field(default_factory=lambda: np.zeros(3))

    def elementary(self) -> tuple[Fixed | AxisMotion, ...]:
        """The three translations to the ellipsoid, if it has a size, and the three rotations."""
        turns = tuple(
            AxisMotion("rotate", np.array(axis), (place,))
            for axis, place in zip((X, Y, Z), self.coordinates, strict=True)
        )
        slides = tuple(
            AxisMotion(
                "translate",
                np.array(axis),
                self.coordinates,
                EllipsoidPoint(component, float(radius)),
            )
            for component, (axis, radius) in enumerate(zip((X, Y, Z), self.radii, strict=True))
            if radius != 0.0
        )
        return slides + turns

    def rates(self, q: Array) -> Array:
        """N (3, 3); SimulationError where the second angle makes it singular."""
        own: Any = self._angles(q)
        return np.array([angle_rate_row(own, _FIRST, part) for part in range(3)])

    def rate_bias(self, q: Array, u: Array) -> Array:
        """Ndot u (3,); SimulationError where the second angle makes N singular."""
        own, rows = self._angles(q), self.rates(q)
        rates: Any = (rows @ u[list(self.coordinates)]).tolist()
        return np.array(
            [angle_acceleration_bias(own, rates, _FIRST, tuple(row)) for row in rows.tolist()]
        )

    def _angles(self, q: Array) -> Any:
        angles = q[list(self.coordinates)].tolist()
        if abs(math.cos(angles[1])) < 1e-12:
            raise SimulationError(
                "the second of three angles stands at ±90 degrees, where their rates are not defined; "
                "choose another pose, or turn the frames of the joint"
            )
        return angles


_FIRST: Any = (0, 1, 2)


@dataclass(frozen=True)
class EllipsoidPoint(Function):
    """One component of the point that `SphericalMotion` reaches, as a function of its three angles."""

    component: int
    radius: float

    def evaluate(self, arguments: Arguments) -> Evaluated:
        """Value, gradient (3,) and Hessian (3, 3) at the three angles."""
        a, b, r = float(arguments[0]), float(arguments[1]), self.radius
        sa, ca, sb, cb = math.sin(a), math.cos(a), r * math.sin(b), r * math.cos(b)
        if self.component == 0:
            return sb, [0.0, cb, 0.0], [[0.0] * 3, [0.0, -sb, 0.0], [0.0] * 3]
        # g(a) cos b with g = -sin a for y and cos a for z, so that g'' = -g.
        g, slope = (-sa, -ca) if self.component == 1 else (ca, -sa)
        across = -slope * sb
        return (
            g * cb,
            [slope * cb, -g * sb, 0.0],
            [[-g * cb, across, 0.0], [across, -g * cb, 0.0], [0.0] * 3],
        )


def rotate_about(axis: Sequence[float], coordinate: int) -> AxisMotion:
    """Rotation about a unit `axis` by a coordinate."""
    return AxisMotion("rotate", np.array(axis), (coordinate,))


def translate(axis: Sequence[float], coordinate: int) -> AxisMotion:
    """Translation along a unit `axis` by a coordinate."""
    return AxisMotion("translate", np.array(axis), (coordinate,))


def place(rotation: Array | None = None, translation: Sequence[float] | None = None) -> Fixed:
    """A fixed rotation and translation."""
    return Fixed(make_transform(rotation, translation))
