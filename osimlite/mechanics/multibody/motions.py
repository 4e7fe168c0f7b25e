"""Elementary motions: the factors of the transform of a joint.

A motion moves its outgoing frame in its incoming frame by some generalized coordinates and speeds.
The numbers in `coordinates` are indices among the coordinates of the joint; `q` (k,) and `u` (k,)
are always all those of the joint.
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
    ConstantValue,
    FunctionDerivatives,
    SmoothFunction,
    make_zero_derivatives,
)
from osimlite.mechanics.multibody.spatial import (
    Array,
    make_transform,
    rotation_about,
)
from osimlite.mechanics.multibody.spatial import invert_transform as inverse_transform


class JointMotion(ABC):
    """Factor of the transform of a joint."""

    coordinates: tuple[int, ...]

    @abstractmethod
    def elementary(self) -> tuple[FixedTransform | AxisMotion, ...]:
        """Return the transform as a product of one-axis motions.

        Returns:
            Fixed transforms, and motions about or along one axis, in order.
        """

    def transform(self, q: Array) -> Array:
        """Return the outgoing frame in the incoming frame (4, 4)."""
        return reduce(np.matmul, (motion.transform(q) for motion in self.elementary()), np.eye(4))

    def rates(self, q: Array) -> Array | None:
        """Return N (k, k) with qdot = N u for these `coordinates`.

        None stands for the identity: the speeds are the rates.
        """
        return None

    def rate_bias(self, q: Array, u: Array) -> Array | None:
        """Return Ndot u (k,), so that qddot = N udot + Ndot u; None if it is zero.

        Args:
            q: coordinates of the joint (k,).
            u: speeds of the joint (k,).
        """
        return None


@dataclass(frozen=True, eq=False)
class FixedTransform(JointMotion):
    """Transform that never changes."""

    matrix: Array  # outgoing frame in the incoming frame (4, 4)
    coordinates: tuple[int, ...] = ()

    def transform(self, q: Array) -> Array:
        """Return the outgoing frame in the incoming frame (4, 4), whatever the coordinates."""
        return self.matrix

    def elementary(self) -> tuple[FixedTransform | AxisMotion, ...]:
        """Return the motion itself, which is elementary.

        Returns:
            Tuple with the motion as its only entry.
        """
        return (self,)

    def inverse(self) -> FixedTransform:
        """Return the transform of the incoming frame in the outgoing frame."""
        return FixedTransform(inverse_transform(self.matrix))


@dataclass(frozen=True, eq=False)
class AxisMotion(JointMotion):
    """Rotation about or translation along a fixed unit axis, by a function of coordinates."""

    kind: Literal["rotate", "translate"]
    axis: Array  # unit vector (3,) in the incoming frame
    coordinates: tuple[int, ...]  # arguments of the function
    function: SmoothFunction = IDENTITY  # amount, rad or m

    @property
    def coordinate(self) -> int | None:
        """Coordinate that equals the amount, or None if the amount is another function."""
        return self.coordinates[0] if self.function == IDENTITY else None

    def amount(self, q: Array) -> float:
        """Return the amount of the motion (rad or m)."""
        return self.function.evaluate(q[list(self.coordinates)])[0]

    def transform(self, q: Array) -> Array:
        """Return the outgoing frame, rotated about or moved along the axis (4, 4)."""
        amount = self.amount(q)
        if self.kind == "rotate":
            return make_transform(rotation_about(self.axis, amount))
        return make_transform(None, amount * self.axis)

    def elementary(self) -> tuple[FixedTransform | AxisMotion, ...]:
        """Return the motion itself, which is elementary.

        Returns:
            Tuple with the motion as its only entry.
        """
        return (self,)

    def inverse(self) -> AxisMotion:
        """Return the inverse motion, which is about the opposite axis."""
        return AxisMotion(self.kind, -self.axis, self.coordinates, self.function)


@dataclass(frozen=True, eq=False)
class SimbodyAccelerationError(JointMotion):
    """Error of Simbody's angular acceleration of a CustomJoint, without any motion.

    The angular velocity is W r with the rates r of the three angles and the axes W, each rotated by
    the angles before it. In the derivative of W, Simbody uses for the rate of the first angle the
    effect of the first coordinate on all three angles, and for the rates of the first two angles
    the effect of the first two coordinates. That is correct only if each coordinate drives the
    angle of the same number.

    Attributes:
        rotations: the three rotations of the joint, which follow this motion.
        coordinates: empty, because the motion depends on those of `rotations`.
    """

    rotations: tuple[AxisMotion, ...]
    coordinates: tuple[int, ...] = ()

    def elementary(self) -> tuple[FixedTransform | AxisMotion, ...]:
        """Return three rotations that stay at zero but have an acceleration.

        Returns:
            The rotations; none where Simbody makes no error.
        """
        # A constant drives nothing, whatever its arguments.
        drivers = [
            set() if isinstance(rotation.function, ConstantValue) else set(rotation.coordinates)
            for rotation in self.rotations
        ]
        # No error if the second rotation is constant, or only the first coordinate drives the first
        # rotation and none of the others; the same for the third rotation and the first two
        # coordinates.
        if (
            not drivers[1] or (drivers[0] <= {0} and not drivers[1] & {0} and not drivers[2] & {0})
        ) and (not drivers[2] or (drivers[0] | drivers[1] <= {0, 1} and not drivers[2] & {0, 1})):
            return ()
        coordinates = tuple(
            sorted(set().union(*(rotation.coordinates for rotation in self.rotations)))
        )
        return tuple(
            AxisMotion(
                "rotate",
                np.array(axis),
                coordinates,
                AccelerationErrorAngle(self, coordinates, row),
            )
            for row, axis in enumerate((X, Y, Z))
        )


@dataclass(frozen=True, eq=False)
class AccelerationErrorAngle(SmoothFunction):
    """Angle of zero with a rate of zero, whose acceleration is a component of Simbody's error."""

    drift: SimbodyAccelerationError
    argument_indices: tuple[int, ...]  # indices of its arguments among the coordinates of the joint
    component: int  # component of the error, 0, 1 or 2

    def evaluate(self, arguments: Arguments) -> FunctionDerivatives:
        """Return zero and zero derivatives; the acceleration does not follow from derivatives."""
        return make_zero_derivatives(len(arguments))


