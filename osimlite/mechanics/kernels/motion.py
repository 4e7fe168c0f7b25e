"""Forward kinematics: poses and velocities of the links, outwards from ground.

Velocities and accelerations are propagated from each link to its children as in the outward pass
of the recursive Newton-Euler algorithm (R. Featherstone, Rigid Body Dynamics Algorithms, 2008,
chapter 5.3), in spatial vectors along the axes of ground.
"""

from __future__ import annotations

from osimlite.mechanics.kernels.layout import (
    FIXED,
    ITEM,
    LINK,
    LINK_WORK,
    MODEL,
    MOTION,
    OPERATION,
    OPERATION_WORK,
    OUTCOME,
    REALS,
    TRANSFORM,
    WORK,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.kernels.points import (
    link_ints,
    link_work,
    operation_ints,
    operation_work,
    unit_twist,
)
from osimlite.mechanics.laws.rotations import (
    Axes,
    X,
    Y,
    Z,
    combine_axes,
    multiply_rotations,
    sine_cosine,
)
from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    add_scaled,
    cross,
    plus,
    store_vector,
    times,
    vector,
)

BALL_MOVES = 1
"""Offset from the number of the law that places a ball (or drift) to that of the law that moves it."""


def place_links(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats) -> None:
    """Compute rotations, positions and origins of all links, and the axes of all operations.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: filled with the poses.
        y: state; only the coordinates are used.
        f: scratch that laws may use.
    """
    # Parents come before children, so that one pass is enough.
    for link in range(model[MODEL.LINKS]):
        i = link_ints(model, link)
        link_record = link_work(model, data, link)
        # Start from the frame of the parent, or of ground.
        axes = (X, Y, Z)
        origin = ZERO
        if i[LINK.PARENT] >= 0:
            parent = link_work(model, data, i[LINK.PARENT])
            axes = axes_from_rows(parent)
            origin = vector(parent, LINK_WORK.POSITION)
        for operation in range(i[LINK.FIRST_OPERATION], i[LINK.END_OPERATION]):
            record = model[MODEL.OPERATION_AT] + OPERATION.SIZE * operation
            j = at(model, record)
            a = operation_work(model, data, operation)
            b = at(reals, model[MODEL.FIXED_AT] + FIXED.SIZE * operation)
            # Apply the fixed transform before the motion.
            # Most joints are not offset by a rotation: skip identity transforms.
            if j[OPERATION.BEFORE] != TRANSFORM.NOTHING:
                origin = plus(origin, combine_axes(axes, vector(b, FIXED.TRANSLATION)))
                if j[OPERATION.BEFORE] == TRANSFORM.MOVE:
                    axes = multiply_rotations(axes, axes_from_rows(b))
            motion = j[OPERATION.MOTION]
            if motion < MOTION.BALL:
                if j[OPERATION.DOF] >= 0:
                    amount = y[j[OPERATION.DOF]]
                else:
                    call(
                        # A function of coordinates gives the amount.
                        model[MODEL.LAWS + j[OPERATION.FUNCTION]],
                        model,
                        reals,
                        data,
                        y,
                        f,
                        operation,
                    )
                    amount = a[OPERATION_WORK.AMOUNT]
                # Rotate about z, or translate along the axis; keep the axis for the velocities.
                if motion == MOTION.TURN:
                    x_axis, y_axis, z_axis = axes
                    store_vector(a, OPERATION_WORK.AXIS, z_axis)
                    store_vector(a, OPERATION_WORK.POINT, origin)
                    sine, cosine = sine_cosine(amount)
                    axes = (
                        add_scaled(times(cosine, x_axis), sine, y_axis),
                        add_scaled(times(cosine, y_axis), -sine, x_axis),
                        z_axis,
                    )
                else:
                    axis = combine_axes(axes, vector(b, FIXED.AXIS))
                    store_vector(a, OPERATION_WORK.AXIS, axis)
                    origin = add_scaled(origin, amount, axis)
            # A ball changes the frame by three angles: its law receives the frame in SCRATCH and
            # returns it there.
            else:
                frame = at(data, WORK.SCRATCH)
                set_frame(frame, axes, origin)
                call(model[MODEL.LAWS + j[OPERATION.FUNCTION]], model, reals, data, y, f, operation)
                axes = axes_from_rows(frame)
                origin = vector(frame, LINK_WORK.POSITION)
        # All links of a tree share the origin of its first link for their spatial vectors, so that
        # these add up without shifts.
        set_frame(link_record, axes, origin)
        if i[LINK.PARENT] >= 0:
            origin = vector(link_work(model, data, i[LINK.PARENT]), LINK_WORK.ORIGIN)
        store_vector(link_record, LINK_WORK.ORIGIN, origin)


def axes_from_rows(rows: Floats) -> Axes:
    """Return the axes of a frame, the columns of a rotation that is stored by rows."""
    return (rows[0], rows[3], rows[6]), (rows[1], rows[4], rows[7]), (rows[2], rows[5], rows[8])


def set_frame(rows: Floats, axes: Axes, origin: Vector) -> None:
    """Store a rotation by rows, and the position after it.

    Args:
        rows: filled with the rotation (9,) and the position (3,).
        axes: axes of the frame, the columns of the rotation.
        origin: position of the frame's origin (m).
    """
    x_axis, y_axis, z_axis = axes
    rows[0], rows[3], rows[6] = x_axis
    rows[1], rows[4], rows[7] = y_axis
    rows[2], rows[5], rows[8] = z_axis
    store_vector(rows, LINK_WORK.POSITION, origin)


