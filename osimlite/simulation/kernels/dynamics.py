"""Accelerations of a tree of links under gravity and whatever pushes.

The composite-rigid-body algorithm gives the mass matrix, and a factorisation that keeps its zeros solves for the
accelerations (R. Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 6.2 and 6.5). Of the row of a degree of
freedom only the entries of those on its way to ground are there, its own first. The cost grows with the number of
degrees of freedom times the square of how many of them carry one another.
"""

from __future__ import annotations

from osimlite.simulation.kernels.layout import (
    ABOVE,
    ACCELERATION,
    ACCELERATION_STAGE,
    CHAIN,
    CHAIN_DYNAMICS,
    CONSTRAINED,
    CONSTRAINED_DYNAMICS,
    CONTACT_WORK,
    CONTACTS,
    DEPTH,
    DEPTH_OF,
    END_FREEDOM,
    EQUILIBRIA,
    EQUILIBRIUM_AT,
    EQUILIBRIUM_INTS,
    FIRST_FREEDOM,
    FORCE_STAGE,
    FREEDOM_AT,
    FREEDOM_INTS,
    FREEDOMS,
    INERTIA,
    INERTIA_AT,
    ITEM_AT,
    ITEMS,
    LAW,
    LAWS,
    LINK_AT,
    LINK_INTS,
    LINK_WORK,
    LINKS,
    OK,
    ORIGIN,
    PARENT,
    POSITION,
    POSITION_STAGE,
    ROTATION,
    ROW,
    SINGULAR_MASS,
    STATE_SIZE,
    UNSOLVED,
    VELOCITY,
    VELOCITY_STAGE,
    WORK_COLUMN,
    WORK_CONTACT,
    WORK_LINK,
    WORK_PIVOT,
    WRENCH,
)
from osimlite.simulation.kernels.motion import move, place
from osimlite.simulation.kernels.pointers import Floats, Ints, at, call

SMALLEST_PIVOT = 1e-13
"""What of the inertia that a speed moves must be left after all others that it carries are free."""


def evaluate(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, stage: int) -> int:
    """The derivative f of the state y = (q, u, z); what else there is to know stays in `w`. Nothing depends on z.

    Returns:
        OK or what went wrong; with SINGULAR_MASS, f[0] is the degree of freedom that moves no mass.
    """
    place(s, x, w, y, f)
    if stage == POSITION_STAGE:
        return OK
    status = move(s, x, w, y, f)
    if status != OK or stage == VELOCITY_STAGE:
        return status
    right = at(f, s[FREEDOMS])
    if stage == FORCE_STAGE or s[CHAIN] > 0:
        clear_wrenches(s, w)
        status = apply_forces(s, x, w, y, f)
        generalized_forces(s, w, right)
        if stage == ACCELERATION_STAGE and status == OK:
            status = call(s[LAWS + s[s[CHAIN] + CHAIN_DYNAMICS]], s, x, w, y, f, 0)
    else:
        spatial_inertias_and_bias(s, x, w)
        status = apply_forces(s, x, w, y, f)
        composite_rigid_body(s, w, right)
    if stage == FORCE_STAGE or status != OK:
        return status
    if s[CONSTRAINED] > 0:
        return call(s[LAWS + s[s[CONSTRAINED] + CONSTRAINED_DYNAMICS]], s, x, w, y, f, 0)
    singular = solve(s, w, right)
    if singular >= 0:
        f[0] = singular
        return SINGULAR_MASS
    return OK


def equilibrate(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, stage: int) -> int:
    """Bring what can be into equilibrium: changes auxiliary states in y, also after one has failed.

    Returns:
        OK, or what went wrong; with UNSOLVED, f[0] is the number of the first that has no equilibrium.
    """
    status = call(s[LAWS], s, x, w, y, f, stage)
    if status != OK:
        return status
    for k in range(s[EQUILIBRIA] - 1, -1, -1):
        j = at(s, s[EQUILIBRIUM_AT] + EQUILIBRIUM_INTS * k)
        if call(j[0], s, x, w, y, f, j[1]) != OK:
            status, f[0] = UNSOLVED, k
    return status


