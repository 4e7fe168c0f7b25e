"""Accelerations of a tree of links under gravity, contacts and limits.

The composite-rigid-body algorithm gives the mass matrix, and a factorisation that keeps its zeros solves for the
accelerations (R. Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 6.2 and 6.5). The cost grows with the
number of degrees of freedom times the square of how many of them carry one another.
"""

from __future__ import annotations

from osimlite.forces.coordinate_limit import limit_force
from osimlite.forces.hunt_crossley import contact_force, half_space_sphere, sphere_sphere
from osimlite.simulation.kernels.arrays import HALF_SPACE, Floats, Numbers, Structure, Work
from osimlite.simulation.kernels.motion import FINE, SINGULAR_MASS, move, place

SMALLEST_PIVOT = 1e-13
"""What of the inertia that a speed moves must be left after all others that it carries are free."""


def evaluate(s: Structure, x: Numbers, w: Work, y: Floats, f: Floats) -> int:
    """The derivative f of the state y = (q, u); what else there is to know stays in `w`.

    Returns:
        FINE or what went wrong; with SINGULAR_MASS, f[0] is the degree of freedom that moves no mass.
    """
    size = len(s.above)
    q, u, rates, right = y[:size], y[size:], f[:size], f[size:]
    place(s, x, w, q)
    status = move(s, x, w, q, u, rates)
    if status != FINE:
        return status
    weigh(s, x, w)
    touch(s, x, w)
    for freedom in range(size):
        right[freedom] = 0.0
    for number in range(len(s.limited)):
        freedom, c = s.limited[number], x.limits
        value = q[freedom]
        if not c[number, 3] <= value <= c[number, 1]:
            right[freedom] += limit_force(
                value,
                u[freedom],
                c[number, 0],
                c[number, 1],
                c[number, 2],
                c[number, 3],
                c[number, 4],
                c[number, 5],
            )
    gather(s, w, right)
    singular = solve(s, w, right)
    if singular >= 0:
        f[0] = singular
        return SINGULAR_MASS
    return FINE


def contacts_at(s: Structure, x: Numbers, w: Work, y: Floats, f: Floats) -> None:
    """Contacts at a state, in `w`; f is overwritten."""
    size = len(s.above)
    place(s, x, w, y[:size])
    move(s, x, w, y[:size], y[size:], f[:size])
    touch(s, x, w)


def momentum(
    i: Floats, link: int, wx: float, wy: float, wz: float, vx: float, vy: float, vz: float
) -> tuple[float, float, float, float, float, float]:
    """Inertia of a link times a spatial vector."""
    m, cx, cy, cz = i[link, 0], i[link, 1], i[link, 2], i[link, 3]
    xx, yy, zz, xy, xz, yz = i[link, 4], i[link, 5], i[link, 6], i[link, 7], i[link, 8], i[link, 9]
    return (
        xx * wx + xy * wy + xz * wz + cy * vz - cz * vy,
        xy * wx + yy * wy + yz * wz + cz * vx - cx * vz,
        xz * wx + yz * wy + zz * wz + cx * vy - cy * vx,
        m * vx + wy * cz - wz * cy,
        m * vy + wz * cx - wx * cz,
        m * vz + wx * cy - wy * cx,
    )


