"""Cost of a pose, the weighted squared deviations of its measurements, with derivatives.

The cost is half the weighted sum of the squared distances of markers (m^2), squared angles of
orientation sensors (rad^2) and squared deviations of coordinates. A marker is a point mass on its
link and a spring that pulls at it: the gradient is the generalized force of the springs, and the
Gauss-Newton part of the Hessian is the mass matrix of the point masses, which the
composite-rigid-body algorithm computes. The rest of the Hessian follows from how the axes of the
joints rotate one another (R. Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 2.10 and
6.2): a rotation about an axis carries the columns of all joints outwards of it.

The Hessian omits the second derivatives of functions of several coordinates.
"""

from __future__ import annotations

from osimlite.mechanics.kernels.constrained_dynamics import evaluate_constraints
from osimlite.mechanics.kernels.dynamics import spatial_momentum
from osimlite.mechanics.kernels.functions import (
    FUNCTION_TYPE,
    evaluate_function,
    evaluate_monomials,
)
from osimlite.mechanics.kernels.layout import CONSTRAINED, DOF, LINK, LINK_WORK, MODEL, STAGE
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.kernels.points import link_ints, link_work, station
from osimlite.mechanics.kernels.pose_curvature import add_joint_curvature, displaced_moment
from osimlite.mechanics.kernels.pose_record import COUPLER, FIT, MARKER_NUMBERS, Fit
from osimlite.mechanics.kernels.pose_sensors import add_sensors
from osimlite.mechanics.kernels.projection import collect_position_errors, write_position_jacobian
from osimlite.mechanics.laws.rotations import sine_cosine
from osimlite.mechanics.laws.vectors import (
    cross,
    dot,
    minus,
    plus,
    store_vector,
    times,
    vector,
)


def evaluate_cost(m: Fit, y: Floats) -> float:
    """Return the cost of a pose.

    Its gradient and both parts of its Hessian by all free coordinates are computed, too.

    Args:
        m: inputs and workspace of the fit.
        y: state of the pose; speeds are set to 1.

    Returns:
        Half the weighted sum of squared deviations.
    """
    model = m.model
    data = m.data
    p = m.p
    v = m.v
    size = m.model[MODEL.DOFS]
    evaluate_pose(m, y)
    # Columns of balls belong to their speeds; derivatives are by coordinates.
    for k in range(p[FIT.BALLS]):
        convert_ball_columns(m, y, at(model, p[p[FIT.BALL_AT] + k]))
    slope, stiffness, bend = at(v, p[FIT.SLOPE]), at(v, p[FIT.STIFFNESS]), at(v, p[FIT.BEND])
    for k in range(size):
        slope[k] = 0.0
    for k in range(size * size):
        stiffness[k] = bend[k] = 0.0
    for link in range(model[MODEL.LINKS]):
        link_sums = at(link_work(model, data, link), LINK_WORK.INERTIA)
        moments = at(v, p[FIT.MOMENTS] + 9 * link)
        # Inertia and wrench of each link collect masses and forces of springs.
        for k in range(16):
            link_sums[k] = 0.0
        for k in range(9):
            moments[k] = 0.0
    value = add_markers(m) + add_sensors(m)
    gather_derivatives(m, y)
    goals = 3 * p[FIT.MARKERS] + 9 * p[FIT.SENSORS]
    for k in range(p[FIT.GOALS]):
        freedom = p[p[FIT.GOAL_AT] + k]
        weight = v[p[FIT.WEIGHTS] + p[FIT.MARKERS] + p[FIT.SENSORS] + k]
        if weight > 0.0:
            # A goal is a spring on its coordinate.
            deviation = y[freedom] - v[p[FIT.MEASURED] + goals + k]
            value += 0.5 * weight * deviation * deviation
            slope[freedom] += weight * deviation
            stiffness[size * freedom + freedom] += weight
    apply_couplers(m, y)
    return value


def evaluate_pose(m: Fit, y: Floats) -> None:
    """Evaluate a pose: links, columns of the coordinates, and equations.

    Args:
        m: inputs and workspace of the fit.
        y: state; its speeds are set to 1.
    """
    model = m.model
    p = m.p
    v = m.v
    size = m.model[MODEL.DOFS]
    for k in range(size):
        # With unit speeds, curvatures of functions are second derivatives by their coordinate.
        y[size + k] = 1.0
    call(model[MODEL.LAWS], model, m.reals, m.data, y, m.f, STAGE.VELOCITY)
    if model[MODEL.CONSTRAINED] > 0:
        evaluate_constraints(model, m.reals, m.data, y, m.f)
        collect_position_errors(model, m.data, at(v, p[FIT.ERRORS]))
        write_position_jacobian(model, m.data, y, at(v, p[FIT.ROWS]))


