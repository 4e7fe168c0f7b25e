"""The linear equations of implicit integrators, of which only those of the speeds are solved together.

An implicit method solves (1 - c J) d = r over and over, J being the derivative of the rates of a state (q, u, z) by it.
Here J is what muscles, springs and stops make of it: each pushes along one displacement, with a force and with rates of
its states that depend on that displacement, its speed and these states only. So its states are eliminated by
themselves, as internal variables of a material are in finite elements, and so are the coordinates, whose rates count
as the speeds. What is left is symmetric and of the size of the speeds: the mass matrix, and of each force a stiffness
along its generalized force of 1 N. The equations of constraints count as heavy masses along them. Contacts of
half spaces and spheres are three such forces, along the normal and across it. All else (gravity, Coriolis forces, that
friction grows with the normal force) is left out of J: iterations converge without it, and W-methods keep their order.
"""

from __future__ import annotations

from osimlite.kernels.constrained_dynamics import bind
from osimlite.kernels.dynamics import (
    SMALLEST_PIVOT,
    clear_wrenches,
    composite_rigid_body,
    generalized_forces,
    spatial_inertias_and_bias,
)
from osimlite.kernels.layout import CONSTRAINED, DOF, MODEL, OUTCOME, RESPONSE_INTS, STAGE, WORK
from osimlite.kernels.least_squares import cholesky, substitute
from osimlite.kernels.pointers import Floats, Ints, at, call

MOST_STATES = 3
"""A force has at most so many states that are condensed."""
WIDTH = 2 + MOST_STATES
"""Length of a row of derivatives: by displacement, speed and states. The rows are of the force and of the rates."""
INVERSE = (1 + MOST_STATES) * WIDTH
GAINS = INVERSE + MOST_STATES * MOST_STATES
PULLS, RIGHT, LEVER = GAINS + MOST_STATES, GAINS + 2 * MOST_STATES, GAINS + 3 * MOST_STATES
FIRST, END = LEVER + 1, LEVER + 2
RESPONSE_WORK = LEVER + 3
"""What is known of a force besides the generalized force of 1 N: the derivatives; the inverse of 1 - c J of the states;
what a speed does to them, and they to the force; their right sides; what the displacement does to the force; the first
degree of freedom that it moves, and the one after the last."""

SLIGHT = 1e-12
"""What counts as rounding among generalized forces of 1 N."""

KERNEL, ITEM, FIRST_STATE, STATES, SENSE = 0, 1, 2, 3, 4
"""Integers of a response: its kernel, its item, its first state and their count, and the sense in which it pulls."""

HEAVY = 1e6
"""Weight of constraints: what a unit of an equation weighs, in terms of the largest mass."""


def condensation_room(size: int, responses: int) -> int:
    """How many numbers the equations of so many speeds and forces need."""
    return 2 * size * size + size + responses * (size + RESPONSE_WORK)


def linearise(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, room: Floats, is_evaluated: float) -> int:
    """Fill the room with masses, generalized forces and derivatives at a state; f is room for its rates.

    If `is_evaluated` is not 0, the last evaluation was that of this state.
    """
    size, status = s[MODEL.DOFS], OUTCOME.OK
    right = at(f, size)
    if is_evaluated == 0.0:
        status = call(s[MODEL.LAWS], s, x, w, y, f, STAGE.ACCELERATION)
    if status != OUTCOME.OK:
        return status
    if s[MODEL.CONSTRAINED] > 0:
        bind(s, x, w, y, f)
    spatial_inertias_and_bias(s, x, w)
    composite_rigid_body(s, w, right)
    masses(s, w, room)
    for number in range(s[MODEL.RESPONSES]):
        response, known = at(s, s[MODEL.RESPONSE_AT] + RESPONSE_INTS * number), known_of(s, room, number)
        clear_wrenches(s, w)
        for k in range(size):
            right[k] = 0.0
        status = call(response[KERNEL], s, x, w, y, f, response[ITEM])
        if status != OUTCOME.OK:
            return status
        changes = response[STATES] > 0
        for k in range(INVERSE):
            known[size + k] = w[WORK.SCRATCH + k]
            changes = changes or w[WORK.SCRATCH + k] != 0.0
        first, end = size, 0
        if changes:
            generalized_forces(s, w, right)
        for k in range(size):
            known[k] = right[k]
            if abs(right[k]) > SLIGHT:
                first, end = min(first, k), k + 1
        known[size + FIRST], known[size + END] = first, end
    return OUTCOME.OK


def known_of(s: Ints, room: Floats, number: int) -> Floats:
    """The part of the room of a force: its generalized force of 1 N, and what RESPONSE_WORK tells."""
    size = s[MODEL.DOFS]
    return at(room, 2 * size * size + size + number * (size + RESPONSE_WORK))


