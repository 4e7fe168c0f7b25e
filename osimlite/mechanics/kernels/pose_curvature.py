"""Second derivative of the cost of a pose due to the axes of a joint.

Each axis of a joint is carried by the axes before it. With the moment m of the springs' forces at
arms that a motion about one axis displaces, the second derivative by the angle about an axis a
before it is a . m.
"""

from __future__ import annotations

from osimlite.mechanics.kernels.ball_joint import third_axis
from osimlite.mechanics.kernels.layout import LINK_WORK, MODEL, MOTION, OPERATION, OPERATION_WORK
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.points import link_work, operation_ints, operation_work
from osimlite.mechanics.kernels.pose_record import FIT, SLIDES, Fit
from osimlite.mechanics.laws.rotations import sine_cosine
from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    add_scaled,
    component,
    cross,
    dot,
    minus,
    multiply_elementwise,
    plus,
    times,
    vector,
)
from osimlite.mechanics.laws.vectors import rotate as turned_by


def displaced_moment(load: Floats, moments: Floats, turn: Vector, shift: Vector) -> Vector:
    """Return the moment of the springs' forces at arms that a motion displaces.

    It is the sum over the springs of (shift + turn x arm) x force.

    Args:
        load: sum of moments and forces (6,).
        moments: sum of forces times arms (3, 3).
        turn: angular part of the motion.
        shift: linear part of the motion.
    """
    # Sum of arm (force . turn) - turn (arm . force), written with the matrix of forces times arms.
    trace = moments[0] + moments[4] + moments[8]
    x, y, z = turn
    result = add_scaled(
        add_scaled(times(x, vector(moments, 0)), y, vector(moments, 3)), z, vector(moments, 6)
    )
    return add_scaled(plus(cross(shift, vector(load, 3)), result), -trace, turn)


def add_joint_curvature(m: Fit, y: Floats, link: int, load: Floats, moments: Floats) -> None:
    """Add to the Hessian the contribution of the axes of one joint.

    Args:
        m: inputs and workspace of the fit.
        y: state.
        link: link of the joint.
        load: sum of moments and forces on the subtree of the link.
        moments: sum of forces times arms on the subtree.
    """
    p = m.p
    axis_ranges = at(p, p[FIT.AXES_AT])
    for outer_axis in range(axis_ranges[link], axis_ranges[link + 1]):
        turn, shift = axis_column(m, y, link, outer_axis)
        moment_change = displaced_moment(load, moments, turn, shift)
        # An axis carries itself and those after it.
        for inner_axis in range(axis_ranges[link], outer_axis + 1):
            rotation_axis, _ = axis_column(m, y, link, inner_axis)
            amount = dot(rotation_axis, moment_change)
            add_axis_product(m, y, inner_axis, outer_axis, amount)
            if inner_axis < outer_axis:
                add_axis_product(m, y, outer_axis, inner_axis, amount)
        add_axis_curvature(
            m, y, outer_axis, dot(turn, vector(load, 0)) + dot(shift, vector(load, 3))
        )


def add_axis_curvature(m: Fit, y: Floats, number: int, pull: float) -> None:
    """Add to the Hessian the second derivative of the function of one axis.

    Args:
        m: inputs and workspace of the fit.
        y: state.
        number: number of the axis.
        pull: generalized force of the springs along the axis.
    """
    model = m.model
    size = m.model[MODEL.DOFS]
    bend = at(m.v, m.p[FIT.BEND])
    axis = axis_ints(m, number)
    j = operation_ints(model, axis[0])
    first = model[j[OPERATION.ARGUMENTS]] if j[OPERATION.ARGUMENT_COUNT] > 0 else -1
    # Translations to the ellipsoid are functions of the first two angles.
    if axis[1] >= SLIDES:
        second = model[j[OPERATION.ARGUMENTS] + 1]
        axis_index = axis[1] - SLIDES
        s1, c1 = sine_cosine(y[first])
        s2, c2 = sine_cosine(y[second])
        scaled_pull = pull * m.reals[j[OPERATION.EXTRA] + axis_index]
        mixed = scaled_pull * component((0.0, c1 * s2, s1 * s2), axis_index)
        bend[size * first + first] += scaled_pull * component((0.0, s1 * c2, -c1 * c2), axis_index)
        bend[size * first + second] += mixed
        bend[size * second + first] += mixed
        bend[size * second + second] += scaled_pull * component(
            (-s2, s1 * c2, -c1 * c2), axis_index
        )
    # With unit speeds the curvature of an operation is its second derivative.
    elif axis[1] < 0 and j[OPERATION.DOF] < 0 and j[OPERATION.ARGUMENT_COUNT] == 1 and first >= 0:
        bend[size * first + first] += (
            pull * operation_work(model, m.data, axis[0])[OPERATION_WORK.CURVATURE]
        )


