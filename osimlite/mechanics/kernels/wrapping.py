"""What the laws of wrap surfaces are given and say: see `wrap_cylinder.py` and its neighbours.

A surface of a path is an item, whose law finds how a straight piece of the path bends around it.
All points are in the frame of the wrap object, in m. The numbers p of the item do not change:
p[AXIS] is the axis (0, 1, 2) of the quadrant and p[SIDE] its sign, 0.0 for all of the surface;
p[METHOD] is how an ellipsoid is wrapped, p[ALONE] is 1.0 if the path has no other PathWrap, and
from p[SIZES] on stand the dimensions (cylinder: radius, length; sphere: radius; ellipsoid: three
radii; torus: inner_radius, outer_radius). The record e of the item has the ends of the piece e[0:3]
and e[3:6], to which the law adds the tangent points e[6:9] and e[9:12], in the same order, the
length e[12] along the surface between them, and in e[CURVE:ROOM] what `wrap_curves.py` needs to
trace the way there; the rest, up to ENDS, is room of the law's own.

A law returns INSIDE if an end is inside the surface, NONE if the piece goes straight on, WRAPPED if
it may wrap, and MANDATORY if it must; what it leaves in e counts in the last two cases only. Where
OpenSim takes a piece to wrap but then finds no points, the tangent points are NaN: such a piece
goes straight on.
"""

from __future__ import annotations

from math import atan2, nan, pi, sqrt

from osimlite.mechanics.kernels.layout import ITEM
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.laws.vectors import (
    Vector,
    along,
    component,
    cross,
    dot,
    minus,
    norm,
    plus,
    put,
    times,
    unit,
    vector,
)

AXIS, SIDE, METHOD, ALONE, SIZES = 0, 1, 2, 3, 4
HYBRID, MIDPOINT, AXIAL = 0.0, 1.0, 2.0

FIRST_END, SECOND_END, FIRST_TANGENT, SECOND_TANGENT, SURFACE_LENGTH, CURVE, ROOM, ENDS = (
    0,
    3,
    6,
    9,
    12,
    13,
    18,
    98,
)

INSIDE, NONE, WRAPPED, MANDATORY = -1, 0, 1, 2


def on_side(point: Vector, axis: int, side: float) -> bool:
    """Whether a point is on the active side, to which points between the sides belong if it is the positive one."""
    return (component(point, axis) >= 0.0) == (side > 0.0)


def action(first: bool, second: bool, closest: bool, crosses: bool) -> int:
    """What becomes of a piece of a path, by what is on the active side: its ends, and its point closest to the middle.

    `crosses` tells whether it goes through the surface.
    """
    if not (first or second):
        return WRAPPED
    if crosses:
        return MANDATORY
    return WRAPPED if first != second and not closest else NONE


def tangents(point: Vector, radius: float, axis: Vector) -> tuple[Vector, Vector]:
    """Where the two lines from a point touch a circle about the origin, whose unit axis is normal to the point."""
    distance = norm(point)
    sine = radius / distance
    foot, across = times(sine * sine, point), cross(axis, point)
    reach = radius * sqrt(1.0 - sine * sine) / distance
    return along(foot, reach, across), along(foot, -reach, across)


def nearest_pair(a1: Vector, b1: Vector, a2: Vector, b2: Vector) -> tuple[Vector, Vector]:
    """Of points on one circle, two for each end, those two that are nearest to each other."""
    aa, ab, ba, bb = dot(a1, a2), dot(a1, b2), dot(b1, a2), dot(b1, b2)
    if aa > ab and aa > ba and aa > bb:
        return a1, a2
    if ab > ba and ab > bb:
        return a1, b2
    if ba > bb:
        return b1, a2
    return b1, b2


def nowhere(e: Floats, code: int) -> int:
    """The code, with tangent points that are none: OpenSim finds nothing, and the piece goes straight on."""
    put(e, FIRST_TANGENT, (nan, nan, nan))
    put(e, SECOND_TANGENT, (nan, nan, nan))
    e[SURFACE_LENGTH] = nan
    return code


STRAIGHT = 1e-5
"""Sine of the angle between the line and the direction of the centre below which OpenSim finds no plane."""


def wrap_sphere(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """The law of a WrapSphere, see :mod:`osimlite.mechanics.kernels.wrapping`.

    As in OpenSim a line through the centre goes straight on, a length on the far side of the sphere
    is negative, and where a side is active a line must wrap only if its first end is less than 1 m
    from the middle of it.
    """
    p, e = at(reals, model[item + ITEM.NUMBERS]), at(data, model[item + ITEM.RECORD])
    first, second, radius = vector(e, FIRST_END), vector(e, SECOND_END), p[SIZES]
    if norm(first) < radius or norm(second) < radius:
        return INSIDE
    if not crosses(first, second, radius):
        return NONE
    way = unit(minus(first, second))
    normal = cross(way, unit(second))
    if norm(normal) < STRAIGHT:
        return nowhere(e, WRAPPED)
    normal = unit(normal)
    a1, b1 = tangents(first, radius, normal)
    a2, b2 = tangents(second, radius, normal)
    one, two = nearest_pair(a1, b1, a2, b2)
    code, far = WRAPPED, False
    if p[SIDE] != 0.0:
        axis, side = int(p[AXIS]), p[SIDE]
        active = on_side(first, axis, side), on_side(second, axis, side)
        before = dot(first, way)
        code = action(*active, on_side(along(first, -before, way), axis, side), before < 1.0)
        if code == NONE:
            return NONE
        if not (active[0] and active[1]):
            one, two, far = pair_on_side(first, second, a1, b1, a2, b2, axis, side)
    angle = atan2(norm(cross(one, two)), dot(one, two))
    put(e, FIRST_TANGENT, one)
    put(e, SECOND_TANGENT, two)
    e[CURVE] = angle - 2.0 * pi if far else angle
    e[SURFACE_LENGTH] = radius * e[CURVE]
    return code


def crosses(first: Vector, second: Vector, radius: float) -> bool:
    """Whether a line enters and leaves a sphere between its ends."""
    way = minus(first, second)
    a, b, c = dot(way, way), 2.0 * dot(second, way), dot(second, second) - radius * radius
    discriminant = b * b - 4.0 * a * c
    if not (discriminant >= 0.0 and a > 0.0):
        return False
    root = sqrt(discriminant)
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
    """The tangent points of the two ends on the active side, and whether the way between them is the longer one."""
    to_centre = plus(first, second)
    a1_nearer, a2_nearer = (
        dot(a1, to_centre) < dot(b1, to_centre),
        dot(a2, to_centre) < dot(b2, to_centre),
    )
    one, two = a1 if a1_nearer else b1, a2 if a2_nearer else b2
    outwards = plus(minus(one, first), minus(two, second))
    if side * component(outwards, axis) < 0.0:
        one, two = b1 if a1_nearer else a1, b2 if a2_nearer else a2
        outwards = plus(minus(one, first), minus(two, second))
    return one, two, dot(plus(one, two), outwards) < 0.0
