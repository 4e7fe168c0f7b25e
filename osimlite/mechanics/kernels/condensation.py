"""Linear equations of implicit integrators, condensed to the size of the speeds.

An implicit method repeatedly solves (1 - c J) d = r, where J is the derivative of the rates of a
state (q, u, z) by the state. Here J contains the contributions of muscles, springs and stops. Each
acts along one displacement, with a force and with rates of its states that depend on this
displacement, its speed and these states only. Its states are therefore eliminated locally, by
static condensation as of internal variables in finite elements, and so are the coordinates, whose
rates count as the speeds.

The condensed matrix has the size of the speeds: the mass matrix, and for each force a rank-one
stiffness along its generalized force per newton. Constraint equations count as heavy masses along
them. A contact of half spaces and spheres is three such forces, along the normal and across it;
friction grows with the depth. Other derivatives (Coriolis forces, changing moment arms of muscles)
are omitted from J: iterations converge without them, and W-methods keep their order.
"""

from __future__ import annotations

from osimlite.mechanics.kernels.constrained_dynamics import evaluate_constraints
from osimlite.mechanics.kernels.dynamics import (
    add_generalized_forces,
    clear_wrenches,
    composite_rigid_body,
    spatial_inertias_and_bias,
)
from osimlite.mechanics.kernels.layout import (
    CONSTRAINED,
    CONTACT_WORK,
    DOF,
    INERTIA,
    ITEM,
    LINK,
    LINK_WORK,
    MODEL,
    MOTION,
    OPERATION,
    OPERATION_WORK,
    OUTCOME,
    REALS,
    RESPONSE,
    STAGE,
    WORK,
    Record,
)
from osimlite.mechanics.kernels.linear_algebra import (
    dot_range,
    factorise_matrix,
    invert_matrix,
    solve_factorised,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.kernels.points import (
    link_ints,
    link_work,
    operation_ints,
    operation_work,
    station,
    unit_twist,
)
from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    cross,
    dot,
    minus,
    plus,
    rotate,
    store_vector,
    times,
    vector,
)

MOST_STATES = 3
"""Largest number of states of a force that are condensed."""
WIDTH = 2 + MOST_STATES
"""Length of a row of derivatives: by displacement, by speed, and by states.

The first row is that of the force; the others are those of the rates of the states.
"""


class RESPONSE_WORK(metaclass=Record):
    """Record of a force, which begins with its derivatives."""

    INVERSE = (1 + MOST_STATES) * WIDTH
    """Inverse of 1 - c J of its states, after the derivatives."""
    GAINS = INVERSE + MOST_STATES * MOST_STATES
    """Change of the states per unit of speed."""
    PULLS = GAINS + MOST_STATES
    """Change of the force per unit of the states' right sides."""
    RIGHT = GAINS + 2 * MOST_STATES
    """Right sides of the states."""
    FIRST = GAINS + 3 * MOST_STATES
    """First degree of freedom that the force acts on."""
    END = GAINS + 3 * MOST_STATES + 1
    """End of these degrees of freedom."""
    SIZE = GAINS + 3 * MOST_STATES + 2
    """Length of the record of a force, without the generalized force per newton (n,) before it."""


class MATRIX(metaclass=Record):
    """Numbers of the matrices (n, n) in the workspace."""

    SYSTEM = 1
    """Condensed matrix (n, n); number 0 is the mass matrix."""
    STIFFNESS = 2
    """Derivatives of generalized forces by coordinates, at constant states."""
    DAMPING = 3
    """Derivatives of generalized forces by speeds, at constant states."""
    LEVERS = 4
    """Derivatives of generalized forces by coordinates, with condensed states."""
    COUNT = 5
    """Number of matrices, after which a right side (n,) follows."""


# In place of the inertia of a link, which has 10 numbers, and the first two of its wrench.
LOAD = 12
"""Length of the load of a link: force (3,), and sum of products of positions and forces (3, 3)."""


class CONTACT_NUMBERS(metaclass=Record):
    """Numbers of a pair of contact surfaces."""

    CENTER = 7
    """Centre of surface 2."""
    RADIUS = 10
    """Radius of surface 2."""


FORCE_ROUNDING = 1e-12
"""Entries of a generalized force per newton below this are rounding errors."""


CONSTRAINT_MASS = 1e6
"""Mass that represents a constraint equation, relative to the largest diagonal entry of M."""


def condensation_size(size: int, responses: int) -> int:
    """Return the length of the workspace of the condensation.

    Args:
        size: number of speeds.
        responses: number of forces.
    """
    return MATRIX.COUNT * size * size + size + responses * (size + RESPONSE_WORK.SIZE)


