"""Models that were made for nimblephysics, rewritten so that their bodies move in OpenSim as in Nimble.

AddBiomechanics, SKEL and BioAMASS use Nimble, which reads some joints otherwise than OpenSim: an
EllipsoidJoint has another order of rotations, and a CustomJoint is replaced by a simpler joint where
its functions allow it. The rules are those of nimblephysics 0.10.52, and were compared with it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from osimlite.base.records import dataclass
from osimlite.base.text import add_article, join_words
from osimlite.errors import UnsupportedError
from osimlite.io.nimble import (
    JOINT_CLASSES,
    OMITTED_JOINTS,
    ROTATED_FRAME_SUFFIX,
    NimbleJoint,
    classify_custom_joint,
    has_rotated_frames,
    list_coordinates,
    unwrap_function,
)
from osimlite.mechanics.multibody import functions as curves
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.base import Object
from osimlite.schema.constraint_types import CoordinateCouplerConstraint
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.custom_joint import CustomJoint, TransformAxis
from osimlite.schema.frames import PhysicalOffsetFrame
from osimlite.schema.functions import Constant, Function, LinearFunction, MultiplierFunction
from osimlite.schema.joint_types import ConstantCurvatureJoint, EllipsoidJoint
from osimlite.schema.joints import Joint
from osimlite.schema.model import Model
from osimlite.schema.sets import Constraint
from osimlite.schema.splines import SimmSpline
from osimlite.schema.tree import Tree

UNIT_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
"""The axes X, Y and Z."""

AXIS_ORDERS = ((0, 1, 2), (2, 1, 0), (2, 0, 1), (0, 2, 1))
"""Orders of rotations about unit axes that Nimble knows."""

MAX_SKEW = 1e-4
"""Largest product of two axes that Nimble takes for orthogonal."""

ORTHOGONALIZATIONS = 10
"""Number of passes in which Nimble makes three axes orthogonal."""

EXTRA_POINTS = 3
"""Number of points by which a spline is extended: with three, its end condition holds as before."""

EXTRA_FRACTION = 0.1
"""Fraction of the range of a coordinate by which a spline is extended beyond the range."""

MAX_BEND_RAD = math.pi / 2 - 0.01
"""Angle of a ConstantCurvatureJoint at which OpenSim stops, and Nimble does not."""


@dataclass(frozen=True)
class NimbleChange:
    """Difference between Nimble's and OpenSim's reading of a model.

    Attributes:
        component: path of the component.
        difference: sentence about what Nimble does otherwise than OpenSim.
        done: change of the model as a phrase; "" if nothing can be changed.
    """

    component: str
    difference: str
    done: str = ""


def convert_from_nimble(model: Model) -> list[NimbleChange]:
    """Change a model so that its bodies move in OpenSim as they do in Nimble.

    Names, coordinates, ranges and units stay. Muscles, which Nimble does not move, stay too.

    Args:
        model: model to change in place.

    Returns:
        The differences, with the change of the model for each.

    Raises:
        UnsupportedError: Nimble cannot read the model, so that it has no motion there.
    """
    changes: list[NimbleChange] = []
    joints: list[Object] = [*model.joint_set.objects]
    for joint in joints:
        # Patellae are left out by Nimble.
        if not isinstance(joint, Joint) or joint.name in OMITTED_JOINTS:
            continue
        if not isinstance(joint, JOINT_CLASSES):
            raise UnsupportedError(
                f"'{joint.path}': Nimble cannot read {add_article(type(joint).__name__)}, so this model was not made for Nimble"
            )
        if isinstance(joint, EllipsoidJoint):
            if has_rotated_frames(joint):
                continue
            changes.append(_turn_ellipsoid(joint, model.tree()))
        elif isinstance(joint, CustomJoint):
            changes += _rewrite_custom_joint(joint)
            changes += _extend_splines(joint)
        elif isinstance(joint, ConstantCurvatureJoint):
            changes += _note_bend(joint)
    changes += _release_constraints(model)
    return changes


def _turn_ellipsoid(joint: EllipsoidJoint, tree: Tree) -> NimbleChange:
    """Turn the frames of an EllipsoidJoint by 90 degrees about Z, and exchange two radii.

    OpenSim rotates by Rx(q0) Ry(q1) Rz(q2), Nimble by Ry(q0) Rx(-q1) Rz(q2). With E = Rz(90 deg),
    Nimble's rotation is E Rx(q0) Ry(q1) Rz(q2) E^T, and the centre moves on an ellipsoid
    with the radii (ry, rx, rz).

    Returns:
        Description of the difference and of the change.
    """
    path = joint.path
    sockets = ("socket_parent_frame", "socket_child_frame")
    bases = [tree.target(joint, socket, getattr(joint, socket)) for socket in sockets]
    for socket, base in zip(sockets, bases, strict=True):
        frame = PhysicalOffsetFrame(
            name=f"{base.name}{ROTATED_FRAME_SUFFIX}",
            socket_parent=base,
            # A quarter turn about Z.
            orientation=(0.0, 0.0, math.pi / 2),
        )
        joint.frames = [*joint.frames, frame]
        setattr(joint, socket, frame)
    x, y, z = joint.radii_x_y_z
    joint.radii_x_y_z = (y, x, z)
    return NimbleChange(
        path,
        "Nimble rotates an EllipsoidJoint by Ry(q0) Rx(-q1) Rz(q2), OpenSim by Rx(q0) Ry(q1) Rz(q2)",
        "frames turned by 90 degrees about Z, radii x and y exchanged",
    )


def _rewrite_custom_joint(joint: CustomJoint) -> list[NimbleChange]:
    """Replace axes and functions of a CustomJoint by those with which Nimble moves it.

    Returns:
        One difference if an axis was changed, otherwise none.
    """
    nimble_joint = classify_custom_joint(joint)
    names = [coordinate.name for coordinate in joint.coordinates]
    axes = list(joint.spatial_transform.axes().values())
    vectors = [_flip(axis) for axis in axes]
    linear_axes = [
        index
        for index, axis in enumerate(axes)
        if isinstance(unwrap_function(axis)[0], LinearFunction)
    ]
    if nimble_joint is NimbleJoint.WELD:
        return []
    if nimble_joint is NimbleJoint.CUSTOM:
        new_axes = _build_custom_axes(joint, axes, vectors)
    else:
        if nimble_joint in (NimbleJoint.EULER, NimbleJoint.EULER_FREE):
            vectors[:3] = _orthogonalize(
                joint, vectors[:3], may_tilt=nimble_joint is NimbleJoint.EULER
            )
        if nimble_joint is NimbleJoint.EULER_FREE:
            vectors[3:] = UNIT_AXES
        # The axes that follow a coordinate; all others are fixed.
        driven_axes = {
            NimbleJoint.EULER: [0, 1, 2],
            NimbleJoint.EULER_FREE: [0, 1, 2, 3, 4, 5],
        }.get(nimble_joint, linear_axes)
        new_axes = [(vector, Constant(name="function", value=0.0), "") for vector in vectors]
        for name, index in zip(names, driven_axes, strict=False):
            new_axes[index] = (
                vectors[index],
                LinearFunction(name="function", coefficients=(1.0, 0.0)),
                name,
            )
    changed_axes = []
    for (axis_name, axis), (vector, function, name) in zip(
        joint.spatial_transform.axes().items(), new_axes, strict=True
    ):
        if _replace_axis(axis, vector, function, name):
            changed_axes.append(axis_name)
    if not changed_axes:
        return []
    return [
        NimbleChange(
            joint.path,
            f"Nimble reads this CustomJoint as {nimble_joint.value}, and ignores functions that such a joint does not have",
            f"functions of {join_words(changed_axes)} rewritten",
        )
    ]


def _flip(axis: TransformAxis) -> tuple[float, float, float]:
    """Return the vector of an axis; Nimble puts the slope -1 of a linear function into it."""
    function, _ = unwrap_function(axis)
    x, y, z = axis.axis
    is_flipped = isinstance(function, LinearFunction) and function.coefficients[0] == -1.0
    return (-x, -y, -z) if is_flipped else (x, y, z)


def _build_custom_axes(
    joint: CustomJoint, axes: Sequence[TransformAxis], vectors: Sequence[tuple[float, float, float]]
) -> list[tuple[tuple[float, float, float], Function, str]]:
    """Return vector, function and coordinate of the six axes of a CustomJoint of Nimble.

    Translations along anything but the positive axes X, Y and Z get lost in Nimble.

    Raises:
        UnsupportedError: an axis has no function, so that Nimble cannot read the joint.
    """
    names = [coordinate.name for coordinate in joint.coordinates]
    _orthogonalize(joint, vectors[:3], may_tilt=False)
    functions: list[tuple[Function, str]] = []
    for axis in axes:
        function, scale = unwrap_function(axis)
        axis_coordinates = axis.names
        name = (
            axis_coordinates[0]
            if len(axis_coordinates) == 1 and axis_coordinates[0] in names
            else (names or [""])[0]
        )
        if isinstance(function, LinearFunction):
            slope, offset = function.coefficients
            # The sign is in the vector already; see :func:`_flip`.
            slope = 1.0 if slope == -1.0 else slope
            functions.append(
                (
                    LinearFunction(name="function", coefficients=(slope * scale, offset * scale)),
                    name,
                )
            )
        elif isinstance(function, Constant):
            functions.append((Constant(name="function", value=function.value * scale), ""))
        elif axis.function is not None:
            functions.append((axis.function, name))
        else:
            raise UnsupportedError(
                f"'{joint.path}': an axis has no function, so Nimble cannot read the joint"
            )
    result = [
        (vector, *function) for vector, function in zip(vectors[:3], functions[:3], strict=True)
    ]
    if sorted(map(tuple, vectors[3:])) == sorted(UNIT_AXES):
        # The order of translations does not matter.
        return [(vector, *function) for vector, function in zip(vectors, functions, strict=True)]
    for unit in UNIT_AXES:
        # Of two translations along one axis Nimble keeps the last.
        matches = [index for index in range(3, 6) if tuple(vectors[index]) == unit]
        selected = functions[matches[-1]] if matches else (Constant(name="function", value=0.0), "")
        result.append((unit, *selected))
    return result


def _orthogonalize(
    joint: CustomJoint, vectors: Sequence[tuple[float, float, float]], *, may_tilt: bool
) -> list[tuple[float, float, float]]:
    """Return the three axes of rotation that Nimble uses.

    Args:
        joint: joint of the axes, for messages.
        vectors: axes of the file.
        may_tilt: whether Nimble accepts axes that are not the coordinate axes.

    Raises:
        UnsupportedError: Nimble cannot read these axes.
    """
    order = [next((k for k in range(3) if _is_unit(vector, k)), None) for vector in vectors]
    if None not in order:
        if tuple(order) not in AXIS_ORDERS:
            raise UnsupportedError(
                f"'{joint.path}': Nimble does not support this order of rotation axes"
            )
        return list(vectors)
    matrix = np.array(vectors, dtype=float).T
    # Nimble tolerates small angles between axes of three rotations.
    products = [abs(float(matrix[:, i] @ matrix[:, j])) for i, j in ((0, 1), (1, 2), (2, 0))]
    if not may_tilt or max(products) >= MAX_SKEW:
        raise UnsupportedError(
            f"'{joint.path}': Nimble cannot read these rotation axes; use the axes X, Y and Z in some order"
        )
    matrix = matrix / np.linalg.norm(matrix, axis=0)
    for _ in range(ORTHOGONALIZATIONS):
        for i in range(3):
            other_columns = [matrix[:, j] for j in range(3) if j != i]
            column: Array = matrix[:, i]
            matrix[:, i] = column - sum(
                float(column @ other_column) * other_column for other_column in other_columns
            )
    return [tuple(column.tolist()) for column in matrix.T]


def _is_unit(vector: Sequence[float], index: int) -> bool:
    """Return whether a vector is a coordinate axis, in either direction."""
    return tuple(abs(value) for value in vector) == UNIT_AXES[index]


def _replace_axis(
    axis: TransformAxis, vector: tuple[float, float, float], function: Function, name: str
) -> bool:
    """Give an axis another vector, function and coordinate.

    Returns:
        Whether this changes the motion.
    """
    if _describe(tuple(axis.axis), axis.function, axis.names) == _describe(
        vector, function, [name]
    ):
        # Axes that already move in this way stay as they are.
        return False
    axis.axis = vector
    axis.function = function.copy_deep() if function is axis.function else function
    axis.coordinates = (name,) if name else ()
    return True


def _describe(
    vector: Sequence[float], function: Function, names: Sequence[str]
) -> tuple[object, ...]:
    """Return numbers and names that are equal for two axes with equal motions."""
    scale = 1.0
    if isinstance(function, MultiplierFunction) and function.function is not None:
        function, scale = function.function, float(function.scale)
    # The length of an axis does not matter.
    direction = np.array(vector) / (np.linalg.norm(vector) or 1.0) * scale
    if isinstance(function, Constant):
        return tuple((direction * function.value + 0.0).tolist())
    if isinstance(function, LinearFunction):
        slope, offset = function.coefficients
        return (*(direction * slope + 0.0).tolist(), *(direction * offset + 0.0).tolist(), *names)
    return (*(direction + 0.0).tolist(), id(function), *names)


def _extend_splines(joint: CustomJoint) -> list[NimbleChange]:
    """Extend the splines of a CustomJoint to the ranges of its coordinates.

    Beyond its points a SimmSpline continues as a cubic in Nimble, and as a straight line in
    OpenSim.

    Returns:
        One difference if a spline was extended, otherwise none.
    """
    ranges = {coordinate.name: coordinate.range for coordinate in joint.coordinates}
    extended_axes = []
    for axis_name, axis in joint.spatial_transform.axes().items():
        function = axis.function
        spline = function.function if isinstance(function, MultiplierFunction) else function
        if not isinstance(spline, SimmSpline) or len(axis.names) != 1:
            continue
        lower, upper = sorted(ranges.get(axis.names[0], (0.0, 0.0)))
        # A spline of two points is a line in both programs.
        if len(spline.x) > 2 and (lower < spline.x[0] or upper > spline.x[-1]):
            _extend_spline(spline, lower, upper)
            extended_axes.append(axis_name)
    if not extended_axes:
        return []
    return [
        NimbleChange(
            joint.path,
            "beyond its points, a SimmSpline continues as a cubic in Nimble, but as a straight line in OpenSim",
            f"splines of {join_words(extended_axes)} extended to the range of the coordinate",
        )
    ]


def _extend_spline(spline: SimmSpline, lower: float, upper: float) -> None:
    """Add points on the first and last cubic of a spline, so that it covers an interval.

    The spline does not change between its points: with three points on the continued cubic, the
    third derivative at the new end, which the end condition takes from the last four points, is
    that of the cubic.
    """
    pieces = curves.SimmCubicSpline(spline.x, spline.y).pieces
    margin = EXTRA_FRACTION * (upper - lower)
    x, y = list(spline.x), list(spline.y)
    fractions = [(k + 1) / EXTRA_POINTS for k in range(EXTRA_POINTS)]
    if upper > x[-1]:
        start = x[-1]
        value, slope, curvature, _ = pieces[-1]
        # The last record has no cubic term, because OpenSim continues as a line.
        cubic = pieces[-2][3]
        for t in [fraction * (upper + margin - start) for fraction in fractions]:
            x.append(start + t)
            y.append(value + t * (slope + t * (curvature + t * cubic)))
    if lower < x[0]:
        start = x[0]
        value, slope, curvature, cubic = pieces[0]
        # Insert from the inner to the outer point, so that the points stay in ascending order.
        for t in [fraction * (lower - margin - start) for fraction in fractions]:
            x.insert(0, start + t)
            y.insert(0, value + t * (slope + t * (curvature + t * cubic)))
    spline.x, spline.y = tuple(x), tuple(y)


def _note_bend(joint: ConstantCurvatureJoint) -> list[NimbleChange]:
    """Note that a ConstantCurvatureJoint bends farther in Nimble, if its ranges allow it.

    Returns:
        One difference if a range allows a larger bend than OpenSim, otherwise none.
    """
    for coordinate, neutral in zip(joint.coordinates, joint.neutral_angle_x_z_y, strict=False):
        # The neutral angle adds to the coordinate.
        if max(abs(limit + neutral) for limit in coordinate.range) > MAX_BEND_RAD:
            return [
                NimbleChange(
                    joint.path,
                    f"OpenSim limits the bend of a ConstantCurvatureJoint to {MAX_BEND_RAD:.4f} rad, Nimble does not",
                )
            ]
    return []


def _release_constraints(model: Model) -> list[NimbleChange]:
    """Turn off the constraints between coordinates and bodies that Nimble moves.

    Returns:
        One difference for each constraint and each prescribed coordinate that was released.
    """
    free_names = {coordinate.name for coordinate in list_coordinates(model)}
    changes = []
    for constraint in model.components(Constraint):
        if isinstance(constraint, CoordinateCouplerConstraint):
            name = constraint.dependent_coordinate_name.rpartition("/")[2]
            if name not in free_names:
                continue
        if constraint.isEnforced:
            constraint.isEnforced = False
            changes.append(
                NimbleChange(
                    constraint.path, "Nimble does not know constraints", "turned off (isEnforced)"
                )
            )
    for coordinate in model.components(Coordinate):
        if coordinate.prescribed and coordinate.name in free_names:
            coordinate.prescribed = False
            changes.append(
                NimbleChange(
                    coordinate.path,
                    "Nimble does not know prescribed motions",
                    "turned off (prescribed)",
                )
            )
    return changes