def momentum(
    i: Floats, wx: float, wy: float, wz: float, vx: float, vy: float, vz: float
) -> tuple[float, float, float, float, float, float]:
    """Inertia times a spatial vector."""
    m, cx, cy, cz, xx, yy, zz, xy, xz, yz = i[0], i[1], i[2], i[3], i[4], i[5], i[6], i[7], i[8], i[9]
    return (
        xx * wx + xy * wy + xz * wz + cy * vz - cz * vy,
        xy * wx + yy * wy + yz * wz + cz * vx - cx * vz,
        xz * wx + yz * wy + zz * wz + cx * vy - cy * vx,
        m * vx + wy * cz - wz * cy,
        m * vy + wz * cx - wx * cz,
        m * vz + wx * cy - wy * cx,
    )


def spatial_inertias_and_bias(s: Ints, x: Floats, w: Floats) -> None:
    """Inertias of the links, and the wrenches that are missing for their accelerations without udot."""
    for link in range(s[LINKS]):
        b, here = at(x, INERTIA_AT + 10 * link), at(w, s[WORK_LINK] + LINK_WORK * link)
        r, p, o, i = at(here, ROTATION), at(here, POSITION), at(here, ORIGIN), at(here, INERTIA)
        m, bx, by, bz = b[0], b[1], b[2], b[3]
        r0, r1, r2, r3, r4, r5, r6, r7, r8 = r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8]
        cx = p[0] - o[0] + r0 * bx + r1 * by + r2 * bz
        cy = p[1] - o[1] + r3 * bx + r4 * by + r5 * bz
        cz = p[2] - o[2] + r6 * bx + r7 * by + r8 * bz
        xx, yy, zz, xy, xz, yz = b[4], b[5], b[6], b[7], b[8], b[9]
        # Rows of R I.
        ax, ay, az = r0 * xx + r1 * xy + r2 * xz, r0 * xy + r1 * yy + r2 * yz, r0 * xz + r1 * yz + r2 * zz
        ex, ey, ez = r3 * xx + r4 * xy + r5 * xz, r3 * xy + r4 * yy + r5 * yz, r3 * xz + r4 * yz + r5 * zz
        gx, gy, gz = r6 * xx + r7 * xy + r8 * xz, r6 * xy + r7 * yy + r8 * yz, r6 * xz + r7 * yz + r8 * zz
        mx, my, mz = m * cx, m * cy, m * cz
        i[0], i[1], i[2], i[3] = m, mx, my, mz
        i[4] = ax * r0 + ay * r1 + az * r2 + my * cy + mz * cz
        i[5] = ex * r3 + ey * r4 + ez * r5 + mx * cx + mz * cz
        i[6] = gx * r6 + gy * r7 + gz * r8 + mx * cx + my * cy
        i[7] = ax * r3 + ay * r4 + az * r5 - mx * cy
        i[8] = ax * r6 + ay * r7 + az * r8 - mx * cz
        i[9] = ex * r6 + ey * r7 + ez * r8 - my * cz
        v, a, load = at(here, VELOCITY), at(here, ACCELERATION), at(here, WRENCH)
        wx, wy, wz, vx, vy, vz = v[0], v[1], v[2], v[3], v[4], v[5]
        nx, ny, nz, lx, ly, lz = momentum(i, wx, wy, wz, vx, vy, vz)
        qx, qy, qz, hx, hy, hz = momentum(i, a[0], a[1], a[2], a[3], a[4], a[5])
        load[0] = -qx - (wy * nz - wz * ny + vy * lz - vz * ly)
        load[1] = -qy - (wz * nx - wx * nz + vz * lx - vx * lz)
        load[2] = -qz - (wx * ny - wy * nx + vx * ly - vy * lx)
        load[3] = -hx - (wy * lz - wz * ly)
        load[4] = -hy - (wz * lx - wx * lz)
        load[5] = -hz - (wx * ly - wy * lx)


def clear_wrenches(s: Ints, w: Floats) -> None:
    """No wrench on any link."""
    for link in range(s[LINKS]):
        load = at(w, s[WORK_LINK] + LINK_WORK * link + WRENCH)
        for k in range(6):
            load[k] = 0.0


