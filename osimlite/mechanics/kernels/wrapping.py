"""Interface of the laws of wrap surfaces, what they share, and the law of a sphere.

A surface of a path is an item, whose law finds how a straight segment of the path bends around it.
All points are in the frame of the wrap object, in m. The numbers p of the item are constant; its
record e holds the ends of the segment, to which the law adds two tangent points, the length on the
surface between them, and numbers that `wrap_curves` needs to trace the curve.

A law returns INSIDE, NONE, WRAPPED or MANDATORY of `WRAPPING`; its results in e count in the last
two cases only. Where OpenSim wraps a segment but then finds no points, the tangent points are NaN:
such a segment stays straight.

A path wraps around a sphere along the great circle in the plane of both ends and the centre.
Source: OpenSim 4.6's WrapSphere.
"""

from __future__ import annotations

from math import atan2, nan, pi, sqrt

from osimlite.mechanics.kernels.layout import ITEM, Record
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.laws.vectors import (
    Vector,
    add_scaled,
    component,
    cross,
    dot,
    minus,
    norm,
    plus,
    store_vector,
    times,
    unit,
    vector,
)


class WRAP_SURFACE(metaclass=Record):
    """Numbers of a wrap surface."""

    AXIS = 0
    """Axis of the quadrant, 0, 1 or 2."""
    SIDE = 1
    """Sign of the quadrant, 0.0 for the complete surface."""
    METHOD = 2
    """Method of an ellipsoid, such as ELLIPSOID_METHOD.HYBRID."""
    ALONE = 3
    """1.0 if the path has no other PathWrap, else 0.0."""
    SIZES = 4
    """Dimensions (m).

    Cylinder: radius, length; sphere: radius; ellipsoid: three radii; torus: inner and outer radius.
"""


class ELLIPSOID_METHOD(metaclass=Record):
    """Methods for an ellipsoid."""

    HYBRID = 0.0
    """A blend of axial point and fan, OpenSim's default."""
    MIDPOINT = 1.0
    """The point closest to the middle of the chord."""
    AXIAL = 2.0
    """The point where the chord crosses a plane of symmetry."""


class WRAP_WORK(metaclass=Record):
    """Record of the law of a wrap surface."""

    FIRST_END = 0
    """First end of the segment (m)."""
    SECOND_END = 3
    """Second end of the segment (m)."""
    FIRST_TANGENT = 6
    """Tangent point next to the first end (m)."""
    SECOND_TANGENT = 9
    """Tangent point next to the second end (m)."""
    SURFACE_LENGTH = 12
    """Length on the surface between the tangent points (m)."""
    CURVE = 13
    """Numbers that trace the curve between the tangent points."""
    WORKSPACE = 18
    """Workspace of the law."""
    END = 98
    """End of the record of the law."""


class WRAPPING(metaclass=Record):
    """Results of the law of a wrap surface."""

    INSIDE = -1
    """An end of the segment is inside the surface."""
    NONE = 0
    """The segment stays straight."""
    WRAPPED = 1
    """The segment may wrap."""
    MANDATORY = 2
    """The segment must wrap."""
    NO_POINTS = -2
    """Wrap whose range contains no active point; OpenSim then leaves the path as it is."""
    BEYOND = -3
    """Wrap whose range ends beyond the path; OpenSim then fails."""


def is_on_side(point: Vector, axis: int, side: float) -> bool:
    """Return whether a point is on the active side.

    Points between the sides belong to the positive one.

    Args:
        point: point in the frame of the surface.
        axis: axis of the quadrant, 0, 1 or 2.
        side: sign of the active side.
    """
    return (component(point, axis) >= 0.0) == (side > 0.0)


def decide_wrapping(first: bool, second: bool, closest: bool, crosses: bool) -> int:
    """Return whether a segment wraps, by which of its points are on the active side.

    Args:
        first: whether the first end is on the active side.
        second: whether the second end is.
        closest: whether the point of the segment that is closest to the middle of the surface is.
        crosses: whether the segment passes through the surface.

    Returns:
        NONE, WRAPPED or MANDATORY of `WRAPPING`, as OpenSim decides.
    """
    if not (first or second):
        return WRAPPING.WRAPPED
    if crosses:
        return WRAPPING.MANDATORY
    return WRAPPING.WRAPPED if first != second and not closest else WRAPPING.NONE


def find_tangents(point: Vector, radius: float, axis: Vector) -> tuple[Vector, Vector]:
    """Return the two tangent points of a circle about the origin, seen from a point of its plane.

    Args:
        point: point outside of the circle.
        radius: radius of the circle.
        axis: unit normal of the plane of the circle.

    Returns:
        The tangent points to the left and to the right about the axis.
    """
    distance = norm(point)
    # The tangent point is at the height r^2 / d above the centre, seen towards the point.
    sine = radius / distance
    foot = times(sine * sine, point)
    across = cross(axis, point)
    reach = radius * sqrt(1.0 - sine * sine) / distance
    return add_scaled(foot, reach, across), add_scaled(foot, -reach, across)


def nearest_pair(a1: Vector, b1: Vector, a2: Vector, b2: Vector) -> tuple[Vector, Vector]:
    """Return the two points of a circle that are nearest to each other.

    There are two candidates for each end.

    Args:
        a1: first candidate of the first end.
        b1: second candidate of the first end.
        a2: first candidate of the second end.
        b2: second candidate of the second end.

    Returns:
        The points of the first and of the second end.
    """
    aa, ab, ba, bb = dot(a1, a2), dot(a1, b2), dot(b1, a2), dot(b1, b2)
    if aa > ab and aa > ba and aa > bb:
        return a1, a2
    if ab > ba and ab > bb:
        return a1, b2
    if ba > bb:
        return b1, a2
    return b1, b2


