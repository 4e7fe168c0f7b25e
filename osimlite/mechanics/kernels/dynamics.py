"""Accelerations of a tree of links under gravity and whatever pushes.

The composite-rigid-body algorithm gives the mass matrix, and a factorisation that keeps its zeros
solves for the accelerations (R. Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 6.2
and 6.5). Of the row of a degree of freedom only the entries of those on its way to ground are
there, its own first. The cost grows with the number of degrees of freedom times the square of how
many of them carry one another.
"""

from __future__ import annotations

from osimlite.mechanics.kernels.layout import (
    CHAIN,
    CONSTRAINED,
    CONTACT_WORK,
    DOF,
    EQUILIBRIUM,
    INERTIA,
    INERTIA_AT,
    ITEM,
    LINK,
    LINK_WORK,
    MODEL,
    OUTCOME,
    RUN,
    STAGE,
)
from osimlite.mechanics.kernels.motion import move, place
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.kernels.points import link_ints, link_work
from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    along,
    cross,
    dot,
    minus,
    plus,
    put,
    times,
    turned,
    vector,
)

SMALLEST_PIVOT = 1e-13
"""Part of the inertia about a degree of freedom that must remain once the joints further out are
free; with less it moves no mass.
"""


def evaluate(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, stage: int) -> int:
    """The derivative f of the state y = (q, u, z): positions, speeds, auxiliary states. All else stays in `data`.

    Returns:
        OK or what went wrong; with SINGULAR_MASS, f[0] is the degree of freedom that moves no mass.
    """
    place(model, reals, data, y, f)
    if stage == STAGE.POSITION:
        return OUTCOME.OK
    status = move(model, reals, data, y, f)
    if status != OUTCOME.OK or stage == STAGE.VELOCITY:
        return status
    right = at(f, model[MODEL.DOFS])
    if stage == STAGE.FORCE or model[MODEL.CHAIN] > 0:
        clear_wrenches(model, data)
        status = apply_forces(model, reals, data, y, f)
        generalized_forces(model, data, right)
        if stage == STAGE.ACCELERATION and status == OUTCOME.OK:
            status = call(
                model[MODEL.LAWS + model[model[MODEL.CHAIN] + CHAIN.DYNAMICS]],
                model,
                reals,
                data,
                y,
                f,
                0,
            )
    else:
        spatial_inertias_and_bias(model, reals, data)
        status = apply_forces(model, reals, data, y, f)
        composite_rigid_body(model, data, right)
    if stage == STAGE.FORCE or status != OUTCOME.OK:
        return status
    if model[MODEL.CONSTRAINED] > 0:
        return call(
            model[MODEL.LAWS + model[model[MODEL.CONSTRAINED] + CONSTRAINED.DYNAMICS]],
            model,
            reals,
            data,
            y,
            f,
            0,
        )
    singular = solve(model, data, right)
    if singular >= 0:
        f[0] = singular
        return OUTCOME.SINGULAR_MASS
    return OUTCOME.OK


def inverse(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, unused: int) -> int:
    """The generalized forces that are missing for accelerations, constraints left aside.

    Args:
        model: the mechanism.
        reals: its numbers.
        data: room.
        y: the state.
        f: udot behind the place of the rates; the forces (N, N m) take its place.
        unused: any number.

    Returns:
        OK or what went wrong, as of `evaluate`.
    """
    place(model, reals, data, y, f)
    status = move(model, reals, data, y, f)
    if status != OUTCOME.OK:
        return status
    right = at(f, model[MODEL.DOFS])
    accelerate(model, data, right)
    spatial_inertias_and_bias(model, reals, data)
    status = apply_forces(model, reals, data, y, f)
    generalized_forces(model, data, right)
    for freedom in range(model[MODEL.DOFS]):
        right[freedom] = -right[freedom]
    return status


def equilibrate(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, stage: int) -> int:
    """Bring what can be into equilibrium: changes auxiliary states in y, also after one has failed.

    Returns: OK, or what went wrong; with UNSOLVED, f[0] is the number of the first that has no
        equilibrium.
    """
    status = call(model[MODEL.LAWS], model, reals, data, y, f, stage)
    if status != OUTCOME.OK:
        return status
    for k in range(model[MODEL.EQUILIBRIA] - 1, -1, -1):
        j = at(model, model[MODEL.EQUILIBRIUM_AT] + EQUILIBRIUM.SIZE * k)
        if call(j[EQUILIBRIUM.KERNEL], model, reals, data, y, f, j[EQUILIBRIUM.ITEM]) != OUTCOME.OK:
            status, f[0] = OUTCOME.UNSOLVED, k
    return status