def masses(s: Ints, w: Floats, mass: Floats) -> None:
    """The mass matrix (n, n), heavy across the constraints."""
    size, freedoms, largest = s[MODEL.DOFS], at(s, s[MODEL.DOF_AT]), 0.0
    for k in range(size * size):
        mass[k] = 0.0
    for k in range(size):
        j, i = at(freedoms, DOF.SIZE * k), k
        row = at(w, j[DOF.ROW])
        largest = max(largest, row[0])
        for m in range(j[DOF.DEPTH] + 1):
            mass[size * k + i] = mass[size * i + k] = row[m]
            i = freedoms[DOF.SIZE * i + DOF.ABOVE]
    if s[MODEL.CONSTRAINED] > 0:
        h = at(s, s[MODEL.CONSTRAINED])
        for equation in range(h[CONSTRAINED.EQUATIONS]):
            row, square = at(w, h[CONSTRAINED.WORK_ROWS] + size * equation), 0.0
            for k in range(size):
                square += row[k] * row[k]
            if square > 0.0:
                add_square(size, HEAVY * largest / square, row, 0, size, mass)


def add_square(size: int, factor: float, row: Floats, first: int, end: int, matrix: Floats) -> None:
    """Add a multiple of the product of a row with itself, from an entry up to another."""
    for i in range(first, end):
        if row[i] != 0.0:
            scaled, target = factor * row[i], at(matrix, size * i)
            for k in range(first, end):
                target[k] += scaled * row[k]


def condense(s: Ints, c: float, room: Floats) -> bool:
    """Eliminate all but the speeds from 1 - c J; whether that can be solved."""
    size = s[MODEL.DOFS]
    system = at(room, size * size)
    for k in range(size * size):
        system[k] = room[k]
    for number in range(s[MODEL.RESPONSES]):
        response, known = at(s, s[MODEL.RESPONSE_AT] + RESPONSE_INTS * number), known_of(s, room, number)
        count, places, a = response[STATES], at(s, response[ITEM] + response[FIRST_STATE]), at(known, size)
        inverse, gains, pulls, driven = at(a, INVERSE), at(a, GAINS), at(a, PULLS), at(a, RIGHT)
        for i in range(count):
            rates = at(a, WIDTH * (1 + i))
            there = places[i] >= 0
            driven[i] = c * (c * rates[0] + rates[1]) if there else 0.0
            for k in range(count):
                own = c * rates[2 + k] if there and places[k] >= 0 else 0.0
                inverse[count * i + k] = (1.0 if i == k else 0.0) - own
        invert(count, inverse)
        stiffness, lever = c * a[0] + a[1], a[0]
        for i in range(count):
            gains[i] = pulls[i] = 0.0
            for k in range(count):
                gains[i] += inverse[count * i + k] * driven[k]
                if places[k] >= 0:
                    pulls[i] += inverse[count * k + i] * a[2 + k]
        for i in range(count):
            if places[i] >= 0:
                stiffness += a[2 + i] * gains[i]
                lever += c * pulls[i] * a[WIDTH * (1 + i)]
        a[LEVER] = lever
        add_square(size, -c * response[SENSE] * stiffness, known, int(a[FIRST]), int(a[END]), system)
    return cholesky(size, system, SMALLEST_PIVOT)


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


def correct(s: Ints, c: float, room: Floats, d: Floats) -> None:
    """Solve (1 - c J) d = r in place, after `condense` with the same c."""
    size = s[MODEL.DOFS]
    du, system, right = at(d, size), at(room, size * size), at(room, 2 * size * size)
    for i in range(size):
        right[i] = 0.0
        for k in range(size):
            right[i] += room[size * i + k] * du[k]
    for number in range(s[MODEL.RESPONSES]):
        response, known = at(s, s[MODEL.RESPONSE_AT] + RESPONSE_INTS * number), known_of(s, room, number)
        places, a = at(s, response[ITEM] + response[FIRST_STATE]), at(known, size)
        first, end = int(a[FIRST]), int(a[END])
        force = a[LEVER] * response[SENSE] * product(first, end, known, d)
        for k in range(response[STATES]):
            if places[k] >= 0:
                force += a[PULLS + k] * d[places[k]]
        for k in range(first, end):
            right[k] += c * force * known[k]
    substitute(size, system, right)
    for number in range(s[MODEL.RESPONSES]):
        response, known = at(s, s[MODEL.RESPONSE_AT] + RESPONSE_INTS * number), known_of(s, room, number)
        count, places, a = response[STATES], at(s, response[ITEM] + response[FIRST_STATE]), at(known, size)
        first, end = int(a[FIRST]), int(a[END])
        displacement = response[SENSE] * product(first, end, known, d)
        speed = response[SENSE] * product(first, end, known, right)
        for i in range(count):
            a[RIGHT + i] = d[places[i]] + c * a[WIDTH * (1 + i)] * displacement if places[i] >= 0 else 0.0
        for i in range(count):
            if places[i] >= 0:
                d[places[i]] = a[GAINS + i] * speed + product(0, count, at(a, INVERSE + count * i), at(a, RIGHT))
    for k in range(size):
        du[k] = right[k]
        d[k] += c * right[k]


def product(first: int, end: int, a: Floats, b: Floats) -> float:
    """Of two vectors, from an entry up to another."""
    total = 0.0
    for k in range(first, end):
        total += a[k] * b[k]
    return total
