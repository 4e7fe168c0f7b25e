"""The motion of a ball or ellipsoid joint, whose speeds are not the rates of its angles."""

from __future__ import annotations

from osimlite.simulation.kernels.layout import (
    ARGUMENTS,
    AXIS,
    BALL,
    EXTRA,
    FREEDOMS,
    MOTION,
    OK,
    OPERATION_AT,
    OPERATION_INTS,
    OPERATION_WORK,
    POINT,
    SCRATCH,
    SINGULAR_RATES,
    WORK_COLUMN,
    WORK_OPERATION,
)
from osimlite.simulation.kernels.motion import add_row, set_frame
from osimlite.simulation.kernels.pointers import Floats, Ints, at
from osimlite.simulation.kernels.trigonometry import sine_cosine


def place_ball(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, operation: int) -> int:
    """Pass the frame in SCRATCH on by the motion."""
    j = at(s, s[OPERATION_AT] + OPERATION_INTS * operation)
    kept, frame, radii = at(w, s[WORK_OPERATION] + OPERATION_WORK * operation), at(w, SCRATCH), at(x, j[EXTRA])
    angles = at(s, j[ARGUMENTS])
    s1, c1 = sine_cosine(y[angles[0]])
    s2, c2 = sine_cosine(y[angles[1]])
    s3, c3 = sine_cosine(y[angles[2]])
    xx, xy, xz, yx, yy, yz = frame[0], frame[1], frame[2], frame[3], frame[4], frame[5]
    zx, zy, zz, px, py, pz = frame[6], frame[7], frame[8], frame[9], frame[10], frame[11]
    mxx, mxy, mxz = c2 * c3, -c2 * s3, s2
    myx, myy, myz = c1 * s3 + s1 * s2 * c3, c1 * c3 - s1 * s2 * s3, -s1 * c2
    mzx, mzy, mzz = s1 * s3 - c1 * s2 * c3, s1 * c3 + c1 * s2 * s3, c1 * c2
    ex, ey, ez = radii[0] * mxz, radii[1] * myz, radii[2] * mzz
    forward = j[MOTION] == BALL
    if forward:
        set_frame(at(kept, AXIS), xx, xy, xz, yx, yy, yz, zx, zy, zz, px, py, pz)
        px += xx * ex + xy * ey + xz * ez
        py += yx * ex + yy * ey + yz * ez
        pz += zx * ex + zy * ey + zz * ez
    else:
        mxy, myx = myx, mxy
        mxz, mzx = mzx, mxz
        myz, mzy = mzy, myz
    xx, xy, xz = xx * mxx + xy * myx + xz * mzx, xx * mxy + xy * myy + xz * mzy, xx * mxz + xy * myz + xz * mzz
    yx, yy, yz = yx * mxx + yy * myx + yz * mzx, yx * mxy + yy * myy + yz * mzy, yx * mxz + yy * myz + yz * mzz
    zx, zy, zz = zx * mxx + zy * myx + zz * mzx, zx * mxy + zy * myy + zz * mzy, zx * mxz + zy * myz + zz * mzz
    if not forward:
        px -= xx * ex + xy * ey + xz * ez
        py -= yx * ex + yy * ey + yz * ez
        pz -= zx * ex + zy * ey + zz * ez
        set_frame(at(kept, AXIS), xx, xy, xz, yx, yy, yz, zx, zy, zz, px, py, pz)
    set_frame(frame, xx, xy, xz, yx, yy, yz, zx, zy, zz, px, py, pz)
    return OK


def move_ball(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, operation: int) -> int:
    """Columns of the three speeds, rates of the angles; velocity and own acceleration in SCRATCH."""
    j = at(s, s[OPERATION_AT] + OPERATION_INTS * operation)
    kept, found, radii = at(w, s[WORK_OPERATION] + OPERATION_WORK * operation), at(w, SCRATCH), at(x, j[EXTRA])
    angles, u = at(s, j[ARGUMENTS]), at(y, s[FREEDOMS])
    sign = 1.0 if j[MOTION] == BALL else -1.0
    r00, r01, r02, r10, r11, r12 = kept[0], kept[1], kept[2], kept[3], kept[4], kept[5]
    r20, r21, r22 = kept[6], kept[7], kept[8]
    px, py, pz = kept[POINT] - found[0], kept[POINT + 1] - found[1], kept[POINT + 2] - found[2]
    s1, c1 = sine_cosine(y[angles[0]])
    s2, c2 = sine_cosine(y[angles[1]])
    nx, ny, nz = s2, -s1 * c2, c1 * c2
    rx, ry, rz = radii[0], radii[1], radii[2]
    ux, uy, uz = u[angles[0]], u[angles[1]], u[angles[2]]
    sx = sy = sz = tx = ty = tz = 0.0
    for k in range(3):
        # What this speed moves the far end by in the frame, r * (e x n), brought to its start: - e x (r * n).
        if k == 0:
            lx, ly, lz, rate = 0.0, -ry * nz + rz * nz, rz * ny - ry * ny, ux
        elif k == 1:
            lx, ly, lz, rate = rx * nz - rz * nz, 0.0, -rz * nx + rx * nx, uy
        else:
            lx, ly, lz, rate = -rx * ny + ry * ny, ry * nx - rx * nx, 0.0, uz
        ex, ey, ez = sign * kept[k], sign * kept[3 + k], sign * kept[6 + k]
        mx = sign * (r00 * lx + r01 * ly + r02 * lz) + py * ez - pz * ey
        my = sign * (r10 * lx + r11 * ly + r12 * lz) + pz * ex - px * ez
        mz = sign * (r20 * lx + r21 * ly + r22 * lz) + px * ey - py * ex
        add_row(at(w, s[WORK_COLUMN] + 6 * angles[k]), 1.0, ex, ey, ez, mx, my, mz)
        sx += rate * ex
        sy += rate * ey
        sz += rate * ez
        tx += rate * mx
        ty += rate * my
        tz += rate * mz
    dx, dy, dz = uy * nz - uz * ny, uz * nx - ux * nz, ux * ny - uy * nx
    # r * (u x (u x n)) - u x (r * (u x n)), in the frame.
    gx = rx * (uy * dz - uz * dy) - (uy * rz * dz - uz * ry * dy)
    gy = ry * (uz * dx - ux * dz) - (uz * rx * dx - ux * rz * dz)
    gz = rz * (ux * dy - uy * dx) - (ux * ry * dy - uy * rx * dx)
    found[0], found[1], found[2], found[3], found[4], found[5] = sx, sy, sz, tx, ty, tz
    found[6] = sign * (r00 * gx + r01 * gy + r02 * gz)
    found[7] = sign * (r10 * gx + r11 * gy + r12 * gz)
    found[8] = sign * (r20 * gx + r21 * gy + r22 * gz)
    found[9] = found[10] = found[11] = 0.0
    # qdot = N u.
    if abs(c2) < 1e-12:
        return SINGULAR_RATES
    across = s1 * uy - c1 * uz
    f[angles[0]] = ux + s2 / c2 * across
    f[angles[1]] = c1 * uy + s1 * uz
    f[angles[2]] = -across / c2
    return OK
