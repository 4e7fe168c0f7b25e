"""Forward and inverse dynamics of a tree of links.

The composite-rigid-body algorithm gives the mass matrix M, and a factorization M = Lᵀ D L that
preserves the branch-induced sparsity solves M udot = f for the accelerations (R. Featherstone,
Rigid Body Dynamics Algorithms, 2008, chapters 6.2 and 6.5). The row of a degree of freedom stores
only the entries of the degrees of freedom on its path to ground, its own first. The cost grows with
the number of degrees of freedom times the square of the depth of the tree.
"""

from __future__ import annotations

from osimlite.mechanics.kernels.layout import (
    CHAIN,
    CONSTRAINED,
    CONTACT_WORK,
    DOF,
    EQUILIBRIUM,
    INERTIA,
    ITEM,
    LINK,
    LINK_WORK,
    MODEL,
    OUTCOME,
    REALS,
    RUN,
    STAGE,
)
from osimlite.mechanics.kernels.motion import move_links, place_links
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.kernels.points import link_ints, link_work
from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    add_scaled,
    cross,
    dot,
    minus,
    plus,
    rotate,
    store_vector,
    times,
    vector,
)

SMALLEST_PIVOT = 1e-13
"""Smallest pivot relative to the diagonal entry; with less a degree of freedom moves no mass."""


def evaluate(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, stage: int) -> int:
    """Compute the rates f of the state y = (q, u, z): coordinates, speeds, auxiliary states.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: filled with all intermediate results.
        y: state.
        f: filled with the rates of the state.
        stage: last stage to evaluate, see `STAGE`.

    Returns:
        `OUTCOME.OK`, or the outcome of the law that failed; with SINGULAR_MASS, f[0] is the degree
        of freedom without mass.
    """
    place_links(model, reals, data, y, f)
    if stage == STAGE.POSITION:
        return OUTCOME.OK
    status = move_links(model, reals, data, y, f)
    if status != OUTCOME.OK or stage == STAGE.VELOCITY:
        return status
    right = at(f, model[MODEL.DOFS])
    # Without a mass matrix of its own the evaluation skips inertias: forces only, or another
    # program supplies M.
    if stage == STAGE.FORCE or model[MODEL.CHAIN] > 0:
        clear_wrenches(model, data)
        status = apply_forces(model, reals, data, y, f)
        add_generalized_forces(model, data, right)
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
        # Inertial wrenches first; forces of items are then added to the same wrenches.
        spatial_inertias_and_bias(model, reals, data)
        status = apply_forces(model, reals, data, y, f)
        # One pass inwards gives M and the generalized forces.
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
    singular = solve_accelerations(model, data, right)
    if singular >= 0:
        f[0] = singular
        return OUTCOME.SINGULAR_MASS
    return OUTCOME.OK


def inverse(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, unused: int) -> int:
    """Compute the generalized forces that are missing for given accelerations, without constraints.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: workspace of an evaluation.
        y: state.
        f: udot after the rates; replaced by the generalized forces (N, N m).
        unused: argument without meaning, which all laws have.

    Returns:
        `OUTCOME.OK`, or the outcome of a kernel that failed, see `evaluate`.
    """
    place_links(model, reals, data, y, f)
    status = move_links(model, reals, data, y, f)
    if status != OUTCOME.OK:
        return status
    right = at(f, model[MODEL.DOFS])
    # Recursive Newton-Euler algorithm: accelerations outwards, wrenches inwards.
    add_accelerations(model, data, right)
    spatial_inertias_and_bias(model, reals, data)
    status = apply_forces(model, reals, data, y, f)
    add_generalized_forces(model, data, right)
    for freedom in range(model[MODEL.DOFS]):
        # Forces that balance inertia and items would be negative; what is missing has the opposite
        # sign.
        right[freedom] = -right[freedom]
    return status