def linearise_state(
    model: Ints,
    reals: Floats,
    data: Floats,
    y: Floats,
    f: Floats,
    work: Floats,
    is_evaluated: float,
) -> int:
    """Linearise the equations of motion at a state: mass matrix M, stiffness K and damping D.

    M d(udot) = K dq + D du, where K and D are the derivatives of the generalized forces by
    coordinates and speeds (a stiff spring has a negative K). Each contact or spring contributes one
    row: its generalized force r per newton, and the derivatives k and d of the force by its
    displacement and speed, so that K and D grow by the rank-one matrices s k r rᵀ and s d r rᵀ,
    where s is `RESPONSE.SENSE` (-1 for a force that pulls against the displacement).

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results of an evaluation.
        y: state.
        f: workspace for the rates of the state.
        work: filled with the matrices and the records of contacts and springs, see
            `condensation_size`.
        is_evaluated: not 0 if the last evaluation was at this state.

    Returns:
        `OUTCOME.OK`, or the outcome of a kernel that failed.
    """
    size = model[MODEL.DOFS]
    status = OUTCOME.OK
    right = at(f, size)
    if is_evaluated == 0.0:
        status = call(model[MODEL.LAWS], model, reals, data, y, f, STAGE.ACCELERATION)
    if status != OUTCOME.OK:
        return status
    if model[MODEL.CONSTRAINED] > 0:
        # Constraint rows are needed by `fill_mass_matrix`.
        evaluate_constraints(model, reals, data, y, f)
    # The mass matrix is composed again, because solving for accelerations has overwritten it.
    spatial_inertias_and_bias(model, reals, data)
    composite_rigid_body(model, data, right)
    fill_mass_matrix(model, data, work)
    stiffness = at(work, MATRIX.STIFFNESS * size * size)
    damping = at(work, MATRIX.DAMPING * size * size)
    for k in range(size * size):
        stiffness[k] = damping[k] = 0.0
    add_geometric_stiffness(model, reals, data, stiffness)
    for number in range(model[MODEL.RESPONSES]):
        response = at(model, model[MODEL.RESPONSE_AT] + RESPONSE.SIZE * number)
        record = response_record(model, work, number)
        # The kernel of a response applies 1 N to the wrenches and generalized forces, and writes
        # derivatives to SCRATCH; what it writes to f is the change of the force by the coordinates,
        # if it is not along its own displacement.
        clear_wrenches(model, data)
        for k in range(size):
            f[k] = right[k] = 0.0
        status = call(response[RESPONSE.KERNEL], model, reals, data, y, f, response[RESPONSE.ITEM])
        if status != OUTCOME.OK:
            return status
        changes = response[RESPONSE.STATES] > 0
        for k in range(RESPONSE_WORK.INVERSE):
            record[size + k] = data[WORK.SCRATCH + k]
            changes = changes or data[WORK.SCRATCH + k] != 0.0
        first, end = size, 0
        # A force without any derivative, such as a slack spring, needs no generalized force.
        if changes:
            add_generalized_forces(model, data, right)
        for k in range(size):
            record[k] = right[k]
            if abs(right[k]) > FORCE_ROUNDING:
                first = min(first, k)
                end = k + 1
        record[size + RESPONSE_WORK.FIRST], record[size + RESPONSE_WORK.END] = first, end
        if changes:
            sense = response[RESPONSE.SENSE]
            by_displacement = record[size]
            by_speed = record[size + 1]
            # The derivative by the displacement acts along the generalized force per newton: a
            # rank-one matrix.
            add_outer_product(size, 1.0, record, first, end, f, 0, size, stiffness)
            add_outer_product(
                size, sense * by_displacement, record, first, end, record, first, end, stiffness
            )
            add_outer_product(
                size, sense * by_speed, record, first, end, record, first, end, damping
            )
    return OUTCOME.OK


def response_record(model: Ints, work: Floats, number: int) -> Floats:
    """Return the record of a force in the workspace.

    It contains the generalized force per newton (n,), then RESPONSE_WORK.SIZE numbers.

    Args:
        model: integers of the model.
        work: workspace of the condensation.
        number: number of the force.
    """
    size = model[MODEL.DOFS]
    return at(work, MATRIX.COUNT * size * size + size + number * (size + RESPONSE_WORK.SIZE))


