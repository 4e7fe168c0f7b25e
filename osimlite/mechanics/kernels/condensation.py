"""The linear equations of implicit integrators, of which only those of the speeds are solved together.

An implicit method solves (1 - c J) d = r over and over, J being the derivative of the rates of a
state (q, u, z) by it. Here J is what muscles, springs and stops make of it: each pushes along one
displacement, with a force and with rates of its states that depend on that displacement, its speed
and these states only. So its states are eliminated by themselves, as internal variables of a
material are in finite elements, and so are the coordinates, whose rates count as the speeds. What
is left is of the size of the speeds: the mass matrix, and of each force a stiffness along its
generalized force of 1 N. The equations of constraints count as heavy masses along them. Contacts of
half spaces and spheres are three such forces, along the normal and across it; friction grows with
the depth. All else (gravity, Coriolis forces, how levers change) is left out of J: iterations
converge without it, and W-methods keep their order.
"""

from __future__ import annotations

from osimlite.mechanics.kernels.constrained_dynamics import bind
from osimlite.mechanics.kernels.dynamics import (
    SMALLEST_PIVOT,
    clear_wrenches,
    composite_rigid_body,
    generalized_forces,
    spatial_inertias_and_bias,
)
from osimlite.mechanics.kernels.layout import (
    CONSTRAINED,
    CONTACT_WORK,
    DOF,
    GRAVITY_AT,
    INERTIA,
    INERTIA_AT,
    ITEM,
    LINK,
    LINK_WORK,
    MODEL,
    MOTION,
    OPERATION,
    OPERATION_WORK,
    OUTCOME,
    RESPONSE,
    STAGE,
    WORK,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.kernels.points import (
    link_ints,
    link_work,
    operation_ints,
    operation_work,
    screw,
    station,
)
from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    cross,
    dot,
    minus,
    plus,
    put,
    times,
    turned,
    vector,
)

MOST_STATES = 3
"""A force has at most so many states that are condensed."""
WIDTH = 2 + MOST_STATES
"""Length of a row of derivatives: by displacement, speed and states. The rows are of the force and of the rates."""
INVERSE = (1 + MOST_STATES) * WIDTH
GAINS = INVERSE + MOST_STATES * MOST_STATES
PULLS, RIGHT = GAINS + MOST_STATES, GAINS + 2 * MOST_STATES
FIRST, END, RESPONSE_WORK = (
    GAINS + 3 * MOST_STATES,
    GAINS + 3 * MOST_STATES + 1,
    GAINS + 3 * MOST_STATES + 2,
)
"""What is known of a force besides the generalized force of 1 N: the derivatives; the inverse of 1
- c J of the states; what a speed does to them, and they to the force; their right sides; the first
degree of freedom that it moves, and the one after the last.
"""
SYSTEM, STIFFNESS, DAMPING, LEVERS, RIGHT_AT = range(1, 6)
"""Matrices (n, n) in the room, behind that of the masses: that to be solved; how generalized forces
change with coordinates and with speeds while states stay; how with coordinates while states follow.
A right side is behind them.
"""

LOAD = 12
"""How many numbers the loads of a link are."""
CENTER = 7
"""Place of the centre of surface 2 among the numbers of a contact."""
SLIGHT = 1e-12
"""What counts as rounding among generalized forces of 1 N."""


HEAVY = 1e6
"""Weight of constraints: what a unit of an equation weighs, in terms of the largest mass."""


def condensation_room(size: int, responses: int) -> int:
    """How many numbers the equations of so many speeds and forces need."""
    return RIGHT_AT * size * size + size + responses * (size + RESPONSE_WORK)


