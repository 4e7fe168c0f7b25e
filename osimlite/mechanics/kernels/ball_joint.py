"""Motion of ball and ellipsoid joints, whose generalized speeds are angular velocities.

With the body-fixed X-Y-Z angles q and the angular velocity u in the parent, the rates are
qdot = N(q) u, as in :class:`osimlite.mechanics.multibody.motions.SphericalMotion`. The end of the
motion lies on an ellipsoid with the half axes r at r * n, the elementwise product of r and the
third axis n of the rotation (A. Seth et al., Minimal formulation of joint motion for
biomechanisms, Nonlinear Dynamics 62, 2010); r = 0 for a ball joint.
"""

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
    """Advance the frame in SCRATCH by the rotation and translation of a ball or ellipsoid joint."""
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
    """Write the columns of the three speeds and the rates of the angles.

    Velocity and acceleration while udot = 0 of the motion itself go to SCRATCH.

    Returns:
        `OUTCOME.SINGULAR_RATES` where the second angle is a right angle, else `OUTCOME.OK`.
    """
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
    """Return the row of N that gives the rate of one angle from the three speeds."""
    s1, c1 = sine_cosine(y[angles[0]])
    s2, c2 = sine_cosine(y[angles[1]])
    if part == 1:
        return 0.0, c1, s1
    return (1.0, s1 * s2 / c2, -c1 * s2 / c2) if part == 0 else (0.0, -s1 / c2, c1 / c2)


def angle_drift(y: Floats, f: Floats, angles: Ints, row: Vector) -> float:
    """Return the acceleration of an angle while udot = 0.

    The speeds are u = B r, where r are the rates and the columns of B the axes of the angles, so that
    qddot = N (udot - Bdot r).

    Args:
        y: state.
        f: rates of the coordinates.
        angles: degrees of freedom of the three angles.
        row: row of N of the angle.
    """
    s1, c1 = sine_cosine(y[angles[0]])
    s2, c2 = sine_cosine(y[angles[1]])
    r1, r2, r3 = f[angles[0]], f[angles[1]], f[angles[2]]
    dy = -s1 * r1 * r2 + (s1 * s2 * r2 - c1 * c2 * r1) * r3
    dz = c1 * r1 * r2 - (s1 * c2 * r1 + c1 * s2 * r2) * r3
    return -dot(row, (c2 * r2 * r3, dy, dz))


def last_axis(y: Floats, angles: Ints) -> Vector:
    """Return the third axis n of the rotation of a ball, in its parent frame."""
    s1, c1 = sine_cosine(y[angles[0]])
    s2, c2 = sine_cosine(y[angles[1]])
    return s2, -s1 * c2, c1 * c2


def left_behind(far: Vector, turn: Vector, n: Vector) -> Vector:
    """Return the velocity of the end r * n less that of the rotating frame: r * (e x n) - e x (r * n)."""
    return minus(elementwise(far, cross(turn, n)), cross(turn, elementwise(far, n)))