def axis_ints(m: Fit, number: int) -> Ints:
    """Return the operation of an axis, and its part of a ball.

    Args:
        m: inputs and workspace of the fit.
        number: number of the axis.
    """
    return at(m.p, m.p[FIT.AXES_AT] + m.model[MODEL.LINKS] + 1 + 2 * number)


def axis_column(m: Fit, y: Floats, link: int, number: int) -> tuple[Vector, Vector]:
    """Return the twist per unit amount of one axis of a link.

    Args:
        m: inputs and workspace of the fit.
        y: state.
        link: link whose origin of spatial vectors is used.
        number: number of the axis.

    Returns:
        Angular and linear part.
    """
    model = m.model
    data = m.data
    axis = axis_ints(m, number)
    j = operation_ints(model, axis[0])
    a = operation_work(model, data, axis[0])
    rotation_axis, center = vector(a, OPERATION_WORK.AXIS), vector(a, OPERATION_WORK.POINT)
    if axis[1] >= SLIDES:
        axis_index = axis[1] - SLIDES
        sign = 1.0 if j[OPERATION.MOTION] == MOTION.BALL else -1.0
        return ZERO, times(sign, (a[axis_index], a[3 + axis_index], a[6 + axis_index]))
    if axis[1] >= 0:
        # A column of a ball already is the axis of one angle, see `convert_ball_columns`.
        rotation_axis = vector(
            data, model[MODEL.WORK_COLUMN] + 6 * model[j[OPERATION.ARGUMENTS] + axis[1]]
        )
        end_position = multiply_elementwise(
            vector(m.reals, j[OPERATION.EXTRA]), third_axis(y, at(model, j[OPERATION.ARGUMENTS]))
        )
        center = plus(center, turned_by(a, end_position))
    elif j[OPERATION.MOTION] != MOTION.TURN:
        return ZERO, rotation_axis
    return rotation_axis, cross(
        minus(center, vector(link_work(model, data, link), LINK_WORK.ORIGIN)), rotation_axis
    )


def add_axis_product(m: Fit, y: Floats, first_axis: int, second_axis: int, amount: float) -> None:
    """Add to the Hessian a multiple of the product of two axes' derivatives by all coordinates.

    Args:
        m: inputs and workspace of the fit.
        y: state.
        first_axis: number of the first axis.
        second_axis: number of the second axis.
        amount: factor of the product.
    """
    size = m.model[MODEL.DOFS]
    bend = at(m.v, m.p[FIT.BEND])
    for k in range(count_arguments(m, first_axis)):
        first, gain = axis_argument(m, y, first_axis, k)
        if first < 0:
            continue
        for argument in range(count_arguments(m, second_axis)):
            second, second_gain = axis_argument(m, y, second_axis, argument)
            if second >= 0:
                bend[size * first + second] += amount * gain * second_gain


def count_arguments(m: Fit, number: int) -> int:
    """Return the number of coordinates that an axis depends on.

    Args:
        m: inputs and workspace of the fit.
        number: number of the axis.
    """
    model = m.model
    axis = axis_ints(m, number)
    j = operation_ints(model, axis[0])
    if axis[1] >= SLIDES:
        return 2
    return 1 if axis[1] >= 0 or j[OPERATION.DOF] >= 0 else j[OPERATION.ARGUMENT_COUNT]


def axis_argument(m: Fit, y: Floats, number: int, k: int) -> tuple[int, float]:
    """Return a coordinate that an axis depends on, and the derivative of its amount by it.

    Args:
        m: inputs and workspace of the fit.
        y: state.
        number: number of the axis.
        k: number of the coordinate among those of the axis.

    Returns:
        Degree of freedom and derivative.
    """
    model = m.model
    axis = axis_ints(m, number)
    j = operation_ints(model, axis[0])
    if axis[1] >= SLIDES:
        axis_index = axis[1] - SLIDES
        s1, c1 = sine_cosine(y[model[j[OPERATION.ARGUMENTS]]])
        s2, c2 = sine_cosine(y[model[j[OPERATION.ARGUMENTS] + 1]])
        slope = (0.0, -c1 * c2, -s1 * c2) if k == 0 else (c2, s1 * s2, -c1 * s2)
        return model[j[OPERATION.ARGUMENTS] + k], m.reals[
            j[OPERATION.EXTRA] + axis_index
        ] * component(slope, axis_index)
    if axis[1] >= 0:
        return model[j[OPERATION.ARGUMENTS] + axis[1]], 1.0
    if j[OPERATION.DOF] >= 0:
        return j[OPERATION.DOF], 1.0
    return model[j[OPERATION.ARGUMENTS] + k], m.data[j[OPERATION.GRADIENT] + k]