def equilibrate(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, stage: int) -> int:
    """Bring all items that have an equilibrium into it, by changing their auxiliary states in y.

    The remaining items are equilibrated even if one fails.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: filled with the results of the evaluation.
        y: state; auxiliary states of forces are changed.
        f: workspace for the rates of the state.
        stage: last stage to evaluate before, see `STAGE`.

    Returns:
        `OUTCOME.OK`, or the outcome of the evaluation that failed; with UNSOLVED, f[0] is the index
        of the first item that failed.
    """
    status = call(model[MODEL.LAWS], model, reals, data, y, f, stage)
    if status != OUTCOME.OK:
        return status
    # Backwards, so that f[0] ends up with the first item that failed.
    for k in range(model[MODEL.EQUILIBRIA] - 1, -1, -1):
        j = at(model, model[MODEL.EQUILIBRIUM_AT] + EQUILIBRIUM.SIZE * k)
        if call(j[EQUILIBRIUM.KERNEL], model, reals, data, y, f, j[EQUILIBRIUM.ITEM]) != OUTCOME.OK:
            status, f[0] = OUTCOME.UNSOLVED, k
    return status


def multiply_symmetric(moments: Floats, a: Vector) -> Vector:
    """Return the product of a symmetric matrix, stored as its six different entries, and a vector.

    Args:
        moments: entries xx, yy, zz, xy, xz, yz of the matrix.
        a: vector.
    """
    x, y, z = a
    xx, yy, zz, xy, xz, yz = moments[0], moments[1], moments[2], moments[3], moments[4], moments[5]
    return xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z


def spatial_momentum(i: Floats, spin: Vector, velocity: Vector) -> tuple[Vector, Vector]:
    """Multiply a spatial velocity by a spatial inertia.

    Args:
        i: mass, first moment (3,), xx, yy, zz, xy, xz, yz about the origin.
        spin: angular velocity.
        velocity: linear velocity at the origin.

    Returns:
        Angular and linear momentum.
    """
    first = vector(i, 1)
    return (
        plus(multiply_symmetric(at(i, 4), spin), cross(first, velocity)),
        plus(times(i[0], velocity), cross(spin, first)),
    )


def spatial_inertias_and_bias(model: Ints, reals: Floats, data: Floats) -> None:
    """Compute spatial inertias of the links, and minus the wrenches that they need while udot = 0.

    With m the mass, c the mass centre and I the inertia about it, the spatial inertia about the
    origin is (I + m (c.c 1 - c c'), m c x; -m c x, m), and the wrench is I a + v x* (I v).

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results with poses, velocities and accelerations; filled with inertias and wrenches.
    """
    for link in range(model[MODEL.LINKS]):
        b = at(reals, REALS.INERTIA + INERTIA.SIZE * link)
        link_record = link_work(model, data, link)
        r = at(link_record, LINK_WORK.ROTATION)
        i = at(link_record, LINK_WORK.INERTIA)
        m = b[INERTIA.MASS]
        center = plus(
            minus(vector(link_record, LINK_WORK.POSITION), vector(link_record, LINK_WORK.ORIGIN)),
            rotate(r, vector(b, INERTIA.CENTER)),
        )
        cx, cy, cz = center
        mx, my, mz = times(m, center)
        # Rows of the rotation, since I in ground is R I Rᵀ.
        x_row, y_row, z_row = vector(r, 0), vector(r, 3), vector(r, 6)
        # Rows of R I, where I is the inertia in the link.
        first = multiply_symmetric(at(b, INERTIA.MOMENTS), x_row)
        second = multiply_symmetric(at(b, INERTIA.MOMENTS), y_row)
        third = multiply_symmetric(at(b, INERTIA.MOMENTS), z_row)
        i[0], i[1], i[2], i[3] = m, mx, my, mz
        # Inertia about the origin: R I Rᵀ plus the parallel axis terms.
        i[4] = dot(first, x_row) + my * cy + mz * cz
        i[5] = dot(second, y_row) + mx * cx + mz * cz
        i[6] = dot(third, z_row) + mx * cx + my * cy
        i[7] = dot(first, y_row) - mx * cy
        i[8] = dot(first, z_row) - mx * cz
        i[9] = dot(second, z_row) - my * cz
        spin = vector(link_record, LINK_WORK.VELOCITY)
        velocity = vector(link_record, LINK_WORK.VELOCITY + 3)
        # Newton-Euler equation: wrench = I a + v x* (I v).
        angular, linear = spatial_momentum(i, spin, velocity)
        torque, force = spatial_momentum(
            i,
            vector(link_record, LINK_WORK.ACCELERATION),
            vector(link_record, LINK_WORK.ACCELERATION + 3),
        )
        torque = plus(torque, plus(cross(spin, angular), cross(velocity, linear)))
        # The sign makes inertia a load like any other: M udot = sum of loads.
        store_vector(link_record, LINK_WORK.WRENCH, times(-1.0, torque))
        store_vector(
            link_record, LINK_WORK.WRENCH + 3, times(-1.0, plus(force, cross(spin, linear)))
        )


