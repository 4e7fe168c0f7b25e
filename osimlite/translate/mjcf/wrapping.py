"""How MuJoCo bends a tendon around a sphere or a cylinder, in many poses at once.

The tendon stays in a plane: of a sphere that of both ends and the middle, of a cylinder that normal to the axis, and
heights above that grow in proportion to the length. In the plane it either goes straight or touches a circle, and what
decides is the side site, whose meaning changed with MuJoCo 4.0:

- 4.0: the tendon goes around the middle by the angle from the first end to the side site and on to the second end,
- 3.x: a tendon that neither cuts the circle nor passes on the other side of the middle than the side site goes
  straight; any other goes the way around whose tangent points are nearer to the side site.

Without a side site both go the shorter way, if the line between the ends cuts the circle. A side site inside of the
surface makes the tendon go through the surface: by the shortest way that has a point in common with the circle.

Source: MuJoCo's XML reference (``spatial/geom``), its changelog for 4.0.0, and the public code of `mju_wrap`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from osimlite.multibody.spatial import Array

Mask = NDArray[np.bool_]
Radius = float | Array

TINY = 1e-15
"""MuJoCo's own least number."""


class Bend(NamedTuple):
    """How a tendon bends around a surface, in P poses; what is not touched goes straight on.

    Attributes:
        touches: whether it touches (P,).
        first: where the tendon leads to from the first end (P, 3), in the frame of the surface, m: a tangent point, or
            the second end.
        second: where it comes to the second end from (P, 3).
        length: on the surface (P,), m.
    """

    touches: Mask
    first: Array
    second: Array
    length: Array


def bend(kind: str, radius: Radius, first: Array, second: Array, side: Array | None = None, *, version: int) -> Bend:
    """How a tendon bends.

    Args:
        kind: ``"sphere"`` or ``"cylinder"``, this one about z.
        radius: m, one for all or each.
        first: one end (P, 3) in the frame of the surface, m.
        second: the other end (P, 3).
        side: side site (P, 3) there.
        version: of MuJoCo, 3 or 4.
    """
    if kind == "cylinder":
        flat, across = np.eye(3)[:2], np.broadcast_to(np.eye(3)[:2], (len(first), 2, 3))
    else:
        flat, across = None, _plane(first, second)
    p, q = _in(across, first), _in(across, second)
    toward = None if side is None else _in(across, side)
    winding = _winding(p, q, toward, radius, version)
    reach_p, reach_q = _reach(p, radius), _reach(q, radius)
    arc = radius * (np.abs(winding) - reach_p - reach_q)
    outside = (norm(p) >= radius) & (norm(q) >= radius)
    touches = outside & (arc > 0.0)
    sign = np.where(winding < 0.0, -1.0, 1.0)
    at_p, at_q = _turned(p, sign * reach_p, radius), _turned(q, -sign * reach_q, radius)
    if side is not None and (inside := np.sqrt(np.einsum("pi,pi->p", side, side)) < radius).any():
        through, at = _through(p, q, radius)
        touches = np.where(inside, outside & through, touches)
        arc = np.where(inside, 0.0, arc)
        at_p, at_q = (np.where(inside[:, None], at, point) for point in (at_p, at_q))
    one, two = (np.einsum("pij,pi->pj", across, flat_point) for flat_point in (at_p, at_q))
    if flat is not None:
        lines = np.stack((norm(at_p - p), arc, norm(at_q - q)))
        rise = second[:, 2] - first[:, 2]
        share = rise / np.maximum(lines.sum(0), TINY)
        one[:, 2] = first[:, 2] + share * lines[0]
        two[:, 2] = first[:, 2] + share * (lines[0] + lines[1])
        arc = np.hypot(arc, two[:, 2] - one[:, 2])
    hit = touches[:, None]
    return Bend(touches, np.where(hit, one, second), np.where(hit, two, first), np.where(touches, arc, 0.0))


