"""Constraints as equations: rows of the matrix G, errors of the positions, and what G u and G udot are to be.

Each law here fills in the equations of one constraint, after the velocities of the links are known. Those between
bodies are made of two kinds of vectors: an axis fixed in a link, and an arm from a point of one link to one of another.
What a unit of a vector's rate takes of the speeds is what a force along it would do to their coordinates.
"""

from __future__ import annotations

from math import sqrt

from osimlite.simulation.kernels.functions import MONOMIALS, several_at, value_at
from osimlite.simulation.kernels.layout import (
    ABOVE,
    CONSTRAINED,
    CONSTRAINT_OWN,
    END_EQUATION,
    END_FREEDOM,
    FIRST_EQUATION,
    FREEDOM_AT,
    FREEDOM_INTS,
    FREEDOMS,
    LINK_AT,
    LINK_INTS,
    LINK_WORK,
    NUMBERS,
    OK,
    ORIGIN,
    SCRATCH,
    TIME,
    WORK_COLUMN,
    WORK_DRIFTS,
    WORK_ERRORS,
    WORK_LINK,
    WORK_RATES,
    WORK_ROWS,
)
from osimlite.simulation.kernels.pointers import Floats, Ints, at
from osimlite.simulation.kernels.points import (
    acceleration,
    angular_acceleration_bias,
    angular_velocity,
    direction,
    station,
    velocity,
)
from osimlite.simulation.kernels.trigonometry import sine_cosine

AXIS, ARM, MEETING = 0, 1, 2
"""Kinds of vectors; that of a meeting is an arm whose rate is how fast its end leaves the point of its first link that
is there."""
PRODUCT, DISTANCE, SLIP = 0, 1, 2
"""Kinds of equations between bodies: the product of two vectors has a certain value; the second has a certain length;
the end of the second is a roller whose point at its start moves along with that, as far as the first tells."""
VECTOR_INTS, EQUATION_INTS, EQUATION_NUMBERS = 3, 7, 13
"""Of a vector its kind and two links (an axis has the first); of an equation its kind and two vectors; and for each
vector six numbers, of an axis or two points in their links, and the wanted value."""
COORDINATE_INTS = 3
"""Of a coordinate: its degree of freedom, the place of the arguments of its ball or -1, and its number among these."""


def prescribe(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, constraint: int) -> int:
    """A coordinate follows a function of time, whose table is all its numbers."""
    i, h = at(s, constraint), at(s, s[CONSTRAINED])
    row, own = i[FIRST_EQUATION], at(i, CONSTRAINT_OWN)
    value, slope, curvature = value_at(at(x, i[NUMBERS]), w[TIME])
    w[h[WORK_ERRORS] + row] = y[own[0]] - value
    w[h[WORK_RATES] + row] = slope
    bias = add_coordinate(s, y, f, own, 1.0, at(w, h[WORK_ROWS] + s[FREEDOMS] * row))
    w[h[WORK_DRIFTS] + row] = curvature - bias
    return OK


def couple(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, constraint: int) -> int:
    """A coordinate is a function of others.

    Its integers are the dependent coordinate, the place of room for the gradient, the count of the others, their
    degrees of freedom, and each coordinate again in full; its numbers the values of coordinates at rest, the dependent
    one first, and the table of the function.
    """
    i, h, p = at(s, constraint), at(s, s[CONSTRAINED]), at(x, s[constraint + NUMBERS])
    row, own = i[FIRST_EQUATION], at(i, CONSTRAINT_OWN)
    size, freedoms = own[COORDINATE_INTS + 1], at(own, COORDINATE_INTS + 2)
    others, gradient, constants = at(freedoms, size), at(w, own[COORDINATE_INTS]), at(p, 1)
    if int(constants[size]) >= MONOMIALS:
        value, _, curvature = several_at(size, freedoms, constants, y, f, gradient)
    else:
        argument = rate = 0.0
        if size > 0:
            argument = y[freedoms[0]] if freedoms[0] >= 0 else constants[0]
            rate = f[freedoms[0]] if freedoms[0] >= 0 else 0.0
        value, slope, bend = value_at(at(constants, size), argument)
        curvature = bend * rate * rate
        gradient[0] = slope
    to = at(w, h[WORK_ROWS] + s[FREEDOMS] * row)
    bias = add_coordinate(s, y, f, own, -1.0, to)
    for k in range(size):
        bias += add_coordinate(s, y, f, at(others, COORDINATE_INTS * k), gradient[k], to)
    w[h[WORK_ERRORS] + row] = value - (y[own[0]] if own[0] >= 0 else p[0])
    w[h[WORK_DRIFTS] + row] = -bias - curvature
    return OK