def add_accelerations(model: Ints, data: Floats, udot: Floats) -> None:
    """Add the contribution of udot to the accelerations of the links, outwards from ground.

    Args:
        model: integers of the model.
        data: results with accelerations while udot = 0; changed.
        udot: accelerations of the speeds (n,).
    """
    columns = at(data, model[MODEL.WORK_COLUMN])
    for link in range(model[MODEL.LINKS]):
        j = link_ints(model, link)
        link_record = link_work(model, data, link)
        # The wrench is not needed yet: its entries hold the accelerations that parents contribute.
        turn, shift = ZERO, ZERO
        if j[LINK.PARENT] >= 0:
            parent_change = at(link_work(model, data, j[LINK.PARENT]), LINK_WORK.WRENCH)
            turn, shift = vector(parent_change, 0), vector(parent_change, 3)
        for freedom in range(j[LINK.FIRST_DOF], j[LINK.END_DOF]):
            c = at(columns, 6 * freedom)
            turn = add_scaled(turn, udot[freedom], vector(c, 0))
            shift = add_scaled(shift, udot[freedom], vector(c, 3))
        store_vector(link_record, LINK_WORK.WRENCH, turn)
        store_vector(link_record, LINK_WORK.WRENCH + 3, shift)
        store_vector(
            link_record,
            LINK_WORK.ACCELERATION,
            plus(vector(link_record, LINK_WORK.ACCELERATION), turn),
        )
        store_vector(
            link_record,
            LINK_WORK.ACCELERATION + 3,
            plus(vector(link_record, LINK_WORK.ACCELERATION + 3), shift),
        )


def clear_wrenches(model: Ints, data: Floats) -> None:
    """Set the wrenches on all links to zero.

    Args:
        model: integers of the model.
        data: results; the wrenches are changed.
    """
    for link in range(model[MODEL.LINKS]):
        load = at(link_work(model, data, link), LINK_WORK.WRENCH)
        for k in range(6):
            load[k] = 0.0


def apply_forces(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats) -> int:
    """Add the loads of all items to wrenches or generalized forces.

    Generalized forces follow the rates of the coordinates in f.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results with poses and velocities; the wrenches are changed.
        y: state.
        f: rates of the coordinates, then generalized forces, then rates of auxiliary states;
            changed.

    Returns:
        `OUTCOME.OK`, or the outcome of the kernel of an item; then f[0] is the number of the item.
    """
    # Items add to the rates of auxiliary states, such as activation, so that these start from 0.
    for number in range(model[MODEL.DOFS], model[MODEL.STATE_SIZE]):
        f[number] = 0.0
    # A pair that does not touch writes nothing; clear what the last evaluation left.
    for number in range(model[MODEL.CONTACTS]):
        result = at(data, model[MODEL.WORK_CONTACT] + CONTACT_WORK.SIZE * number)
        result[0], result[1], result[2], result[CONTACT_WORK.DEPTH] = 0.0, 0.0, 0.0, 0.0
    for number in range(model[MODEL.RUNS]):
        run = model[MODEL.RUN_AT] + RUN.SIZE * number
        # A run of muscles of one type is computed together, other items one by one.
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


def add_generalized_forces(model: Ints, data: Floats, right: Floats) -> None:
    """Add the generalized forces of the wrenches, inwards from the leaves; sums up the wrenches.

    Args:
        model: integers of the model.
        data: results with wrenches, which are summed up over the subtrees.
        right: generalized forces (n,); changed.
    """
    columns = at(data, model[MODEL.WORK_COLUMN])
    # Children have larger numbers than their parents, so that this order goes inwards.
    for link in range(model[MODEL.LINKS] - 1, -1, -1):
        j = link_ints(model, link)
        load = at(link_work(model, data, link), LINK_WORK.WRENCH)
        for freedom in range(j[LINK.FIRST_DOF], j[LINK.END_DOF]):
            c = at(columns, 6 * freedom)
            for k in range(6):
                right[freedom] += c[k] * load[k]
        if j[LINK.PARENT] >= 0:
            parent_load = at(link_work(model, data, j[LINK.PARENT]), LINK_WORK.WRENCH)
            for k in range(6):
                parent_load[k] += load[k]


