"""Where the links are and how they move, outwards from ground."""

from __future__ import annotations

from math import cos, sin

from osimlite.simulation.kernels.arrays import (
    BALL,
    BALL_BACK,
    MOVE,
    NOTHING,
    SLIDE,
    TURN,
    Floats,
    Numbers,
    Structure,
    Work,
)
from osimlite.simulation.kernels.functions import slope_of, value_of

FINE, SINGULAR_MASS, SINGULAR_RATES = 0, 1, 2
"""What becomes of an evaluation: good, a degree of freedom moves no mass, the rates of a ball are not defined."""


def place(s: Structure, x: Numbers, w: Work, q: Floats) -> None:
    """Rotations and positions of all links, axes of all operations, and the origin of the vectors."""
    links = len(s.parent)
    ox = oy = oz = 0.0
    for link in range(links):
        parent = s.parent[link]
        if parent >= 0:
            r = w.rotation
            xx, xy, xz = r[parent, 0], r[parent, 1], r[parent, 2]
            yx, yy, yz = r[parent, 3], r[parent, 4], r[parent, 5]
            zx, zy, zz = r[parent, 6], r[parent, 7], r[parent, 8]
            px, py, pz = w.position[parent, 0], w.position[parent, 1], w.position[parent, 2]
        else:
            xx, xy, xz, yx, yy, yz, zx, zy, zz = 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
            px = py = pz = 0.0
        for op in range(s.operations[link], s.operations[link + 1]):
            before, kind = s.before[op], s.kind[op]
            if before != NOTHING:
                b = x.fixed
                px += xx * b[op, 9] + xy * b[op, 10] + xz * b[op, 11]
                py += yx * b[op, 9] + yy * b[op, 10] + yz * b[op, 11]
                pz += zx * b[op, 9] + zy * b[op, 10] + zz * b[op, 11]
                if before == MOVE:
                    xx, xy, xz = (
                        xx * b[op, 0] + xy * b[op, 3] + xz * b[op, 6],
                        xx * b[op, 1] + xy * b[op, 4] + xz * b[op, 7],
                        xx * b[op, 2] + xy * b[op, 5] + xz * b[op, 8],
                    )
                    yx, yy, yz = (
                        yx * b[op, 0] + yy * b[op, 3] + yz * b[op, 6],
                        yx * b[op, 1] + yy * b[op, 4] + yz * b[op, 7],
                        yx * b[op, 2] + yy * b[op, 5] + yz * b[op, 8],
                    )
                    zx, zy, zz = (
                        zx * b[op, 0] + zy * b[op, 3] + zz * b[op, 6],
                        zx * b[op, 1] + zy * b[op, 4] + zz * b[op, 7],
                        zx * b[op, 2] + zy * b[op, 5] + zz * b[op, 8],
                    )
            if kind == TURN:
                w.axes[op, 0], w.axes[op, 1], w.axes[op, 2] = xz, yz, zz
                w.point[op, 0], w.point[op, 1], w.point[op, 2] = px, py, pz
                angle = q[s.arguments[s.first_argument[op]]] if s.function[op] < 0 else value_of(s, x, q, op)
                sine, cosine = sin(angle), cos(angle)
                xx, xy = cosine * xx + sine * xy, cosine * xy - sine * xx
                yx, yy = cosine * yx + sine * yy, cosine * yy - sine * yx
                zx, zy = cosine * zx + sine * zy, cosine * zy - sine * zx
            elif kind == SLIDE:
                w.axes[op, 0], w.axes[op, 1], w.axes[op, 2] = xz, yz, zz
                amount = q[s.arguments[s.first_argument[op]]] if s.function[op] < 0 else value_of(s, x, q, op)
                px += amount * xz
                py += amount * yz
                pz += amount * zz
            else:
                first = s.first_argument[op]
                a, b0, c = q[s.arguments[first]], q[s.arguments[first + 1]], q[s.arguments[first + 2]]
                s1, c1, s2, c2, s3, c3 = sin(a), cos(a), sin(b0), cos(b0), sin(c), cos(c)
                mxx, mxy, mxz = c2 * c3, -c2 * s3, s2
                myx, myy, myz = c1 * s3 + s1 * s2 * c3, c1 * c3 - s1 * s2 * s3, -s1 * c2
                mzx, mzy, mzz = s1 * s3 - c1 * s2 * c3, s1 * c3 + c1 * s2 * s3, c1 * c2
                ex, ey, ez = x.radii[op, 0] * mxz, x.radii[op, 1] * myz, x.radii[op, 2] * mzz
                if kind == BALL_BACK:
                    mxy, myx = myx, mxy
                    mxz, mzx = mzx, mxz
                    myz, mzy = mzy, myz
                else:
                    keep_frame(w, op, xx, xy, xz, yx, yy, yz, zx, zy, zz, px, py, pz)
                    px += xx * ex + xy * ey + xz * ez
                    py += yx * ex + yy * ey + yz * ez
                    pz += zx * ex + zy * ey + zz * ez
                xx, xy, xz = (
                    xx * mxx + xy * myx + xz * mzx,
                    xx * mxy + xy * myy + xz * mzy,
                    xx * mxz + xy * myz + xz * mzz,
                )
                yx, yy, yz = (
                    yx * mxx + yy * myx + yz * mzx,
                    yx * mxy + yy * myy + yz * mzy,
                    yx * mxz + yy * myz + yz * mzz,
                )
                zx, zy, zz = (
                    zx * mxx + zy * myx + zz * mzx,
                    zx * mxy + zy * myy + zz * mzy,
                    zx * mxz + zy * myz + zz * mzz,
                )
                if kind == BALL_BACK:
                    px -= xx * ex + xy * ey + xz * ez
                    py -= yx * ex + yy * ey + yz * ez
                    pz -= zx * ex + zy * ey + zz * ez
                    keep_frame(w, op, xx, xy, xz, yx, yy, yz, zx, zy, zz, px, py, pz)
        r = w.rotation
        r[link, 0], r[link, 1], r[link, 2] = xx, xy, xz
        r[link, 3], r[link, 4], r[link, 5] = yx, yy, yz
        r[link, 6], r[link, 7], r[link, 8] = zx, zy, zz
        w.position[link, 0], w.position[link, 1], w.position[link, 2] = px, py, pz
        ox += px
        oy += py
        oz += pz
    if links > 0:
        w.origin[0], w.origin[1], w.origin[2] = ox / links, oy / links, oz / links


