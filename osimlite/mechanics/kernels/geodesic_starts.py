"""Starts of geodesics: where a straight segment of a path begins to bend around a surface.

They are exact on cylinders and spheres, and approximate on other surfaces. A segment bends around a
surface that it would pass through. The quadrant of the surface determines the side; without a
quadrant the shorter way is chosen:

- A cylinder with a side x or y: the path turns so that it lies on the active side, by any angle,
  also where it misses the cylinder but would pass behind it, whenever OpenSim bends it.
- A sphere or an ellipsoid with a side: a line through it is bent to where it is least deep in the
  surface; if that is not on the active side, to the opposite end of the same plane, if this is
  nearer to the mirror image.
- A torus: the path passes through the hole, and never through the plane outside of the ring.

Of several segments around one cylinder or torus, only the one that comes nearest to its axis or
ring needs to do so. The others bend where they pass through it, the shorter way.

All points are in the frame of the surface, in m. Neighbours of a segment that are inside count as
on the surface.
"""

from __future__ import annotations

from math import atan2, cos, inf, pi, sin, sqrt

from osimlite.mechanics.kernels.cable_surfaces import SURFACE, SURFACE_TYPE, surface_value
from osimlite.mechanics.kernels.layout import Record
from osimlite.mechanics.kernels.pointers import Floats, at
from osimlite.mechanics.kernels.segment_depths import (
    MIN_DENOMINATOR,
    nearest_to_ring,
    outward_direction,
)
from osimlite.mechanics.kernels.wrap_cylinder import closest_to_axis
from osimlite.mechanics.kernels.wrapping import WRAPPING, decide_wrapping, is_on_side
from osimlite.mechanics.laws.vectors import (
    Vector,
    add_scaled,
    component,
    cross,
    dot,
    minus,
    multiply_elementwise,
    norm,
    plus,
    replace_component,
    store_vector,
    times,
    unit,
    vector,
)


class WRAP_NUMBERS(metaclass=Record):
    """Numbers of a wrap."""

    AXIS = 0
    """Axis of its active side."""
    SIDE = 1
    """Sign of its active side, 0.0 for the complete surface."""
    HALF_LENGTH = 2
    """Half the length of a cylinder (m)."""
    SURFACE = 3
    """Numbers of the surface, see `cable_surfaces`."""


Start = tuple[float, Vector, Vector, float]
"""Start of a geodesic.

It consists of the angle by which the path turns on the surface, 0 or less if it does not touch; the
point where it meets the surface; its direction there; and its length on the surface (m).
"""


class BENDING(metaclass=Record):
    """Ways in which a surface bends a segment."""

    NOT = 0.0
    """A surface does not bend the segment."""
    ACTIVE_SIDE = 1.0
    """A surface bends a segment on its active side."""
    ANY_SIDE = 2.0
    """A surface bends a segment on any side where the segment passes through it."""
    STRING = 3.0
    """An ellipsoid bends a segment where a tightened string comes to lie."""


MIN_AXIS_COSINE = 0.5
"""Cosine with the least deep direction below which the given axis determines the direction."""
STRING_COSINE = 0.7
"""Cosine between both ends of a path below which a string is tightened over an ellipsoid."""
STRING_SEGMENTS = 16
"""Number of segments of the string."""
STRING_SWEEPS = 8
"""Number of sweeps at each resolution of the string."""


