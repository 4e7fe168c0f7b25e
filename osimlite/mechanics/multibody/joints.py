"""Mobilizers: the joints of a model as products of elementary motions.

The motions of a joint type are an attribute of its class in the schema, or a short function here;
nothing else in the package depends on joint types. The conventions (order of coordinates, meaning
of speeds) are OpenSim's.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache, cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, field
from osimlite.errors import ModelError, SimulationError
from osimlite.mechanics.laws.rotations import X, Y, Z
from osimlite.mechanics.multibody.arc import ArcPoint
from osimlite.mechanics.multibody.functions import Linear, SmoothFunction
from osimlite.mechanics.multibody.motions import (
    AxisMotion,
    FixedTransform,
    JointMotion,
    SimbodyAccelerationError,
    SphericalMotion,
    make_fixed_transform,
    rotate_about,
    translate,
)
from osimlite.mechanics.multibody.spatial import (
    Array,
    invert_transform,
    make_transform,
    rotation_about,
)
from osimlite.schema.joints import Joint, MotionType


@cache
def make_plain_motions(joint_class: type[Joint]) -> tuple[JointMotion, ...]:
    """Return the motions of a joint type without properties, as its schema declares them.

    Args:
        joint_class: class of the joint, whose motions are about and along the axes of its frames.

    Returns:
        Translations first, then rotations; those of a ball joint are one motion.
    """
    axes = {"x": X, "y": Y, "z": Z}
    words = [*enumerate((joint_class.coordinate_motions or "").split())]
    translations = [translate(axes[word[1]], index) for index, word in words if word[0] == "t"]
    rotations = [rotate_about(axes[word[1]], index) for index, word in words if word[0] == "r"]
    if joint_class.speeds_are_rates:
        return (*translations, *rotations)
    return (
        *translations,
        SphericalMotion(tuple(index for turn in rotations for index in turn.coordinates)),
    )


PLAIN_JOINTS = (
    "WeldJoint",
    "PinJoint",
    "SliderJoint",
    "PlanarJoint",
    "UniversalJoint",
    "GimbalJoint",
    "BallJoint",
    "FreeJoint",
)
"""Joint classes without properties of their own; as names, so that only those of a model are imported."""


def make_ellipsoid_motions(radii: ArrayLike) -> tuple[JointMotion, ...]:
    """Return the motions of an EllipsoidJoint: rx, ry, rz on an ellipsoid.

    Args:
        radii: half axes of the ellipsoid along the axes of F (3,), m.

    Returns:
        Factors of X_FM.
    """
    return (SphericalMotion((0, 1, 2), np.array(radii, dtype=float)),)


def make_scapulothoracic_motions(
    radii: ArrayLike, winging_origin: ArrayLike, winging_direction: float
) -> tuple[JointMotion, ...]:
    """Return the motions of a ScapulothoracicJoint.

    The scapula moves on an ellipsoid of the thorax by three rotations, and then wings about an
    axis in the XY plane of its frame.

    Args:
        radii: half axes of the thoracic ellipsoid along F (3,), m.
        winging_origin: x and y of a point of the winging axis, m.
        winging_direction: angle of the winging axis (rad).

    Returns:
        Factors of X_FM.
    """
    # The angles refer to a frame that is rotated by a quarter turn about Z, and rotated back behind
    # them; the half axes change places with it.
    quarter = rotation_about(np.array(Z), math.pi / 2)
    x, y = np.asarray(winging_origin, dtype=float).tolist()
    axis = (-math.sin(winging_direction), math.cos(winging_direction), 0.0)
    return (
        make_fixed_transform(quarter),
        SphericalMotion((0, 1, 2), np.asarray(radii, dtype=float)[[1, 0, 2]]),
        make_fixed_transform(quarter.T),
        make_fixed_transform(None, (x, y, 0.0)),
        rotate_about(axis, 3),
        make_fixed_transform(None, (-x, -y, 0.0)),
    )


def constant_curvature(length: float, neutral: Sequence[float]) -> tuple[JointMotion, ...]:
    """Return the motions of a ConstantCurvatureJoint.

    The end of a rod bends about X, then about Z, and twists about Y.

    Args:
        length: length of the rod (m).
        neutral: the three angles where the coordinates are zero (rad).

    Returns:
        Factors of X_FM.
    """
    bend, swing, twist = (float(angle) for angle in neutral)
    # The point is on the arc of the first two angles; the twist about Y turns the end only.
    translations = (
        AxisMotion("translate", np.array(axis), (0, 1), ArcPoint(component, length, (bend, swing)))
        for component, axis in enumerate((X, Y, Z))
    )
    rotations = (
        AxisMotion("rotate", np.array(axis), (index,), Linear(1.0, start))
        for index, (axis, start) in enumerate(((X, bend), (Z, swing), (Y, twist)))
    )
    return (*translations, *rotations)


class JointAxis(NamedTuple):
    """One axis of a CustomJoint: a function of coordinates along or about an axis."""

    coordinates: tuple[int, ...]  # indices among the coordinates of the joint
    axis: ArrayLike  # direction (3,) in F
    function: SmoothFunction  # amount, rad or m


def make_custom_motions(
    rotations: Sequence[JointAxis],
    translations: Sequence[JointAxis],
    *,
    opensim_derivatives: bool = False,
) -> tuple[JointMotion, ...]:
    """Return the motions of a CustomJoint.

    They are three translations along axes of F, then three body-fixed rotations.

    Args:
        rotations: the three rotation axes.
        translations: the three translation axes.
        opensim_derivatives: whether velocity-dependent accelerations are Simbody's, see
            :class:`osimlite.mechanics.multibody.motions.SimbodyAccelerationError`.

    Returns:
        Factors of X_FM.

    Raises:
        ModelError: an axis has no direction.
    """
    translation_motions = tuple(_make_axis_motion("translate", axis) for axis in translations)
    rotation_motions = tuple(_make_axis_motion("rotate", axis) for axis in rotations)
    return (
        (*translation_motions, SimbodyAccelerationError(rotation_motions), *rotation_motions)
        if opensim_derivatives
        else (*translation_motions, *rotation_motions)
    )


def _make_axis_motion(motion_kind: Literal["rotate", "translate"], axis: JointAxis) -> AxisMotion:
    """Return the motion along or about an axis of a CustomJoint, with a unit vector.

    Raises:
        ModelError: the length of the axis is zero, infinite or NaN.
    """
    direction = np.array(axis.axis, dtype=float)
    length = float(np.linalg.norm(direction))
    if not 0.0 < length < np.inf:
        raise ModelError(
            f"the axis {direction.tolist()} of a transform has no direction; give one that is not zero"
        )
    return AxisMotion(motion_kind, direction / length, axis.coordinates, axis.function)


def motion_types(motions: Sequence[JointMotion], count: int) -> tuple[MotionType, ...]:
    """Return the motion type of each coordinate of a joint.

    A coordinate that drives an axis with slope exactly 1 or -1 has the motion type of that axis (of
    the last such axis, where translations come after rotations); any other coordinate is coupled.
    These are OpenSim's rules.

    Args:
        motions: motions of the joint.
        count: number of its coordinates.

    Returns:
        Motion type of each coordinate.
    """
    types: list[MotionType] = ["coupled"] * count
    axes = [
        axis for motion in motions for axis in motion.elementary() if isinstance(axis, AxisMotion)
    ]
    # "rotate" sorts before "translate"; the sort keeps the order of axes of one kind.
    for axis in sorted(axes, key=lambda axis: axis.kind):
        if axis.function.slope in (1.0, -1.0):
            types[axis.coordinates[0]] = "rotational" if axis.kind == "rotate" else "translational"
    return tuple(types)


@dataclass(frozen=True, eq=False)
class Mobilizer:
    """Connection of a body to the body (or ground) that carries it.

    The transform of the joint is T_PC = X_PF X_FM(q) X_CM⁻¹ for its parent P and child C; `motions`
    are the factors of X_FM. With `reversed` the joint's child carries its parent in the tree; the
    speeds are those of M in F all the same.
    """

    joint: str  # absolute path of the joint
    joint_type: str  # OpenSim's class name of the joint, for messages
    motions: tuple[JointMotion, ...]  # factors of X_FM
    coordinates: tuple[int, ...] = ()  # index in the mechanism of each of the joint's coordinates
    parent_frame: Array = field(default_factory=make_transform)  # X_PF (4, 4), in the parent body
    child_frame: Array = field(default_factory=make_transform)  # X_CM (4, 4), in the child body
    reversed: bool = False  # whether the child carries the parent

    def elementary(self) -> tuple[FixedTransform | AxisMotion, ...]:
        """Return the transform from the carrying to the carried body as one-axis motions.

        ``coordinates`` of each motion are indices among the `coordinates` of this mobilizer.
        Programs with one-axis joints need nothing else.

        Returns:
            Fixed transforms and one-axis motions, in order.
        """
        motions = (
            FixedTransform(self.parent_frame),
            *self.motions,
            FixedTransform(invert_transform(self.child_frame)),
        )
        chain = [step for motion in motions for step in motion.elementary()]
        # The inverse of a product is the product of the inverses in the opposite order.
        return tuple(step.inverse() for step in reversed(chain)) if self.reversed else tuple(chain)

    def rate_matrix(self, q: Array) -> Array:
        """Return N (k, k) with qdot = N u.

        Args:
            q: coordinates of the joint (k,).

        Raises:
            SimulationError: N is singular at this pose; the message names the joint.
        """
        matrix = np.eye(len(q))
        with _name_joint_in_errors(self.joint):
            for motion in self.motions:
                block = motion.rates(q)
                if block is not None:
                    matrix[np.ix_(motion.coordinates, motion.coordinates)] = block
        return matrix

    def rate_bias(self, q: Array, u: Array) -> Array:
        """Return Ndot u (k,), so that qddot = N udot + Ndot u.

        Args:
            q: coordinates of the joint (k,).
            u: speeds of the joint (k,).

        Raises:
            SimulationError: N is singular at this pose; the message names the joint.
        """
        bias = np.zeros(len(q))
        with _name_joint_in_errors(self.joint):
            for motion in self.motions:
                motion_bias = motion.rate_bias(q, u)
                if motion_bias is not None:
                    bias[list(motion.coordinates)] = motion_bias
        return bias

    @cached_property
    def speeds_are_rates(self) -> bool:
        """Tell whether qdot = u for every coordinate of the joint."""
        return all(type(motion).rates is JointMotion.rates for motion in self.motions)

    @cached_property
    def turning(self) -> tuple[tuple[int, ...], ...]:
        """Groups of coordinates whose rates follow together from as many speeds.

        Each group has indices in the mechanism; a ball joint has one group of three.

        Returns:
            Indices in the mechanism, group by group.
        """
        return tuple(
            tuple(self.coordinates[index] for index in motion.coordinates)
            for motion in self.motions
            if type(motion).rates is not JointMotion.rates
        )


@contextmanager
def _name_joint_in_errors(joint: str) -> Iterator[None]:
    """Prepend the path of a joint to the messages of errors of its motions.

    Raises:
        SimulationError: the code in the context raises a SimulationError.
    """
    try:
        yield
    except SimulationError as error:
        raise SimulationError(f"{joint}: {error.message}") from None
