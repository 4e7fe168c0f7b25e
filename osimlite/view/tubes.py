"""Lines as tubes: muscles with fibers between tendons, springs and sticks; the same rings in pictures and in the page.

The functions above :func:`build_tube` are written in the restricted Python of kernels, since the page
of the viewer runs them as JavaScript.
"""

from __future__ import annotations

from functools import cache
from itertools import count
from math import pi, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from osimlite.io.meshes.surface import Indices, Surface
from osimlite.mechanics.kernels.layout import Record
from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    add_scaled,
    cross,
    dot,
    minus,
    norm,
    plus,
    store_vector,
    times,
    vector,
)
from osimlite.mechanics.multibody.spatial import Array
from osimlite.view.scene import Color, Line

TENDON: Color = (0.89, 0.784, 0.549)
"""Colour of tendons."""

FIBER_STEPS = 14
"""Number of steps in which the radius of fibers changes from one tendon to the other."""

LONGEST_TENDON = 0.4
"""Largest part of a path that is drawn as tendon at each end, so that fibers are always visible."""

BULGE_EXPONENT = 0.7
"""Exponent of the sine that gives the radius of fibers along them; 1 would be a spindle."""

END_RINGS = 3
"""Number of rings that round off an end."""

MORE_RINGS = FIBER_STEPS + 3 + 2 * END_RINGS
"""Number of rings that a tube may have besides those at the corners of its line."""

ROUND_CORNERS = 10
"""Number of corners of a ring in pictures."""


class RING(metaclass=Record):
    """Ring of a tube."""

    _at = count()
    CENTER = next(_at)
    """Middle in ground (3), m."""
    ALONG = CENTER + 3
    """Unit vector along the tube (3)."""
    ACROSS = ALONG + 3
    """Unit vector towards the first corner of the ring (3)."""
    RADIUS = ACROSS + 3
    """Radius, m."""
    FIBERS = RADIUS + 1
    """1 for a ring of muscle fibers or of a line without tendons, 0 for a ring of a tendon."""
    SIZE = FIBERS + 1
    """Number of numbers."""


def lay_tube(
    corners: Floats,
    corner_count: int,
    thin: float,
    thick: float,
    tendon: float,
    growth: float,
    rings: Floats,
) -> int:
    """Write the rings of a tube along a line.

    Half of the tendon is at each end, at most `LONGEST_TENDON` of the length. The radius of the
    fibers between them grows from `thin` to `thick` in the middle.

    Args:
        corners: corners of the line in ground (3 each), m.
        corner_count: number of corners; without any there are no rings.
        thin: radius of the line and of tendons, m.
        thick: radius of the fibers in their middle, m; 0 for a line without fibers.
        tendon: tendon slack length, m.
        growth: factor of all radii.
        rings: filled with `RING` records, at most `corner_count` + `MORE_RINGS`.

    Returns:
        Number of rings that were written.
    """
    if corner_count == 0:
        return 0
    end = _write_rings(corners, corner_count, thin, thick, tendon, growth, rings)
    _direct_rings(rings, end)
    _round_off(rings, END_RINGS, END_RINGS - 1, -1)
    _round_off(rings, end - 1, end, 1)
    _turn_rings(rings, end + END_RINGS)
    return end + END_RINGS


def _write_rings(
    corners: Floats,
    corner_count: int,
    thin: float,
    thick: float,
    tendon: float,
    growth: float,
    rings: Floats,
) -> int:
    """Write centres, radii and parts of rings except the ends.

    Returns:
        Index after the last ring.
    """
    length = 0.0
    for k in range(1, corner_count):
        length += norm(minus(vector(corners, 3 * k), vector(corners, 3 * k - 3)))
    ring = END_RINGS
    if not (thick > 0.0 and length > 0.0):
        for k in range(corner_count):
            ring = _add_ring(rings, ring, vector(corners, 3 * k), growth * thin, 1.0)
        return ring
    start = min(0.5 * tendon, LONGEST_TENDON * length)
    stop = length - start
    # Ring 0 ends the first tendon, ring FIBER_STEPS + 2 begins the second; the others are of fibers.
    step = 0 if start > 0.0 else 1
    last_step = FIBER_STEPS + 2 if start > 0.0 else FIBER_STEPS + 1
    ring = _add_ring(rings, ring, vector(corners, 0), growth * thin, 0.0) if start > 0.0 else ring
    before = 0.0
    for k in range(1, corner_count):
        here = vector(corners, 3 * k - 3)
        there = vector(corners, 3 * k)
        segment = norm(minus(there, here))
        after = before + segment
        is_last = k == corner_count - 1
        while step <= last_step:
            distance = start + (stop - start) * min(max(step - 1, 0), FIBER_STEPS) / FIBER_STEPS
            # Rounding may put the last ring behind the last corner.
            if distance > after and not is_last:
                break
            fraction = min((distance - before) / segment, 1.0) if segment > 0.0 else 0.0
            is_fiber = 0 < step < FIBER_STEPS + 2
            radius = measure_radius(distance, start, stop, thin, thick) if is_fiber else thin
            center = add_scaled(here, fraction, minus(there, here))
            ring = _add_ring(rings, ring, center, growth * radius, 1.0 if is_fiber else 0.0)
            step += 1
        if start < after < stop:
            radius = measure_radius(after, start, stop, thin, thick)
            ring = _add_ring(rings, ring, there, growth * radius, 1.0)
        elif after < start or after > stop:
            ring = _add_ring(rings, ring, there, growth * thin, 0.0)
        before = after
    return ring


