"""Rotations and rigid transforms."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from osimlite.mechanics.laws.rotations import (
    rotation_about_axis,
    rotation_from_xyz,
    transpose_rotation,
)

Array = NDArray[np.float64]
"""Array of floats."""


def cross(a: Array, b: Array) -> Array:
    """Return the cross product of two vectors (3,).

    It is ten times as fast as numpy's general function.
    """
    ax, ay, az = a.tolist()
    bx, by, bz = b.tolist()
    return np.array((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx))


def skew_matrix(v: Array) -> Array:
    """Return the matrix [v] (3, 3) with [v] a = v × a."""
    x, y, z = v.tolist()
    return np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))


def skew_matrices(vectors: Array) -> Array:
    """Return the matrices [v] (b, 3, 3) with [v] a = v × a of vectors (b, 3)."""
    result = np.zeros((len(vectors), 3, 3))
    for row, column, component, sign in ((0, 1, 2, -1), (0, 2, 1, 1), (1, 2, 0, -1)):
        result[:, row, column] = sign * vectors[:, component]
        result[:, column, row] = -sign * vectors[:, component]
    return result


def rotation_about(axis: Array, angle: float) -> Array:
    """Return the rotation matrix (3, 3) about an axis, by Rodrigues' formula.

    Args:
        axis: unit vector (3,).
        angle: angle (rad).
    """
    # The laws return the columns of the matrix as three axes.
    return np.array(
        transpose_rotation(
            rotation_about_axis(axis.tolist(), float(np.sin(angle)), float(np.cos(angle)))
        )
    )


def rotation_xyz(angles: Array) -> Array:
    """Return the rotation matrix Rx(a) Ry(b) Rz(c) (3, 3) of body-fixed X-Y-Z angles (3,), rad."""
    return np.array(
        transpose_rotation(
            rotation_from_xyz(*np.stack((np.sin(angles), np.cos(angles)), axis=1).ravel().tolist())
        )
    )


def rotation_about_space(angles: ArrayLike) -> Array:
    """Return the rotation matrix Rz(c) Ry(b) Rx(a) (3, 3) of space-fixed X-Y-Z angles (3,), rad."""
    # Its inverse is Rx(-a) Ry(-b) Rz(-c).
    return rotation_xyz(-np.asarray(angles, dtype=float)).T


def angles_xyz(rotation: Array) -> Array:
    """Return body-fixed X-Y-Z angles (..., 3) of rotation matrices (..., 3, 3), rad.

    The second angle is from -90 to 90 degrees.
    """
    r13, r23, r33 = (rotation[..., k, 2] for k in range(3))
    # Near a right angle the cosine has all digits, but arcsin(r13) only half of them.
    cosine = np.hypot(r23, r33)
    first, second = np.arctan2(-r23, r33), np.arctan2(r13, cosine)
    sin, cos = np.sin(first), np.cos(first)
    # The third angle is that of the rotation without the first one. Near a right angle, rounding
    # errors of the entries change the first angle, and this one compensates for them.
    third = np.arctan2(
        cos * rotation[..., 1, 0] + sin * rotation[..., 2, 0],
        cos * rotation[..., 1, 1] + sin * rotation[..., 2, 1],
    )
    # At a right angle only the sum (or difference) of the others is determined: OpenSim sets the
    # third to 0, and this is its limit.
    is_straight = cosine <= 4.0 * np.finfo(float).eps
    alone = np.arctan2(rotation[..., 1, 0], rotation[..., 1, 1]) * np.copysign(1.0, r13)
    return np.stack(
        [np.where(is_straight, alone, first), second, np.where(is_straight, 0.0, third)], axis=-1
    )


def quaternion_of(rotation: ArrayLike) -> Array:
    """Return unit quaternions (..., 4), scalar first, of rotation matrices (..., 3, 3).

    Each is computed from its largest component, which avoids cancellation.
    """
    m = np.asarray(rotation)
    trace = np.trace(m, axis1=-2, axis2=-1)[..., None, None]
    # Each row is the quaternion times one of its components; the longest row is the most exact.
    products = np.empty((*m.shape[:-2], 4, 4))
    products[..., 1:, 1:] = m + np.swapaxes(m, -1, -2) + (1.0 - trace) * np.eye(3)
    for k in range(3):
        products[..., k + 1, 0] = products[..., 0, k + 1] = (
            m[..., k - 1, k - 2] - m[..., k - 2, k - 1]
        )
    products[..., :1, :1] = 1.0 + trace
    largest = np.argmax(np.diagonal(products, axis1=-2, axis2=-1), axis=-1)
    rows: Array = np.take_along_axis(products, largest[..., None, None], axis=-2)[..., 0, :]
    rows /= np.linalg.norm(rows, axis=-1, keepdims=True)
    return rows


def rotation_of(quaternions: ArrayLike) -> Array:
    """Return rotation matrices (..., 3, 3) of quaternions (..., 4), scalar first.

    Quaternions need not have unit length; zeros give NaN.
    """
    components = np.asarray(quaternions, dtype=float)
    with np.errstate(invalid="ignore"):
        # Scale first, since the squares of very long or short quaternions overflow or vanish.
        scaled = components / np.abs(components).max(axis=-1, keepdims=True)
        w, x, y, z = np.moveaxis(scaled / np.linalg.norm(scaled, axis=-1, keepdims=True), -1, 0)
    return np.stack(
        (
            np.stack(
                (w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)), -1
            ),
            np.stack(
                (2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)), -1
            ),
            np.stack(
                (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z), -1
            ),
        ),
        -2,
    )


def make_transform(rotation: Any = None, translation: Any = None) -> Array:
    """Return the homogeneous matrix (4, 4) of a rotation and a translation.

    Args:
        rotation: rotation matrix (3, 3); None for the identity.
        translation: translation (3,), m; None for none.
    """
    matrix = np.eye(4)
    if rotation is not None:
        matrix[:3, :3] = rotation
    if translation is not None:
        matrix[:3, 3] = translation
    return matrix


def make_offset(translation: Any, orientation: Any) -> Array:
    """Return the homogeneous matrix (4, 4) of an offset frame.

    Args:
        translation: origin (3,), m.
        orientation: body-fixed X-Y-Z angles (3,), rad.
    """
    return make_transform(rotation_xyz(np.asarray(orientation, dtype=float)), translation)


def invert_transform(matrix: Array) -> Array:
    """Return the inverse of a homogeneous matrix (4, 4)."""
    rotation = matrix[:3, :3].T
    return make_transform(rotation, -rotation @ matrix[:3, 3])