def start_on_surface(
    p: Floats, first: Vector, second: Vector, bending: float, about: Vector, work: Floats
) -> Start:
    """Return the start at which a segment between two points begins to bend around a surface.

    Args:
        p: numbers of the wrap.
        first: start of the segment.
        second: end of the segment.
        bending: ACTIVE_SIDE, ANY_SIDE or STRING of `BENDING`.
        about: axis about which the segment turns around a surface without a side, by the right-hand
            rule; zeros for either direction.
        work: workspace of a string.

    Returns:
        Angle by which the path turns on the surface (rad), 0 or less if it does not touch; point
        where it meets the surface (m); direction of the path there; and its length on the surface
        (m).
    """
    axis = int(p[WRAP_NUMBERS.AXIS])
    side = p[WRAP_NUMBERS.SIDE]
    surface = at(p, WRAP_NUMBERS.SURFACE)
    if surface[SURFACE.KIND] == SURFACE_TYPE.TORUS:
        return start_on_torus(
            surface[SURFACE.RADIUS], surface[SURFACE.TUBE], first, second, axis, side, bending
        )
    if surface[SURFACE.KIND] == SURFACE_TYPE.CYLINDER:
        has_side = bending != BENDING.ANY_SIDE and axis < 2
        side_out = replace_component((0.0, 0.0, 0.0), axis, side if has_side else 0.0)
        return start_on_cylinder(
            surface[SURFACE.RADIUS],
            p[WRAP_NUMBERS.HALF_LENGTH],
            first,
            second,
            side_out,
            component(about, 2),
        )
    return start_on_ellipsoid(surface, first, second, axis, side, bending, about, work)


def start_on_cylinder(
    radius: float, half_length: float, first: Vector, second: Vector, side_out: Vector, about: float
) -> Start:
    """Return the start on a cylinder about z, along a straight line on the unrolled cylinder.

    As in OpenSim a path that would meet and leave the cylinder beyond its ends does not touch.

    Args:
        radius: radius of the cylinder (m).
        half_length: half the length of the cylinder (m).
        first: start of the segment.
        second: end of the segment.
        side_out: direction of the active side, zeros for the complete surface.
        about: sign of the turn about z, 0.0 for either.
    """
    px, py, pz = first
    qx, qy, qz = second
    ux, uy, _ = side_out
    closest, crosses = closest_to_axis(first, second, radius)
    is_open = ux == 0.0 and uy == 0.0
    active = dot(side_out, first) >= 0.0, dot(side_out, second) >= 0.0
    if (
        # With a prescribed direction the segment bends in any case; otherwise OpenSim's rules
        # decide.
        about == 0.0
        and (
            WRAPPING.NONE
            if is_open and not crosses
            else decide_wrapping(*active, dot(side_out, closest) >= 0.0, crosses)
        )
        == WRAPPING.NONE
    ):
        return 0.0, first, second, 0.0
    # Angles are measured from the middle of the active side, or from the first end.
    if is_open:
        ux, uy = px, py
    first_angle = atan2(ux * py - uy * px, ux * px + uy * py)
    second_angle = atan2(ux * qy - uy * qx, ux * qx + uy * qy)
    far1, far2 = sqrt(px * px + py * py), sqrt(qx * qx + qy * qy)
    # Lengths of the tangents, 0 for ends inside, which count as on the surface.
    line1 = sqrt(max(far1 * far1 - radius * radius, 0.0))
    line2 = sqrt(max(far2 * far2 - radius * radius, 0.0))
    # Angles between the ends and their tangent points, seen from the axis.
    first_tangent_angle, second_tangent_angle = atan2(line1, radius), atan2(line2, radius)
    sweep = (second_angle - first_angle) % (2.0 * pi)
    rotation_sense = (
        1.0
        if (
            sweep <= pi
            if is_open
            else is_left_turn(
                first_angle, first_tangent_angle, second_angle, second_tangent_angle, sweep
            )
        )
        else -1.0
    )
    if about != 0.0:
        rotation_sense = 1.0 if about > 0.0 else -1.0
    turn = (
        (sweep if rotation_sense > 0.0 else 2.0 * pi - sweep)
        - first_tangent_angle
        - second_tangent_angle
    )
    size = sqrt(ux * ux + uy * uy)
    c = cos(first_angle + rotation_sense * first_tangent_angle) / size
    s = sin(first_angle + rotation_sense * first_tangent_angle) / size
    nx = c * ux - s * uy
    ny = c * uy + s * ux
    # On the unrolled cylinder the path is a straight line of constant slope.
    slope = (qz - pz) / max(line1 + radius * max(turn, 0.0) + line2, MIN_DENOMINATOR)
    z = pz + slope * line1
    # OpenSim ignores a path that meets and leaves beyond the ends of the cylinder.
    if abs(z) > half_length and abs(qz - slope * line2) > half_length:
        turn = 0.0
    return (
        turn,
        (radius * nx, radius * ny, z),
        (-rotation_sense * ny, rotation_sense * nx, slope),
        radius * turn * sqrt(1.0 + slope * slope),
    )


