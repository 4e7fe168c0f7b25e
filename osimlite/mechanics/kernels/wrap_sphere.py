"""How a path bends around a sphere: along the great circle in the plane of both ends and the centre.

Source: OpenSim 4.6's WrapSphere.
"""

from __future__ import annotations

from math import atan2, pi, sqrt

from osimlite.mechanics.kernels.layout import ITEM
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.wrap_sides import action, nearest_pair, nowhere, on_side, tangents
from osimlite.mechanics.kernels.wrapping import (
    AXIS,
    CURVE,
    FIRST_END,
    FIRST_TANGENT,
    INSIDE,
    NONE,
    SECOND_END,
    SECOND_TANGENT,
    SIDE,
    SIZES,
    SURFACE_LENGTH,
    WRAPPED,
)
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
    unit,
    vector,
)

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