def convert_ball_columns(m: Fit, y: Floats, angles: Ints) -> None:
    """Convert the columns of the speeds of a ball to those of the rates of its angles.

    Args:
        m: the fit; the columns in its data are changed.
        y: state.
        angles: degrees of freedom of the three angles.
    """
    columns = at(m.data, m.model[MODEL.WORK_COLUMN])
    s1, c1 = sine_cosine(y[angles[0]])
    s2, c2 = sine_cosine(y[angles[1]])
    first_column = at(columns, 6 * angles[0])
    second_column = at(columns, 6 * angles[1])
    third_column = at(columns, 6 * angles[2])
    for k in range(6):
        a, b, c = first_column[k], second_column[k], third_column[k]
        second_column[k] = c1 * b + s1 * c
        third_column[k] = s2 * a - s1 * c2 * b + c1 * c2 * c


def add_markers(m: Fit) -> float:
    """Add the masses and springs of the markers to the links.

    Args:
        m: the fit; inertias and wrenches of links are changed.

    Returns:
        Cost of the markers.
    """
    model, data, p, v, value = m.model, m.data, m.p, m.v, 0.0
    for k in range(p[FIT.MARKERS]):
        weight, link = v[p[FIT.WEIGHTS] + k], p[p[FIT.MARKER_AT] + k]
        if not weight > 0.0:
            continue
        point = station(model, data, link, vector(m.c, MARKER_NUMBERS * k))
        # Gradient of the cost by the position of the marker: the pull of the spring, reversed.
        deviation = minus(point, vector(v, p[FIT.MEASURED] + 3 * k))
        value += 0.5 * weight * dot(deviation, deviation)
        if link < 0:
            continue
        link_record = link_work(model, data, link)
        i = at(link_record, LINK_WORK.INERTIA)
        load = at(link_record, LINK_WORK.WRENCH)
        moments = at(v, p[FIT.MOMENTS] + 9 * link)
        pull = times(weight, deviation)
        arm = minus(point, vector(link_record, LINK_WORK.ORIGIN))
        a, b, c = arm
        mx, my, mz = times(weight, arm)
        # Inertia of a point mass about the common origin.
        i[0] += weight
        i[1] += mx
        i[2] += my
        i[3] += mz
        i[4] += my * b + mz * c
        i[5] += mx * a + mz * c
        i[6] += mx * a + my * b
        i[7] -= mx * b
        i[8] -= mx * c
        i[9] -= my * c
        store_vector(load, 0, plus(vector(load, 0), cross(arm, pull)))
        store_vector(load, 3, plus(vector(load, 3), pull))
        # Sums of force times arm, by rows; with them a displacement of the arms changes the moment.
        px, py, pz = pull
        store_vector(moments, 0, plus(vector(moments, 0), times(px, arm)))
        store_vector(moments, 3, plus(vector(moments, 3), times(py, arm)))
        store_vector(moments, 6, plus(vector(moments, 6), times(pz, arm)))
    return value


def gather_derivatives(m: Fit, y: Floats) -> None:
    """Compute gradient and Hessian by the degrees of freedom, inwards from the leaves.

    Args:
        m: inputs and workspace of the fit.
        y: state of the pose.
    """
    model = m.model
    data = m.data
    p = m.p
    v = m.v
    size = m.model[MODEL.DOFS]
    freedoms, columns = at(model, model[MODEL.DOF_AT]), at(data, model[MODEL.WORK_COLUMN])
    slope, stiffness, bend = at(v, p[FIT.SLOPE]), at(v, p[FIT.STIFFNESS]), at(v, p[FIT.BEND])
    for link in range(model[MODEL.LINKS] - 1, -1, -1):
        j = link_ints(model, link)
        link_record = link_work(model, data, link)
        i = at(link_record, LINK_WORK.INERTIA)
        load = at(link_record, LINK_WORK.WRENCH)
        moments = at(v, p[FIT.MOMENTS] + 9 * link)
        # A subtree without measurements contributes nothing.
        if i[0] > 0.0 or i[4] > 0.0:
            for freedom in range(j[LINK.FIRST_DOF], j[LINK.END_DOF]):
                c = at(columns, 6 * freedom)
                turn, shift = vector(c, 0), vector(c, 3)
                slope[freedom] += dot(turn, vector(load, 0)) + dot(shift, vector(load, 3))
                # As in the composite-rigid-body algorithm: the Gauss-Newton matrix is a mass
                # matrix.
                angular, linear = spatial_momentum(i, turn, shift)
                moment_change = displaced_moment(load, moments, turn, shift)
                k = freedom
                while k >= 0:
                    c = at(columns, 6 * k)
                    entry = dot(vector(c, 0), angular) + dot(vector(c, 3), linear)
                    stiffness[size * freedom + k] = stiffness[size * k + freedom] = entry
                    # Axes of one joint are carried by each other; `add_joint_curvature` treats
                    # these.
                    if k < j[LINK.FIRST_DOF]:
                        bend[size * freedom + k] = bend[size * k + freedom] = dot(
                            vector(c, 0), moment_change
                        )
                    k = freedoms[DOF.SIZE * k + DOF.ABOVE]
            add_joint_curvature(m, y, link, load, moments)
        if j[LINK.PARENT] >= 0:
            parent_sums = at(link_work(model, data, j[LINK.PARENT]), LINK_WORK.INERTIA)
            # Inertia (10) and wrench (6) are adjacent, and both are summed.
            for k in range(16):
                parent_sums[k] += i[k]
            parent_sums = at(v, p[FIT.MOMENTS] + 9 * j[LINK.PARENT])
            for k in range(9):
                parent_sums[k] += moments[k]


