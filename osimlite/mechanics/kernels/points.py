"""Records of links and operations, and positions, velocities and forces at points of links.

A negative number of a link stands for ground.
"""

from __future__ import annotations

from osimlite.mechanics.kernels.layout import (
    LINK,
    LINK_WORK,
    MODEL,
    MOTION,
    OPERATION,
    OPERATION_WORK,
    REALS,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    cross,
    minus,
    plus,
    rotate,
    store_vector,
    vector,
)


def link_ints(model: Ints, link: int) -> Ints:
    """Return the integers of a link, see `LINK`.

    Args:
        model: integers of the model.
        link: number of the link.
    """
    return at(model, model[MODEL.LINK_AT] + LINK.SIZE * link)


def link_work(model: Ints, data: Floats, link: int) -> Floats:
    """Return the results of a link, see `LINK_WORK`.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        link: number of the link.
    """
    return at(data, model[MODEL.WORK_LINK] + LINK_WORK.SIZE * link)


def operation_ints(model: Ints, operation: int) -> Ints:
    """Return the integers of an operation, see `OPERATION`.

    Args:
        model: integers of the model.
        operation: number of the operation.
    """
    return at(model, model[MODEL.OPERATION_AT] + OPERATION.SIZE * operation)


def operation_work(model: Ints, data: Floats, operation: int) -> Floats:
    """Return the results of an operation, see `OPERATION_WORK`.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        operation: number of the operation.
    """
    return at(data, model[MODEL.WORK_OPERATION] + OPERATION_WORK.SIZE * operation)


def unit_twist(j: Ints, a: Floats, origin: Vector) -> tuple[Vector, Vector]:
    """Return the motion per unit amount of an operation that is no ball: a twist about `origin`.

    Args:
        j: integers of the operation.
        a: results of the operation.
        origin: point of ground that the linear part is taken at (m).

    Returns:
        Angular and linear part of the twist.
    """
    axis = vector(a, OPERATION_WORK.AXIS)
    # A rotation about an axis that does not contain the origin moves the origin, too.
    if j[OPERATION.MOTION] == MOTION.TURN:
        return axis, cross(minus(vector(a, OPERATION_WORK.POINT), origin), axis)
    return ZERO, axis


def station(model: Ints, data: Floats, link: int, point: Vector) -> Vector:
    """Return the position in ground of a point that is fixed in a link (m).

    Args:
        model: integers of the model.
        data: results of an evaluation.
        link: number of the link, negative for ground.
        point: position in the link (m).
    """
    if link < 0:
        return point
    r = link_work(model, data, link)
    # The work of a link begins with its rotation matrix to ground, by rows.
    x, y, z = point
    return (
        r[LINK_WORK.POSITION] + r[0] * x + r[1] * y + r[2] * z,
        r[LINK_WORK.POSITION + 1] + r[3] * x + r[4] * y + r[5] * z,
        r[LINK_WORK.POSITION + 2] + r[6] * x + r[7] * y + r[8] * z,
    )


def direction(model: Ints, data: Floats, link: int, local_direction: Vector) -> Vector:
    """Return a direction that is fixed in a link, along the axes of ground.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        link: number of the link, negative for ground.
        local_direction: direction in the link.
    """
    return local_direction if link < 0 else rotate(link_work(model, data, link), local_direction)


def place_frame(
    model: Ints, data: Floats, link: int, rows: Floats, point: Vector, pose: Floats
) -> None:
    """Compute the pose in ground of a frame that is fixed in a link.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        link: number of the link.
        rows: rotation of the frame in the link, by rows.
        point: origin of the frame in the link (m).
        pose: filled with the rotation in ground by rows (9,), then the origin in ground (3,).
    """
    # Columns of a rotation matrix are directions of axes.
    for k in range(3):
        pose[k], pose[3 + k], pose[6 + k] = direction(
            model, data, link, (rows[k], rows[3 + k], rows[6 + k])
        )
    store_vector(pose, 9, station(model, data, link, point))