def _winding(p: Array, q: Array, side: Array | None, radius: Radius, version: int) -> Array:
    """The angle (P,) by which a tendon goes around the middle; 0 where it goes straight in 3.x."""
    between = _angle(p, q)
    if side is None:
        return between
    if version >= 4:
        return _angle(p, side) + _angle(side, q)
    way = q - p
    part = np.clip(-_dot(way, p) / np.maximum(_dot(way, way), TINY), 0.0, 1.0)
    nearest = p + part[:, None] * way
    straight = (norm(nearest) > radius) & (_dot(side, nearest) >= 0.0)
    reach_p, reach_q = _reach(p, radius), _reach(q, radius)
    best, winding = np.full(len(p), -np.inf), np.zeros(len(p))
    for sign in (1.0, -1.0):
        one, two = _turned(p, sign * reach_p, radius), _turned(q, -sign * reach_q, radius)
        middle = one + two
        good = _dot(middle, side) / np.maximum(norm(middle) * norm(side), TINY)
        good = np.where(_cut(p, one, q, two), -np.inf, good)
        # Of ends one behind the other, one line passes the other by, and MuJoCo 3 goes all the way around.
        turn = np.mod(sign * between - reach_p - reach_q, 2.0 * np.pi) + reach_p + reach_q
        winding, best = np.where(good > best, sign * turn, winding), np.maximum(good, best)
    return np.where(straight, 0.0, winding)


def _through(p: Array, q: Array, radius: Radius) -> tuple[Mask, Array]:
    """Whether the way through a circle is not straight (P,), and the point of the circle (P, 2) that it then has.

    Both lines to that point have the same angle with the radius there.
    """
    way = q - p
    part = np.clip(-_dot(way, p) / np.maximum(_dot(way, way), TINY), 0.0, 1.0)
    passes = norm(p + part[:, None] * way) > radius
    between = _angle(p, q)
    # At the share t of the angle from p to q the slope of the length changes its sign once.
    low, high = np.zeros(len(p)), np.ones(len(p))
    for _ in range(50):
        middle = 0.5 * (low + high)
        at = _turned(p, middle * between, radius)
        slope = sum(_cross(at, at - end) / np.maximum(norm(at - end), TINY) for end in (p, q)) * np.sign(between)
        low, high = np.where(slope < 0.0, middle, low), np.where(slope < 0.0, high, middle)
    return passes, _turned(p, 0.5 * (low + high) * between, radius)


def _cut(p: Array, one: Array, q: Array, two: Array) -> Mask:
    """Whether the line from p to one and that from q to two have a point in common (P,)."""
    way, other, apart = one - p, two - q, q - p
    across = _cross(way, other)
    across = np.where(np.abs(across) < TINY, np.nan, across)
    along, back = _cross(apart, other) / across, _cross(apart, way) / across
    found: Mask = (along >= 0.0) & (along <= 1.0) & (back >= 0.0) & (back <= 1.0)
    return found


def _plane(first: Array, second: Array) -> Array:
    """Two unit vectors (P, 2, 3) in the plane of both ends and the middle of a sphere, one toward the first end."""
    along = first / np.maximum(norm(first), TINY)[:, None]
    normal = np.cross(first, second)
    size = norm(normal)
    # Ends in line with the middle share no plane of their own.
    other = np.where(np.abs(along) < np.abs(along).max(1, keepdims=True), 1.0, 0.0)
    normal = np.where((size > TINY)[:, None], normal, np.cross(along, other))
    normal /= np.maximum(norm(normal), TINY)[:, None]
    return np.stack((along, np.cross(normal, along)), axis=1)


def _in(across: Array, points: Array) -> Array:
    found: Array = np.einsum("pij,pj->pi", across, points)
    return found


def _dot(a: Array, b: Array) -> Array:
    found: Array = np.einsum("...i,...i->...", a, b)
    return found


def norm(a: Array) -> Array:
    """Lengths (...) of vectors (..., 3)."""
    found: Array = np.sqrt(_dot(a, a))
    return found


def unit(a: Array) -> Array:
    """Vectors (..., 3) of length 1; zero where they are."""
    found: Array = a / np.maximum(norm(a), np.finfo(float).tiny)[..., None]
    return found


def _angle(a: Array, b: Array) -> Array:
    """From one vector to the other (P,), from -pi to pi."""
    return np.arctan2(_cross(a, b), _dot(a, b))


def _cross(a: Array, b: Array) -> Array:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def _reach(p: Array, radius: Radius) -> Array:
    """The angle between a point and where a line from it touches the circle, as seen from the middle (P,)."""
    return np.arccos(np.clip(radius / np.maximum(norm(p), TINY), 0.0, 1.0))


def _turned(p: Array, angle: Array, radius: Radius) -> Array:
    """On the circle, in the direction of a point turned by an angle (P, 2)."""
    direction = np.arctan2(p[:, 1], p[:, 0]) + angle
    found: Array = np.expand_dims(radius, -1) * np.stack((np.cos(direction), np.sin(direction)), axis=1)
    return found