def apply_couplers(m: Fit, y: Floats) -> None:
    """Convert the derivatives and the equations to those by the independent coordinates.

    Args:
        m: inputs and workspace of the fit.
        y: state of the pose.
    """
    p = m.p
    v = m.v
    size = m.model[MODEL.DOFS]
    slope = at(v, p[FIT.SLOPE])
    stiffness = at(v, p[FIT.STIFFNESS])
    bend = at(v, p[FIT.BEND])
    rows = at(v, p[FIT.ROWS])
    gradient = at(v, p[FIT.WORKSPACE])
    rates = at(v, p[FIT.WORKSPACE] + size)
    for k in range(size):
        rates[k] = 1.0
    # Backwards, so that a dependent coordinate may itself be an argument of another coupler.
    for number in range(p[FIT.COUPLERS] - 1, -1, -1):
        i = at(p, p[p[FIT.COUPLER_AT] + number])
        dependent = i[COUPLER.DEPENDENT]
        _, curvature = evaluate_coupler(m, i, y, gradient, rates)
        for k in range(i[COUPLER.COUNT]):
            freedom = i[COUPLER.ARGUMENTS + k]
            if freedom < 0:
                continue
            gain = gradient[k]
            # Columns, then rows: the congruence transformation of the Hessian.
            for j in range(size):
                stiffness[size * j + freedom] += gain * stiffness[size * j + dependent]
                bend[size * j + freedom] += gain * bend[size * j + dependent]
            for j in range(size):
                stiffness[size * freedom + j] += gain * stiffness[size * dependent + j]
                bend[size * freedom + j] += gain * bend[size * dependent + j]
            if i[COUPLER.COUNT] == 1:
                bend[size * freedom + freedom] += curvature * slope[dependent]
            slope[freedom] += gain * slope[dependent]
            for j in range(count_equations(m)):
                rows[size * j + freedom] += gain * rows[size * j + dependent]


def count_equations(m: Fit) -> int:
    """Return the number of equations that constrain positions."""
    return (
        m.model[m.model[MODEL.CONSTRAINED] + CONSTRAINED.POSITIONS]
        if m.model[MODEL.CONSTRAINED] > 0
        else 0
    )


def evaluate_coupler(
    m: Fit, i: Ints, y: Floats, gradient: Floats, rates: Floats
) -> tuple[float, float]:
    """Evaluate a coordinate that depends on others, and fill the derivatives by these.

    Args:
        m: inputs and workspace of the fit.
        i: integers of the coupler.
        y: state.
        gradient: filled with the derivatives by the arguments.
        rates: rates of the coordinates for the second derivative.

    Returns:
        The value, and the second derivative if it depends on one coordinate.
    """
    size = i[COUPLER.COUNT]
    constants = at(m.c, i[COUPLER.NUMBERS])
    if int(constants[size]) >= FUNCTION_TYPE.MONOMIALS:
        value, _, curvature = evaluate_monomials(
            size, at(i, COUPLER.ARGUMENTS), constants, y, rates, gradient
        )
        return value, curvature
    argument = 0.0
    if size > 0:
        argument = y[i[COUPLER.ARGUMENTS]] if i[COUPLER.ARGUMENTS] >= 0 else constants[0]
    value, slope, curvature = evaluate_function(at(constants, size), argument)
    gradient[0] = slope
    return value, curvature