def is_left_turn(
    first_angle: float,
    first_tangent_angle: float,
    second_angle: float,
    second_tangent_angle: float,
    sweep: float,
) -> bool:
    """Return whether a path turns to the left around a cylinder.

    The path is to stay on the active side, as in OpenSim.

    It follows the tangent of the first end that meets the active side. If both or none do, that of the
    second end decides; if these do not either, the shorter way, but the longer one from behind to
    behind.

    Args:
        first_angle: angle of the first end from the middle of the active side (rad).
        first_tangent_angle: angle from the first end to its tangents (rad).
        second_angle: angle of the second end (rad).
        second_tangent_angle: angle from the second end to its tangents (rad).
        sweep: angle from end to end to the left, not negative (rad).
    """
    left1 = cos(first_angle + first_tangent_angle) >= 0.0
    right1 = cos(first_angle - first_tangent_angle) >= 0.0
    left2 = cos(second_angle - second_tangent_angle) >= 0.0
    right2 = cos(second_angle + second_tangent_angle) >= 0.0
    if left1 != right1:
        return left1
    if left2 != right2:
        return left2
    return (sweep <= pi) == (left1 or left2)


def start_on_ellipsoid(
    p: Floats,
    first: Vector,
    second: Vector,
    axis: int,
    side: float,
    bending: float,
    about: Vector,
    work: Floats,
) -> Start:
    """Return the start on a sphere or an ellipsoid, along a circle on the scaled unit sphere.

    The circle is in the plane of the ends and the direction in which the line is least deep.

    Args:
        p: numbers of the surface.
        first: start of the segment.
        second: end of the segment.
        axis: axis of the active side.
        side: sign of the active side, 0.0 for the complete surface.
        bending: ACTIVE_SIDE, ANY_SIDE or STRING of `BENDING`.
        about: axis about which the segment turns, zeros for either direction.
        work: workspace of a string; filled with beads.
    """
    weights = vector(p, SURFACE.WEIGHTS)
    wx, wy, wz = times(1.0 / p[SURFACE.SQUARE], weights)
    scale = sx, sy, sz = sqrt(wx), sqrt(wy), sqrt(wz)
    radii = 1.0 / sx, 1.0 / sy, 1.0 / sz
    scaled_first = multiply_elementwise(scale, first)
    scaled_second = multiply_elementwise(scale, second)
    scaled_chord = minus(scaled_second, scaled_first)
    fraction = min(
        max(
            -dot(scaled_first, scaled_chord)
            / max(dot(scaled_chord, scaled_chord), MIN_DENOMINATOR),
            0.0,
        ),
        1.0,
    )
    middle = add_scaled(scaled_first, fraction, scaled_chord)
    # The line passes outside of the unit sphere.
    if not dot(middle, middle) < 1.0:
        return 0.0, first, scaled_chord, 0.0
    outwards = middle
    # On a sphere the nearest point of the line points out of it; on an ellipsoid the least deep
    # direction must be searched.
    if (
        p[SURFACE.KIND] == SURFACE_TYPE.ELLIPSOID
        or norm(cross(middle, scaled_chord)) < MIN_DENOMINATOR
    ):
        # Of two opposite directions both start at the narrow side.
        outwards = outward_direction(
            radii,
            times(0.0 if norm(about) > 0.0 else 1.0, multiply_elementwise(radii, middle)),
            multiply_elementwise(radii, scaled_chord),
            0.0,
        )
    if norm(about) > 0.0:
        outwards = times(
            -1.0
            if dot(about, cross(outwards, multiply_elementwise(radii, scaled_chord))) < 0.0
            else 1.0,
            outwards,
        )
        # Perpendicular to the least deep direction: another surface may make that the shortest.
        outwards_about = cross(multiply_elementwise(radii, scaled_chord), about)
        if (
            p[SURFACE.KIND] == SURFACE_TYPE.SPHERE
            and dot(unit(outwards_about), unit(outwards)) < MIN_AXIS_COSINE
        ):
            outwards = outwards_about
    if side != 0.0 and not is_on_side(outwards, axis, side):
        # Towards the mirror image, which itself is near no geodesic.
        mirrored = replace_component(outwards, axis, -component(outwards, axis))
        outwards = times(1.0 if dot(mirrored, outwards) >= 0.0 else -1.0, outwards)
    outwards = multiply_elementwise(scale, outwards)
    result = start_on_section(
        radii, scaled_first, scaled_second, cross(outwards, scaled_chord), work
    )
    turn, _, sets_out, _ = result
    # A section that turns far, or that starts on the wrong side, is a poor start.
    is_bent = dot(unit(sets_out), unit(vector(work, 0))) < STRING_COSINE and (
        side == 0.0 or dot(outwards, middle) > 0.0
    )
    if p[SURFACE.KIND] == SURFACE_TYPE.ELLIPSOID and (is_bent or bending == BENDING.STRING):
        result = start_on_string(p, turn, first, second, work)
    return result