def add_coordinate(s: Ints, y: Floats, f: Floats, coordinate: Ints, factor: float, row: Floats) -> float:
    """Add a multiple of the rate of a coordinate to a row; returns that of what it changes by while no speed does."""
    freedom, ball = coordinate[0], coordinate[1]
    if freedom < 0:
        return 0.0
    if ball < 0:
        row[freedom] += factor
        return 0.0
    a = at(s, ball)
    s1, c1 = sine_cosine(y[a[0]])
    s2, c2 = sine_cosine(y[a[1]])
    r1, r2, r3 = f[a[0]], f[a[1]], f[a[2]]
    # The rate is nx ux + ny uy + nz uz. The speeds are B r with the axes of the angles as columns, which turn.
    nx, ny, nz = 0.0, c1, s1
    if coordinate[2] == 0:
        nx, ny, nz = 1.0, s1 * s2 / c2, -c1 * s2 / c2
    elif coordinate[2] == 2:
        nx, ny, nz = 0.0, -s1 / c2, c1 / c2
    row[a[0]] += factor * nx
    row[a[1]] += factor * ny
    row[a[2]] += factor * nz
    dx = c2 * r2 * r3
    dy = -s1 * r1 * r2 + (s1 * s2 * r2 - c1 * c2 * r1) * r3
    dz = c1 * r1 * r2 - (s1 * c2 * r1 + c1 * s2 * r2) * r3
    return -factor * (nx * dx + ny * dy + nz * dz)


def bind_bodies(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, constraint: int) -> int:
    """Some equations between bodies; its integers and numbers are theirs."""
    i, h = at(s, constraint), at(s, s[CONSTRAINED])
    first, size = i[FIRST_EQUATION], s[FREEDOMS]
    one, two = at(w, SCRATCH), at(w, SCRATCH + 9)
    for row in range(first, i[END_EQUATION]):
        own, p = (
            at(i, CONSTRAINT_OWN + EQUATION_INTS * (row - first)),
            at(x, i[NUMBERS] + EQUATION_NUMBERS * (row - first)),
        )
        a, b, q, wanted = at(own, 1), at(own, 1 + VECTOR_INTS), at(p, 6), p[12]
        to = at(w, h[WORK_ROWS] + size * row)
        follow(s, x, w, a, p, one)
        follow(s, x, w, b, q, two)
        ax, ay, az, bx, by, bz = one[0], one[1], one[2], two[0], two[1], two[2]
        error = drift = 0.0
        if own[0] == PRODUCT:
            error = ax * bx + ay * by + az * bz - wanted
            drift = ax * two[6] + ay * two[7] + az * two[8] + bx * one[6] + by * one[7] + bz * one[8]
            drift += 2.0 * (one[3] * two[3] + one[4] * two[4] + one[5] * two[5])
            lean(s, w, a, p, bx, by, bz, to)
            lean(s, w, b, q, ax, ay, az, to)
        elif own[0] == DISTANCE:
            length = sqrt(bx * bx + by * by + bz * bz)
            error = length - wanted
            # No direction is better than another to leave a point in.
            ex, ey, ez, stretch = 1.0, 0.0, 0.0, 0.0
            if length > 0.0:
                ex, ey, ez = bx / length, by / length, bz / length
                along = ex * two[3] + ey * two[4] + ez * two[5]
                stretch = (two[3] * two[3] + two[4] * two[4] + two[5] * two[5] - along * along) / length
            drift = ex * two[6] + ey * two[7] + ez * two[8] + stretch
            lean(s, w, b, q, ex, ey, ez, to)
        else:
            drift = slip(s, w, b, q, one, two, to)
        w[h[WORK_ERRORS] + row], w[h[WORK_DRIFTS] + row] = error, -drift
    return OK


