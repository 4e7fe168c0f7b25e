"""What the wrap surfaces share: the active side, whether a path has to wrap, points of tangency."""

from __future__ import annotations

from math import nan, sqrt

from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.kernels.wrapping import (
    FIRST_TANGENT,
    MANDATORY,
    NONE,
    SECOND_TANGENT,
    SURFACE_LENGTH,
    WRAPPED,
)
from osimlite.mechanics.laws.vectors import Vector, along, component, cross, dot, norm, put, times


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
