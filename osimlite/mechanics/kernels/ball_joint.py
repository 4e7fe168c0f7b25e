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
from osimlite.mechanics.kernels.motion import (
    add_spatial_vector,
    axes_from_rows,
    set_frame,
    set_spatial_vector,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, copy_numbers
from osimlite.mechanics.kernels.points import operation_ints, operation_work
from osimlite.mechanics.laws.rotations import (
    combine_axes,
    multiply_rotations,
    rotation_from_xyz,
    sine_cosine,
    transpose_rotation,
)
from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    add_scaled,
    cross,
    dot,
    minus,
    multiply_elementwise,
    plus,
    replace_component,
    rotate,
    times,
    vector,
)


def place_ball(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, operation: int
) -> int:
    """Advance the frame in SCRATCH by the rotation and translation of a ball or ellipsoid joint.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; SCRATCH holds the frame before the joint and is filled with that behind it.
        y: state.
        f: rates of the coordinates.
        operation: number of the operation.

    Returns:
        `OUTCOME.OK`.
    """
    j = operation_ints(model, operation)
    operation_record = operation_work(model, data, operation)
    frame = at(data, WORK.SCRATCH)
    radii = at(reals, j[OPERATION.EXTRA])
    angles = at(model, j[OPERATION.ARGUMENTS])
    s1, c1 = sine_cosine(y[angles[0]])
    s2, c2 = sine_cosine(y[angles[1]])
    s3, c3 = sine_cosine(y[angles[2]])
    axes = axes_from_rows(frame)
    ball_rotation = rotation_from_xyz(s1, c1, s2, c2, s3, c3)
    end = multiply_elementwise(vector(radii, 0), ball_rotation[2])
    # The frame that the speeds are about is that of the parent: before the motion, or, if the joint
    # is traversed from its end, behind it.
    if j[OPERATION.MOTION] == MOTION.BALL:
        copy_numbers(12, frame, operation_record)
        set_frame(
            frame,
            multiply_rotations(axes, ball_rotation),
            plus(vector(frame, LINK_WORK.POSITION), combine_axes(axes, end)),
        )
    else:
        axes = multiply_rotations(axes, transpose_rotation(ball_rotation))
        set_frame(frame, axes, minus(vector(frame, LINK_WORK.POSITION), combine_axes(axes, end)))
        copy_numbers(12, frame, operation_record)
    return OUTCOME.OK


def move_ball(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, operation: int
) -> int:
    """Write the columns of the three speeds and the rates of the angles.

    Velocity and acceleration while udot = 0 of the motion itself go to SCRATCH.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; SCRATCH holds the origin of the spatial vectors and is filled with the
            motion.
        y: state.
        f: filled with the rates of the three angles.
        operation: number of the operation.

    Returns:
        `OUTCOME.SINGULAR_RATES` where the second angle is a right angle, else `OUTCOME.OK`.
    """
    j = operation_ints(model, operation)
    operation_record = operation_work(model, data, operation)
    result = at(data, WORK.SCRATCH)
    radii = at(reals, j[OPERATION.EXTRA])
    angles, u = at(model, j[OPERATION.ARGUMENTS]), at(y, model[MODEL.DOFS])
    # Traversed from end to start, all velocities are opposite.
    sign = 1.0 if j[OPERATION.MOTION] == MOTION.BALL else -1.0
    n, end_radii = third_axis(y, angles), vector(radii, 0)
    arm = minus(vector(operation_record, OPERATION_WORK.POINT), vector(result, 0))
    spin = (u[angles[0]], u[angles[1]], u[angles[2]])
    turn = shift = ZERO
    # The column of speed k: a turn about axis k of the parent, and the velocity of the end of the
    # ellipsoid.
    for k in range(3):
        axis = replace_component(ZERO, k, 1.0)
        e = times(sign, rotate(operation_record, axis))
        m = plus(
            times(sign, rotate(operation_record, far_end_velocity(end_radii, axis, n))),
            cross(arm, e),
        )
        add_spatial_vector(at(data, model[MODEL.WORK_COLUMN] + 6 * angles[k]), 1.0, e, m)
        turn, shift = add_scaled(turn, spin[k], e), add_scaled(shift, spin[k], m)
    set_spatial_vector(result, turn, shift)
    set_spatial_vector(
        at(result, 6),
        times(sign, rotate(operation_record, far_end_velocity(end_radii, spin, cross(spin, n)))),
        ZERO,
    )
    # N contains 1 / cos of the second angle; near a right angle the angles have no finite rates.
    if abs(sine_cosine(y[angles[1]])[1]) < 1e-12:
        return OUTCOME.SINGULAR_RATES
    for k in range(3):
        f[angles[k]] = dot(angle_rate_row(y, angles, k), spin)
    return OUTCOME.OK


def angle_rate_row(y: Floats, angles: Ints, angle_index: int) -> Vector:
    """Return the row of N that gives the rate of one angle from the three speeds.

    N is the matrix of body-fixed X-Y-Z angles with angular velocity along the axes of the parent;
    its first and third row are singular where the second angle is a right angle.

    Args:
        y: state.
        angles: degrees of freedom of the three angles.
        angle_index: number of the angle, 0, 1 or 2.
    """
    s1, c1 = sine_cosine(y[angles[0]])
    s2, c2 = sine_cosine(y[angles[1]])
    if angle_index == 1:
        return 0.0, c1, s1
    return (1.0, s1 * s2 / c2, -c1 * s2 / c2) if angle_index == 0 else (0.0, -s1 / c2, c1 / c2)


def angle_acceleration_bias(y: Floats, f: Floats, angles: Ints, row: Vector) -> float:
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
    # Components y and z of -Bdot r; the first axis is fixed in the parent.
    dy = -s1 * r1 * r2 + (s1 * s2 * r2 - c1 * c2 * r1) * r3
    dz = c1 * r1 * r2 - (s1 * c2 * r1 + c1 * s2 * r2) * r3
    return -dot(row, (c2 * r2 * r3, dy, dz))


def third_axis(y: Floats, angles: Ints) -> Vector:
    """Return the third axis n of the rotation of a ball, in its parent frame.

    Args:
        y: state.
        angles: degrees of freedom of the three angles.
    """
    s1, c1 = sine_cosine(y[angles[0]])
    s2, c2 = sine_cosine(y[angles[1]])
    return s2, -s1 * c2, c1 * c2


def far_end_velocity(end_radii: Vector, turn: Vector, n: Vector) -> Vector:
    """Return the velocity of the end r * n less that of the rotating frame.

    It is r * (e x n) - e x (r * n), where * is the elementwise product.

    Args:
        end_radii: half axes r (m).
        turn: angular velocity e in the parent (rad/s).
        n: third axis of the rotation, or its rate for the acceleration.
    """
    return minus(
        multiply_elementwise(end_radii, cross(turn, n)),
        cross(turn, multiply_elementwise(end_radii, n)),
    )