def fill_mass_matrix(model: Ints, data: Floats, mass: Floats) -> None:
    """Fill the mass matrix, with heavy masses along the constraint equations.

    The equation G du = 0 is replaced by a mass CONSTRAINT_MASS times the largest entry of M along
    each row of G. Multipliers would need a larger, indefinite system. The small motion that remains
    across the constraints is removed by the projection of the step.

    Args:
        model: integers of the model.
        data: results with the sparse rows of the mass matrix and the constraint equations.
        mass: filled with the matrix (n, n).
    """
    size = model[MODEL.DOFS]
    freedoms = at(model, model[MODEL.DOF_AT])
    largest = 0.0
    for k in range(size * size):
        mass[k] = 0.0
    for k in range(size):
        j = at(freedoms, DOF.SIZE * k)
        i = k
        row = at(data, j[DOF.ROW])
        largest = max(largest, row[0])
        # A sparse row stores the entries of the degrees of freedom on the path to ground.
        for m in range(j[DOF.DEPTH] + 1):
            mass[size * k + i] = mass[size * i + k] = row[m]
            i = freedoms[DOF.SIZE * i + DOF.ABOVE]
    if model[MODEL.CONSTRAINED] > 0:
        h = at(model, model[MODEL.CONSTRAINED])
        for equation in range(h[CONSTRAINED.EQUATIONS]):
            row = at(data, h[CONSTRAINED.WORK_ROWS] + size * equation)
            square = 0.0
            # Divide by the squared length, so that equations in metres and radians weigh the same.
            for k in range(size):
                square += row[k] * row[k]
            if square > 0.0:
                add_outer_product(
                    size, CONSTRAINT_MASS * largest / square, row, 0, size, row, 0, size, mass
                )


def add_geometric_stiffness(model: Ints, reals: Floats, data: Floats, levers: Floats) -> None:
    """Add the geometric stiffness of weights and contacts to a matrix (n, n).

    It is the change of their generalized forces as coordinates move the points of application. The
    inertias of the links, which are no longer needed, are replaced by loads: the force on a link and
    its subtree, and the sum of products of positions (from the origin of the spatial vectors) and
    forces, by rows.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results of an evaluation; the inertias of the links are destroyed.
        levers: matrix (n, n); changed.
    """
    size = model[MODEL.DOFS]
    for link in range(model[MODEL.LINKS]):
        b = at(reals, REALS.INERTIA + INERTIA.SIZE * link)
        load = at(link_work(model, data, link), LINK_WORK.INERTIA)
        for k in range(LOAD):
            load[k] = 0.0
        weight = times(b[INERTIA.MASS], vector(reals, REALS.GRAVITY))
        add_load(
            model, data, link, station(model, data, link, vector(b, INERTIA.CENTER)), weight, ZERO
        )
    for pair in range(model[MODEL.CONTACTS]):
        i = at(model, model[model[MODEL.CONTACT_AT] + pair])
        contact = at(data, model[MODEL.WORK_CONTACT] + CONTACT_WORK.SIZE * pair)
        force = vector(contact, CONTACT_WORK.FORCE)
        point = vector(contact, CONTACT_WORK.FORCE + 3)
        first_link = i[ITEM.DETAILS]
        second_link = i[ITEM.DETAILS + 1]
        # Contacts with ground only move one link; pairs of surfaces on ground have no degrees of
        # freedom.
        if contact[CONTACT_WORK.DEPTH] > 0.0 and max(first_link, second_link) >= 0:
            center = station(
                model, data, second_link, vector(reals, i[ITEM.NUMBERS] + CONTACT_NUMBERS.CENTER)
            )
            add_load(model, data, second_link, point, force, minus(center, point))
            add_load(model, data, first_link, point, times(-1.0, force), ZERO)
    # Inwards from the leaves: the load of a link contains those of its subtree.
    for link in range(model[MODEL.LINKS] - 1, -1, -1):
        i = link_ints(model, link)
        link_record = link_work(model, data, link)
        load, origin = at(link_record, LINK_WORK.INERTIA), vector(link_record, LINK_WORK.ORIGIN)
        for operation in range(i[LINK.FIRST_OPERATION], i[LINK.END_OPERATION]):
            j = operation_ints(model, operation)
            # Only motions about or along one axis; those of balls and functions are omitted from J.
            if j[OPERATION.DOF] < 0 or j[OPERATION.MOTION] >= MOTION.BALL:
                continue
            turn, shift = unit_twist(j, operation_work(model, data, operation), origin)
            # Change of the moment of the load as it moves along this operation: with the sum S of
            # products of positions and forces, it is shift x F + S turn - trace(S) turn.
            load_change = minus(
                cross(shift, vector(load, 0)), times(load[3] + load[7] + load[11], turn)
            )
            # Each pair of an operation and a rotation on its path to ground is visited once, so both
            # entries of the symmetric matrix are changed.
            load_change = plus(load_change, rotate(at(load, 3), turn))
            inner_operation = operation
            inner_link = link
            while inner_link >= 0:
                inner_ints = operation_ints(model, inner_operation)
                if inner_ints[OPERATION.DOF] >= 0 and inner_ints[OPERATION.MOTION] == MOTION.TURN:
                    change = dot(
                        load_change,
                        vector(operation_work(model, data, inner_operation), OPERATION_WORK.AXIS),
                    )
                    levers[size * j[OPERATION.DOF] + inner_ints[OPERATION.DOF]] += change
                    if inner_operation != operation:
                        levers[size * inner_ints[OPERATION.DOF] + j[OPERATION.DOF]] += change
                inner_operation -= 1
                while (
                    inner_link >= 0
                    and inner_operation < link_ints(model, inner_link)[LINK.FIRST_OPERATION]
                ):
                    inner_link = link_ints(model, inner_link)[LINK.PARENT]
                    inner_operation = (
                        link_ints(model, inner_link)[LINK.END_OPERATION] - 1
                        if inner_link >= 0
                        else -1
                    )
        if i[LINK.PARENT] >= 0:
            parent_load = at(link_work(model, data, i[LINK.PARENT]), LINK_WORK.INERTIA)
            for n in range(LOAD):
                parent_load[n] += load[n]


