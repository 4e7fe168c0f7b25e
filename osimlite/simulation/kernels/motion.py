"""Where the links are and how they move, outwards from ground."""

from __future__ import annotations

from osimlite.forces.vectors import ZERO, Vector, along, cross, minus, plus, put, times, vector
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

Axes = tuple[Vector, Vector, Vector]

BALL_MOVES = 1
"""How far after the law of a ball (or a drift) that places its link is the one that moves it."""


def place(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats) -> None:
    """Rotations, positions and origins of all links, axes of all operations."""
    for link in range(s[LINKS]):
        i, here = at(s, s[LINK_AT] + LINK_INTS * link), at(w, s[WORK_LINK] + LINK_WORK * link)
        axes, origin = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), ZERO
        if i[PARENT] >= 0:
            parent = at(w, s[WORK_LINK] + LINK_WORK * i[PARENT])
            axes, origin = axes_of(parent), vector(parent, POSITION)
        for operation in range(i[FIRST_OPERATION], i[END_OPERATION]):
            record = s[OPERATION_AT] + OPERATION_INTS * operation
            j, a = at(s, record), at(w, s[WORK_OPERATION] + OPERATION_WORK * operation)
            b = at(x, s[FIXED_AT] + FIXED_NUMBERS * operation)
            if j[BEFORE] != NOTHING:
                origin = plus(origin, along_axes(axes, vector(b, 9)))
                if j[BEFORE] == MOVE:
                    axes = turned_axes(axes, axes_of(b))
            motion = j[MOTION]
            if motion < BALL:
                if j[FREEDOM] >= 0:
                    amount = y[j[FREEDOM]]
                else:
                    call(s[LAWS + j[FUNCTION]], s, x, w, y, f, operation)
                    amount = a[AMOUNT]
                if motion == TURN:
                    one, two, three = axes
                    put(a, AXIS, three)
                    put(a, POINT, origin)
                    sine, cosine = sine_cosine(amount)
                    axes = along(times(cosine, one), sine, two), along(times(cosine, two), -sine, one), three
                else:
                    axis = along_axes(axes, vector(b, 12))
                    put(a, AXIS, axis)
                    origin = along(origin, amount, axis)
            else:
                frame = at(w, SCRATCH)
                set_frame(frame, axes, origin)
                call(s[LAWS + j[FUNCTION]], s, x, w, y, f, operation)
                axes, origin = axes_of(frame), vector(frame, POSITION)
        set_frame(here, axes, origin)
        if i[PARENT] >= 0:
            origin = vector(w, s[WORK_LINK] + LINK_WORK * i[PARENT] + ORIGIN)
        put(here, ORIGIN, origin)


def axes_of(rows: Floats) -> Axes:
    """The axes of a frame, whose rotation is given by rows."""
    return (rows[0], rows[3], rows[6]), (rows[1], rows[4], rows[7]), (rows[2], rows[5], rows[8])


def along_axes(axes: Axes, a: Vector) -> Vector:
    """A vector that has these components along axes."""
    one, two, three = axes
    x, y, z = a
    return along(along(times(x, one), y, two), z, three)


def turned_axes(axes: Axes, others: Axes) -> Axes:
    """Axes that have these components along others, which are the first."""
    one, two, three = others
    return along_axes(axes, one), along_axes(axes, two), along_axes(axes, three)


def set_frame(rows: Floats, axes: Axes, origin: Vector) -> None:
    """Set a rotation by rows, and the position after it."""
    one, two, three = axes
    rows[0], rows[3], rows[6] = one
    rows[1], rows[4], rows[7] = two
    rows[2], rows[5], rows[8] = three
    put(rows, POSITION, origin)


def move(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats) -> int:
    """After `place`: velocities, accelerations without udot, columns of the speeds, rates of coordinates, controls."""
    status, size, controls = OK, s[FREEDOMS], s[CONTROLS]
    if controls > 0:
        status = call(s[controls + LAW], s, x, w, y, f, controls)
    for freedom in range(size):
        f[freedom] = y[size + freedom]
    for k in range(s[SUMMED]):
        set_row(at(w, s[WORK_COLUMN] + 6 * s[s[SUMMED_AT] + k]), ZERO, ZERO)
    for link in range(s[LINKS]):
        i, here = at(s, s[LINK_AT] + LINK_INTS * link), at(w, s[WORK_LINK] + LINK_WORK * link)
        origin = vector(here, ORIGIN)
        # Links that are pushed upwards move in one another as under gravity.
        spin, velocity, spin_rate, acceleration = ZERO, ZERO, ZERO, times(-1.0, vector(x, GRAVITY_AT))
        if i[PARENT] >= 0:
            parent = at(w, s[WORK_LINK] + LINK_WORK * i[PARENT])
            spin, velocity = vector(parent, VELOCITY), vector(parent, VELOCITY + 3)
            spin_rate, acceleration = vector(parent, ACCELERATION), vector(parent, ACCELERATION + 3)
        for operation in range(i[FIRST_OPERATION], i[END_OPERATION]):
            j = at(s, s[OPERATION_AT] + OPERATION_INTS * operation)
            a = at(w, s[WORK_OPERATION] + OPERATION_WORK * operation)
            motion, freedom = j[MOTION], j[FREEDOM]
            if motion < BALL:
                turn, shift = ZERO, vector(a, AXIS)
                if motion == TURN:
                    turn, shift = shift, cross(minus(vector(a, POINT), origin), shift)
                if freedom >= 0:
                    rate = y[size + freedom]
                    column = at(w, s[WORK_COLUMN] + 6 * freedom)
                    if j[FUNCTION] == ALONE:
                        set_row(column, turn, shift)
                    else:
                        add_row(column, 1.0, turn, shift)
                else:
                    rate, curvature = a[RATE], a[CURVATURE]
                    spin_rate = along(spin_rate, curvature, turn)
                    acceleration = along(acceleration, curvature, shift)
                    for k in range(j[ARGUMENT_COUNT]):
                        freedom = s[j[ARGUMENTS] + k]
                        if freedom >= 0:
                            add_row(at(w, s[WORK_COLUMN] + 6 * freedom), w[j[GRADIENT] + k], turn, shift)
                turn, shift = times(rate, turn), times(rate, shift)
            else:
                # The origin goes to the law, and what it finds comes back.
                result = at(w, SCRATCH)
                put(result, 0, origin)
                status = max(status, call(s[LAWS + j[FUNCTION] + BALL_MOVES], s, x, w, y, f, operation))
                turn, shift = vector(result, 0), vector(result, 3)
                acceleration, spin_rate = plus(acceleration, vector(result, 6)), plus(spin_rate, vector(result, 9))
            # The axes are carried around by what moved before.
            spin_rate = plus(spin_rate, cross(spin, turn))
            acceleration = plus(acceleration, plus(cross(velocity, turn), cross(spin, shift)))
            spin, velocity = plus(spin, turn), plus(velocity, shift)
        set_row(at(here, VELOCITY), spin, velocity)
        set_row(at(here, ACCELERATION), spin_rate, acceleration)
    return status


def set_row(row: Floats, turn: Vector, shift: Vector) -> None:
    """Set a spatial vector."""
    put(row, 0, turn)
    put(row, 3, shift)


def add_row(row: Floats, factor: float, turn: Vector, shift: Vector) -> None:
    """Add a multiple to a spatial vector."""
    set_row(row, along(vector(row, 0), factor, turn), along(vector(row, 3), factor, shift))