def follow(s: Ints, x: Floats, w: Floats, vector: Ints, p: Floats, found: Floats) -> None:
    """A vector, its rate, and its second derivative while no speed changes."""
    one, two = vector[1], vector[2]
    if vector[0] == AXIS:
        ex, ey, ez = direction(s, w, one, p[0], p[1], p[2])
        wx, wy, wz = angular_velocity(s, w, one)
        tx, ty, tz = angular_acceleration_bias(s, w, one)
        rx, ry, rz = wy * ez - wz * ey, wz * ex - wx * ez, wx * ey - wy * ex
        found[0], found[1], found[2], found[3], found[4], found[5] = ex, ey, ez, rx, ry, rz
        found[6] = ty * ez - tz * ey + wy * rz - wz * ry
        found[7] = tz * ex - tx * ez + wz * rx - wx * rz
        found[8] = tx * ey - ty * ex + wx * ry - wy * rx
        return
    ax, ay, az = station(s, w, one, p[0], p[1], p[2])
    bx, by, bz = station(s, w, two, p[3], p[4], p[5])
    found[0], found[1], found[2] = bx - ax, by - ay, bz - az
    if vector[0] == MEETING:
        ax, ay, az = bx, by, bz
    ux, uy, uz = velocity(s, w, one, ax, ay, az)
    vx, vy, vz = velocity(s, w, two, bx, by, bz)
    found[3], found[4], found[5] = vx - ux, vy - uy, vz - uz
    ux, uy, uz = acceleration(s, x, w, one, ax, ay, az)
    vx, vy, vz = acceleration(s, x, w, two, bx, by, bz)
    found[6], found[7], found[8] = vx - ux, vy - uy, vz - uz


def lean(s: Ints, w: Floats, vector: Ints, p: Floats, dx: float, dy: float, dz: float, row: Floats) -> None:
    """Add to a row what the speeds do to a vector along a direction."""
    one, two = vector[1], vector[2]
    if vector[0] == AXIS:
        ex, ey, ez = direction(s, w, one, p[0], p[1], p[2])
        add_wrench(s, w, one, ey * dz - ez * dy, ez * dx - ex * dz, ex * dy - ey * dx, 0.0, 0.0, 0.0, row)
        return
    ax, ay, az = station(s, w, one, p[0], p[1], p[2])
    bx, by, bz = station(s, w, two, p[3], p[4], p[5])
    if vector[0] == MEETING:
        ax, ay, az = bx, by, bz
    add_force(s, w, one, ax, ay, az, -dx, -dy, -dz, row)
    add_force(s, w, two, bx, by, bz, dx, dy, dz, row)


def slip(s: Ints, w: Floats, arm: Ints, p: Floats, one: Floats, two: Floats, row: Floats) -> float:
    """Row of a slip along the first vector; returns its rate while no speed changes."""
    surface, roller = arm[1], arm[2]
    ex, ey, ez, bx, by, bz, vx, vy, vz = one[0], one[1], one[2], two[0], two[1], two[2], two[3], two[4], two[5]
    px, py, pz = station(s, w, surface, p[0], p[1], p[2])
    add_force(s, w, surface, px, py, pz, -ex, -ey, -ez, row)
    add_force(s, w, roller, px, py, pz, ex, ey, ez, row)
    wx, wy, wz = angular_velocity(s, w, roller)
    tx, ty, tz = angular_acceleration_bias(s, w, roller)
    drift: float = (
        one[3] * (vx - wy * bz + wz * by) + one[4] * (vy - wz * bx + wx * bz) + one[5] * (vz - wx * by + wy * bx)
    )
    drift += ex * (two[6] - ty * bz + tz * by - wy * vz + wz * vy)
    drift += ey * (two[7] - tz * bx + tx * bz - wz * vx + wx * vz)
    drift += ez * (two[8] - tx * by + ty * bx - wx * vy + wy * vx)
    return drift


def add_force(
    s: Ints, w: Floats, link: int, px: float, py: float, pz: float, fx: float, fy: float, fz: float, row: Floats
) -> None:
    """Add what a force at a point of ground on a link does to the coordinates."""
    if link >= 0:
        o = at(w, s[WORK_LINK] + LINK_WORK * link + ORIGIN)
        px, py, pz = px - o[0], py - o[1], pz - o[2]
        add_wrench(s, w, link, py * fz - pz * fy, pz * fx - px * fz, px * fy - py * fx, fx, fy, fz, row)


def add_wrench(
    s: Ints, w: Floats, link: int, tx: float, ty: float, tz: float, fx: float, fy: float, fz: float, row: Floats
) -> None:
    """Add what a wrench about the origin of the spatial vectors does to the coordinates."""
    if link < 0:
        return
    # Every link has a degree of freedom of its own.
    freedom = s[s[LINK_AT] + LINK_INTS * link + END_FREEDOM] - 1
    while freedom >= 0:
        c = at(w, s[WORK_COLUMN] + 6 * freedom)
        row[freedom] += tx * c[0] + ty * c[1] + tz * c[2] + fx * c[3] + fy * c[4] + fz * c[5]
        freedom = s[s[FREEDOM_AT] + FREEDOM_INTS * freedom + ABOVE]