def add_load(
    model: Ints, data: Floats, link: int, point: Vector, force: Vector, offset: Vector
) -> None:
    """Add a force on a link to its load.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        link: number of the link; ground is ignored.
        point: position of the force in ground (m).
        force: force (N).
        offset: offset from `point` to the material point that the force moves with (m).
    """
    if link >= 0:
        link_record = link_work(model, data, link)
        load = at(link_record, LINK_WORK.INERTIA)
        arm = minus(point, vector(link_record, LINK_WORK.ORIGIN))
        store_vector(load, 0, plus(vector(load, 0), force))
        # The products contain the motion of the point where the material point is not the point of
        # action.
        for k in range(3):
            store_vector(
                load,
                3 + 3 * k,
                plus(vector(load, 3 + 3 * k), plus(times(arm[k], force), times(force[k], offset))),
            )


def add_outer_product(
    size: int,
    factor: float,
    a: Floats,
    first: int,
    end: int,
    b: Floats,
    start: int,
    stop: int,
    matrix: Floats,
) -> None:
    """Add a multiple of the outer product of two vectors to a matrix.

    Args:
        size: size of the matrix.
        factor: factor of the outer product.
        a: first vector.
        first: start of the nonzero entries of a.
        end: end of the nonzero entries of a.
        b: second vector.
        start: start of the nonzero entries of b.
        stop: end of the nonzero entries of b.
        matrix: matrix (size, size); changed.
    """
    for i in range(first, end):
        if a[i] != 0.0:
            scaled = factor * a[i]
            target = at(matrix, size * i)
            for k in range(start, stop):
                target[k] += scaled * b[k]