def apply_forces(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats) -> int:
    """Add what all items push to the wrenches, or to the generalized forces behind the rates in f.

    Returns:
        OK, or what the kernel of an item says; then f[0] is the number of the item.
    """
    for number in range(s[FREEDOMS], s[STATE_SIZE]):
        f[number] = 0.0
    for number in range(s[CONTACTS]):
        found = at(w, s[WORK_CONTACT] + CONTACT_WORK * number)
        found[0], found[1], found[2], found[DEPTH_OF] = 0.0, 0.0, 0.0, 0.0
    for number in range(s[ITEMS]):
        item = s[s[ITEM_AT] + number]
        status = call(s[item + LAW], s, x, w, y, f, item)
        if status != OK:
            f[0] = number
            return status
    return OK


def generalized_forces(s: Ints, w: Floats, right: Floats) -> None:
    """The generalized forces of the wrenches, inwards from the leaves."""
    columns = at(w, s[WORK_COLUMN])
    for link in range(s[LINKS] - 1, -1, -1):
        j, load = at(s, s[LINK_AT] + LINK_INTS * link), at(w, s[WORK_LINK] + LINK_WORK * link + WRENCH)
        for freedom in range(j[FIRST_FREEDOM], j[END_FREEDOM]):
            c = at(columns, 6 * freedom)
            for k in range(6):
                right[freedom] += c[k] * load[k]
        if j[PARENT] >= 0:
            above = at(w, s[WORK_LINK] + LINK_WORK * j[PARENT] + WRENCH)
            for k in range(6):
                above[k] += load[k]


def composite_rigid_body(s: Ints, w: Floats, right: Floats) -> None:
    """Mass matrix, and the generalized forces, inwards from the leaves."""
    freedoms, columns = at(s, s[FREEDOM_AT]), at(w, s[WORK_COLUMN])
    for link in range(s[LINKS] - 1, -1, -1):
        j, here = at(s, s[LINK_AT] + LINK_INTS * link), at(w, s[WORK_LINK] + LINK_WORK * link)
        i, load = at(here, INERTIA), at(here, WRENCH)
        for freedom in range(j[FIRST_FREEDOM], j[END_FREEDOM]):
            c = at(columns, 6 * freedom)
            ex, ey, ez, mx, my, mz = c[0], c[1], c[2], c[3], c[4], c[5]
            right[freedom] += ex * load[0] + ey * load[1] + ez * load[2] + mx * load[3] + my * load[4] + mz * load[5]
            hx, hy, hz, lx, ly, lz = momentum(i, ex, ey, ez, mx, my, mz)
            row, k, place = at(w, freedoms[FREEDOM_INTS * freedom + ROW]), freedom, 0
            while k >= 0:
                c = at(columns, 6 * k)
                row[place] = c[0] * hx + c[1] * hy + c[2] * hz + c[3] * lx + c[4] * ly + c[5] * lz
                k = freedoms[FREEDOM_INTS * k + ABOVE]
                place += 1
        if j[PARENT] >= 0:
            above = at(w, s[WORK_LINK] + LINK_WORK * j[PARENT] + INERTIA)
            # The wrench stands behind the inertia.
            for k in range(16):
                above[k] += i[k]


def solve(s: Ints, w: Floats, right: Floats) -> int:
    """Solve for the accelerations in place; returns the degree of freedom that moves no mass, or -1."""
    size, freedoms, pivots = s[FREEDOMS], at(s, s[FREEDOM_AT]), at(w, s[WORK_PIVOT])
    for k in range(size):
        pivots[k] = w[freedoms[FREEDOM_INTS * k + ROW]]
    for k in range(size - 1, -1, -1):
        j = at(freedoms, FREEDOM_INTS * k)
        row, depth, i = at(w, j[ROW]), j[DEPTH], j[ABOVE]
        pivot = row[0]
        if not pivot > SMALLEST_PIVOT * pivots[k]:
            return k
        inverse, load = 1.0 / pivot, right[k]
        for m in range(1, depth + 1):
            a = row[m] * inverse
            target = at(w, freedoms[FREEDOM_INTS * i + ROW])
            for t in range(depth + 1 - m):
                target[t] -= a * row[m + t]
            right[i] -= a * load
            row[m] = a
            i = freedoms[FREEDOM_INTS * i + ABOVE]
        right[k] = load * inverse
    for k in range(size):
        j = at(freedoms, FREEDOM_INTS * k)
        row, i, total = at(w, j[ROW]), j[ABOVE], right[k]
        for m in range(1, j[DEPTH] + 1):
            total -= row[m] * right[i]
            i = freedoms[FREEDOM_INTS * i + ABOVE]
        right[k] = total
    return -1
