"""Contact of a mesh with a half space or a sphere by an elastic foundation."""

from __future__ import annotations

from osimlite.forces.elastic_foundation import spring_in_half_space, spring_in_sphere, spring_load
from osimlite.simulation.kernels.layout import CONTACT_AT, DEPTH_OF, FIRST_CONTACT, NUMBERS, OK, OWN, RECORD
from osimlite.simulation.kernels.pointers import Floats, Ints, at
from osimlite.simulation.kernels.points import angular_velocity, apply_force, apply_torque, direction, station, velocity

SPRINGS = 16
"""Where the springs stand among the numbers: stiffness and middle in the link of each."""

MESH_WORK = 10
"""The record: force and torque on the mesh, the point that they are about, and energy."""


def touch_mesh(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """A mesh (surface 2) on a half space or a sphere.

    The integers are the links of both, the place of the pair among those of the force, the number of the springs, and
    whether surface 1 is a half space; the numbers centre, normal and radius of surface 1 in its link, centre and radius
    of the ball around the mesh in its link, and c, us, ud, uv, vt of the law.
    """
    i = at(s, item)
    one, two, count, is_plane = i[OWN], i[OWN + 1], i[OWN + 3], i[OWN + 4]
    p, found = at(x, i[NUMBERS]), at(w, i[RECORD])
    for k in range(MESH_WORK):
        found[k] = 0.0
    ox, oy, oz = station(s, w, one, p[0], p[1], p[2])
    ax, ay, az = station(s, w, two, p[7], p[8], p[9])
    nx, ny, nz = direction(s, w, one, p[3], p[4], p[5])
    gx, gy, gz = ax - ox, ay - oy, az - oz
    if is_plane:
        if gx * nx + gy * ny + gz * nz >= p[10]:
            return OK
    elif gx * gx + gy * gy + gz * gz >= (p[6] + p[10]) * (p[6] + p[10]):
        return OK
    ux, uy, uz = velocity(s, w, one, ax, ay, az)
    vx, vy, vz = velocity(s, w, two, ax, ay, az)
    vx, vy, vz = ux - vx, uy - vy, uz - vz
    ux, uy, uz = angular_velocity(s, w, one)
    wx, wy, wz = angular_velocity(s, w, two)
    wx, wy, wz = ux - wx, uy - wy, uz - wz
    fx = fy = fz = tx = ty = tz = energy = 0.0
    for k in range(count):
        spring = at(p, SPRINGS + 4 * k)
        mx, my, mz = station(s, w, two, spring[1], spring[2], spring[3])
        if is_plane:
            d, ex, ey, ez = spring_in_half_space(ox, oy, oz, nx, ny, nz, mx, my, mz)
        else:
            d, ex, ey, ez = spring_in_sphere(ox, oy, oz, p[6], mx, my, mz)
        if d > 0.0:
            px, py, pz, qx, qy, qz, stored = spring_load(
                spring[0], p[11], p[12], p[13], p[14], p[15], mx, my, mz, ex, ey, ez, ax, ay, az,
                vx, vy, vz, wx, wy, wz,
            )  # fmt: skip
            fx += px
            fy += py
            fz += pz
            tx += qx
            ty += qy
            tz += qz
            energy += stored
    load_mesh(s, w, item, ax, ay, az, fx, fy, fz, tx, ty, tz, energy)
    return OK


def load_mesh(
    s: Ints,
    w: Floats,
    item: int,
    ax: float,
    ay: float,
    az: float,
    fx: float,
    fy: float,
    fz: float,
    tx: float,
    ty: float,
    tz: float,
    energy: float,
) -> None:
    """Apply a force at a point, and a torque, to the mesh, and their opposites to surface 1; fill both records."""
    i = at(s, item)
    one, two, found = i[OWN], i[OWN + 1], at(w, i[RECORD])
    found[0], found[1], found[2], found[3], found[4], found[5] = fx, fy, fz, ax, ay, az
    found[6], found[7], found[8], found[9] = tx, ty, tz, energy
    apply_force(s, w, two, ax, ay, az, fx, fy, fz)
    apply_torque(s, w, two, tx, ty, tz)
    apply_force(s, w, one, ax, ay, az, -fx, -fy, -fz)
    apply_torque(s, w, one, -tx, -ty, -tz)
    contact = at(w, s[s[s[CONTACT_AT] + i[FIRST_CONTACT] + i[OWN + 2]] + RECORD])
    contact[0], contact[1], contact[2], contact[3], contact[4], contact[5] = fx, fy, fz, ax, ay, az
    if fx != 0.0 or fy != 0.0 or fz != 0.0:
        contact[DEPTH_OF] = 1.0
