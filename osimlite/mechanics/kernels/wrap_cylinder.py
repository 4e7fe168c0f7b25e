"""Wrapping of a path around a cylinder about z.

Both ends are joined to the surface by tangents of its circle, seen along the axis. The heights of
the tangent points come from a plane through both ends and an apex on the surface; between them the
path is a helix. As in OpenSim it is therefore the shortest path only at constant height.

Source: OpenSim 4.6's WrapCylinder; for the choice of the tangents also B. A. Garner and M. G.
Pandy, The obstacle-set method for representing muscle paths in musculoskeletal models, Computer
Methods in Biomechanics and Biomedical Engineering 3, 2000.
"""

from __future__ import annotations

from math import atan2, cos, inf, pi, radians, sin, sqrt, tan

from osimlite.mechanics.kernels.layout import ITEM
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.wrapping import (
    WRAP_SURFACE,
    WRAP_WORK,
    WRAPPING,
    decide_wrapping,
    find_tangents,
    is_on_side,
    nearest_pair,
)
from osimlite.mechanics.laws.vectors import (
    EPSILON,
    Vector,
    add_scaled,
    cross,
    dot,
    minus,
    plus,
    store_vector,
    unit,
    vector,
)

PARALLEL_TOLERANCE = 2e-13
"""Squared sine of the angle between two lines up to which OpenSim treats them as parallel."""
MIN_AXIAL_COMPONENT = 5e-7
"""Smallest axial component of a plane's normal with which an edge intersects the plane."""
MAX_EDGE_DISTANCE_M = 10.0002
"""Largest distance along the edge to that intersection (m)."""
SEGMENT_LENGTH_M = 0.002
"""Length of the segments that OpenSim draws the helix with (m)."""
MAX_BEND_TANGENT = tan(radians(0.1))
"""Tangent of the largest angle between a line and the helix where they meet."""
MAX_ROUNDS = 100
"""Largest number of rounds in the search for such heights."""


