"""MuJoCo's wrapping of tendons around spheres and cylinders, in many poses at once.

The tendon stays in a plane: for a sphere that of both ends and the centre, for a cylinder the one
normal to the axis, with heights that grow in proportion to the length. In the plane it is either
straight or touches a circle. The side site decides, and its meaning changed with MuJoCo 4.0:

- 4.0: the tendon turns about the centre by the angle from the first end to the side site, and on to
  the second end.
- 3.x: a tendon that neither cuts the circle nor passes the centre on the side opposite to the side
  site is straight. Any other takes the way whose tangent points are nearer to the side site.

Without a side site both take the shorter way, if the line between the ends cuts the circle. A side
site inside the surface makes the tendon pass through the surface: by the shortest way that has a
point in common with the circle.

Source: MuJoCo's XML reference (``spatial/geom``), its changelog for 4.0.0, and the public code of
    `mju_wrap`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from osimlite.base.named_tuples import NamedTuple
from osimlite.mechanics.multibody.spatial import Array

Mask = NDArray[np.bool_]

MIN_LENGTH_M = 1e-15
"""Smallest length that MuJoCo divides by (mjMINVAL)."""
MIN_TURN_RAD = 1e-9
"""Turn (rad) below which a tendon does not turn at all, instead of by a complete revolution."""


class TendonCourse(NamedTuple):
    """Course of a tendon around each of S surfaces in P poses, in each of C ways.

    Attributes:
        touches: whether it touches the surface (C, S, P).
        first: first tangent point in the frame of the surface (C, S, P, 3) (m); without contact the
            second end.
        second: second tangent point (C, S, P, 3) (m); without contact the first end.
        length: length on the surface (C, S, P) (m).
        choice: way for each of k side sites (k, P); without side sites one for each surface.
    """

    touches: Mask
    first: Array
    second: Array
    length: Array
    choice: NDArray[np.intp]


def bend_tendon(
    kind: str,
    radius: Array,
    first: Array,
    second: Array,
    side_sites: Array | None,
    owners: NDArray[np.intp],
    version: int,
) -> TendonCourse:
    """Bend a tendon around surfaces.

    Args:
        kind: "sphere" or "cylinder"; the axis of a cylinder is z.
        radius: radii (S, 1) (m).
        first: first end in the frames of the surfaces (S, P, 3) (m).
        second: second end (S, P, 3) (m).
        side_sites: side sites in the frames of their surfaces (k, P, 3) (m), or None.
        owners: index of the surface of each side site (k,).
        version: major version of MuJoCo.

    Returns:
        Course of the tendon in all ways, and the way that it takes.
    """
    plane_axes = None if kind == "cylinder" else _make_plane_axes(first, second)
    p = _project_to_plane(plane_axes, first)
    q = _project_to_plane(plane_axes, second)
    reach_p = _compute_tangent_angle(p, radius)
    reach_q = _compute_tangent_angle(q, radius)
    end_angle = _compute_angle(p, q)
    signs = (
        np.array((0.0, 1.0, -1.0))[:, None, None]
        if side_sites is not None
        else np.where(end_angle < 0.0, -1.0, 1.0)[None]
    )
    # If one end is behind the other, MuJoCo 3 with a side site winds completely around the circle.
    min_winding = reach_p + reach_q if version < 4 and side_sites is not None else -MIN_TURN_RAD
    # The angle from p to q in each direction, which is at least `min_winding`.
    winding = np.abs(signs) * (np.mod(signs * end_angle - min_winding, 2.0 * np.pi) + min_winding)
    arc = radius * (winding - reach_p - reach_q)
    at_p = _turn_on_circle(p, signs * reach_p, radius)
    at_q = _turn_on_circle(q, -signs * reach_q, radius)
    # MuJoCo does not wrap if an end is inside the surface.
    outside = (norm(p) >= radius) & (norm(q) >= radius)
    # Otherwise the straight line passes the surface.
    touches = outside & (arc > 0.0)
    choice = np.zeros((len(owners), len(p[0])), dtype=int)
    if side_sites is not None:
        toward = _project_to_plane(None if plane_axes is None else plane_axes[owners], side_sites)
        if version >= 4:
            choice = np.where(
                _compute_angle(p[owners], toward) + _compute_angle(toward, q[owners]) < 0.0, 2, 1
            )
        else:
            choice = _choose_side(p, q, radius, at_p[1:], at_q[1:], toward, owners)
        if (inside := norm(side_sites) < radius[owners]).any():
            passes_through, passage = _find_passage(p, q, radius)
            touches = np.stack((*touches, outside & passes_through))
            arc = np.stack((*arc, 0.0 * end_angle))
            at_p = np.stack((*at_p, passage))
            at_q = np.stack((*at_q, passage))
            choice = np.where(inside, 3, choice)
    if plane_axes is None:
        lines = np.stack((norm(at_p - p), arc, norm(at_q - q)))
        # Height changes in proportion to the length in the plane, as on an unrolled cylinder.
        slope = (second - first)[..., 2] / np.maximum(lines.sum(0), MIN_LENGTH_M)
        heights = first[..., 2] + slope * lines[0], first[..., 2] + slope * (lines[0] + lines[1])
        first_points, second_points = (
            np.concatenate((passage, z[..., None]), axis=-1)
            for passage, z in zip((at_p, at_q), heights, strict=True)
        )
        # On a cylinder the tendon is a helix, whose length is the hypotenuse of arc and height.
        arc = np.hypot(arc, heights[1] - heights[0])
    else:
        first_points, second_points = (
            np.einsum("spij,cspi->cspj", plane_axes, passage) for passage in (at_p, at_q)
        )
    touch_mask = touches[..., None]
    return TendonCourse(
        touches,
        np.where(touch_mask, first_points, second),
        np.where(touch_mask, second_points, first),
        np.where(touches, arc, 0.0),
        choice,
    )


def _choose_side(
    p: Array,
    q: Array,
    radius: Array,
    at_p: Array,
    at_q: Array,
    side: Array,
    owners: NDArray[np.intp],
) -> NDArray[np.intp]:
    """Return the way of a tendon in MuJoCo 3 with each of k side sites (k, P): 0 is straight."""
    segment = q - p
    fraction = np.clip(
        -_dot(segment, p) / np.maximum(_dot(segment, segment), MIN_LENGTH_M), 0.0, 1.0
    )
    nearest = p + fraction[..., None] * segment
    straight = (norm(nearest) > radius)[owners] & (_dot(side, nearest[owners]) >= 0.0)
    middle = unit(at_p + at_q)
    crossed: Mask = _lines_cross(p, at_p, q, at_q)
    # A way whose tangents cross is impossible.
    alignment = np.where(crossed[:, owners], -np.inf, _dot(middle[:, owners], side))
    return np.where(straight | np.all(crossed, axis=0)[owners], 0, 1 + alignment.argmax(0))


def _find_passage(p: Array, q: Array, radius: Array) -> tuple[Mask, Array]:
    """Find the shortest way through a circle.

    Both lines to its point on the circle have the same angle with the radius there.

    Args:
        p: first end in the plane (S, P, 2) (m).
        q: second end in the plane (S, P, 2) (m).
        radius: radii (S, 1) (m).

    Returns:
        Whether the way is not straight (S, P), and its point on the circle (S, P, 2).
    """
    segment = q - p
    fraction = np.clip(
        -_dot(segment, p) / np.maximum(_dot(segment, segment), MIN_LENGTH_M), 0.0, 1.0
    )
    is_free = norm(p + fraction[..., None] * segment) > radius
    end_angle = _compute_angle(p, q)
    # As a function of the angle between p and q, the slope of the length changes its sign once: bisect.
    lower = np.zeros(end_angle.shape)
    upper = np.ones(end_angle.shape)
    for _ in range(50):
        middle = 0.5 * (lower + upper)
        passage = _turn_on_circle(p, middle * end_angle, radius)
        slope = sum(
            _cross(passage, passage - end) / np.maximum(norm(passage - end), MIN_LENGTH_M)
            for end in (p, q)
        ) * np.sign(end_angle)
        lower = np.where(slope < 0.0, middle, lower)
        upper = np.where(slope < 0.0, upper, middle)
    return is_free, _turn_on_circle(p, 0.5 * (lower + upper) * end_angle, radius)


def _lines_cross(p: Array, p_end: Array, q: Array, q_end: Array) -> Mask:
    """Return whether the segments from `p` to `p_end` and from `q` to `q_end` intersect (...)."""
    first_direction, second_direction, start_offset = p_end - p, q_end - q, q - p
    determinant = _cross(first_direction, second_direction)
    # Parallel lines have no intersection; comparisons with NaN are false.
    determinant = np.where(np.abs(determinant) < MIN_LENGTH_M, np.nan, determinant)
    first_fraction = _cross(start_offset, second_direction) / determinant
    second_fraction = _cross(start_offset, first_direction) / determinant
    return (
        (first_fraction >= 0.0)
        & (first_fraction <= 1.0)
        & (second_fraction >= 0.0)
        & (second_fraction <= 1.0)
    )


def _make_plane_axes(first: Array, second: Array) -> Array:
    """Return two unit vectors (S, P, 2, 3) in the plane of both ends and the centre.

    The first one points to the first end.
    """
    first_axis = first / np.maximum(norm(first), MIN_LENGTH_M)[..., None]
    normal = np.cross(first, second)
    size = norm(normal)[..., None]
    # Ends on a line with the centre define no plane; any plane through the line will do.
    smallest_axis = np.where(
        np.abs(first_axis) < np.abs(first_axis).max(-1, keepdims=True), 1.0, 0.0
    )
    normal = np.where(size > MIN_LENGTH_M, normal, np.cross(first_axis, smallest_axis))
    normal /= np.maximum(norm(normal), MIN_LENGTH_M)[..., None]
    return np.stack((first_axis, np.cross(normal, first_axis)), axis=-2)


def _project_to_plane(plane_axes: Array | None, points: Array) -> Array:
    """Return coordinates (..., 2) of points (..., 3) in a plane.

    It is the plane of two vectors (..., 2, 3), or the one normal to z.
    """
    return (
        points[..., :2] if plane_axes is None else np.einsum("...ij,...j->...i", plane_axes, points)
    )


def _dot(a: Array, b: Array) -> Array:
    """Return the scalar products (...,) of vectors (..., n)."""
    return np.einsum("...i,...i->...", a, b)


def norm(a: Array) -> Array:
    """Return the lengths (...) of vectors (..., 3)."""
    return np.sqrt(_dot(a, a))


def unit(a: Array) -> Array:
    """Return unit vectors (..., 3); zero vectors remain zero."""
    return a / np.maximum(norm(a), np.finfo(float).tiny)[..., None]


def _compute_angle(a: Array, b: Array) -> Array:
    """Return the angle from one vector to another (...), from -pi to pi."""
    return np.arctan2(_cross(a, b), _dot(a, b))


def _cross(a: Array, b: Array) -> Array:
    """Return the z components (...,) of the cross products of vectors in the x-y plane."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _compute_tangent_angle(p: Array, radius: Array) -> Array:
    """Return the angle at the centre between a point and the tangent point of a line from it (...)."""
    return np.arccos(np.clip(radius / np.maximum(norm(p), MIN_LENGTH_M), 0.0, 1.0))


def _turn_on_circle(p: Array, angle: Array, radius: Array) -> Array:
    """Return the point on the circle (..., 2) in the direction of a point, turned by an angle."""
    direction = np.arctan2(p[..., 1], p[..., 0]) + angle
    return np.stack((radius * np.cos(direction), radius * np.sin(direction)), axis=-1)