def velocity(model: Ints, data: Floats, link: int, point: Vector) -> Vector:
    """Return the velocity (m/s) of the material point of a link at a position in ground.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        link: number of the link, negative for ground.
        point: position in ground (m).
    """
    if link < 0:
        return ZERO
    link_record = link_work(model, data, link)
    v = at(link_record, LINK_WORK.VELOCITY)
    px, py, pz = minus(point, vector(link_record, LINK_WORK.ORIGIN))
    # v + w x p, written out: this is the most frequent product of an evaluation.
    return v[3] + v[1] * pz - v[2] * py, v[4] + v[2] * px - v[0] * pz, v[5] + v[0] * py - v[1] * px


def angular_velocity(model: Ints, data: Floats, link: int) -> Vector:
    """Return the angular velocity of a link along the axes of ground (rad/s).

    Args:
        model: integers of the model.
        data: results of an evaluation.
        link: number of the link, negative for ground.
    """
    return ZERO if link < 0 else vector(link_work(model, data, link), LINK_WORK.VELOCITY)


def acceleration(model: Ints, reals: Floats, data: Floats, link: int, point: Vector) -> Vector:
    """Return the acceleration of a material point of a link while udot = 0 (m/s²).

    The point is at a position in ground. Links carry accelerations relative to free fall, so that
    gravity is added here.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results of an evaluation.
        link: number of the link, negative for ground.
        point: position in ground (m).
    """
    if link < 0:
        return ZERO
    link_record = link_work(model, data, link)
    v = at(link_record, LINK_WORK.VELOCITY)
    a = at(link_record, LINK_WORK.ACCELERATION)
    g = at(reals, REALS.GRAVITY)
    px, py, pz = minus(point, vector(link_record, LINK_WORK.ORIGIN))
    wx, wy, wz = v[0], v[1], v[2]
    # v holds the angular velocity, then that of the material point of the link at its origin.
    vx, vy, vz = v[3] + wy * pz - wz * py, v[4] + wz * px - wx * pz, v[5] + wx * py - wy * px
    # The accelerations of links are relative to free fall: add gravity.
    return (
        a[3] + g[0] + a[1] * pz - a[2] * py + wy * vz - wz * vy,
        a[4] + g[1] + a[2] * px - a[0] * pz + wz * vx - wx * vz,
        a[5] + g[2] + a[0] * py - a[1] * px + wx * vy - wy * vx,
    )


def angular_acceleration_bias(model: Ints, data: Floats, link: int) -> Vector:
    """Return the angular acceleration of a link while udot = 0 (rad/s²).

    Args:
        model: integers of the model.
        data: results of an evaluation.
        link: number of the link, negative for ground.
    """
    return ZERO if link < 0 else vector(link_work(model, data, link), LINK_WORK.ACCELERATION)


def apply_force(model: Ints, data: Floats, link: int, point: Vector, force: Vector) -> None:
    """Add a force (N) at a position in ground to the wrench on a link.

    Args:
        model: integers of the model.
        data: results; the wrench is changed.
        link: number of the link; forces on ground have no effect.
        point: position in ground (m).
        force: force along the axes of ground (N).
    """
    if link < 0:
        return
    link_record = link_work(model, data, link)
    load = at(link_record, LINK_WORK.WRENCH)
    store_vector(
        # Wrenches are torque, then force, about the origin of the link's work, in axes of ground.
        load,
        0,
        plus(vector(load, 0), cross(minus(point, vector(link_record, LINK_WORK.ORIGIN)), force)),
    )
    store_vector(load, 3, plus(vector(load, 3), force))


def apply_torque(model: Ints, data: Floats, link: int, torque: Vector) -> None:
    """Add a torque (N m) to the wrench on a link.

    Args:
        model: integers of the model.
        data: results; the wrench is changed.
        link: number of the link; torques on ground have no effect.
        torque: torque along the axes of ground (N m).
    """
    if link >= 0:
        load = at(link_work(model, data, link), LINK_WORK.WRENCH)
        store_vector(load, 0, plus(vector(load, 0), torque))
