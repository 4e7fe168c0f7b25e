"""Conversion of the joints of a model to motions, with the order of their coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, cast

import numpy as np

from osimlite.base.text import (
    SAME_CLASS_SIMILARITY,
    add_article,
    format_count,
    join_words,
    suggest_name,
)
from osimlite.errors import ModelError, UnsupportedError
from osimlite.mechanics.multibody.joints import (
    PLAIN_JOINTS,
    JointAxis,
    constant_curvature,
    make_custom_motions,
    make_ellipsoid_motions,
    make_plain_motions,
    make_scapulothoracic_motions,
)
from osimlite.mechanics.multibody.motions import JointMotion
from osimlite.mechanics.multibody.schema_functions import convert_function
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.joints import Joint
from osimlite.schema.resolution import is_a

if TYPE_CHECKING:
    from osimlite.schema.custom_joint import CustomJoint
    from osimlite.schema.joint_types import (
        ConstantCurvatureJoint,
        EllipsoidJoint,
        ScapulothoracicJoint,
    )

JOINT_TYPES = (
    *PLAIN_JOINTS,
    "EllipsoidJoint",
    "ScapulothoracicJoint",
    "ConstantCurvatureJoint",
    "CustomJoint",
)
"""OpenSim's joint classes that osimlite computes."""


def joint_motions(
    joint: Joint, path: str, *, opensim_derivatives: bool = False
) -> tuple[tuple[JointMotion, ...], Sequence[Coordinate]]:
    """Return the motions of a joint.

    Args:
        joint: joint of the model.
        path: path of the joint in the model, for messages.
        opensim_derivatives: see `build_mechanism`.

    Returns:
        Factors of X_FM, and the coordinates in the order to which the factors refer.

    Raises:
        ModelError: the number of coordinates is wrong, or an axis, a function or radii are
            impossible.
        UnsupportedError: the joint or a function is of an unknown class.
    """  # noqa: DOC501 - a function makes the UnsupportedError
    class_name = type(joint).__name__
    coordinates = list(joint.coordinates)
    # Classes are compared by name, so that those of other joints are not imported.
    if is_a(joint, "CustomJoint"):
        return _build_custom_motions(cast("CustomJoint", joint), path, opensim_derivatives)
    if is_a(joint, "EllipsoidJoint"):
        ellipsoid = cast("EllipsoidJoint", joint)
        motions = make_ellipsoid_motions(_read_radii(ellipsoid.radii_x_y_z, path))
    elif is_a(joint, "ScapulothoracicJoint"):
        scapula = cast("ScapulothoracicJoint", joint)
        motions = make_scapulothoracic_motions(
            _read_radii(scapula.thoracic_ellipsoid_radii_x_y_z, path),
            scapula.scapula_winging_axis_origin,
            scapula.scapula_winging_axis_direction,
        )
    elif is_a(joint, "ConstantCurvatureJoint"):
        rod = cast("ConstantCurvatureJoint", joint)
        if not 0.0 < rod.length < np.inf:
            raise ModelError(
                f"the rod of '{path}' has the length {rod.length:g}; give a positive length in m"
            )
        motions = constant_curvature(rod.length, rod.neutral_angle_x_z_y)
    elif class_name in PLAIN_JOINTS:
        motions = make_plain_motions(type(joint))
    else:
        raise unknown_joint(path, class_name)
    needed = 1 + max((index for motion in motions for index in motion.coordinates), default=-1)
    if len(coordinates) != needed:
        raise ModelError(
            f"{class_name} '{path}' has {format_count(len(coordinates), 'coordinate')}, but needs {needed}"
        )
    return motions, coordinates


def unknown_joint(path: str, class_name: str) -> UnsupportedError:
    """Return the error for a joint of an unknown class.

    Args:
        path: path of the joint.
        class_name: name of its class.
    """
    supported = f"; it supports {join_words(JOINT_TYPES, max_count=len(JOINT_TYPES))}"
    return UnsupportedError(
        f"'{path}' is {add_article(class_name)}, a class of joints that osimlite does not support"
        f"{suggest_name(class_name, JOINT_TYPES, cutoff=SAME_CLASS_SIMILARITY) or supported}"
    )


def _build_custom_motions(
    joint: CustomJoint, path: str, opensim_derivatives: bool
) -> tuple[tuple[JointMotion, ...], Sequence[Coordinate]]:
    """Return the motions of a CustomJoint, and its coordinates in the order of the motions.

    Args:
        joint: joint.
        path: path of the joint in the model, for messages.
        opensim_derivatives: whether accelerations have Simbody's error, see `make_custom_motions`.

    Returns:
        Motions, and coordinates.

    Raises:
        ModelError: an axis has no direction or an unknown coordinate, or a coordinate is unused.
    """
    coordinates = {coordinate.name: coordinate for coordinate in joint.coordinates}
    order: dict[str, int] = {}
    axes: list[JointAxis] = []
    for name, axis in joint.spatial_transform.axes().items():
        where = f"{name} of '{path}'"
        words = axis.names
        for word in words:
            if word not in coordinates:
                raise ModelError(
                    f"{where} names the coordinate '{word}', which the joint does not have; add it to the joint"
                )
            # OpenSim sorts the coordinates by their first appearance here, whatever their order in
            # the file.
            order.setdefault(word, len(order))
        direction = np.array(axis.axis, dtype=float)
        if not np.isfinite(direction).all() or not direction.any():
            raise ModelError(f"the axis of {where} has no direction; give one that is not zero")
        function = convert_function(
            axis.function,
            len(words),
            f"the function of {where}",
            opensim_derivatives=opensim_derivatives,
        )
        axes.append(JointAxis(tuple(order[word] for word in words), direction, function))
    unused = [name for name in coordinates if name not in order]
    if unused:
        raise ModelError(
            f"CustomJoint '{path}' has {format_count(len(coordinates), 'coordinate')}, but nothing in its "
            f"SpatialTransform depends on {join_words(unused)}; add each to an axis, or remove it"
        )
    motions = make_custom_motions(axes[:3], axes[3:], opensim_derivatives=opensim_derivatives)
    return motions, [coordinates[name] for name in order]


def _read_radii(radii: Sequence[float], path: str) -> Sequence[float]:
    """Return the half axes of an ellipsoid after a check (3,), m.

    Args:
        radii: half axes of the file.
        path: path of the joint, for messages.

    Raises:
        ModelError: a half axis is not finite.
    """
    # Negative radii are accepted: models use them to mirror an ellipsoid.
    if not np.isfinite(radii).all():
        words = " ".join(f"{radius:g}" for radius in radii)
        raise ModelError(
            f"the radii of the ellipsoid of '{path}' are {words}; give three lengths in m"
        )
    return radii
