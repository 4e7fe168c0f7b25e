"""Where the links are and how they move, outwards from ground."""

from __future__ import annotations

from osimlite.simulation.kernels.layout import (
    ACCELERATION,
    ALONE,
    AMOUNT,
    ARGUMENT_COUNT,
    ARGUMENTS,
    AXIS,
    BALL,
    BEFORE,
    CONTROLS,
    CURVATURE,
    END_OPERATION,
    FIRST_OPERATION,
    FIXED_AT,
    FIXED_NUMBERS,
    FREEDOM,
    FREEDOMS,
    FUNCTION,
    GRADIENT,
    GRAVITY_AT,
    LAW,
    LAWS,
    LINK_AT,
    LINK_INTS,
    LINK_WORK,
    LINKS,
    MOTION,
    MOVE,
    NOTHING,
    OK,
    OPERATION_AT,
    OPERATION_INTS,
    OPERATION_WORK,
    ORIGIN,
    PARENT,
    POINT,
    POSITION,
    RATE,
    ROTATION,
    SCRATCH,
    SUMMED,
    SUMMED_AT,
    TURN,
    VELOCITY,
    WORK_COLUMN,
    WORK_LINK,
    WORK_OPERATION,
)
from osimlite.simulation.kernels.pointers import Floats, Ints, at, call
from osimlite.simulation.kernels.trigonometry import sine_cosine

BALL_MOVES = 1
"""How far after the law of a ball (or a drift) that places its link is the one that moves it."""


def place(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats) -> None:
    """Rotations, positions and origins of all links, axes of all operations."""
    for link in range(s[LINKS]):
        i, here = at(s, s[LINK_AT] + LINK_INTS * link), at(w, s[WORK_LINK] + LINK_WORK * link)
        parent = i[PARENT]
        if parent >= 0:
            r = at(w, s[WORK_LINK] + LINK_WORK * parent)
            xx, xy, xz, yx, yy, yz, zx, zy, zz = r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8]
            px, py, pz = r[POSITION], r[POSITION + 1], r[POSITION + 2]
        else:
            xx, xy, xz, yx, yy, yz, zx, zy, zz = 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
            px = py = pz = 0.0
        for operation in range(i[FIRST_OPERATION], i[END_OPERATION]):
            record = s[OPERATION_AT] + OPERATION_INTS * operation
            j, a = at(s, record), at(w, s[WORK_OPERATION] + OPERATION_WORK * operation)
            b = at(x, s[FIXED_AT] + FIXED_NUMBERS * operation)
            if j[BEFORE] != NOTHING:
                px += xx * b[9] + xy * b[10] + xz * b[11]
                py += yx * b[9] + yy * b[10] + yz * b[11]
                pz += zx * b[9] + zy * b[10] + zz * b[11]
                if j[BEFORE] == MOVE:
                    b0, b1, b2, b3, b4, b5, b6, b7, b8 = b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7], b[8]
                    xx, xy, xz = xx * b0 + xy * b3 + xz * b6, xx * b1 + xy * b4 + xz * b7, xx * b2 + xy * b5 + xz * b8
                    yx, yy, yz = yx * b0 + yy * b3 + yz * b6, yx * b1 + yy * b4 + yz * b7, yx * b2 + yy * b5 + yz * b8
                    zx, zy, zz = zx * b0 + zy * b3 + zz * b6, zx * b1 + zy * b4 + zz * b7, zx * b2 + zy * b5 + zz * b8
            motion = j[MOTION]
            if motion < BALL:
                if j[FREEDOM] >= 0:
                    amount = y[j[FREEDOM]]
                else:
                    call(s[LAWS + j[FUNCTION]], s, x, w, y, f, operation)
                    amount = a[AMOUNT]
                if motion == TURN:
                    a[AXIS], a[AXIS + 1], a[AXIS + 2] = xz, yz, zz
                    a[POINT], a[POINT + 1], a[POINT + 2] = px, py, pz
                    sine, cosine = sine_cosine(amount)
                    xx, xy = cosine * xx + sine * xy, cosine * xy - sine * xx
                    yx, yy = cosine * yx + sine * yy, cosine * yy - sine * yx
                    zx, zy = cosine * zx + sine * zy, cosine * zy - sine * zx
                else:
                    ex = xx * b[12] + xy * b[13] + xz * b[14]
                    ey = yx * b[12] + yy * b[13] + yz * b[14]
                    ez = zx * b[12] + zy * b[13] + zz * b[14]
                    a[AXIS], a[AXIS + 1], a[AXIS + 2] = ex, ey, ez
                    px += amount * ex
                    py += amount * ey
                    pz += amount * ez
            else:
                frame = at(w, SCRATCH)
                set_frame(frame, xx, xy, xz, yx, yy, yz, zx, zy, zz, px, py, pz)
                call(s[LAWS + j[FUNCTION]], s, x, w, y, f, operation)
                xx, xy, xz, yx, yy, yz = frame[0], frame[1], frame[2], frame[3], frame[4], frame[5]
                zx, zy, zz, px, py, pz = frame[6], frame[7], frame[8], frame[9], frame[10], frame[11]
        set_frame(at(here, ROTATION), xx, xy, xz, yx, yy, yz, zx, zy, zz, px, py, pz)
        if parent >= 0:
            r = at(w, s[WORK_LINK] + LINK_WORK * parent)
            here[ORIGIN], here[ORIGIN + 1], here[ORIGIN + 2] = r[ORIGIN], r[ORIGIN + 1], r[ORIGIN + 2]
        else:
            here[ORIGIN], here[ORIGIN + 1], here[ORIGIN + 2] = px, py, pz