def keep_frame(
    w: Work,
    op: int,
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
    """Keep the frame in which the speeds of a BALL are expressed."""
    a = w.axes[op]
    a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8] = xx, xy, xz, yx, yy, yz, zx, zy, zz
    w.point[op, 0], w.point[op, 1], w.point[op, 2] = px, py, pz


def move(s: Structure, x: Numbers, w: Work, q: Floats, u: Floats, rates: Floats) -> int:
    """After `place`: velocities, accelerations without udot, columns of the speeds, rates of the coordinates."""
    status = FINE
    for freedom in range(len(s.above)):
        rates[freedom] = u[freedom]
        for k in range(6):
            w.columns[freedom, k] = 0.0
    for link in range(len(s.parent)):
        parent = s.parent[link]
        if parent >= 0:
            v, a = w.velocity, w.acceleration
            wx, wy, wz, vx, vy, vz = (
                v[parent, 0],
                v[parent, 1],
                v[parent, 2],
                v[parent, 3],
                v[parent, 4],
                v[parent, 5],
            )
            ax, ay, az, bx, by, bz = (
                a[parent, 0],
                a[parent, 1],
                a[parent, 2],
                a[parent, 3],
                a[parent, 4],
                a[parent, 5],
            )
        else:
            wx = wy = wz = vx = vy = vz = ax = ay = az = 0.0
            # Links that are pushed upwards move in one another as under gravity.
            bx, by, bz = -x.gravity[0], -x.gravity[1], -x.gravity[2]
        for op in range(s.operations[link], s.operations[link + 1]):
            kind, first = s.kind[op], s.first_argument[op]
            if kind in (TURN, SLIDE):
                ex, ey, ez = w.axes[op, 0], w.axes[op, 1], w.axes[op, 2]
                if kind == TURN:
                    px, py, pz = (
                        w.point[op, 0] - w.origin[0],
                        w.point[op, 1] - w.origin[1],
                        w.point[op, 2] - w.origin[2],
                    )
                    mx, my, mz = py * ez - pz * ey, pz * ex - px * ez, px * ey - py * ex
                else:
                    mx, my, mz = ex, ey, ez
                    ex = ey = ez = 0.0
                rate = curvature = 0.0
                if s.function[op] < 0:
                    freedom = s.arguments[first]
                    rate = u[freedom]
                    add_row(w.columns, freedom, 1.0, ex, ey, ez, mx, my, mz)
                else:
                    rate, curvature = slope_of(s, x, w, q, u, op)
                    for place in range(first, s.first_argument[op + 1]):
                        if s.arguments[place] >= 0:
                            add_row(w.columns, s.arguments[place], w.gradient[place - first], ex, ey, ez, mx, my, mz)
                sx, sy, sz, tx, ty, tz = rate * ex, rate * ey, rate * ez, rate * mx, rate * my, rate * mz
                ax += curvature * ex
                ay += curvature * ey
                az += curvature * ez
                bx += curvature * mx
                by += curvature * my
                bz += curvature * mz
            else:
                status = max(status, ball_rates(s, q, u, rates, first))
                sx, sy, sz, tx, ty, tz, mx, my, mz = ball(s, x, w, q, u, op)
                bx += mx
                by += my
                bz += mz
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
        set_row(w.velocity, link, wx, wy, wz, vx, vy, vz)
        set_row(w.acceleration, link, ax, ay, az, bx, by, bz)
    return status