def start_on_section(
    radii: Vector, scaled_first: Vector, scaled_second: Vector, across: Vector, work: Floats
) -> Start:
    """Return the start on a plane section of an ellipsoid, and beads along it.

    Args:
        radii: half axes.
        scaled_first: first end, scaled so that the surface is the unit sphere.
        scaled_second: second end, scaled in the same way.
        across: normal of the plane of the section; the path turns to the left about it.
        work: filled with the direction at the end, and the beads.
    """
    # The section of the unit sphere is a circle with this centre and radius.
    normal = unit(across)
    centre = times(dot(normal, scaled_first), normal)
    radius = sqrt(max(1.0 - dot(centre, centre), 0.0))
    a1 = find_tangent(minus(scaled_first, centre), radius, normal, 1.0)
    a2 = find_tangent(minus(scaled_second, centre), radius, normal, -1.0)
    across = cross(normal, a1)
    turn = atan2(dot(across, a2), dot(a1, a2))
    # A small negative angle is rounding of a path that just touches; others are turns by more than
    # half.
    if turn < -1e-6:
        turn += 2.0 * pi
    store_vector(work, 0, multiply_elementwise(radii, cross(normal, a2)))
    length = 0.0
    # Length by the midpoint rule over the angles of the beads.
    for k in range(1, STRING_SEGMENTS):
        angle = turn * (k - 0.5) / (STRING_SEGMENTS - 1)
        c, s = cos(angle), sin(angle)
        length += norm(multiply_elementwise(radii, add_scaled(times(c, across), -s, a1)))
        store_vector(
            work,
            3 * k,
            multiply_elementwise(radii, add_scaled(add_scaled(centre, c, a1), s, across)),
        )
    return (
        turn,
        multiply_elementwise(radii, add_scaled(centre, 1.0, a1)),
        multiply_elementwise(radii, across),
        turn / (STRING_SEGMENTS - 1) * length,
    )


def start_on_string(p: Floats, turn: float, first: Vector, second: Vector, work: Floats) -> Start:
    """Return a start from a string of beads that is tightened over an ellipsoid.

    The resolution of the string rises from 4 to 16 segments.

    A section that turns far may be near no geodesic, or not near the shortest one.

    Args:
        p: numbers of the surface.
        turn: angle by which the section turns (rad).
        first: start of the segment.
        second: end of the segment.
        work: beads of the section; the ends are filled, and the beads moved.
    """
    store_vector(work, 0, first)
    store_vector(work, 3 * STRING_SEGMENTS, second)
    # Start with four segments, so that the string moves far in few sweeps.
    stride = STRING_SEGMENTS // 4
    first_bead, last_bead = STRING_SEGMENTS, 0
    while stride > 0:
        for pull in range(STRING_SWEEPS + 1):
            # The first sweep sets the new beads only.
            for k in range(stride, STRING_SEGMENTS, stride if pull > 0 else 2 * stride):
                # Gauss-Seidel relaxation: each bead moves to the middle of its neighbours, and out
                # of the surface.
                bead = times(
                    0.5, plus(vector(work, 3 * (k - stride)), vector(work, 3 * (k + stride)))
                )
                if surface_value(p, bead) > 0.0:
                    for _ in range(2):
                        gradient = multiply_elementwise(vector(p, SURFACE.WEIGHTS), bead)
                        bead = add_scaled(
                            bead, 0.5 * surface_value(p, bead) / dot(gradient, gradient), gradient
                        )
                    # In the last sweep note the first and last bead that touch.
                    if stride == 1 and pull == STRING_SWEEPS:
                        first_bead = min(first_bead, k)
                        last_bead = k
                store_vector(work, 3 * k, bead)
        stride //= 2
    if last_bead == 0:
        return 0.0, first, second, 0.0
    begin = vector(work, 3 * first_bead - 3)
    end = vector(work, 3 * first_bead)
    # The first and last segment are half on the surface.
    length = 0.5 * (
        norm(minus(end, begin))
        + norm(minus(vector(work, 3 * last_bead + 3), vector(work, 3 * last_bead)))
    )
    for k in range(first_bead, last_bead):
        length += norm(minus(vector(work, 3 * k + 3), vector(work, 3 * k)))
    return turn, times(0.5, plus(begin, end)), minus(end, begin), length