def weigh(s: Structure, x: Numbers, w: Work) -> None:
    """Inertias of the links, and the wrenches that are missing for their accelerations without udot."""
    for link in range(len(s.parent)):
        b, r, i = x.inertia, w.rotation, w.inertia
        m = b[link, 0]
        cx = (
            w.position[link, 0]
            - w.origin[0]
            + r[link, 0] * b[link, 1]
            + r[link, 1] * b[link, 2]
            + r[link, 2] * b[link, 3]
        )
        cy = (
            w.position[link, 1]
            - w.origin[1]
            + r[link, 3] * b[link, 1]
            + r[link, 4] * b[link, 2]
            + r[link, 5] * b[link, 3]
        )
        cz = (
            w.position[link, 2]
            - w.origin[2]
            + r[link, 6] * b[link, 1]
            + r[link, 7] * b[link, 2]
            + r[link, 8] * b[link, 3]
        )
        xx, yy, zz, xy, xz, yz = b[link, 4], b[link, 5], b[link, 6], b[link, 7], b[link, 8], b[link, 9]
        # Rows of R I.
        ax, ay, az = (
            r[link, 0] * xx + r[link, 1] * xy + r[link, 2] * xz,
            r[link, 0] * xy + r[link, 1] * yy + r[link, 2] * yz,
            r[link, 0] * xz + r[link, 1] * yz + r[link, 2] * zz,
        )
        bx, by, bz = (
            r[link, 3] * xx + r[link, 4] * xy + r[link, 5] * xz,
            r[link, 3] * xy + r[link, 4] * yy + r[link, 5] * yz,
            r[link, 3] * xz + r[link, 4] * yz + r[link, 5] * zz,
        )
        ex, ey, ez = (
            r[link, 6] * xx + r[link, 7] * xy + r[link, 8] * xz,
            r[link, 6] * xy + r[link, 7] * yy + r[link, 8] * yz,
            r[link, 6] * xz + r[link, 7] * yz + r[link, 8] * zz,
        )
        mx, my, mz = m * cx, m * cy, m * cz
        i[link, 0], i[link, 1], i[link, 2], i[link, 3] = m, mx, my, mz
        i[link, 4] = ax * r[link, 0] + ay * r[link, 1] + az * r[link, 2] + my * cy + mz * cz
        i[link, 5] = bx * r[link, 3] + by * r[link, 4] + bz * r[link, 5] + mx * cx + mz * cz
        i[link, 6] = ex * r[link, 6] + ey * r[link, 7] + ez * r[link, 8] + mx * cx + my * cy
        i[link, 7] = ax * r[link, 3] + ay * r[link, 4] + az * r[link, 5] - mx * cy
        i[link, 8] = ax * r[link, 6] + ay * r[link, 7] + az * r[link, 8] - mx * cz
        i[link, 9] = bx * r[link, 6] + by * r[link, 7] + bz * r[link, 8] - my * cz
        v, a, load = w.velocity, w.acceleration, w.wrench
        wx, wy, wz, vx, vy, vz = v[link, 0], v[link, 1], v[link, 2], v[link, 3], v[link, 4], v[link, 5]
        nx, ny, nz, lx, ly, lz = momentum(i, link, wx, wy, wz, vx, vy, vz)
        gx, gy, gz, hx, hy, hz = momentum(
            i, link, a[link, 0], a[link, 1], a[link, 2], a[link, 3], a[link, 4], a[link, 5]
        )
        load[link, 0] = -gx - (wy * nz - wz * ny + vy * lz - vz * ly)
        load[link, 1] = -gy - (wz * nx - wx * nz + vz * lx - vx * lz)
        load[link, 2] = -gz - (wx * ny - wy * nx + vx * ly - vy * lx)
        load[link, 3] = -hx - (wy * lz - wz * ly)
        load[link, 4] = -hy - (wz * lx - wx * lz)
        load[link, 5] = -hz - (wx * ly - wy * lx)


def touch(s: Structure, x: Numbers, w: Work) -> None:
    """Contacts of all pairs, added to the wrenches."""
    for pair in range(len(s.pair_kind)):
        p, found = x.pairs, w.contacts
        for k in range(8):
            found[pair, k] = 0.0
        one, two = s.pair_links[pair, 0], s.pair_links[pair, 1]
        ox, oy, oz = station(w, one, p[pair, 0], p[pair, 1], p[pair, 2])
        cx, cy, cz = station(w, two, p[pair, 7], p[pair, 8], p[pair, 9])
        if s.pair_kind[pair] == HALF_SPACE:
            nx, ny, nz = direction(w, one, p[pair, 3], p[pair, 4], p[pair, 5])
            radius = p[pair, 10]
            d, px, py, pz = half_space_sphere(ox, oy, oz, nx, ny, nz, cx, cy, cz, radius, p[pair, 12])
        else:
            d, radius, nx, ny, nz, px, py, pz = sphere_sphere(
                ox, oy, oz, p[pair, 6], cx, cy, cz, p[pair, 10], p[pair, 12]
            )
        if not d > 0.0:
            continue
        ux, uy, uz = velocity(w, one, px, py, pz)
        vx, vy, vz = velocity(w, two, px, py, pz)
        fx, fy, fz = contact_force(
            d,
            radius,
            p[pair, 11],
            p[pair, 13],
            p[pair, 14],
            p[pair, 15],
            p[pair, 16],
            p[pair, 17],
            nx,
            ny,
            nz,
            ux - vx,
            uy - vy,
            uz - vz,
        )
        found[pair, 0], found[pair, 1], found[pair, 2], found[pair, 3], found[pair, 4], found[pair, 5] = (
            fx,
            fy,
            fz,
            px,
            py,
            pz,
        )
        found[pair, 6], found[pair, 7] = d, radius
        push(w, two, px, py, pz, fx, fy, fz)
        push(w, one, px, py, pz, -fx, -fy, -fz)