def linearise(
    model: Ints,
    reals: Floats,
    data: Floats,
    y: Floats,
    f: Floats,
    room: Floats,
    is_evaluated: float,
) -> int:
    """Fill the room with masses, generalized forces and derivatives at a state; f is room for its rates.

    If `is_evaluated` is not 0, the last evaluation was that of this state.
    """
    size, status = model[MODEL.DOFS], OUTCOME.OK
    right = at(f, size)
    if is_evaluated == 0.0:
        status = call(model[MODEL.LAWS], model, reals, data, y, f, STAGE.ACCELERATION)
    if status != OUTCOME.OK:
        return status
    if model[MODEL.CONSTRAINED] > 0:
        bind(model, reals, data, y, f)
    spatial_inertias_and_bias(model, reals, data)
    composite_rigid_body(model, data, right)
    masses(model, data, room)
    stiffness, damping = at(room, STIFFNESS * size * size), at(room, DAMPING * size * size)
    for k in range(size * size):
        stiffness[k] = damping[k] = 0.0
    turn_levers(model, reals, data, stiffness)
    for number in range(model[MODEL.RESPONSES]):
        response, known = (
            at(model, model[MODEL.RESPONSE_AT] + RESPONSE.SIZE * number),
            known_of(model, room, number),
        )
        clear_wrenches(model, data)
        for k in range(size):
            f[k] = right[k] = 0.0
        status = call(response[RESPONSE.KERNEL], model, reals, data, y, f, response[RESPONSE.ITEM])
        if status != OUTCOME.OK:
            return status
        changes = response[RESPONSE.STATES] > 0
        for k in range(INVERSE):
            known[size + k] = data[WORK.SCRATCH + k]
            changes = changes or data[WORK.SCRATCH + k] != 0.0
        first, end = size, 0
        if changes:
            generalized_forces(model, data, right)
        for k in range(size):
            known[k] = right[k]
            if abs(right[k]) > SLIGHT:
                first, end = min(first, k), k + 1
        known[size + FIRST], known[size + END] = first, end
        if changes:
            sense, by_displacement, by_speed = (
                response[RESPONSE.SENSE],
                known[size],
                known[size + 1],
            )
            add_product(size, 1.0, known, first, end, f, 0, size, stiffness)
            add_product(
                size, sense * by_displacement, known, first, end, known, first, end, stiffness
            )
            add_product(size, sense * by_speed, known, first, end, known, first, end, damping)
    return OUTCOME.OK


def known_of(model: Ints, room: Floats, number: int) -> Floats:
    """The part of the room of a force: its generalized force of 1 N, and what RESPONSE_WORK tells."""
    size = model[MODEL.DOFS]
    return at(room, RIGHT_AT * size * size + size + number * (size + RESPONSE_WORK))


def masses(model: Ints, data: Floats, mass: Floats) -> None:
    """The mass matrix (n, n), heavy across the constraints."""
    size, freedoms, largest = model[MODEL.DOFS], at(model, model[MODEL.DOF_AT]), 0.0
    for k in range(size * size):
        mass[k] = 0.0
    for k in range(size):
        j, i = at(freedoms, DOF.SIZE * k), k
        row = at(data, j[DOF.ROW])
        largest = max(largest, row[0])
        for m in range(j[DOF.DEPTH] + 1):
            mass[size * k + i] = mass[size * i + k] = row[m]
            i = freedoms[DOF.SIZE * i + DOF.ABOVE]
    if model[MODEL.CONSTRAINED] > 0:
        h = at(model, model[MODEL.CONSTRAINED])
        for equation in range(h[CONSTRAINED.EQUATIONS]):
            row, square = at(data, h[CONSTRAINED.WORK_ROWS] + size * equation), 0.0
            for k in range(size):
                square += row[k] * row[k]
            if square > 0.0:
                add_product(size, HEAVY * largest / square, row, 0, size, row, 0, size, mass)