def find_tangent(point: Vector, radius: float, normal: Vector, rotation_sense: float) -> Vector:
    """Return the tangent point of a circle about the origin, seen from a point of its plane.

    For a point inside, it is the nearest point of the circle.

    Args:
        point: point of the plane of the circle.
        radius: radius of the circle.
        normal: unit normal of the plane.
        rotation_sense: 1.0 for the tangent point to the left about the normal, -1.0 for that to the right.
    """
    distance = max(norm(point), MIN_DENOMINATOR)
    cosine = min(radius / distance, 1.0)
    foot = times(radius * cosine / distance, point)
    return add_scaled(
        foot, rotation_sense * radius * sqrt(1.0 - cosine * cosine) / distance, cross(normal, point)
    )


def start_on_torus(
    ring: float, tube: float, first: Vector, second: Vector, axis: int, side: float, bending: float
) -> Start:
    """Return the start on a torus about z, as on a cylinder at the nearest point of its ring.

    Args:
        ring: radius of the ring (m).
        tube: radius of the tube (m).
        first: start of the segment.
        second: end of the segment.
        axis: axis of the active side.
        side: sign of the active side, 0.0 for the complete surface.
        bending: ACTIVE_SIDE or ANY_SIDE of `BENDING`.
    """
    x, y, _ = ring_point = nearest_to_ring(ring, first, second)
    if side != 0.0 and not is_on_side(ring_point, axis, side):
        return 0.0, first, ring_point, 0.0
    rx, ry, _ = inwards = unit((-x, -y, 0.0))
    centre = times(-ring, inwards)
    tangent = (-ry, rx, 0.0)
    local_first = vector_in_cylinder(minus(first, centre), inwards, tangent)
    local_second = vector_in_cylinder(minus(second, centre), inwards, tangent)
    turn, point, start_direction, length = start_on_cylinder(
        # The active side of the cylinder is the inside of the ring, since a path passes through the
        # hole.
        tube,
        inf,
        local_first,
        local_second,
        (0.0 if bending == BENDING.ANY_SIDE else 1.0, 0.0, 0.0),
        0.0,
    )
    return (
        turn,
        add_scaled(vector_from_cylinder(point, inwards, tangent), 1.0, centre),
        vector_from_cylinder(start_direction, inwards, tangent),
        length,
    )


def vector_in_cylinder(point: Vector, inwards: Vector, tangent: Vector) -> Vector:
    """Return the components of a vector in the cylinder at the ring: inwards, down, and along it.

    Args:
        point: vector in the frame of the torus.
        inwards: unit vector from the ring to the middle of the torus.
        tangent: unit vector along the ring.
    """
    _, _, z = point
    return dot(inwards, point), -z, dot(tangent, point)


def vector_from_cylinder(point: Vector, inwards: Vector, tangent: Vector) -> Vector:
    """Return the vector with these components in the cylinder, in the frame of the torus.

    Args:
        point: components inwards, down and along the ring.
        inwards: unit vector from the ring to the middle of the torus.
        tangent: unit vector along the ring.
    """
    x, y, z = point
    return add_scaled(add_scaled((0.0, 0.0, -y), x, inwards), z, tangent)