def spun(moments: Floats, a: Vector) -> Vector:
    """A symmetric matrix times a vector."""
    x, y, z = a
    xx, yy, zz, xy, xz, yz = moments[0], moments[1], moments[2], moments[3], moments[4], moments[5]
    return xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z


def momentum(i: Floats, spin: Vector, velocity: Vector) -> tuple[Vector, Vector]:
    """Inertia times a spatial vector."""
    first = vector(i, 1)
    return (
        plus(spun(at(i, 4), spin), cross(first, velocity)),
        plus(times(i[0], velocity), cross(spin, first)),
    )


def spatial_inertias_and_bias(model: Ints, reals: Floats, data: Floats) -> None:
    """Inertias of the links, and the wrenches that are missing for their accelerations without udot."""
    for link in range(model[MODEL.LINKS]):
        b, here = at(reals, INERTIA_AT + INERTIA.SIZE * link), link_work(model, data, link)
        r, i, m = at(here, LINK_WORK.ROTATION), at(here, LINK_WORK.INERTIA), b[INERTIA.MASS]
        center = plus(
            minus(vector(here, LINK_WORK.POSITION), vector(here, LINK_WORK.ORIGIN)),
            turned(r, vector(b, INERTIA.CENTER)),
        )
        cx, cy, cz = center
        mx, my, mz = times(m, center)
        one, two, three = vector(r, 0), vector(r, 3), vector(r, 6)
        # Rows of R I.
        first, second = spun(at(b, INERTIA.MOMENTS), one), spun(at(b, INERTIA.MOMENTS), two)
        third = spun(at(b, INERTIA.MOMENTS), three)
        i[0], i[1], i[2], i[3] = m, mx, my, mz
        i[4] = dot(first, one) + my * cy + mz * cz
        i[5] = dot(second, two) + mx * cx + mz * cz
        i[6] = dot(third, three) + mx * cx + my * cy
        i[7] = dot(first, two) - mx * cy
        i[8] = dot(first, three) - mx * cz
        i[9] = dot(second, three) - my * cz
        spin, velocity = vector(here, LINK_WORK.VELOCITY), vector(here, LINK_WORK.VELOCITY + 3)
        angular, linear = momentum(i, spin, velocity)
        torque, force = momentum(
            i, vector(here, LINK_WORK.ACCELERATION), vector(here, LINK_WORK.ACCELERATION + 3)
        )
        torque = plus(torque, plus(cross(spin, angular), cross(velocity, linear)))
        put(here, LINK_WORK.WRENCH, times(-1.0, torque))
        put(here, LINK_WORK.WRENCH + 3, times(-1.0, plus(force, cross(spin, linear))))


def accelerate(model: Ints, data: Floats, udot: Floats) -> None:
    """Add what udot gives to the accelerations of the links, outwards from ground."""
    columns = at(data, model[MODEL.WORK_COLUMN])
    for link in range(model[MODEL.LINKS]):
        j, here = link_ints(model, link), link_work(model, data, link)
        # The wrench is not needed yet; its place has what the links before add.
        turn, shift = ZERO, ZERO
        if j[LINK.PARENT] >= 0:
            above = at(link_work(model, data, j[LINK.PARENT]), LINK_WORK.WRENCH)
            turn, shift = vector(above, 0), vector(above, 3)
        for freedom in range(j[LINK.FIRST_DOF], j[LINK.END_DOF]):
            c = at(columns, 6 * freedom)
            turn, shift = (
                along(turn, udot[freedom], vector(c, 0)),
                along(shift, udot[freedom], vector(c, 3)),
            )
        put(here, LINK_WORK.WRENCH, turn)
        put(here, LINK_WORK.WRENCH + 3, shift)
        put(here, LINK_WORK.ACCELERATION, plus(vector(here, LINK_WORK.ACCELERATION), turn))
        put(here, LINK_WORK.ACCELERATION + 3, plus(vector(here, LINK_WORK.ACCELERATION + 3), shift))


def clear_wrenches(model: Ints, data: Floats) -> None:
    """No wrench on any link."""
    for link in range(model[MODEL.LINKS]):
        load = at(link_work(model, data, link), LINK_WORK.WRENCH)
        for k in range(6):
            load[k] = 0.0