def measure_radius(distance: float, start: float, stop: float, thin: float, thick: float) -> float:
    """Return the radius of fibers at a distance along the path, m.

    Args:
        distance: distance from the first corner of the path, m.
        start: distance at which the fibers begin, m.
        stop: distance at which they end, m.
        thin: radius of the tendons, m.
        thick: radius of the fibers in their middle, m.
    """
    bulge = max(0.0, sin(pi * (distance - start) / (stop - start))) if stop > start else 1.0
    return max(thin, thin + (thick - thin) * bulge**BULGE_EXPONENT)


def _add_ring(rings: Floats, ring: int, center: Vector, radius: float, fibers: float) -> int:
    """Write centre, radius and part of a ring.

    Returns:
        Index of the next ring.
    """
    offset = ring * RING.SIZE
    store_vector(rings, offset + RING.CENTER, center)
    rings[offset + RING.RADIUS] = radius
    rings[offset + RING.FIBERS] = fibers
    return ring + 1


def _direct_rings(rings: Floats, end: int) -> None:
    """Write the directions of the rings: between those of the segments before and behind."""
    along = 0.0, 1.0, 0.0
    for ring in range(END_RINGS, end):
        offset = ring * RING.SIZE
        center = vector(rings, offset + RING.CENTER)
        total = ZERO
        if ring + 1 < end:
            total = plus(total, _unit_or_zero(minus(vector(rings, offset + RING.SIZE), center)))
        if ring > END_RINGS:
            total = plus(total, _unit_or_zero(minus(center, vector(rings, offset - RING.SIZE))))
        # A ring between two opposite segments, or at a point, keeps the direction before it.
        along = times(1.0 / norm(total), total) if norm(total) > 1e-6 else along
        store_vector(rings, offset + RING.ALONG, along)


def _round_off(rings: Floats, edge: int, first: int, sign: int) -> None:
    """Write the rings that close an end: from the edge outwards, smaller and smaller."""
    offset = edge * RING.SIZE
    center, along = vector(rings, offset + RING.CENTER), vector(rings, offset + RING.ALONG)
    radius = rings[offset + RING.RADIUS]
    ring = first
    # Distance outwards and radius, as parts of the radius of the edge.
    for shape in ((0.3, 0.95), (0.7, 0.7), (1.0, 0.0)):
        distance, width = shape
        ring_center = add_scaled(center, sign * distance * radius, along)
        _add_ring(rings, ring, ring_center, width * radius, rings[offset + RING.FIBERS])
        store_vector(rings, ring * RING.SIZE + RING.ALONG, along)
        ring += sign


def _turn_rings(rings: Floats, end: int) -> None:
    """Write the directions towards the first corners of rings, so that the tube is twisted least."""
    across = ZERO
    for ring in range(end):
        offset = ring * RING.SIZE
        along = vector(rings, offset + RING.ALONG)
        across = add_scaled(across, -dot(across, along), along)
        if norm(across) < 1e-6:
            across = _find_perpendicular(along)
        across = times(1.0 / norm(across), across)
        store_vector(rings, offset + RING.ACROSS, across)


def _unit_or_zero(a: Vector) -> Vector:
    """Return the unit vector in the direction of a vector, or zero for one without direction."""
    length = norm(a)
    return times(1.0 / length, a) if length > 1e-8 else ZERO


def _find_perpendicular(a: Vector) -> Vector:
    """Return a vector perpendicular to `a` and to the axis of its smallest component."""
    x, y, z = a
    least = min(abs(x), abs(y), abs(z))
    axis = 0 if abs(x) == least else (1 if abs(y) == least else 2)
    other = 1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0
    return cross(other, a)


def build_tube(line: Line, corners: Array) -> tuple[Surface, NDArray[np.bool_]]:
    """Build the surface of a line of a scene.

    Args:
        line: line of a scene, with radius, fibers and tendon.
        corners: corners of the line in ground (k, 3), m; at least one.

    Returns:
        The closed surface in ground, and which of its points (n,) belong to tendons.
    """
    # Lists: kernels in Python read single numbers, which arrays give slowly.
    numbers: Any = [0.0] * ((len(corners) + MORE_RINGS) * RING.SIZE)
    coordinates: Any = corners.ravel().tolist()
    ring_count = lay_tube(
        coordinates, len(corners), line.radius, line.fibers, line.tendon, 1.0, numbers
    )
    rings = np.array(numbers).reshape(-1, RING.SIZE)[:ring_count]
    center, along, across = (
        rings[:, offset : offset + 3] for offset in (RING.CENTER, RING.ALONG, RING.ACROSS)
    )
    angles = 2.0 * np.pi * np.arange(ROUND_CORNERS) / ROUND_CORNERS
    outward = (
        np.cos(angles)[:, None] * across[:, None]
        + np.sin(angles)[:, None] * np.cross(along, across)[:, None]
    )
    points = center[:, None] + rings[:, RING.RADIUS, None, None] * outward
    surface = Surface(
        points.reshape(-1, 3), _list_triangles(ring_count), outward.reshape(-1, 3), is_closed=True
    )
    return surface, np.repeat(rings[:, RING.FIBERS] == 0.0, ROUND_CORNERS)


@cache
def _list_triangles(ring_count: int) -> Indices:
    """Return the triangles (t, 3) between neighbouring rings."""
    ring, corner = np.divmod(np.arange((ring_count - 1) * ROUND_CORNERS), ROUND_CORNERS)
    here = ring * ROUND_CORNERS + corner
    next_corner = ring * ROUND_CORNERS + (corner + 1) % ROUND_CORNERS
    triangles: Indices = np.stack(
        (
            here,
            next_corner,
            here + ROUND_CORNERS,
            next_corner,
            next_corner + ROUND_CORNERS,
            here + ROUND_CORNERS,
        ),
        axis=1,
    ).reshape(-1, 3)
    return triangles
