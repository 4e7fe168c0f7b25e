"""Springs, bushings and smooth contact. What a law puts into its record stands with the function that packs it."""

from __future__ import annotations

from math import sqrt

from osimlite.forces.bushing import bushing_dissipation, bushing_load, xyz_angles, xyz_moment, xyz_rates
from osimlite.forces.coordinate_limit import limit_dissipation
from osimlite.forces.smooth_contact import smooth_contact_energy, smooth_contact_force, smooth_hertz
from osimlite.forces.springs import coordinate_spring_force, point_spring_tension, spring_energy
from osimlite.forces.station_contact import station_contact_force
from osimlite.simulation.kernels.functions import value_at
from osimlite.simulation.kernels.layout import FINE, FREEDOMS, NUMBERS, OWN, RECORD
from osimlite.simulation.kernels.pointers import Floats, Ints, at
from osimlite.simulation.kernels.points import direction, push, station, turn, turning, velocity

LINEAR, FUNCTION = 0, 1
"""What the load of a bushing goes with."""


def coordinate_spring(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """A spring on a coordinate."""
    i = at(s, item)
    freedom, p, found = i[OWN], at(x, i[NUMBERS]), at(w, i[RECORD])
    q, u = coordinate(s, y, freedom, p[3])
    found[0], found[1] = coordinate_spring_force(q, u, p[0], p[1], p[2]), spring_energy(q - p[1], p[0])
    if freedom >= 0:
        f[s[FREEDOMS] + freedom] += found[0]
    return FINE


def limit_power(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """What the damper of a limit takes up."""
    i = at(s, item)
    freedom, p = i[OWN], at(x, i[NUMBERS])
    f[i[OWN + 1]] = limit_dissipation(y[freedom], y[s[FREEDOMS] + freedom], p[1], p[3], p[4], p[5])
    return FINE


def coordinate(s: Ints, y: Floats, freedom: int, value: float) -> tuple[float, float]:
    """Value and speed of a coordinate, which has its own value if it is locked."""
    if freedom < 0:
        return value, 0.0
    return y[freedom], y[s[FREEDOMS] + freedom]


def point_spring(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """A spring between two points."""
    i = at(s, item)
    p, found = at(x, i[NUMBERS]), at(w, i[RECORD])
    length, _ = line(s, w, i[OWN], i[OWN + 1], p, found)
    tension = point_spring_tension(length, p[12], p[13])
    pull_line(s, w, i[OWN], i[OWN + 1], p, found, tension)
    found[12] = spring_energy(length - p[13], p[12])
    return FINE


def line(s: Ints, w: Floats, one: int, two: int, p: Floats, found: Floats) -> tuple[float, float]:
    """Length and rate of the line between two points, which go into `found` with its direction."""
    ax, ay, az = station(s, w, one, p[0], p[1], p[2])
    bx, by, bz = station(s, w, two, p[3], p[4], p[5])
    dx, dy, dz = bx - ax, by - ay, bz - az
    length = sqrt(dx * dx + dy * dy + dz * dz)
    inverse = 1.0 / length if length > 0.0 else 0.0
    dx, dy, dz = inverse * dx, inverse * dy, inverse * dz
    ux, uy, uz = velocity(s, w, one, ax, ay, az)
    vx, vy, vz = velocity(s, w, two, bx, by, bz)
    found[0], found[1], found[2], found[3], found[4], found[5] = dx, dy, dz, ax, ay, az
    found[6], found[7], found[8] = bx, by, bz
    return length, (vx - ux) * dx + (vy - uy) * dy + (vz - uz) * dz


def pull_line(s: Ints, w: Floats, one: int, two: int, p: Floats, found: Floats, tension: float) -> None:
    """Pull at both ends of a line after `line`; then `found` has force and recorded point of either."""
    fx, fy, fz = tension * found[0], tension * found[1], tension * found[2]
    push(s, w, one, found[3], found[4], found[5], fx, fy, fz)
    push(s, w, two, found[6], found[7], found[8], -fx, -fy, -fz)
    found[0], found[1], found[2] = fx, fy, fz
    found[3], found[4], found[5] = station(s, w, one, p[6], p[7], p[8])
    found[6], found[7], found[8] = -fx, -fy, -fz
    found[9], found[10], found[11] = station(s, w, two, p[9], p[10], p[11])


def bushing(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """A bushing whose loads go with the deviations one by one."""
    i = at(s, item)
    p, found = at(x, i[NUMBERS]), at(w, i[RECORD])
    deviate(s, w, i[OWN], i[OWN + 1], p, found)
    kinds, loads = at(i, OWN + 2), at(found, BUSHING_LOADS)
    for k in range(6):
        deviation, rate, damping = found[BUSHING_DEVIATIONS + k], found[BUSHING_RATES + k], p[24 + k]
        if kinds[k] == LINEAR:
            loads[k] = bushing_load(deviation, rate, p[30 + k], damping)
        else:
            value, _, _ = value_at(at(p, kinds[6 + k]), deviation)
            loads[k] = -value - damping * rate
    load_bushing(s, w, i[OWN], i[OWN + 1], p, found)
    if i[OWN + 14] > 0:
        power = 0.0
        for k in range(6):
            power += bushing_dissipation(found[BUSHING_RATES + k], p[24 + k])
        f[i[OWN + 14]] = power
    return FINE


BUSHING_DEVIATIONS, BUSHING_LOADS, BUSHING_RATES, BUSHING_R1, BUSHING_R2, BUSHING_REGISTERS = 12, 18, 24, 30, 39, 48
"""Places in the record of a bushing, after force, moment and the origins of its frames."""


def deviate(s: Ints, w: Floats, one: int, two: int, p: Floats, found: Floats) -> None:
    """Deviations of the second frame of a bushing from the first, and their rates.

    Args:
        s: the mechanism.
        w: the work.
        one: link of the first frame.
        two: of the second.
        p: rotation by columns and origin of either frame in its link, and damping.
        found: the record.
    """
    for k in range(3):
        a, b = at(found, BUSHING_R1 + k), at(found, BUSHING_R2 + k)
        a[0], a[3], a[6] = direction(s, w, one, p[3 * k], p[3 * k + 1], p[3 * k + 2])
        b[0], b[3], b[6] = direction(s, w, two, p[12 + 3 * k], p[13 + 3 * k], p[14 + 3 * k])
    r, z = at(found, BUSHING_R1), at(found, BUSHING_R2)
    ax, ay, az = station(s, w, one, p[9], p[10], p[11])
    bx, by, bz = station(s, w, two, p[21], p[22], p[23])
    found[6], found[7], found[8], found[9], found[10], found[11] = ax, ay, az, bx, by, bz
    d, rates = at(found, BUSHING_DEVIATIONS), at(found, BUSHING_RATES)
    d[0], d[1], d[2] = xyz_angles(
        r[0] * z[0] + r[3] * z[3] + r[6] * z[6],
        r[0] * z[1] + r[3] * z[4] + r[6] * z[7],
        r[0] * z[2] + r[3] * z[5] + r[6] * z[8],
        r[1] * z[0] + r[4] * z[3] + r[7] * z[6],
        r[1] * z[1] + r[4] * z[4] + r[7] * z[7],
        r[1] * z[2] + r[4] * z[5] + r[7] * z[8],
        r[2] * z[2] + r[5] * z[5] + r[8] * z[8],
    )
    vx, vy, vz = velocity(s, w, two, bx, by, bz)
    # The moving frame is carried around by the other.
    ux, uy, uz = velocity(s, w, one, bx, by, bz)
    gx, gy, gz, vx, vy, vz = bx - ax, by - ay, bz - az, vx - ux, vy - uy, vz - uz
    wx, wy, wz = turning(s, w, two)
    ux, uy, uz = turning(s, w, one)
    wx, wy, wz = wx - ux, wy - uy, wz - uz
    for k in range(3):
        d[3 + k] = r[k] * gx + r[3 + k] * gy + r[6 + k] * gz
        rates[3 + k] = r[k] * vx + r[3 + k] * vy + r[6 + k] * vz
    rates[0], rates[1], rates[2] = xyz_rates(
        d[1],
        d[2],
        z[0] * wx + z[3] * wy + z[6] * wz,
        z[1] * wx + z[4] * wy + z[7] * wz,
        z[2] * wx + z[5] * wy + z[8] * wz,
    )
    if p[24] == 0.0 and p[25] == 0.0 and p[26] == 0.0:
        # They may be infinite where nothing asks for them.
        rates[0], rates[1], rates[2] = 0.0, 0.0, 0.0


def load_bushing(s: Ints, w: Floats, one: int, two: int, p: Floats, found: Floats) -> None:
    """Apply the loads to both links; the record then has force and moment on the second frame."""
    r, z, loads, d = (
        at(found, BUSHING_R1),
        at(found, BUSHING_R2),
        at(found, BUSHING_LOADS),
        at(found, BUSHING_DEVIATIONS),
    )
    mx, my, mz = xyz_moment(d[1], d[2], loads[0], loads[1], loads[2])
    for k in range(3):
        found[k] = r[3 * k] * loads[3] + r[3 * k + 1] * loads[4] + r[3 * k + 2] * loads[5]
        found[3 + k] = z[3 * k] * mx + z[3 * k + 1] * my + z[3 * k + 2] * mz
    fx, fy, fz, tx, ty, tz = found[0], found[1], found[2], found[3], found[4], found[5]
    push(s, w, two, found[9], found[10], found[11], fx, fy, fz)
    push(s, w, one, found[9], found[10], found[11], -fx, -fy, -fz)
    turn(s, w, two, tx, ty, tz)
    turn(s, w, one, -tx, -ty, -tz)


def station_contact(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """A point that the plane y = 0 of ground pushes."""
    i = at(s, item)
    link, p, found = i[OWN], at(x, i[NUMBERS]), at(w, i[RECORD])
    px, py, pz = station(s, w, link, p[0], p[1], p[2])
    vx, vy, vz = velocity(s, w, link, px, py, pz)
    found[0], found[1], found[2] = station_contact_force(py, vx, vy, vz, p[3], p[4], p[5], p[6], p[7], p[8])
    push(s, w, link, px, py, pz, found[0], found[1], found[2])
    return FINE


def smooth_contact(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """A sphere that a half space pushes smoothly."""
    i = at(s, item)
    one, two, p, found = i[OWN], i[OWN + 1], at(x, i[NUMBERS]), at(w, i[RECORD])
    ox, oy, oz = station(s, w, one, p[0], p[1], p[2])
    nx, ny, nz = direction(s, w, one, p[3], p[4], p[5])
    cx, cy, cz = station(s, w, two, p[6], p[7], p[8])
    radius = p[9]
    d = radius - ((cx - ox) * nx + (cy - oy) * ny + (cz - oz) * nz)
    hertz = smooth_hertz(d, radius, p[10], p[11], p[12])
    # Half the depth is either surface's.
    below = 0.5 * d - radius
    px, py, pz = cx + below * nx, cy + below * ny, cz + below * nz
    ux, uy, uz = velocity(s, w, one, px, py, pz)
    vx, vy, vz = velocity(s, w, two, px, py, pz)
    fx, fy, fz = smooth_contact_force(
        hertz, p[13], p[14], p[15], p[16], p[17], p[18], p[19], nx, ny, nz, ux - vx, uy - vy, uz - vz
    )
    found[0], found[1], found[2], found[3], found[4], found[5] = fx, fy, fz, px, py, pz
    found[6] = smooth_contact_energy(hertz, d)
    push(s, w, two, px, py, pz, fx, fy, fz)
    push(s, w, one, px, py, pz, -fx, -fy, -fz)
    return FINE