def apply_forces(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats) -> int:
    """Add what all items push to the wrenches, or to the generalized forces behind the rates in f.

    Returns:
        OK, or what the kernel of an item says; then f[0] is the number of the item.
    """
    for number in range(model[MODEL.DOFS], model[MODEL.STATE_SIZE]):
        f[number] = 0.0
    for number in range(model[MODEL.CONTACTS]):
        result = at(data, model[MODEL.WORK_CONTACT] + CONTACT_WORK.SIZE * number)
        result[0], result[1], result[2], result[CONTACT_WORK.DEPTH] = 0.0, 0.0, 0.0, 0.0
    for number in range(model[MODEL.RUNS]):
        run = model[MODEL.RUN_AT] + RUN.SIZE * number
        if model[run + RUN.LAW] != 0:
            status = call(model[run + RUN.LAW], model, reals, data, y, f, run)
            if status != OUTCOME.OK:
                return status
            continue
        for k in range(model[run + RUN.FIRST], model[run + RUN.END]):
            item = model[model[MODEL.ITEM_AT] + k]
            status = call(model[item + ITEM.LAW], model, reals, data, y, f, item)
            if status != OUTCOME.OK:
                f[0] = k
                return status
    return OUTCOME.OK


def generalized_forces(model: Ints, data: Floats, right: Floats) -> None:
    """The generalized forces of the wrenches, inwards from the leaves."""
    columns = at(data, model[MODEL.WORK_COLUMN])
    for link in range(model[MODEL.LINKS] - 1, -1, -1):
        j, load = (
            link_ints(model, link),
            at(link_work(model, data, link), LINK_WORK.WRENCH),
        )
        for freedom in range(j[LINK.FIRST_DOF], j[LINK.END_DOF]):
            c = at(columns, 6 * freedom)
            for k in range(6):
                right[freedom] += c[k] * load[k]
        if j[LINK.PARENT] >= 0:
            above = at(link_work(model, data, j[LINK.PARENT]), LINK_WORK.WRENCH)
            for k in range(6):
                above[k] += load[k]


def composite_rigid_body(model: Ints, data: Floats, right: Floats) -> None:
    """Mass matrix, and the generalized forces, inwards from the leaves."""
    freedoms, columns = at(model, model[MODEL.DOF_AT]), at(data, model[MODEL.WORK_COLUMN])
    for link in range(model[MODEL.LINKS] - 1, -1, -1):
        j, here = link_ints(model, link), link_work(model, data, link)
        i, load = at(here, LINK_WORK.INERTIA), at(here, LINK_WORK.WRENCH)
        for freedom in range(j[LINK.FIRST_DOF], j[LINK.END_DOF]):
            c = at(columns, 6 * freedom)
            turn, shift = vector(c, 0), vector(c, 3)
            right[freedom] += dot(turn, vector(load, 0)) + dot(shift, vector(load, 3))
            angular, linear = momentum(i, turn, shift)
            row, k, place = at(data, freedoms[DOF.SIZE * freedom + DOF.ROW]), freedom, 0
            while k >= 0:
                c = at(columns, 6 * k)
                row[place] = dot(vector(c, 0), angular) + dot(vector(c, 3), linear)
                k = freedoms[DOF.SIZE * k + DOF.ABOVE]
                place += 1
        if j[LINK.PARENT] >= 0:
            above = at(link_work(model, data, j[LINK.PARENT]), LINK_WORK.INERTIA)
            # The wrench stands behind the inertia.
            for k in range(16):
                above[k] += i[k]


def solve(model: Ints, data: Floats, right: Floats) -> int:
    """Solve for the accelerations in place; returns the degree of freedom that moves no mass, or -1."""
    size, freedoms, pivots = (
        model[MODEL.DOFS],
        at(model, model[MODEL.DOF_AT]),
        at(data, model[MODEL.WORK_PIVOT]),
    )
    for k in range(size):
        pivots[k] = data[freedoms[DOF.SIZE * k + DOF.ROW]]
    for k in range(size - 1, -1, -1):
        j = at(freedoms, DOF.SIZE * k)
        row, depth, i = at(data, j[DOF.ROW]), j[DOF.DEPTH], j[DOF.ABOVE]
        pivot = row[0]
        if not pivot > SMALLEST_PIVOT * pivots[k]:
            return k
        inverse, load = 1.0 / pivot, right[k]
        for m in range(1, depth + 1):
            a = row[m] * inverse
            target = at(data, freedoms[DOF.SIZE * i + DOF.ROW])
            for t in range(depth + 1 - m):
                target[t] -= a * row[m + t]
            right[i] -= a * load
            row[m] = a
            i = freedoms[DOF.SIZE * i + DOF.ABOVE]
        right[k] = load * inverse
    for k in range(size):
        j = at(freedoms, DOF.SIZE * k)
        row, i, total = at(data, j[DOF.ROW]), j[DOF.ABOVE], right[k]
        for m in range(1, j[DOF.DEPTH] + 1):
            total -= row[m] * right[i]
            i = freedoms[DOF.SIZE * i + DOF.ABOVE]
        right[k] = total
    return -1
