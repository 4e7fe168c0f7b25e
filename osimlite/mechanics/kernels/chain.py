"""Accelerations from the mass matrix and bias forces of another program with one-axis joints.

The joints of the other program (Bullet) follow the coordinates: their rates are J u, and their
accelerations J udot + b. The equations of motion of the coordinates are those of the joints,
projected: the mass matrix is Jᵀ M J, and the bias is Jᵀ times the joint forces at the
accelerations b. The derivatives are the entries of J that may differ from zero.
"""

from __future__ import annotations

from osimlite.mechanics.kernels.ball_joint import (
    angle_acceleration_bias,
    angle_rate_row,
    third_axis,
)
from osimlite.mechanics.kernels.layout import (
    CHAIN,
    DOF,
    EXCESS,
    JOINT,
    JOINT_DERIVATIVE,
    JOINT_SOURCE,
    LINK_WORK,
    MODEL,
    OPERATION,
    OPERATION_WORK,
    OUTCOME,
    PRODUCT,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.kernels.points import link_work, operation_ints, operation_work
from osimlite.mechanics.laws.vectors import (
    ZERO,
    cross,
    dot,
    replace_component,
    store_vector,
    times,
    vector,
)


def chain_dynamics(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, unused: int
) -> int:
    """Compute the mass matrix, and subtract the bias from the generalized forces.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: filled with the mass matrix.
        y: state.
        f: rates of the coordinates, then the generalized forces, from which the bias is subtracted.
        unused: argument without meaning, which all laws have.

    Returns:
        `OUTCOME.OK`, or the outcome of the kernel that obtains the joint forces and the mass matrix
        M of the other program.
    """
    h, right = at(model, model[MODEL.CHAIN]), at(f, model[MODEL.DOFS])
    move_joints(model, reals, data, y, f)
    status = call(h[CHAIN.SUPPLY], model, reals, data, y, f, 0)
    if status != OUTCOME.OK:
        return status
    # Joint forces follow the values, rates and accelerations of the joints, and the matrix follows
    # them.
    forces = at(data, h[CHAIN.WORK_JOINTS] + 3 * h[CHAIN.JOINTS])
    derivatives = at(data, h[CHAIN.WORK_DERIVATIVES])
    matrix = at(forces, h[CHAIN.JOINTS])
    for k in range(h[CHAIN.DERIVATIVES]):
        derivative_record = at(model, h[CHAIN.DERIVATIVE_AT] + JOINT_DERIVATIVE.SIZE * k)
        joint, freedom = (
            derivative_record[JOINT_DERIVATIVE.JOINT],
            derivative_record[JOINT_DERIVATIVE.DOF],
        )
        if freedom >= 0:
            right[freedom] -= derivatives[k] * forces[joint]
    for k in range(h[CHAIN.ENTRY_AT], h[CHAIN.END_ENTRY]):
        data[k] = 0.0
    for k in range(h[CHAIN.PRODUCTS]):
        product = at(model, h[CHAIN.PRODUCT_AT] + PRODUCT.SIZE * k)
        data[product[PRODUCT.TARGET]] += (
            derivatives[product[PRODUCT.ONE]]
            * derivatives[product[PRODUCT.TWO]]
            * matrix[product[PRODUCT.ENTRY]]
        )
    # Links without mass have a small inertia in the other program, which requires one; it is
    # subtracted here.
    for k in range(h[CHAIN.EXCESSES]):
        excess = at(model, h[CHAIN.EXCESS_AT] + EXCESS.SIZE * k)
        subtract_inertia(
            model,
            data,
            reals[excess[EXCESS.NUMBER]],
            excess[EXCESS.DOF],
            at(link_work(model, data, excess[EXCESS.LINK]), LINK_WORK.ACCELERATION),
            right,
        )
    return OUTCOME.OK


def subtract_inertia(
    model: Ints, data: Floats, moment: float, freedom: int, acceleration: Floats, right: Floats
) -> None:
    """Subtract an isotropic moment of inertia of a link from the equations of motion.

    The gyroscopic torque of an isotropic inertia is zero, so that only the angular acceleration
    matters.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        moment: moment of inertia about every axis (kg m²).
        freedom: last degree of freedom on the path from ground to the link.
        acceleration: angular acceleration of the link while udot = 0 (rad/s²).
        right: generalized forces (n,); changed.
    """
    freedoms, columns = at(model, model[MODEL.DOF_AT]), at(data, model[MODEL.WORK_COLUMN])
    while freedom >= 0:
        a = at(columns, 6 * freedom)
        row = at(data, freedoms[DOF.SIZE * freedom + DOF.ROW])
        ancestor = freedom
        # Entries of a row belong to the degrees of freedom on the path to ground, beginning with
        # the degree of freedom of the row.
        column = 0
        right[freedom] += moment * (
            a[0] * acceleration[0] + a[1] * acceleration[1] + a[2] * acceleration[2]
        )
        while ancestor >= 0:
            b = at(columns, 6 * ancestor)
            row[column] -= moment * (a[0] * b[0] + a[1] * b[1] + a[2] * b[2])
            ancestor = freedoms[DOF.SIZE * ancestor + DOF.ABOVE]
            column += 1
        freedom = freedoms[DOF.SIZE * freedom + DOF.ABOVE]


def move_joints(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats) -> None:
    """Compute values, rates and accelerations while udot = 0 of all joints, and the derivatives.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: filled at `CHAIN.WORK_JOINTS` and `CHAIN.WORK_DERIVATIVES`.
        y: state.
        f: rates of the coordinates.
    """
    h = at(model, model[MODEL.CHAIN])
    count = h[CHAIN.JOINTS]
    for number in range(count):
        joint = at(model, h[CHAIN.JOINT_AT] + JOINT.SIZE * number)
        joint_motion = at(data, h[CHAIN.WORK_JOINTS] + number)
        joint_kind = joint[JOINT.KIND]
        source = joint[JOINT.SOURCE]
        component_index = joint[JOINT.PART]
        derivatives = at(data, h[CHAIN.WORK_DERIVATIVES] + joint[JOINT.FIRST_DERIVATIVE])
        # A joint that is a coordinate, or a multiple of one, is the usual case.
        if joint_kind == JOINT_SOURCE.LINE:
            factor = reals[component_index]
            derivatives[0] = factor
            joint_motion[0], joint_motion[count], joint_motion[2 * count] = (
                factor * y[source],
                factor * f[source],
                0.0,
            )
            continue
        j = operation_ints(model, source)
        a = operation_work(model, data, source)
        if joint_kind == JOINT_SOURCE.AMOUNT_OF:
            for k in range(j[OPERATION.ARGUMENT_COUNT]):
                derivatives[k] = data[j[OPERATION.GRADIENT] + k]
            joint_motion[0], joint_motion[count], joint_motion[2 * count] = (
                a[OPERATION_WORK.AMOUNT],
                a[OPERATION_WORK.RATE],
                a[OPERATION_WORK.CURVATURE],
            )
        elif joint_kind == JOINT_SOURCE.ANGLE:
            angles = at(model, j[OPERATION.ARGUMENTS])
            joint_motion[0], joint_motion[count] = (
                y[angles[component_index]],
                f[angles[component_index]],
            )
            joint_motion[2 * count] = move_angle(angles, y, f, component_index, derivatives)
        elif joint_kind == JOINT_SOURCE.ELLIPSOID:
            joint_motion[0], joint_motion[count], joint_motion[2 * count] = move_end(
                at(model, j[OPERATION.ARGUMENTS]),
                y,
                at(y, model[MODEL.DOFS]),
                component_index,
                reals[j[OPERATION.EXTRA] + component_index],
                derivatives,
            )
        else:
            # The joint of a drift has no motion, but an acceleration.
            turn = at(a, OPERATION_WORK.AXIS + component_index)
            joint_motion[0] = joint_motion[count] = 0.0
            joint_motion[2 * count] = (
                turn[0] * a[OPERATION_WORK.AMOUNT]
                + turn[3] * a[OPERATION_WORK.RATE]
                + turn[6] * a[OPERATION_WORK.CURVATURE]
            )


def move_angle(angles: Ints, y: Floats, f: Floats, angle_index: int, row: Floats) -> float:
    """Fill the row of N of one angle of a ball.

    Args:
        angles: degrees of freedom of the ball.
        y: state.
        f: rates of the coordinates.
        angle_index: number of the angle, 0, 1 or 2.
        row: filled with the derivatives by the three speeds.

    Returns:
        Acceleration of the angle while udot = 0 (rad/s²).
    """
    store_vector(row, 0, angle_rate_row(y, angles, angle_index))
    return angle_acceleration_bias(y, f, angles, vector(row, 0))


def move_end(
    angles: Ints, y: Floats, u: Floats, axis: int, radius: float, row: Floats
) -> tuple[float, float, float]:
    """Compute the motion of one component of r n, where n is the third axis of a ball.

    Args:
        angles: degrees of freedom of the ball.
        y: state.
        u: generalized speeds.
        axis: component, 0, 1 or 2.
        radius: half axis r of the ellipsoid (m).
        row: filled with the derivatives by the three speeds.

    Returns:
        Value (m), rate (m/s) and acceleration while udot = 0 (m/s²).
    """
    n = third_axis(y, angles)
    spin = (u[angles[0]], u[angles[1]], u[angles[2]])
    # n moves by u x n, and that by u x (u x n).
    store_vector(row, 0, times(radius, cross(n, replace_component(ZERO, axis, 1.0))))
    centripetal = spin[axis] * dot(spin, n) - n[axis] * dot(spin, spin)
    return radius * n[axis], dot(vector(row, 0), spin), radius * centripetal