def composite_rigid_body(model: Ints, data: Floats, right: Floats) -> None:
    """Compute the mass matrix and add generalized forces of wrenches, inwards from the leaves.

    Args:
        model: integers of the model.
        data: results with inertias and wrenches, both summed up over the subtrees; filled with M.
        right: generalized forces (n,); changed.
    """
    freedoms, columns = at(model, model[MODEL.DOF_AT]), at(data, model[MODEL.WORK_COLUMN])
    for link in range(model[MODEL.LINKS] - 1, -1, -1):
        j = link_ints(model, link)
        link_record = link_work(model, data, link)
        i, load = at(link_record, LINK_WORK.INERTIA), at(link_record, LINK_WORK.WRENCH)
        for freedom in range(j[LINK.FIRST_DOF], j[LINK.END_DOF]):
            c = at(columns, 6 * freedom)
            turn, shift = vector(c, 0), vector(c, 3)
            right[freedom] += dot(turn, vector(load, 0)) + dot(shift, vector(load, 3))
            # Force that accelerates the subtree along this degree of freedom by 1; its products
            # with the columns above are the entries of M.
            angular, linear = spatial_momentum(i, turn, shift)
            row = at(data, freedoms[DOF.SIZE * freedom + DOF.ROW])
            k = freedom
            column = 0
            while k >= 0:
                c = at(columns, 6 * k)
                row[column] = dot(vector(c, 0), angular) + dot(vector(c, 3), linear)
                k = freedoms[DOF.SIZE * k + DOF.ABOVE]
                column += 1
        if j[LINK.PARENT] >= 0:
            parent_inertia = at(link_work(model, data, j[LINK.PARENT]), LINK_WORK.INERTIA)
            # Inertia (10) and wrench (6) are adjacent, and both are summed.
            for k in range(16):
                parent_inertia[k] += i[k]


def solve_accelerations(model: Ints, data: Floats, right: Floats) -> int:
    """Factorise the mass matrix and solve for the accelerations in place.

    Args:
        model: integers of the model.
        data: results with the mass matrix, which is replaced by its factor.
        right: generalized forces (n,), replaced by the accelerations.

    Returns:
        -1, or the degree of freedom that moves no mass.
    """
    size = model[MODEL.DOFS]
    freedoms = at(model, model[MODEL.DOF_AT])
    pivots = at(data, model[MODEL.WORK_PIVOT])
    # Keep the diagonal: pivots are compared with it, and `solve_by_multipliers` needs it.
    for k in range(size):
        pivots[k] = data[freedoms[DOF.SIZE * k + DOF.ROW]]
    # Factorise M = Lᵀ D L from the leaves to the root, and solve with Lᵀ and D on the way.
    for k in range(size - 1, -1, -1):
        j = at(freedoms, DOF.SIZE * k)
        row = at(data, j[DOF.ROW])
        depth = j[DOF.DEPTH]
        i = j[DOF.ABOVE]
        pivot = row[0]
        # A pivot of rounding errors means that a degree of freedom moves no mass; also true for
        # NaN.
        if not pivot > SMALLEST_PIVOT * pivots[k]:
            return k
        inverse = 1.0 / pivot
        load = right[k]
        for m in range(1, depth + 1):
            a = row[m] * inverse
            target = at(data, freedoms[DOF.SIZE * i + DOF.ROW])
            # Only entries on the path to ground exist: elimination from the leaves causes no
            # fill-in.
            for t in range(depth + 1 - m):
                target[t] -= a * row[m + t]
            right[i] -= a * load
            row[m] = a
            i = freedoms[DOF.SIZE * i + DOF.ABOVE]
        right[k] = load * inverse
    # Solve with L from the root to the leaves.
    for k in range(size):
        j = at(freedoms, DOF.SIZE * k)
        row = at(data, j[DOF.ROW])
        i = j[DOF.ABOVE]
        total = right[k]
        for m in range(1, j[DOF.DEPTH] + 1):
            total -= row[m] * right[i]
            i = freedoms[DOF.SIZE * i + DOF.ABOVE]
        right[k] = total
    return -1