def move_links(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats) -> int:
    """Compute velocities, accelerations while udot = 0, columns of the speeds, and controls.

    `place_links` must have been called for the same state.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: filled with velocities, accelerations and columns.
        y: state.
        f: first part (n,) filled with the rates of the coordinates.

    Returns:
        `OUTCOME.OK`, or the outcome of a law that failed.
    """
    status = OUTCOME.OK
    size = model[MODEL.DOFS]
    controls = model[MODEL.CONTROLS]
    # Controls first: items may need them.
    if controls > 0:
        status = call(model[controls + ITEM.LAW], model, reals, data, y, f, controls)
    # The rates are the speeds, except for balls, whose law overwrites them.
    for freedom in range(size):
        f[freedom] = y[size + freedom]
    # Columns that are sums start from zero; all others are overwritten.
    for k in range(model[MODEL.SUMMED]):
        set_spatial_vector(
            at(data, model[MODEL.WORK_COLUMN] + 6 * model[model[MODEL.SUMMED_AT] + k]), ZERO, ZERO
        )
    for link in range(model[MODEL.LINKS]):
        i = link_ints(model, link)
        link_record = link_work(model, data, link)
        origin = vector(link_record, LINK_WORK.ORIGIN)
        # An upward acceleration of ground has the same effect as gravity.
        spin = ZERO
        velocity = ZERO
        spin_rate = ZERO
        acceleration = times(-1.0, vector(reals, REALS.GRAVITY))
        if i[LINK.PARENT] >= 0:
            parent = link_work(model, data, i[LINK.PARENT])
            spin = vector(parent, LINK_WORK.VELOCITY)
            velocity = vector(parent, LINK_WORK.VELOCITY + 3)
            spin_rate = vector(parent, LINK_WORK.ACCELERATION)
            acceleration = vector(parent, LINK_WORK.ACCELERATION + 3)
        for operation in range(i[LINK.FIRST_OPERATION], i[LINK.END_OPERATION]):
            j = operation_ints(model, operation)
            a = operation_work(model, data, operation)
            motion, freedom = j[OPERATION.MOTION], j[OPERATION.DOF]
            if motion < MOTION.BALL:
                turn, shift = unit_twist(j, a, origin)
                if freedom >= 0:
                    rate = y[size + freedom]
                    column = at(data, model[MODEL.WORK_COLUMN] + 6 * freedom)
                    if j[OPERATION.FUNCTION] == OPERATION.SINGLE:
                        # Only an operation that is a degree of freedom alone may overwrite its
                        # column.
                        set_spatial_vector(column, turn, shift)
                    else:
                        add_spatial_vector(column, 1.0, turn, shift)
                else:
                    # A function: its rate moves the link, and its curvature is an acceleration
                    # while udot = 0.
                    rate, curvature = a[OPERATION_WORK.RATE], a[OPERATION_WORK.CURVATURE]
                    spin_rate = add_scaled(spin_rate, curvature, turn)
                    acceleration = add_scaled(acceleration, curvature, shift)
                    for k in range(j[OPERATION.ARGUMENT_COUNT]):
                        freedom = model[j[OPERATION.ARGUMENTS] + k]
                        if freedom >= 0:
                            add_spatial_vector(
                                at(data, model[MODEL.WORK_COLUMN] + 6 * freedom),
                                data[j[OPERATION.GRADIENT] + k],
                                turn,
                                shift,
                            )
                turn, shift = times(rate, turn), times(rate, shift)
            else:
                # Pass the origin to the law in SCRATCH, where it returns its results.
                result = at(data, WORK.SCRATCH)
                store_vector(result, 0, origin)
                status = max(
                    status,
                    call(
                        model[MODEL.LAWS + j[OPERATION.FUNCTION] + BALL_MOVES],
                        model,
                        reals,
                        data,
                        y,
                        f,
                        operation,
                    ),
                )
                turn, shift = vector(result, 0), vector(result, 3)
                acceleration = plus(acceleration, vector(result, 6))
                spin_rate = plus(spin_rate, vector(result, 9))
            # Coriolis terms: earlier motions carry the axes of this one.
            spin_rate = plus(spin_rate, cross(spin, turn))
            acceleration = plus(acceleration, plus(cross(velocity, turn), cross(spin, shift)))
            spin, velocity = plus(spin, turn), plus(velocity, shift)
        set_spatial_vector(at(link_record, LINK_WORK.VELOCITY), spin, velocity)
        set_spatial_vector(at(link_record, LINK_WORK.ACCELERATION), spin_rate, acceleration)
    return status


def set_spatial_vector(row: Floats, turn: Vector, shift: Vector) -> None:
    """Store a spatial vector, angular part first.

    Args:
        row: filled with the spatial vector (6,).
        turn: angular part.
        shift: linear part.
    """
    store_vector(row, 0, turn)
    store_vector(row, 3, shift)


def add_spatial_vector(row: Floats, factor: float, turn: Vector, shift: Vector) -> None:
    """Add a multiple of a spatial vector to a stored one.

    Args:
        row: spatial vector (6,); changed.
        factor: factor of the added vector.
        turn: angular part.
        shift: linear part.
    """
    set_spatial_vector(
        row, add_scaled(vector(row, 0), factor, turn), add_scaled(vector(row, 3), factor, shift)
    )