def turn_levers(model: Ints, reals: Floats, data: Floats, levers: Floats) -> None:
    """Add how generalized forces of weights and of contacts change as coordinates move their points, to (n, n).

    They are what is left of the inertias, which have served: of each link the force on it and on
    all that it carries, and the sum of products of places (from the origin of the spatial vectors)
    with forces, by rows.
    """
    size = model[MODEL.DOFS]
    for link in range(model[MODEL.LINKS]):
        b, load = (
            at(reals, INERTIA_AT + INERTIA.SIZE * link),
            at(link_work(model, data, link), LINK_WORK.INERTIA),
        )
        for k in range(LOAD):
            load[k] = 0.0
        weight = times(b[INERTIA.MASS], vector(reals, GRAVITY_AT))
        add_load(
            model, data, link, station(model, data, link, vector(b, INERTIA.CENTER)), weight, ZERO
        )
    for pair in range(model[MODEL.CONTACTS]):
        i = at(model, model[model[MODEL.CONTACT_AT] + pair])
        contact = at(data, model[MODEL.WORK_CONTACT] + CONTACT_WORK.SIZE * pair)
        force, point = vector(contact, CONTACT_WORK.FORCE), vector(contact, CONTACT_WORK.FORCE + 3)
        one, two = i[ITEM.OWN], i[ITEM.OWN + 1]
        if contact[CONTACT_WORK.DEPTH] > 0.0 and max(one, two) >= 0:
            center = station(model, data, two, vector(reals, i[ITEM.NUMBERS] + CENTER))
            add_load(model, data, two, point, force, minus(center, point))
            add_load(model, data, one, point, times(-1.0, force), ZERO)
    for link in range(model[MODEL.LINKS] - 1, -1, -1):
        i, here = link_ints(model, link), link_work(model, data, link)
        load, origin = at(here, LINK_WORK.INERTIA), vector(here, LINK_WORK.ORIGIN)
        for operation in range(i[LINK.FIRST_OPERATION], i[LINK.END_OPERATION]):
            j = operation_ints(model, operation)
            if j[OPERATION.DOF] < 0 or j[OPERATION.MOTION] >= MOTION.BALL:
                continue
            turn, shift = screw(j, operation_work(model, data, operation), origin)
            moved = minus(cross(shift, vector(load, 0)), times(load[3] + load[7] + load[11], turn))
            moved, inner, within = plus(moved, turned(at(load, 3), turn)), operation, link
            while within >= 0:
                other = operation_ints(model, inner)
                if other[OPERATION.DOF] >= 0 and other[OPERATION.MOTION] == MOTION.TURN:
                    change = dot(
                        moved, vector(operation_work(model, data, inner), OPERATION_WORK.AXIS)
                    )
                    levers[size * j[OPERATION.DOF] + other[OPERATION.DOF]] += change
                    if inner != operation:
                        levers[size * other[OPERATION.DOF] + j[OPERATION.DOF]] += change
                inner -= 1
                while within >= 0 and inner < link_ints(model, within)[LINK.FIRST_OPERATION]:
                    within = link_ints(model, within)[LINK.PARENT]
                    inner = link_ints(model, within)[LINK.END_OPERATION] - 1 if within >= 0 else -1
        if i[LINK.PARENT] >= 0:
            below = at(link_work(model, data, i[LINK.PARENT]), LINK_WORK.INERTIA)
            for n in range(LOAD):
                below[n] += load[n]


def add_load(
    model: Ints, data: Floats, link: int, point: Vector, force: Vector, off: Vector
) -> None:
    """Add a force on a link at a point, which moves as does that of the link that is so far off."""
    if link >= 0:
        here = link_work(model, data, link)
        load, arm = at(here, LINK_WORK.INERTIA), minus(point, vector(here, LINK_WORK.ORIGIN))
        put(load, 0, plus(vector(load, 0), force))
        for k in range(3):
            put(
                load,
                3 + 3 * k,
                plus(vector(load, 3 + 3 * k), plus(times(arm[k], force), times(force[k], off))),
            )


def add_product(
    size: int,
    factor: float,
    a: Floats,
    first: int,
    end: int,
    b: Floats,
    start: int,
    last: int,
    matrix: Floats,
) -> None:
    """Add a multiple of the product of two rows, each from an entry up to another."""
    for i in range(first, end):
        if a[i] != 0.0:
            scaled, target = factor * a[i], at(matrix, size * i)
            for k in range(start, last):
                target[k] += scaled * b[k]


def condense(model: Ints, c: float, room: Floats) -> bool:
    """Eliminate all but the speeds from 1 - c J; whether that can be solved."""
    size = model[MODEL.DOFS]
    system, levers = at(room, SYSTEM * size * size), at(room, LEVERS * size * size)
    stiffness, damping = at(room, STIFFNESS * size * size), at(room, DAMPING * size * size)
    for k in range(size * size):
        system[k] = room[k] - c * (damping[k] + c * stiffness[k])
        levers[k] = stiffness[k]
    for number in range(model[MODEL.RESPONSES]):
        response, known = (
            at(model, model[MODEL.RESPONSE_AT] + RESPONSE.SIZE * number),
            known_of(model, room, number),
        )
        count, a = response[RESPONSE.STATES], at(known, size)
        places = at(model, response[RESPONSE.ITEM] + response[RESPONSE.FIRST_STATE])
        if count == 0:
            continue
        inverse, gains, pulls, driven = at(a, INVERSE), at(a, GAINS), at(a, PULLS), at(a, RIGHT)
        for i in range(count):
            rates = at(a, WIDTH * (1 + i))
            there = places[i] >= 0
            driven[i] = c * (c * rates[0] + rates[1]) if there else 0.0
            for k in range(count):
                own = c * rates[2 + k] if there and places[k] >= 0 else 0.0
                inverse[count * i + k] = (1.0 if i == k else 0.0) - own
        invert(count, inverse)
        by_speed = by_displacement = 0.0
        for i in range(count):
            gains[i] = pulls[i] = 0.0
            for k in range(count):
                gains[i] += inverse[count * i + k] * driven[k]
                if places[k] >= 0:
                    pulls[i] += inverse[count * k + i] * a[2 + k]
        for i in range(count):
            if places[i] >= 0:
                by_speed += a[2 + i] * gains[i]
                by_displacement += c * pulls[i] * a[WIDTH * (1 + i)]
        first, end, sense = int(a[FIRST]), int(a[END]), response[RESPONSE.SENSE]
        add_product(size, -c * sense * by_speed, known, first, end, known, first, end, system)
        add_product(size, sense * by_displacement, known, first, end, known, first, end, levers)
    return eliminate(size, system, room)