def condense_system(model: Ints, c: float, work: Floats) -> bool:
    """Eliminate all but the speeds from 1 - c J and factorise the rest.

    Args:
        model: integers of the model.
        c: coefficient of the method times step length (s).
        work: workspace after `linearise_state`; filled with the factorised matrix.

    Returns:
        Whether it is regular.
    """
    size = model[MODEL.DOFS]
    system, levers = at(work, MATRIX.SYSTEM * size * size), at(work, MATRIX.LEVERS * size * size)
    stiffness = at(work, MATRIX.STIFFNESS * size * size)
    damping = at(work, MATRIX.DAMPING * size * size)
    for k in range(size * size):
        # Coordinates follow the speeds as dq = c du, so that stiffness counts with c^2.
        system[k] = work[k] - c * (damping[k] + c * stiffness[k])
        levers[k] = stiffness[k]
    for number in range(model[MODEL.RESPONSES]):
        response = at(model, model[MODEL.RESPONSE_AT] + RESPONSE.SIZE * number)
        record = response_record(model, work, number)
        count = response[RESPONSE.STATES]
        a = at(record, size)
        states = at(model, response[RESPONSE.ITEM] + response[RESPONSE.FIRST_STATE])
        # Forces without states are complete in the stiffness and damping matrices.
        if count == 0:
            continue
        inverse = at(a, RESPONSE_WORK.INVERSE)
        gains = at(a, RESPONSE_WORK.GAINS)
        pulls = at(a, RESPONSE_WORK.PULLS)
        driven = at(a, RESPONSE_WORK.RIGHT)
        for i in range(count):
            rates = at(a, WIDTH * (1 + i))
            # A negative index stands for a state that the model does not have; its row is that of
            # the identity.
            has_state = states[i] >= 0
            driven[i] = c * (c * rates[0] + rates[1]) if has_state else 0.0
            for k in range(count):
                scaled_rate = c * rates[2 + k] if has_state and states[k] >= 0 else 0.0
                inverse[count * i + k] = (1.0 if i == k else 0.0) - scaled_rate
        invert_matrix(count, inverse)
        # Schur complement: what the states add to the derivatives of the force by speed and
        # displacement.
        by_speed = by_displacement = 0.0
        for i in range(count):
            gains[i] = pulls[i] = 0.0
            for k in range(count):
                gains[i] += inverse[count * i + k] * driven[k]
                if states[k] >= 0:
                    pulls[i] += inverse[count * k + i] * a[2 + k]
        for i in range(count):
            if states[i] >= 0:
                by_speed += a[2 + i] * gains[i]
                by_displacement += c * pulls[i] * a[WIDTH * (1 + i)]
        first = int(a[RESPONSE_WORK.FIRST])
        end = int(a[RESPONSE_WORK.END])
        sense = response[RESPONSE.SENSE]
        add_outer_product(
            size, -c * sense * by_speed, record, first, end, record, first, end, system
        )
        add_outer_product(
            size, sense * by_displacement, record, first, end, record, first, end, levers
        )
    return factorise_matrix(size, system, work)


def solve_condensed(model: Ints, c: float, work: Floats, d: Floats) -> None:
    """Solve (1 - c J) d = r in place, after `condense_system` with the same c.

    Args:
        model: integers of the model.
        c: coefficient of the method times step length (s).
        work: workspace after `condense_system`.
        d: right side r of coordinates, speeds and states, replaced by the solution.
    """
    size = model[MODEL.DOFS]
    du = at(d, size)
    system = at(work, MATRIX.SYSTEM * size * size)
    right = at(work, MATRIX.COUNT * size * size)
    levers = at(work, MATRIX.LEVERS * size * size)
    # Multiply the right sides of speeds by the mass matrix, and add those of the eliminated
    # coordinates and states.
    for i in range(size):
        right[i] = 0.0
        for k in range(size):
            right[i] += work[size * i + k] * du[k] + c * levers[size * i + k] * d[k]
    for number in range(model[MODEL.RESPONSES]):
        response = at(model, model[MODEL.RESPONSE_AT] + RESPONSE.SIZE * number)
        record = response_record(model, work, number)
        states = at(model, response[RESPONSE.ITEM] + response[RESPONSE.FIRST_STATE])
        a = at(record, size)
        force = 0.0
        for k in range(response[RESPONSE.STATES]):
            if states[k] >= 0:
                force += c * a[RESPONSE_WORK.PULLS + k] * d[states[k]]
        if force != 0.0:
            for k in range(int(a[RESPONSE_WORK.FIRST]), int(a[RESPONSE_WORK.END])):
                right[k] += force * record[k]
    solve_factorised(size, system, right)
    # Back-substitution: the states follow from displacement and speed along each force.
    for number in range(model[MODEL.RESPONSES]):
        response = at(model, model[MODEL.RESPONSE_AT] + RESPONSE.SIZE * number)
        record = response_record(model, work, number)
        count = response[RESPONSE.STATES]
        a = at(record, size)
        states = at(model, response[RESPONSE.ITEM] + response[RESPONSE.FIRST_STATE])
        if count == 0:
            continue
        first, end = int(a[RESPONSE_WORK.FIRST]), int(a[RESPONSE_WORK.END])
        displacement = response[RESPONSE.SENSE] * dot_range(first, end, record, d)
        speed = response[RESPONSE.SENSE] * dot_range(first, end, record, right)
        for i in range(count):
            a[RESPONSE_WORK.RIGHT + i] = (
                d[states[i]] + c * a[WIDTH * (1 + i)] * displacement if states[i] >= 0 else 0.0
            )
        for i in range(count):
            if states[i] >= 0:
                d[states[i]] = a[RESPONSE_WORK.GAINS + i] * speed + dot_range(
                    0, count, at(a, RESPONSE_WORK.INVERSE + count * i), at(a, RESPONSE_WORK.RIGHT)
                )
    # Last of all the coordinates, whose right sides the states still needed.
    for k in range(size):
        du[k] = right[k]
        d[k] += c * right[k]