def clear_tangents(e: Floats, code: int) -> int:
    """Return a code after setting the tangent points to NaN, where OpenSim finds none.

    Args:
        e: record of the law; changed.
        code: result of the law.
    """
    store_vector(e, WRAP_WORK.FIRST_TANGENT, (nan, nan, nan))
    store_vector(e, WRAP_WORK.SECOND_TANGENT, (nan, nan, nan))
    e[WRAP_WORK.SURFACE_LENGTH] = nan
    return code


MIN_PLANE_SINE = 1e-5
"""Sine of the angle between segment and centre below which OpenSim finds no plane."""


def wrap_sphere(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Bend a segment around a WrapSphere.

    As in OpenSim, a segment through the centre stays straight, and a length on the far side of the
    sphere is negative. Where a side is active, a segment must wrap only if its first end is less
    than 1 m from the point of the line that is closest to the centre.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the record of the surface holds the ends of the segment and is filled.
        y: state.
        f: rates of the coordinates.
        item: offset of the surface in the model.

    Returns:
        INSIDE, NONE, WRAPPED or MANDATORY of `WRAPPING`.
    """
    p, e = at(reals, model[item + ITEM.NUMBERS]), at(data, model[item + ITEM.RECORD])
    first = vector(e, WRAP_WORK.FIRST_END)
    second = vector(e, WRAP_WORK.SECOND_END)
    radius = p[WRAP_SURFACE.SIZES]
    if norm(first) < radius or norm(second) < radius:
        return WRAPPING.INSIDE
    if not crosses_sphere(first, second, radius):
        return WRAPPING.NONE
    chord_direction = unit(minus(first, second))
    normal = cross(chord_direction, unit(second))
    # Ends and centre on one line define no plane.
    if norm(normal) < MIN_PLANE_SINE:
        return clear_tangents(e, WRAPPING.WRAPPED)
    normal = unit(normal)
    a1, b1 = find_tangents(first, radius, normal)
    a2, b2 = find_tangents(second, radius, normal)
    first_tangent, second_tangent = nearest_pair(a1, b1, a2, b2)
    code, is_long = WRAPPING.WRAPPED, False
    if p[WRAP_SURFACE.SIDE] != 0.0:
        axis = int(p[WRAP_SURFACE.AXIS])
        side = p[WRAP_SURFACE.SIDE]
        active = is_on_side(first, axis, side), is_on_side(second, axis, side)
        distance_along_chord = dot(first, chord_direction)
        # OpenSim compares an absolute distance with 1 m here, see above.
        code = decide_wrapping(
            *active,
            is_on_side(add_scaled(first, -distance_along_chord, chord_direction), axis, side),
            distance_along_chord < 1.0,
        )
        if code == WRAPPING.NONE:
            return WRAPPING.NONE
        # Only where an end is on the other side may the longer arc be the active one.
        if not (active[0] and active[1]):
            first_tangent, second_tangent, is_long = pair_on_side(
                first, second, a1, b1, a2, b2, axis, side
            )
    angle = atan2(norm(cross(first_tangent, second_tangent)), dot(first_tangent, second_tangent))
    store_vector(e, WRAP_WORK.FIRST_TANGENT, first_tangent)
    store_vector(e, WRAP_WORK.SECOND_TANGENT, second_tangent)
    # The far arc has a negative length in OpenSim; the drawn arc goes the other way, too.
    e[WRAP_WORK.CURVE] = angle - 2.0 * pi if is_long else angle
    e[WRAP_WORK.SURFACE_LENGTH] = radius * e[WRAP_WORK.CURVE]
    return code


def crosses_sphere(first: Vector, second: Vector, radius: float) -> bool:
    """Return whether a segment enters and leaves a sphere between its ends.

    Args:
        first: first end of the segment.
        second: second end of the segment.
        radius: radius of the sphere.
    """
    chord = minus(first, second)
    a = dot(chord, chord)
    b = 2.0 * dot(second, chord)
    c = dot(second, second) - radius * radius
    discriminant = b * b - 4.0 * a * c
    if not (discriminant >= 0.0 and a > 0.0):
        return False
    root = sqrt(discriminant)
    # Both intersections must be between the ends: parameters from 0 to 1.
    return -b - root > 0.0 and root - b < 2.0 * a


def pair_on_side(
    first: Vector,
    second: Vector,
    a1: Vector,
    b1: Vector,
    a2: Vector,
    b2: Vector,
    axis: int,
    side: float,
) -> tuple[Vector, Vector, bool]:
    """Return the tangent points of both ends on the active side.

    Args:
        first: first end of the segment (m).
        second: second end of the segment (m).
        a1: first candidate of the first end.
        b1: second candidate of the first end.
        a2: first candidate of the second end.
        b2: second candidate of the second end.
        axis: axis of the quadrant: 0 for x, 1 for y, 2 for z.
        side: sign of the quadrant along this axis.

    Returns:
        The points of the first and second end, and whether the arc between them is the longer one.
    """
    to_centre = plus(first, second)
    a1_nearer = dot(a1, to_centre) < dot(b1, to_centre)
    a2_nearer = dot(a2, to_centre) < dot(b2, to_centre)
    first_tangent, second_tangent = a1 if a1_nearer else b1, a2 if a2_nearer else b2
    outwards = plus(minus(first_tangent, first), minus(second_tangent, second))
    # If the nearer tangent points lead away from the active side, take the other ones.
    if side * component(outwards, axis) < 0.0:
        first_tangent, second_tangent = b1 if a1_nearer else a1, b2 if a2_nearer else a2
        outwards = plus(minus(first_tangent, first), minus(second_tangent, second))
    return first_tangent, second_tangent, dot(plus(first_tangent, second_tangent), outwards) < 0.0
