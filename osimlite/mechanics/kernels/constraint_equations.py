"""Constraint equations: rows of G, errors of positions, and the required values of G u and G udot.

Each law fills in the equations of one constraint after the velocities of the links are known.
Equations between bodies consist of two types of vectors: an axis that is fixed in a link, and an
arm from a point of one link to a point of another. The derivative of a vector's component by the
speeds equals the generalized force of a unit force along it (principle of virtual work).

For an equation g(q) = 0 with the rate G u, the required value of G udot is -Gdot u, the negative
second derivative of g while udot = 0.
"""

from __future__ import annotations

from osimlite.mechanics.kernels.ball_joint import angle_acceleration_bias, angle_rate_row
from osimlite.mechanics.kernels.functions import (
    FUNCTION_TYPE,
    evaluate_function,
    evaluate_monomials,
)
from osimlite.mechanics.kernels.layout import (
    CONSTRAINED,
    CONSTRAINT,
    COORDINATE,
    DOF,
    LINK,
    LINK_WORK,
    MODEL,
    OUTCOME,
    WORK,
    Record,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.points import (
    acceleration,
    angular_acceleration_bias,
    angular_velocity,
    direction,
    link_ints,
    link_work,
    station,
    velocity,
)
from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    cross,
    divide,
    dot,
    minus,
    norm,
    plus,
    times,
    vector,
)


class VECTOR_TYPE(metaclass=Record):
    """Types of vectors in equations."""

    AXIS = 0
    """An axis that is fixed in a link."""
    ARM = 1
    """A vector from a point of one link to a point of another."""
    MEETING = 2
    """An arm whose rate is that of its end relative to the coincident point of link 1."""


class EQUATION_TYPE(metaclass=Record):
    """Types of equations."""

    PRODUCT = 0
    """The scalar product of two vectors has a given value."""
    DISTANCE = 1
    """The second vector has a given length."""
    SLIP = 2
    """A roller at the end of vector 2 does not slip along vector 1 on its start."""


VECTOR_INTS = 3
"""Number of integers of a vector: type and two links, of which an axis uses the first."""
EQUATION_INTS = 7
"""Number of integers of an equation: its type and two vectors."""
EQUATION_NUMBERS = 13
"""Number of reals of an equation: six per vector (axis, or two points), and the given value."""


def prescribe(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, constraint: int
) -> int:
    """Fill in the equation of a coordinate that follows a function of time.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the equation is filled in.
        y: state.
        f: rates of the coordinates.
        constraint: offset of the constraint in the model.

    Returns:
        `OUTCOME.OK`.
    """
    i = at(model, constraint)
    h = at(model, model[MODEL.CONSTRAINED])
    row = i[CONSTRAINT.FIRST_EQUATION]
    coordinate_ints = at(i, CONSTRAINT.DETAILS)
    value, slope, curvature = evaluate_function(at(reals, i[CONSTRAINT.NUMBERS]), data[WORK.TIME])
    data[h[CONSTRAINED.WORK_ERRORS] + row] = y[coordinate_ints[0]] - value
    data[h[CONSTRAINED.WORK_RATES] + row] = slope
    # The angles of a ball accelerate while its speeds are constant; this bias is subtracted.
    bias = add_coordinate(
        model,
        y,
        f,
        coordinate_ints,
        1.0,
        at(data, h[CONSTRAINED.WORK_ROWS] + model[MODEL.DOFS] * row),
    )
    data[h[CONSTRAINED.WORK_DRIFTS] + row] = curvature - bias
    return OUTCOME.OK


def couple(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, constraint: int) -> int:
    """Fill in the equation of a coordinate that is a function of others.

    The integers of the constraint are the dependent coordinate, the offset of workspace for the
    gradient, the number of the other coordinates, their degrees of freedom, and each of these again as
    a `COORDINATE`. Its numbers are the values of constant coordinates, the dependent one first, and the
    table of the function.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the equation is filled in.
        y: state.
        f: rates of the coordinates.
        constraint: offset of the constraint in the model.

    Returns:
        `OUTCOME.OK`.
    """
    i = at(model, constraint)
    h = at(model, model[MODEL.CONSTRAINED])
    p = at(reals, model[constraint + CONSTRAINT.NUMBERS])
    row = i[CONSTRAINT.FIRST_EQUATION]
    coupler_ints = at(i, CONSTRAINT.DETAILS)
    size = coupler_ints[COORDINATE.SIZE + 1]
    freedoms = at(coupler_ints, COORDINATE.SIZE + 2)
    coordinate_records = at(freedoms, size)
    gradient = at(data, coupler_ints[COORDINATE.SIZE])
    constants = at(p, 1)
    if int(constants[size]) >= FUNCTION_TYPE.MONOMIALS:
        # A function of one coordinate, or a constant.
        value, _, curvature = evaluate_monomials(size, freedoms, constants, y, f, gradient)
    else:
        argument = rate = 0.0
        if size > 0:
            argument = y[freedoms[0]] if freedoms[0] >= 0 else constants[0]
            rate = f[freedoms[0]] if freedoms[0] >= 0 else 0.0
        value, slope, bend = evaluate_function(at(constants, size), argument)
        curvature = bend * rate * rate
        gradient[0] = slope
    target_row = at(data, h[CONSTRAINED.WORK_ROWS] + model[MODEL.DOFS] * row)
    # The dependent coordinate has the factor -1: the error is the function less the coordinate.
    bias = add_coordinate(model, y, f, coupler_ints, -1.0, target_row)
    for k in range(size):
        bias += add_coordinate(
            model, y, f, at(coordinate_records, COORDINATE.SIZE * k), gradient[k], target_row
        )
    data[h[CONSTRAINED.WORK_ERRORS] + row] = value - (
        y[coupler_ints[0]] if coupler_ints[0] >= 0 else p[0]
    )
    data[h[CONSTRAINED.WORK_DRIFTS] + row] = -bias - curvature
    return OUTCOME.OK


