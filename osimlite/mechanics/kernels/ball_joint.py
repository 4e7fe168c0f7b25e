"""The motion of a ball or ellipsoid joint, whose speeds are not the rates of its angles."""

from __future__ import annotations

from osimlite.mechanics.kernels.layout import (
    LINK_WORK,
    MODEL,
    MOTION,
    OPERATION,
    OPERATION_WORK,
    OUTCOME,
    WORK,
)
from osimlite.mechanics.kernels.motion import add_row, axes_of, set_frame, set_row
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, copy
from osimlite.mechanics.kernels.points import operation_ints, operation_work
from osimlite.mechanics.laws.rotations import (
    along_axes,
    body_fixed,
    sine_cosine,
    transposed,
    turned_axes,
)
from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    along,
    cross,
    dot,
    elementwise,
    minus,
    plus,
    replaced,
    times,
    turned,
    vector,
)


def place_ball(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, operation: int
) -> int:
    """Pass the frame in SCRATCH on by the motion."""
    j = operation_ints(model, operation)
    kept, frame, radii = (
        operation_work(model, data, operation),
        at(data, WORK.SCRATCH),
        at(reals, j[OPERATION.EXTRA]),
    )
    angles = at(model, j[OPERATION.ARGUMENTS])
    s1, c1 = sine_cosine(y[angles[0]])
    s2, c2 = sine_cosine(y[angles[1]])
    s3, c3 = sine_cosine(y[angles[2]])
    axes, turned_by = axes_of(frame), body_fixed(s1, c1, s2, c2, s3, c3)
    end = elementwise(vector(radii, 0), turned_by[2])
    if j[OPERATION.MOTION] == MOTION.BALL:
        copy(12, frame, kept)
        set_frame(
            frame,
            turned_axes(axes, turned_by),
            plus(vector(frame, LINK_WORK.POSITION), along_axes(axes, end)),
        )
    else:
        axes = turned_axes(axes, transposed(turned_by))
        set_frame(frame, axes, minus(vector(frame, LINK_WORK.POSITION), along_axes(axes, end)))
        copy(12, frame, kept)
    return OUTCOME.OK


def move_ball(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, operation: int
) -> int:
    """Columns of the three speeds, rates of the angles; velocity and own acceleration in SCRATCH."""
    j = operation_ints(model, operation)
    kept, result, radii = (
        operation_work(model, data, operation),
        at(data, WORK.SCRATCH),
        at(reals, j[OPERATION.EXTRA]),
    )
    angles, u = at(model, j[OPERATION.ARGUMENTS]), at(y, model[MODEL.DOFS])
    sign = 1.0 if j[OPERATION.MOTION] == MOTION.BALL else -1.0
    n, far = last_axis(y, angles), vector(radii, 0)
    arm, spin = (
        minus(vector(kept, OPERATION_WORK.POINT), vector(result, 0)),
        (u[angles[0]], u[angles[1]], u[angles[2]]),
    )
    turn = shift = ZERO
    for k in range(3):
        axis = replaced(ZERO, k, 1.0)
        e = times(sign, turned(kept, axis))
        m = plus(times(sign, turned(kept, left_behind(far, axis, n))), cross(arm, e))
        add_row(at(data, model[MODEL.WORK_COLUMN] + 6 * angles[k]), 1.0, e, m)
        turn, shift = along(turn, spin[k], e), along(shift, spin[k], m)
    set_row(result, turn, shift)
    set_row(at(result, 6), times(sign, turned(kept, left_behind(far, spin, cross(spin, n)))), ZERO)
    if abs(sine_cosine(y[angles[1]])[1]) < 1e-12:
        return OUTCOME.SINGULAR_RATES
    for k in range(3):
        f[angles[k]] = dot(angle_row(y, angles, k), spin)
    return OUTCOME.OK


def angle_row(y: Floats, angles: Ints, part: int) -> Vector:
    """What the speeds of a ball do to one of its angles: a row of N, as `SphericalMotion` has it."""
    s1, c1 = sine_cosine(y[angles[0]])
    s2, c2 = sine_cosine(y[angles[1]])
    if part == 1:
        return 0.0, c1, s1
    return (1.0, s1 * s2 / c2, -c1 * s2 / c2) if part == 0 else (0.0, -s1 / c2, c1 / c2)


def angle_drift(y: Floats, f: Floats, angles: Ints, row: Vector) -> float:
    """Acceleration of an angle without udot, for its row; f has the rates r.

    The speeds are B r with the axes of the angles as columns, which turn.
    """
    s1, c1 = sine_cosine(y[angles[0]])
    s2, c2 = sine_cosine(y[angles[1]])
    r1, r2, r3 = f[angles[0]], f[angles[1]], f[angles[2]]
    dy = -s1 * r1 * r2 + (s1 * s2 * r2 - c1 * c2 * r1) * r3
    dz = c1 * r1 * r2 - (s1 * c2 * r1 + c1 * s2 * r2) * r3
    return -dot(row, (c2 * r2 * r3, dy, dz))


def last_axis(y: Floats, angles: Ints) -> Vector:
    """The last axis of a ball, in its frame."""
    s1, c1 = sine_cosine(y[angles[0]])
    s2, c2 = sine_cosine(y[angles[1]])
    return s2, -s1 * c2, c1 * c2


def left_behind(far: Vector, turn: Vector, n: Vector) -> Vector:
    """What a turn moves the far end r * n by, which is r * (e x n), brought to the start: less e x (r * n)."""
    return minus(elementwise(far, cross(turn, n)), cross(turn, elementwise(far, n)))