def set_row(rows: Floats, row: int, ex: float, ey: float, ez: float, mx: float, my: float, mz: float) -> None:
    """Set a spatial vector of several."""
    rows[row, 0], rows[row, 1], rows[row, 2] = ex, ey, ez
    rows[row, 3], rows[row, 4], rows[row, 5] = mx, my, mz


def add_row(
    rows: Floats, row: int, factor: float, ex: float, ey: float, ez: float, mx: float, my: float, mz: float
) -> None:
    """Add a multiple to a spatial vector of several."""
    rows[row, 0] += factor * ex
    rows[row, 1] += factor * ey
    rows[row, 2] += factor * ez
    rows[row, 3] += factor * mx
    rows[row, 4] += factor * my
    rows[row, 5] += factor * mz


def ball_rates(s: Structure, q: Floats, u: Floats, rates: Floats, first: int) -> int:
    """Rates of the three angles of a BALL, qdot = N u."""
    one, two, three = s.arguments[first], s.arguments[first + 1], s.arguments[first + 2]
    s1, c1, s2, c2 = sin(q[one]), cos(q[one]), sin(q[two]), cos(q[two])
    if abs(c2) < 1e-12:
        return SINGULAR_RATES
    across = s1 * u[two] - c1 * u[three]
    rates[one] = u[one] + s2 / c2 * across
    rates[two] = c1 * u[two] + s1 * u[three]
    rates[three] = -across / c2
    return FINE


def ball(
    s: Structure, x: Numbers, w: Work, q: Floats, u: Floats, op: int
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Columns of the three speeds of a BALL; returns its velocity, and the linear part of its own acceleration."""
    first = s.first_argument[op]
    f, sign = w.axes[op], 1.0 if s.kind[op] == BALL else -1.0
    fx, fy, fz = w.point[op, 0] - w.origin[0], w.point[op, 1] - w.origin[1], w.point[op, 2] - w.origin[2]
    a, b = q[s.arguments[first]], q[s.arguments[first + 1]]
    nx, ny, nz = sin(b), -sin(a) * cos(b), cos(a) * cos(b)
    rx, ry, rz = x.radii[op, 0], x.radii[op, 1], x.radii[op, 2]
    sx = sy = sz = tx = ty = tz = 0.0
    for k in range(3):
        freedom = s.arguments[first + k]
        # What this speed moves the far end by in the frame, r * (e x n), brought to its start: - e x (r * n).
        if k == 0:
            lx, ly, lz = 0.0, -ry * nz + rz * nz, rz * ny - ry * ny
        elif k == 1:
            lx, ly, lz = rx * nz - rz * nz, 0.0, -rz * nx + rx * nx
        else:
            lx, ly, lz = -rx * ny + ry * ny, ry * nx - rx * nx, 0.0
        ex, ey, ez = sign * f[k], sign * f[3 + k], sign * f[6 + k]
        mx = sign * (f[0] * lx + f[1] * ly + f[2] * lz) + fy * ez - fz * ey
        my = sign * (f[3] * lx + f[4] * ly + f[5] * lz) + fz * ex - fx * ez
        mz = sign * (f[6] * lx + f[7] * ly + f[8] * lz) + fx * ey - fy * ex
        add_row(w.columns, freedom, 1.0, ex, ey, ez, mx, my, mz)
        rate = u[freedom]
        sx += rate * ex
        sy += rate * ey
        sz += rate * ez
        tx += rate * mx
        ty += rate * my
        tz += rate * mz
    ux, uy, uz = u[s.arguments[first]], u[s.arguments[first + 1]], u[s.arguments[first + 2]]
    dx, dy, dz = uy * nz - uz * ny, uz * nx - ux * nz, ux * ny - uy * nx
    # r * (u x (u x n)) - u x (r * (u x n)), in the frame.
    gx = rx * (uy * dz - uz * dy) - (uy * rz * dz - uz * ry * dy)
    gy = ry * (uz * dx - ux * dz) - (uz * rx * dx - ux * rz * dz)
    gz = rz * (ux * dy - uy * dx) - (ux * ry * dy - uy * rx * dx)
    return (
        sx,
        sy,
        sz,
        tx,
        ty,
        tz,
        sign * (f[0] * gx + f[1] * gy + f[2] * gz),
        sign * (f[3] * gx + f[4] * gy + f[5] * gz),
        sign * (f[6] * gx + f[7] * gy + f[8] * gz),
    )