def eliminate(size: int, a: Floats, masses: Floats) -> bool:
    """Factorise a matrix (size, size) in its place; whether each pivot is more than a part of the mass there."""
    for k in range(size):
        row = at(a, size * k)
        if not row[k] > SMALLEST_PIVOT * masses[size * k + k]:
            return False
        row[k] = 1.0 / row[k]
        for i in range(k + 1, size):
            other = at(a, size * i)
            if other[k] != 0.0:
                factor = other[k] * row[k]
                other[k] = factor
                for j in range(k + 1, size):
                    other[j] -= factor * row[j]
    return True


def substitute(size: int, a: Floats, x: Floats) -> None:
    """Solve with the factors of `eliminate` in place."""
    for i in range(size):
        x[i] -= product(0, i, at(a, size * i), x)
    for i in range(size - 1, -1, -1):
        row = at(a, size * i)
        x[i] = (x[i] - product(i + 1, size, row, x)) * row[i]


def invert(size: int, a: Floats) -> None:
    """Invert a small matrix (size, size) in place."""
    for i in range(size):
        pivot = 1.0 / a[size * i + i]
        a[size * i + i] = 1.0
        for k in range(size):
            a[size * i + k] *= pivot
        for j in range(size):
            if j != i:
                factor = a[size * j + i]
                a[size * j + i] = 0.0
                for k in range(size):
                    a[size * j + k] -= factor * a[size * i + k]


def correct(model: Ints, c: float, room: Floats, d: Floats) -> None:
    """Solve (1 - c J) d = r in place, after `condense` with the same c."""
    size = model[MODEL.DOFS]
    du, system, right = (
        at(d, size),
        at(room, SYSTEM * size * size),
        at(room, RIGHT_AT * size * size),
    )
    levers = at(room, LEVERS * size * size)
    for i in range(size):
        right[i] = 0.0
        for k in range(size):
            right[i] += room[size * i + k] * du[k] + c * levers[size * i + k] * d[k]
    for number in range(model[MODEL.RESPONSES]):
        response, known = (
            at(model, model[MODEL.RESPONSE_AT] + RESPONSE.SIZE * number),
            known_of(model, room, number),
        )
        places, a, force = (
            at(model, response[RESPONSE.ITEM] + response[RESPONSE.FIRST_STATE]),
            at(known, size),
            0.0,
        )
        for k in range(response[RESPONSE.STATES]):
            if places[k] >= 0:
                force += c * a[PULLS + k] * d[places[k]]
        if force != 0.0:
            for k in range(int(a[FIRST]), int(a[END])):
                right[k] += force * known[k]
    substitute(size, system, right)
    for number in range(model[MODEL.RESPONSES]):
        response, known = (
            at(model, model[MODEL.RESPONSE_AT] + RESPONSE.SIZE * number),
            known_of(model, room, number),
        )
        count, a = response[RESPONSE.STATES], at(known, size)
        places = at(model, response[RESPONSE.ITEM] + response[RESPONSE.FIRST_STATE])
        if count == 0:
            continue
        first, end = int(a[FIRST]), int(a[END])
        displacement = response[RESPONSE.SENSE] * product(first, end, known, d)
        speed = response[RESPONSE.SENSE] * product(first, end, known, right)
        for i in range(count):
            a[RIGHT + i] = (
                d[places[i]] + c * a[WIDTH * (1 + i)] * displacement if places[i] >= 0 else 0.0
            )
        for i in range(count):
            if places[i] >= 0:
                d[places[i]] = a[GAINS + i] * speed + product(
                    0, count, at(a, INVERSE + count * i), at(a, RIGHT)
                )
    for k in range(size):
        du[k] = right[k]
        d[k] += c * right[k]


def product(first: int, end: int, a: Floats, b: Floats) -> float:
    """Of two vectors, from an entry up to another."""
    total = 0.0
    for k in range(first, end):
        total += a[k] * b[k]
    return total