def add_coordinate(
    model: Ints, y: Floats, f: Floats, coordinate: Ints, factor: float, row: Floats
) -> float:
    """Add a multiple of the rate of a coordinate to a row.

    Args:
        model: integers of the model.
        y: state.
        f: rates of the coordinates.
        coordinate: integers of the coordinate, see `COORDINATE`.
        factor: factor of the rate.
        row: row of G (n,); changed.

    Returns:
        The multiple of the acceleration of the coordinate while udot = 0.
    """
    freedom, ball = coordinate[COORDINATE.DOF], coordinate[COORDINATE.BALL]
    # A locked coordinate has no speed.
    if freedom < 0:
        return 0.0
    if ball < 0:
        row[freedom] += factor
        return 0.0
    # The rate of an angle of a ball is a row of N times its three speeds.
    angles = at(model, ball)
    n = angle_rate_row(y, angles, coordinate[COORDINATE.PART])
    first_rate, second_rate, third_rate = n
    row[angles[0]] += factor * first_rate
    row[angles[1]] += factor * second_rate
    row[angles[2]] += factor * third_rate
    return factor * angle_acceleration_bias(y, f, angles, n)


def bind_bodies(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, constraint: int
) -> int:
    """Fill in the equations of a constraint between bodies, which its integers and numbers list.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the equations are filled in.
        y: state.
        f: rates of the coordinates.
        constraint: offset of the constraint in the model.

    Returns:
        `OUTCOME.OK`.
    """
    i = at(model, constraint)
    h = at(model, model[MODEL.CONSTRAINED])
    first, size = i[CONSTRAINT.FIRST_EQUATION], model[MODEL.DOFS]
    for row in range(first, i[CONSTRAINT.END_EQUATION]):
        equation_ints = at(i, CONSTRAINT.DETAILS + EQUATION_INTS * (row - first))
        p = at(reals, i[CONSTRAINT.NUMBERS] + EQUATION_NUMBERS * (row - first))
        first_vector = at(equation_ints, 1)
        second_vector = at(equation_ints, 1 + VECTOR_INTS)
        target_value = p[12]
        target_row = at(data, h[CONSTRAINED.WORK_ROWS] + size * row)
        a, a_rate, a_bias = differentiate_vector(model, reals, data, first_vector, p)
        b, b_rate, b_bias = differentiate_vector(model, reals, data, second_vector, at(p, 6))
        error = drift = 0.0
        # Second derivative of a scalar product: both vectors change, hence twice the product of
        # their rates.
        if equation_ints[0] == EQUATION_TYPE.PRODUCT:
            error = dot(a, b) - target_value
            drift = dot(a, b_bias) + dot(b, a_bias) + 2.0 * dot(a_rate, b_rate)
            # The derivative of a . b is that of a along b, plus that of b along a.
            add_vector_row(model, data, first_vector, p, b, target_row)
            add_vector_row(model, data, second_vector, at(p, 6), a, target_row)
        elif equation_ints[0] == EQUATION_TYPE.DISTANCE:
            length = norm(b)
            error = length - target_value
            # At zero distance any direction of the rate is as good.
            e = (1.0, 0.0, 0.0)
            stretch = 0.0
            if length > 0.0:
                e = divide(b, length)
                stretch = (dot(b_rate, b_rate) - dot(e, b_rate) ** 2) / length
            drift = dot(e, b_bias) + stretch
            add_vector_row(model, data, second_vector, at(p, 6), e, target_row)
        else:
            # A roller must not slip on the surface at the point of the surface that it touches.
            surface = second_vector[1]
            roller = second_vector[2]
            point = station(model, data, second_vector[1], vector(p, 6))
            add_force_row(model, data, surface, point, times(-1.0, a), target_row)
            add_force_row(model, data, roller, point, a, target_row)
            turning = angular_velocity(model, data, roller)
            turning_bias = angular_acceleration_bias(model, data, roller)
            # The rate of the arm contains the rotation of the roller, which is not slip.
            drift = dot(a_rate, minus(b_rate, cross(turning, b)))
            drift += dot(a, minus(minus(b_bias, cross(turning_bias, b)), cross(turning, b_rate)))
        data[h[CONSTRAINED.WORK_ERRORS] + row], data[h[CONSTRAINED.WORK_DRIFTS] + row] = (
            error,
            -drift,
        )
    return OUTCOME.OK


