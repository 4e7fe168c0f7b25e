"""Error of Simbody's angular acceleration of a CustomJoint, as the motion of an operation.

Simbody computes the acceleration of a CustomJoint with an incorrect derivative of its rotation
axes. To reproduce OpenSim's motions, an operation of the type
:class:`osimlite.mechanics.multibody.motions.SimbodyAccelerationError` adds the difference.
"""

from __future__ import annotations

from osimlite.mechanics.kernels.layout import (
    MODEL,
    OPERATION,
    OPERATION_WORK,
    OUTCOME,
    WORK,
    Record,
)
from osimlite.mechanics.kernels.motion import set_spatial_vector
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, copy_numbers
from osimlite.mechanics.kernels.points import operation_ints, operation_work
from osimlite.mechanics.laws.vectors import ZERO, add_scaled, cross, minus, times, vector


class DRIFT(metaclass=Record):
    """Arguments of the operation."""

    SIGN = 0
    """1, or -1 if the joint is traversed from child to parent."""
    COORDINATES = 1
    """Degrees of freedom of the joint's first two coordinates, -1 for a constant one."""
    ROTATIONS = 3
    """Operations that are the joint's three rotations, -1 for one that does not move."""


def place_drift(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, operation: int
) -> int:
    """Pass the frame in SCRATCH on unchanged, since a drift does not move its link.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; SCRATCH holds a frame.
        y: state.
        f: rates of the coordinates.
        operation: number of the operation.

    Returns:
        `OUTCOME.OK`.
    """
    operation_record = operation_work(model, data, operation)
    frame = at(data, WORK.SCRATCH)
    copy_numbers(12, frame, operation_record)
    return OUTCOME.OK


def move_drift(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, operation: int
) -> int:
    """Write zero velocity and the error of the acceleration to SCRATCH.

    The components of the error along the axes of the joint are stored as amount, rate and curvature of
    the operation.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; SCRATCH holds the origin of the spatial vectors and is filled with the
            motion.
        y: state.
        f: rates of the coordinates.
        operation: number of the operation.

    Returns:
        `OUTCOME.OK`.
    """
    drift_ints = at(model, operation_ints(model, operation)[OPERATION.ARGUMENTS])
    operation_record = operation_work(model, data, operation)
    result = at(data, WORK.SCRATCH)
    u = at(y, model[MODEL.DOFS])
    arm = minus(vector(operation_record, OPERATION_WORK.POINT), vector(result, 0))
    total = ZERO
    # The first axis is fixed in the parent, so that only the second and third rotation have an
    # error.
    for row in range(1, 3):
        last_turn = drift_ints[DRIFT.ROTATIONS + row]
        if last_turn < 0:
            continue
        # Simbody rotates the axis of this angle by wrong rates of the angles before it: it takes the
        # rates of all rotations by the coordinates before the row; the true rates are those of the
        # rotations before the axis.
        drift = ZERO
        for turn in range(3):
            number = drift_ints[DRIFT.ROTATIONS + turn]
            if number < 0:
                continue
            rate_error = 0.0
            for c in range(row):
                freedom = drift_ints[DRIFT.COORDINATES + c]
                if freedom >= 0:
                    rate_error += operation_gradient(model, data, number, freedom) * u[freedom]
            if turn < row:
                rate_error -= operation_rate(model, data, u, number)
            drift = add_scaled(
                drift, rate_error, vector(operation_work(model, data, number), OPERATION_WORK.AXIS)
            )
        axis = vector(operation_work(model, data, last_turn), OPERATION_WORK.AXIS)
        total = add_scaled(total, -operation_rate(model, data, u, last_turn), cross(axis, drift))
    (
        operation_record[OPERATION_WORK.AMOUNT],
        operation_record[OPERATION_WORK.RATE],
        operation_record[OPERATION_WORK.CURVATURE],
    ) = total
    # Traversed from child to parent, the same error has the opposite sign.
    total = times(float(drift_ints[DRIFT.SIGN]), total)
    set_spatial_vector(result, ZERO, ZERO)
    # As a spatial acceleration about the common origin.
    set_spatial_vector(at(result, 6), cross(arm, total), total)
    return OUTCOME.OK


def operation_rate(model: Ints, data: Floats, u: Floats, operation: int) -> float:
    """Return the rate of the amount of an operation.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        u: generalized speeds.
        operation: number of the operation.
    """
    freedom = operation_ints(model, operation)[OPERATION.DOF]
    return (
        u[freedom] if freedom >= 0 else operation_work(model, data, operation)[OPERATION_WORK.RATE]
    )


def operation_gradient(model: Ints, data: Floats, operation: int, freedom: int) -> float:
    """Return the derivative of the amount of an operation by a degree of freedom.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        operation: number of the operation.
        freedom: degree of freedom.
    """
    j = operation_ints(model, operation)
    total = 0.0
    if j[OPERATION.DOF] >= 0:
        # An operation that is a coordinate itself has derivative 1 by it.
        return 1.0 if j[OPERATION.DOF] == freedom else 0.0
    # A coordinate may occur several times among the arguments.
    for k in range(j[OPERATION.ARGUMENT_COUNT]):
        if model[j[OPERATION.ARGUMENTS] + k] == freedom:
            total += data[j[OPERATION.GRADIENT] + k]
    return total