@dataclass(frozen=True, eq=False)
class SphericalMotion(JointMotion):
    """Rotation by three body-fixed X-Y-Z angles, whose generalized speeds are the angular velocity.

    The angular velocity is that of the outgoing frame in the incoming frame F, along the axes of F,
    so that the speeds are not the rates of the angles. With `radii` (m) the origin moves on an
    ellipsoid: it is at the elementwise product of the radii and the outgoing Z axis.
    """

    coordinates: tuple[int, ...]
    radii: Array = field(default_factory=lambda: np.zeros(3))

    def elementary(self) -> tuple[FixedTransform | AxisMotion, ...]:
        """Return the translations to the ellipsoid, if it has a size, and the three rotations.

        Returns:
            One-axis motions, in order.
        """
        rotations = tuple(
            AxisMotion("rotate", np.array(axis), (coordinate,))
            for axis, coordinate in zip((X, Y, Z), self.coordinates, strict=True)
        )
        translations = tuple(
            AxisMotion(
                "translate",
                np.array(axis),
                self.coordinates,
                EllipsoidPoint(component, float(radius)),
            )
            for component, (axis, radius) in enumerate(zip((X, Y, Z), self.radii, strict=True))
            if radius != 0.0
        )
        return translations + rotations

    def rates(self, q: Array) -> Array:
        """Return N (3, 3) with the rates of the angles N u.

        Raises:
            SimulationError: the second angle is a right angle, where N is singular.
        """
        angles: Any = self._angles(q)
        return np.array([angle_rate_row(angles, _FIRST, row) for row in range(3)])

    def rate_bias(self, q: Array, u: Array) -> Array:
        """Return Ndot u (3,).

        Args:
            q: coordinates of the joint.
            u: speeds of the joint.

        Raises:
            SimulationError: the second angle is a right angle, where N is singular.
        """
        angles, rows = self._angles(q), self.rates(q)
        rates: Any = (rows @ u[list(self.coordinates)]).tolist()
        return np.array(
            [angle_acceleration_bias(angles, rates, _FIRST, tuple(row)) for row in rows.tolist()]
        )

    def _angles(self, q: Array) -> Any:
        """Return the three angles (rad).

        Raises:
            SimulationError: the second angle is a right angle.
        """
        angles = q[list(self.coordinates)].tolist()
        # The rates of the angles contain 1 / cos b of the second angle b.
        if abs(math.cos(angles[1])) < 1e-12:
            raise SimulationError(
                "the second of three angles stands at ±90 degrees, where their rates are not defined; "
                "choose another pose, or turn the frames of the joint"
            )
        return angles


_FIRST: Any = (0, 1, 2)
"""Places of the three angles in the numbers that the kernels of ball joints take them from."""


@dataclass(frozen=True)
class EllipsoidPoint(SmoothFunction):
    """One component of the point on the ellipsoid of a `SphericalMotion`, by its three angles."""

    component: int  # 0, 1 or 2
    radius: float  # half axis along this component, m

    def evaluate(self, arguments: Arguments) -> FunctionDerivatives:
        """Return the value, the gradient (3,) and the Hessian (3, 3) at the three angles."""
        # The point is r times the outgoing Z axis, (sin b, -sin a cos b, cos a cos b).
        a = float(arguments[0])
        b = float(arguments[1])
        r = self.radius
        sa = math.sin(a)
        ca = math.cos(a)
        sb = r * math.sin(b)
        cb = r * math.cos(b)
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
    """Return a rotation about a unit axis by a coordinate.

    Args:
        axis: unit vector (3,).
        coordinate: index of the coordinate in the joint.
    """
    return AxisMotion("rotate", np.array(axis), (coordinate,))


def translate(axis: Sequence[float], coordinate: int) -> AxisMotion:
    """Return a translation along a unit axis by a coordinate.

    Args:
        axis: unit vector (3,).
        coordinate: index of the coordinate in the joint.
    """
    return AxisMotion("translate", np.array(axis), (coordinate,))


def make_fixed_transform(
    rotation: Array | None = None, translation: Sequence[float] | None = None
) -> FixedTransform:
    """Return a fixed transform.

    Args:
        rotation: rotation (3, 3); None for none.
        translation: translation (3,), m; None for none.
    """
    return FixedTransform(make_transform(rotation, translation))