def differentiate_vector(
    model: Ints, reals: Floats, data: Floats, vector_ints: Ints, p: Floats
) -> tuple[Vector, Vector, Vector]:
    """Compute a vector, its rate, and its second derivative while udot = 0.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results of an evaluation.
        vector_ints: integers of the vector.
        p: numbers of the vector.

    Returns:
        Vector, rate and second derivative, along the axes of ground.
    """
    first_link, second_link = vector_ints[1], vector_ints[2]
    if vector_ints[0] == VECTOR_TYPE.AXIS:
        axis = direction(model, data, first_link, vector(p, 0))
        turning = angular_velocity(model, data, first_link)
        rate = cross(turning, axis)
        return (
            axis,
            rate,
            plus(
                cross(angular_acceleration_bias(model, data, first_link), axis),
                cross(turning, rate),
            ),
        )
    start = station(model, data, first_link, vector(p, 0))
    end = station(model, data, second_link, vector(p, 3))
    arm = minus(end, start)
    # Both velocities at the same point of ground: what remains is the motion of the end relative to
    # link 1.
    if vector_ints[0] == VECTOR_TYPE.MEETING:
        start = end
    rate = minus(velocity(model, data, second_link, end), velocity(model, data, first_link, start))
    bias = minus(
        acceleration(model, reals, data, second_link, end),
        acceleration(model, reals, data, first_link, start),
    )
    if vector_ints[0] == VECTOR_TYPE.MEETING:
        # Subtract the Coriolis acceleration of the nearest common ancestor of both links.
        while first_link != second_link:
            if first_link > second_link:
                first_link = link_ints(model, first_link)[LINK.PARENT]
            else:
                second_link = link_ints(model, second_link)[LINK.PARENT]
        bias = minus(bias, times(2.0, cross(angular_velocity(model, data, first_link), rate)))
    return arm, rate, bias


def add_vector_row(
    model: Ints, data: Floats, vector_ints: Ints, p: Floats, projection: Vector, row: Floats
) -> None:
    """Add to a row the derivative by the speeds of a vector's rate along a direction.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        vector_ints: integers of the vector.
        p: numbers of the vector.
        projection: direction, along the axes of ground.
        row: row of G (n,); changed.
    """
    # An axis changes by w x a, whose component along `projection` is w . (a x on): a torque.
    first_link, second_link = vector_ints[1], vector_ints[2]
    if vector_ints[0] == VECTOR_TYPE.AXIS:
        add_wrench_row(
            model,
            data,
            first_link,
            cross(direction(model, data, first_link, vector(p, 0)), projection),
            ZERO,
            row,
        )
        return
    start = station(model, data, first_link, vector(p, 0))
    end = station(model, data, second_link, vector(p, 3))
    if vector_ints[0] == VECTOR_TYPE.MEETING:
        start = end
    add_force_row(model, data, first_link, start, times(-1.0, projection), row)
    add_force_row(model, data, second_link, end, projection, row)


def add_force_row(
    model: Ints, data: Floats, link: int, point: Vector, force: Vector, row: Floats
) -> None:
    """Add to a row the generalized forces of a force on a link at a point of ground.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        link: number of the link; ground has no generalized forces.
        point: point of action in ground (m).
        force: force, along the axes of ground.
        row: row of G (n,); changed.
    """
    if link >= 0:
        arm = minus(point, vector(link_work(model, data, link), LINK_WORK.ORIGIN))
        add_wrench_row(model, data, link, cross(arm, force), force, row)


def add_wrench_row(
    model: Ints, data: Floats, link: int, torque: Vector, force: Vector, row: Floats
) -> None:
    """Add to a row the generalized forces of a wrench on a link.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        link: number of the link; ground has no generalized forces.
        torque: torque about the origin of the spatial vectors, along the axes of ground.
        force: force, along the axes of ground.
        row: row of G (n,); changed.
    """
    # Links without degrees of freedom, such as welded bodies, transmit the wrench to their parent.
    while (
        link >= 0 and link_ints(model, link)[LINK.FIRST_DOF] == link_ints(model, link)[LINK.END_DOF]
    ):
        link = link_ints(model, link)[LINK.PARENT]
    if link < 0:
        return
    freedom = link_ints(model, link)[LINK.END_DOF] - 1
    while freedom >= 0:
        column = model[MODEL.WORK_COLUMN] + 6 * freedom
        row[freedom] += dot(torque, vector(data, column)) + dot(force, vector(data, column + 3))
        freedom = model[model[MODEL.DOF_AT] + DOF.SIZE * freedom + DOF.ABOVE]