def wrap_cylinder(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Bend a segment around a WrapCylinder, see :mod:`osimlite.mechanics.kernels.wrapping`.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the record of the surface holds the ends of the segment and is filled.
        y: state.
        f: rates of the coordinates.
        item: offset of the surface in the model.

    Returns:
        WRAPPING.INSIDE, WRAPPING.NONE, WRAPPING.WRAPPED or WRAPPING.MANDATORY.
    """
    p, e = at(reals, model[item + ITEM.NUMBERS]), at(data, model[item + ITEM.RECORD])
    first, second = vector(e, WRAP_WORK.FIRST_END), vector(e, WRAP_WORK.SECOND_END)
    return bend_around_cylinder(
        first,
        second,
        p[WRAP_SURFACE.SIZES],
        p[WRAP_SURFACE.SIZES + 1],
        int(p[WRAP_SURFACE.AXIS]),
        p[WRAP_SURFACE.SIDE],
        p[WRAP_SURFACE.ALONE] == 1.0,
        e,
    )


def bend_around_cylinder(
    first: Vector,
    second: Vector,
    radius: float,
    length: float,
    axis: int,
    side: float,
    is_single: bool,
    e: Floats,
) -> int:
    """Bend a segment around a cylinder.

    Args:
        first: first end of the segment in the frame of the cylinder (m).
        second: second end of the segment in this frame (m).
        radius: radius of the cylinder (m).
        length: length of the cylinder (m).
        axis: axis of the quadrant: 0 for x, 1 for y, 2 for z.
        side: sign of the quadrant along this axis, 0.0 for the complete surface.
        is_single: whether the path has no other PathWrap.
        e: record of the law; filled with tangent points and length.

    Returns:
        WRAPPING.INSIDE, WRAPPING.NONE, WRAPPING.WRAPPED or WRAPPING.MANDATORY.
    """
    px, py, pz = first
    qx, qy, qz = second
    if px * px + py * py < radius * radius or qx * qx + qy * qy < radius * radius:
        return WRAPPING.INSIDE
    closest, crosses = closest_to_axis(first, second, radius)
    if side != 0.0:
        active = is_on_side(first, axis, side), is_on_side(second, axis, side)
        code = decide_wrapping(*active, is_on_side(closest, axis, side), crosses)
    else:
        code = WRAPPING.MANDATORY if crosses else WRAPPING.NONE
    if code == WRAPPING.NONE:
        return WRAPPING.NONE

    # The tangents are found in the plane across the axis; heights follow later.
    flat_first, flat_second = set_height(first, 0.0), set_height(second, 0.0)
    a1, b1 = find_tangents(flat_first, radius, (0.0, 0.0, 1.0))
    a2, b2 = find_tangents(flat_second, radius, (0.0, 0.0, 1.0))
    if side == 0.0:
        first_tangent, second_tangent = nearest_pair(a1, b1, a2, b2)
        on_far_side = is_long = False
    else:
        # One path around the cylinder is from a1 to b2, the other from b1 to a2.
        is_wide = dot(a1, b2) < dot(b1, a2)
        from_a = starts_at_a(
            set_height(a1, pz),
            set_height(b1, pz),
            set_height(a2, qz),
            set_height(b2, qz),
            is_wide,
            axis,
            side,
        )
        first_tangent, second_tangent = (a1, b2) if from_a else (b1, a2)
        on_far_side = from_a == is_wide
        is_long = (
            dot(
                plus(first_tangent, second_tangent),
                plus(minus(first_tangent, flat_first), minus(second_tangent, flat_second)),
            )
            < 0.0
        )

    # The plane through both ends and an apex on the surface gives the heights of the tangent
    # points.
    apex = apex_between(first, second, radius, on_far_side)
    normal = unit(cross(minus(first, apex), minus(second, apex)))
    z1 = edge_height(first_tangent, pz, first, normal)
    z2 = edge_height(second_tangent, qz, first, normal)
    if abs(qz) < EPSILON:
        # OpenSim uses the foot of the second end as a direction, which is undefined at the origin:
        # all heights then count as that of the first end.
        z1 = pz
        z2 = z2 if pz != qz else qz
    else:
        # A height that is further from the other end than the own end is replaced by that of the
        # own end.
        z1 = z1 if abs(z1 - qz) < abs(pz - qz) else pz
        z2 = z2 if abs(z2 - pz) < abs(qz - pz) else qz
    # Both tangent points beyond the ends of the cylinder: the path misses it.
    if abs(z1) > 0.5 * length and abs(z2) > 0.5 * length:
        return WRAPPING.NONE
    x1, y1, _ = first_tangent
    x2, y2, _ = second_tangent
    angle = atan2(x1 * y2 - y1 * x2, x1 * x2 + y1 * y2)
    # `turn` has a sign for drawing; the length uses the angle of the arc that is taken.
    turn = angle
    if is_long:
        angle = 2.0 * pi - angle
        turn = -angle
    # OpenSim smooths the heights only if a path has several PathWraps.
    if not is_single:
        z1, z2 = smooth_heights(first, second, (x1, y1, z1), (x2, y2, z2), radius * angle, turn)
    store_vector(e, WRAP_WORK.FIRST_TANGENT, (x1, y1, z1))
    store_vector(e, WRAP_WORK.SECOND_TANGENT, (x2, y2, z2))
    e[WRAP_WORK.SURFACE_LENGTH], e[WRAP_WORK.CURVE] = helix_length(radius * angle, z2 - z1), turn
    return code


def closest_to_axis(first: Vector, second: Vector, radius: float) -> tuple[Vector, bool]:
    """Return the point of a line that is closest to the axis.

    Args:
        first: first end of the line.
        second: second end of the line.
        radius: radius of the cylinder (m).

    Returns:
        The point, and whether it is within the radius and between the ends.
    """
    x, y, _ = first
    dx, dy, dz = chord = minus(second, first)
    across = dx * dx + dy * dy
    # OpenSim treats a line along the axis as one that does not cross.
    if across <= PARALLEL_TOLERANCE * (across + dz * dz):
        return (0.0, 0.0, 0.0), False
    fraction = -(x * dx + y * dy) / across
    x, y, _ = closest = add_scaled(first, fraction, chord)
    return closest, x * x + y * y < radius * radius and 0.0 < fraction < 1.0


def set_height(point: Vector, height: float) -> Vector:
    """Return a point moved to another height.

    Args:
        point: point in the frame of the cylinder (m).
        height: new z component (m).
    """
    x, y, _ = point
    return x, y, height


def starts_at_a(
    a1: Vector, b1: Vector, a2: Vector, b2: Vector, is_wide: bool, axis: int, side: float
) -> bool:
    """Return whether the path from a1 to b2, and not that from b1 to a2, is on the active side.

    If no tangent point decides, the wider path is chosen.

    Args:
        a1: first candidate of the first end.
        b1: second candidate of the first end.
        a2: first candidate of the second end.
        b2: second candidate of the second end.
        is_wide: whether the path from a1 to b2 is the wider one.
        axis: axis of the quadrant: 0 for x, 1 for y, 2 for z.
        side: sign of the quadrant along this axis.
    """
    a_active = is_on_side(a1, axis, side)
    if a_active != is_on_side(b1, axis, side):
        return a_active
    return not is_on_side(a2, axis, side) and (a_active or is_on_side(b2, axis, side) or is_wide)


def apex_between(first: Vector, second: Vector, radius: float, on_far_side: bool) -> Vector:
    """Return the point of the cylinder over which the path bends.

    It is at the height of the point that divides the segment in the ratio of the distances of the ends
    from the axis, and in the direction in which the plane through the ends and the axis at that height
    cuts the cylinder; on the far side of the axis if `on_far_side`.

    Args:
        first: first end of the segment (m).
        second: second end of the segment (m).
        radius: radius of the cylinder (m).
        on_far_side: whether the apex is on the far side of the axis.
    """
    px, py, pz = first
    qx, qy, qz = second
    d1, d2 = sqrt(px * px + py * py), sqrt(qx * qx + qy * qy)
    x, y, z = add_scaled(first, d1 / (d1 + d2), minus(second, first))
    # Direction of the intersection of the plane with the cross section, on the side of the segment
    # or opposite.
    nx, ny, _ = unit(cross((px, py, pz - z), (qx, qy, qz - z)))
    ux, uy, _ = unit((-ny, nx, 0.0))
    if (x * ux + y * uy > 0.0) == on_far_side:
        ux, uy = -ux, -uy
    return radius * ux, radius * uy, z


def edge_height(point: Vector, end_height: float, end: Vector, normal: Vector) -> float:
    """Return the height at which the edge of a tangent point intersects a plane (m).

    It is `end_height` if they do not intersect nearby.

    Args:
        point: point of the edge, which is parallel to the axis.
        end_height: height of the end that the point belongs to (m).
        end: point of the plane.
        normal: normal of the plane, the zero vector if there is no plane.
    """
    nx, ny, nz = normal
    # OpenSim treats an edge nearly parallel to the plane as one that does not meet it.
    if abs(nz) < MIN_AXIAL_COMPONENT:
        return end_height
    dx, dy, _ = minus(end, point)
    _, _, height = end
    z = height + (dx * nx + dy * ny) / nz
    return z if abs(z - end_height) <= MAX_EDGE_DISTANCE_M else end_height


def helix_length(arc: float, rise: float) -> float:
    """Return the length of a helix (m).

    Args:
        arc: length of the arc, seen along the axis (m).
        rise: difference of the heights (m).
    """
    return sqrt(arc * arc + rise * rise)


def smooth_heights(
    first: Vector,
    second: Vector,
    first_tangent: Vector,
    second_tangent: Vector,
    arc: float,
    turn: float,
) -> tuple[float, float]:
    """Return the heights of the tangent points at which the lines continue as the helix.

    A small bend may remain.

    OpenSim compares with the next point that it would draw, so that the result jumps where the number
    of these points changes. It does this only if a path has several PathWraps, and without a guarantee
    of convergence.

    Args:
        first: first end of the segment (m).
        second: second end of the segment (m).
        first_tangent: tangent point of the first end (m).
        second_tangent: tangent point of the second end (m).
        arc: length of the arc, seen along the axis (m).
        turn: angle of the arc (rad).

    Returns:
        The heights of the first and second tangent point (m).
    """
    x1, y1, z1 = first_tangent
    x2, y2, z2 = second_tangent
    pieces, fraction = 0, 0.0
    leg1 = leg2 = (0.0, 0.0, 0.0, 0.0)
    for _ in range(MAX_ROUNDS):
        rise = z2 - z1
        length = helix_length(arc, rise) / SEGMENT_LENGTH_M
        # Helices of less than two of OpenSim's segments, and undefined ones, stay as they are.
        if not 2.0 <= length < inf:
            break
        count = int(length)
        # Seen along the axis nothing changes while the number of segments stays the same.
        if count != pieces:
            pieces = count
            fraction = 1.0 / count
            c, s = cos(fraction * turn), sin(fraction * turn)
            leg1 = edge_constants(first, first_tangent, (c * x1 - s * y1, s * x1 + c * y1, 0.0))
            leg2 = edge_constants(second, second_tangent, (c * x2 + s * y2, c * y2 - s * x2, 0.0))
        _, _, height1 = first
        _, _, height2 = second
        w1 = next_height(leg1, height1, z1, z1 + fraction * rise)
        # The helix has moved with its first point.
        w2 = next_height(leg2, height2, z2, w1 + (1.0 - fraction) * rise)
        if w1 == z1 and w2 == z2:
            break
        z1, z2 = w1, w2
    return z1, z2


def edge_constants(
    end: Vector, tangent: Vector, next_point: Vector
) -> tuple[float, float, float, float]:
    """Compute the constants of the motion of a tangent point along its edge.

    Args:
        end: end of the segment.
        tangent: tangent point.
        next_point: next point of the helix.

    Returns:
        Seen along the axis, the lengths of the line and of the first segment of the helix; then the
        factors of the heights of the next point and of the end in the new height: 3/2 of the way to
        where the edge is closest to their line.
    """
    lx, ly, _ = minus(tangent, end)
    nx, ny, _ = minus(next_point, tangent)
    dx, dy, _ = minus(next_point, end)
    across = dx * dx + dy * dy
    fraction = (lx * dx + ly * dy) / across if across > 0.0 else 0.0
    return sqrt(lx * lx + ly * ly), sqrt(nx * nx + ny * ny), 1.5 * fraction, 1.5 * (1.0 - fraction)


def next_height(
    leg: tuple[float, float, float, float], end: float, tangent: float, next_point: float
) -> float:
    """Return the next height of a tangent point, unchanged if the path hardly bends there.

    Args:
        leg: constants of the tangent point.
        end: height of the end (m).
        tangent: height of the tangent point (m).
        next_point: height of the next point of the helix (m).
    """
    line, piece, with_next, with_end = leg
    line_rise, piece_rise = tangent - end, next_point - tangent
    # Tangent of the angle between line and helix, without a division.
    if abs(line * piece_rise - line_rise * piece) <= MAX_BEND_TANGENT * (
        line_rise * piece_rise + line * piece
    ):
        return tangent
    # OpenSim over-relaxes by the factor 3/2.
    return with_next * next_point + (with_end * end - 0.5 * tangent)