def station(w: Work, link: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Position in ground of a point of a link."""
    if link < 0:
        return x, y, z
    r, p = w.rotation, w.position
    return (
        p[link, 0] + r[link, 0] * x + r[link, 1] * y + r[link, 2] * z,
        p[link, 1] + r[link, 3] * x + r[link, 4] * y + r[link, 5] * z,
        p[link, 2] + r[link, 6] * x + r[link, 7] * y + r[link, 8] * z,
    )


def direction(w: Work, link: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """A direction of a link, in ground."""
    if link < 0:
        return x, y, z
    r = w.rotation
    return (
        r[link, 0] * x + r[link, 1] * y + r[link, 2] * z,
        r[link, 3] * x + r[link, 4] * y + r[link, 5] * z,
        r[link, 6] * x + r[link, 7] * y + r[link, 8] * z,
    )


def velocity(w: Work, link: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Velocity of the point of a link that is at (x, y, z) in ground."""
    if link < 0:
        return 0.0, 0.0, 0.0
    v, px, py, pz = w.velocity, x - w.origin[0], y - w.origin[1], z - w.origin[2]
    return (
        v[link, 3] + v[link, 1] * pz - v[link, 2] * py,
        v[link, 4] + v[link, 2] * px - v[link, 0] * pz,
        v[link, 5] + v[link, 0] * py - v[link, 1] * px,
    )


def push(w: Work, link: int, x: float, y: float, z: float, fx: float, fy: float, fz: float) -> None:
    """Apply a force at a point of ground to a link."""
    if link < 0:
        return
    load, px, py, pz = w.wrench, x - w.origin[0], y - w.origin[1], z - w.origin[2]
    load[link, 0] += py * fz - pz * fy
    load[link, 1] += pz * fx - px * fz
    load[link, 2] += px * fy - py * fx
    load[link, 3] += fx
    load[link, 4] += fy
    load[link, 5] += fz


def gather(s: Structure, w: Work, right: Floats) -> None:
    """Mass matrix below its diagonal, and the generalized forces, inwards from the leaves."""
    for link in range(len(s.parent) - 1, -1, -1):
        i, load, c = w.inertia, w.wrench, w.columns
        for j in range(s.freedoms[link], s.freedoms[link + 1]):
            ex, ey, ez, mx, my, mz = c[j, 0], c[j, 1], c[j, 2], c[j, 3], c[j, 4], c[j, 5]
            right[j] += (
                ex * load[link, 0]
                + ey * load[link, 1]
                + ez * load[link, 2]
                + mx * load[link, 3]
                + my * load[link, 4]
                + mz * load[link, 5]
            )
            hx, hy, hz, lx, ly, lz = momentum(i, link, ex, ey, ez, mx, my, mz)
            k = j
            while k >= 0:
                w.matrix[j, k] = c[k, 0] * hx + c[k, 1] * hy + c[k, 2] * hz + c[k, 3] * lx + c[k, 4] * ly + c[k, 5] * lz
                k = s.above[k]
        parent = s.parent[link]
        if parent >= 0:
            for k in range(10):
                i[parent, k] += i[link, k]
            for k in range(6):
                load[parent, k] += load[link, k]


def solve(s: Structure, w: Work, right: Floats) -> int:
    """Solve for the accelerations in place; returns the degree of freedom that moves no mass, or -1."""
    size, matrix = len(s.above), w.matrix
    for k in range(size):
        w.pivots[k] = matrix[k, k]
    for k in range(size - 1, -1, -1):
        pivot = matrix[k, k]
        if not pivot > SMALLEST_PIVOT * w.pivots[k]:
            return k
        inverse, load = 1.0 / pivot, right[k]
        i = s.above[k]
        while i >= 0:
            a = matrix[k, i] * inverse
            j = i
            while j >= 0:
                matrix[i, j] -= a * matrix[k, j]
                j = s.above[j]
            right[i] -= a * load
            matrix[k, i] = a
            i = s.above[i]
        right[k] = load * inverse
    for k in range(size):
        total = right[k]
        i = s.above[k]
        while i >= 0:
            total -= matrix[k, i] * right[i]
            i = s.above[i]
        right[k] = total
    return -1