def set_frame(
    a: Floats,
    xx: float,
    xy: float,
    xz: float,
    yx: float,
    yy: float,
    yz: float,
    zx: float,
    zy: float,
    zz: float,
    px: float,
    py: float,
    pz: float,
) -> None:
    """Set a rotation by rows, and the position after it."""
    a[0], a[1], a[2], a[3], a[4], a[5] = xx, xy, xz, yx, yy, yz
    a[6], a[7], a[8], a[9], a[10], a[11] = zx, zy, zz, px, py, pz


def move(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats) -> int:
    """After `place`: velocities, accelerations without udot, columns of the speeds, rates of coordinates, controls."""
    status, size, controls = OK, s[FREEDOMS], s[CONTROLS]
    if controls > 0:
        status = call(s[controls + LAW], s, x, w, y, f, controls)
    for freedom in range(size):
        f[freedom] = y[size + freedom]
    for k in range(s[SUMMED]):
        set_row(at(w, s[WORK_COLUMN] + 6 * s[s[SUMMED_AT] + k]), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for link in range(s[LINKS]):
        i, here = at(s, s[LINK_AT] + LINK_INTS * link), at(w, s[WORK_LINK] + LINK_WORK * link)
        ox, oy, oz = here[ORIGIN], here[ORIGIN + 1], here[ORIGIN + 2]
        if i[PARENT] >= 0:
            v = at(w, s[WORK_LINK] + LINK_WORK * i[PARENT] + VELOCITY)
            wx, wy, wz, vx, vy, vz = v[0], v[1], v[2], v[3], v[4], v[5]
            ax, ay, az, bx, by, bz = v[6], v[7], v[8], v[9], v[10], v[11]
        else:
            wx = wy = wz = vx = vy = vz = ax = ay = az = 0.0
            # Links that are pushed upwards move in one another as under gravity.
            bx, by, bz = -x[GRAVITY_AT], -x[GRAVITY_AT + 1], -x[GRAVITY_AT + 2]
        for operation in range(i[FIRST_OPERATION], i[END_OPERATION]):
            j = at(s, s[OPERATION_AT] + OPERATION_INTS * operation)
            a = at(w, s[WORK_OPERATION] + OPERATION_WORK * operation)
            motion, freedom = j[MOTION], j[FREEDOM]
            if motion < BALL:
                ex, ey, ez = a[AXIS], a[AXIS + 1], a[AXIS + 2]
                if motion == TURN:
                    px, py, pz = a[POINT] - ox, a[POINT + 1] - oy, a[POINT + 2] - oz
                    mx, my, mz = py * ez - pz * ey, pz * ex - px * ez, px * ey - py * ex
                else:
                    mx, my, mz = ex, ey, ez
                    ex = ey = ez = 0.0
                if freedom >= 0:
                    rate = y[size + freedom]
                    column = at(w, s[WORK_COLUMN] + 6 * freedom)
                    if j[FUNCTION] == ALONE:
                        set_row(column, ex, ey, ez, mx, my, mz)
                    else:
                        add_row(column, 1.0, ex, ey, ez, mx, my, mz)
                else:
                    rate, curvature = a[RATE], a[CURVATURE]
                    ax += curvature * ex
                    ay += curvature * ey
                    az += curvature * ez
                    bx += curvature * mx
                    by += curvature * my
                    bz += curvature * mz
                    for k in range(j[ARGUMENT_COUNT]):
                        freedom = s[j[ARGUMENTS] + k]
                        if freedom >= 0:
                            factor = w[j[GRADIENT] + k]
                            add_row(at(w, s[WORK_COLUMN] + 6 * freedom), factor, ex, ey, ez, mx, my, mz)
                sx, sy, sz, tx, ty, tz = rate * ex, rate * ey, rate * ez, rate * mx, rate * my, rate * mz
            else:
                # The origin goes to the law, and what it finds comes back.
                found = at(w, SCRATCH)
                found[0], found[1], found[2] = ox, oy, oz
                status = max(status, call(s[LAWS + j[FUNCTION] + BALL_MOVES], s, x, w, y, f, operation))
                sx, sy, sz, tx, ty, tz = found[0], found[1], found[2], found[3], found[4], found[5]
                bx += found[6]
                by += found[7]
                bz += found[8]
                ax += found[9]
                ay += found[10]
                az += found[11]
            # The axes are carried around by what moved before.
            ax += wy * sz - wz * sy
            ay += wz * sx - wx * sz
            az += wx * sy - wy * sx
            bx += vy * sz - vz * sy + wy * tz - wz * ty
            by += vz * sx - vx * sz + wz * tx - wx * tz
            bz += vx * sy - vy * sx + wx * ty - wy * tx
            wx += sx
            wy += sy
            wz += sz
            vx += tx
            vy += ty
            vz += tz
        set_row(at(here, VELOCITY), wx, wy, wz, vx, vy, vz)
        set_row(at(here, ACCELERATION), ax, ay, az, bx, by, bz)
    return status


def set_row(row: Floats, ex: float, ey: float, ez: float, mx: float, my: float, mz: float) -> None:
    """Set a spatial vector."""
    row[0], row[1], row[2], row[3], row[4], row[5] = ex, ey, ez, mx, my, mz


def add_row(row: Floats, factor: float, ex: float, ey: float, ez: float, mx: float, my: float, mz: float) -> None:
    """Add a multiple to a spatial vector."""
    row[0] += factor * ex
    row[1] += factor * ey
    row[2] += factor * ez
    row[3] += factor * mx
    row[4] += factor * my
    row[5] += factor * mz
