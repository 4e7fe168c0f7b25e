"""Springs and ligaments along paths of straight lines.

The integers of a path are the number of its points and the link of each, its numbers begin with the points in their
links. Its record begins with length and rate.
"""

from __future__ import annotations

from math import sqrt

from osimlite.forces.springs import blankevoort_energy, blankevoort_tension, path_spring_energy, path_spring_tension
from osimlite.simulation.kernels.functions import value_at
from osimlite.simulation.kernels.layout import FINE, NUMBERS, OWN, RECORD
from osimlite.simulation.kernels.pointers import Floats, Ints, at
from osimlite.simulation.kernels.points import push, station, velocity


def path_spring(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """A spring along a path: tension and energy."""
    length, rate = measure(s, x, w, item)
    p, found = own_numbers(s, x, item), at(w, s[item + RECORD])
    found[2] = path_spring_tension(length, rate, p[0], p[1], p[2])
    found[3] = path_spring_energy(length, p[0], p[1])
    pull(s, x, w, item, found[2])
    return FINE


def ligament(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """A force times a curve of the length: tension."""
    length, _ = measure(s, x, w, item)
    p, found = own_numbers(s, x, item), at(w, s[item + RECORD])
    found[2] = 0.0
    if length > p[0]:
        value, _, _ = value_at(at(p, 2), length / p[0])
        found[2] = p[1] * value
        pull(s, x, w, item, found[2])
    return FINE


def blankevoort(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """A ligament by Blankevoort: tension, its elastic part, energy."""
    length, rate = measure(s, x, w, item)
    p, found = own_numbers(s, x, item), at(w, s[item + RECORD])
    found[2] = blankevoort_tension(length, rate, p[0], p[1], p[2], p[3])
    found[3] = blankevoort_tension(length, 0.0, p[0], p[1], p[2], p[3])
    found[4] = blankevoort_energy(length, p[0], p[1], p[2])
    pull(s, x, w, item, found[2])
    return FINE


def own_numbers(s: Ints, x: Floats, item: int) -> Floats:
    """The numbers of a path's force, after those of its points."""
    return at(x, s[item + NUMBERS] + 3 * s[item + OWN])


def measure(s: Ints, x: Floats, w: Floats, item: int) -> tuple[float, float]:
    """Length and rate of a path, which go into its record too."""
    i = at(s, item)
    count, links, p, found = i[OWN], at(i, OWN + 1), at(x, i[NUMBERS]), at(w, i[RECORD])
    length = rate = 0.0
    ax, ay, az = station(s, w, links[0], p[0], p[1], p[2])
    for k in range(1, count):
        bx, by, bz = station(s, w, links[k], p[3 * k], p[3 * k + 1], p[3 * k + 2])
        gx, gy, gz = bx - ax, by - ay, bz - az
        part = sqrt(gx * gx + gy * gy + gz * gz)
        if part > 0.0:
            ux, uy, uz = velocity(s, w, links[k - 1], ax, ay, az)
            vx, vy, vz = velocity(s, w, links[k], bx, by, bz)
            rate += ((vx - ux) * gx + (vy - uy) * gy + (vz - uz) * gz) / part
        length += part
        ax, ay, az = bx, by, bz
    found[0], found[1] = length, rate
    return length, rate


def pull(s: Ints, x: Floats, w: Floats, item: int, tension: float) -> None:
    """Pull at all points of a path along its lines."""
    i = at(s, item)
    count, links, p = i[OWN], at(i, OWN + 1), at(x, i[NUMBERS])
    ax, ay, az = station(s, w, links[0], p[0], p[1], p[2])
    for k in range(1, count):
        bx, by, bz = station(s, w, links[k], p[3 * k], p[3 * k + 1], p[3 * k + 2])
        gx, gy, gz = bx - ax, by - ay, bz - az
        part = sqrt(gx * gx + gy * gy + gz * gz)
        if part > 0.0:
            by_length = tension / part
            fx, fy, fz = by_length * gx, by_length * gy, by_length * gz
            push(s, w, links[k - 1], ax, ay, az, fx, fy, fz)
            push(s, w, links[k], bx, by, bz, -fx, -fy, -fz)
        ax, ay, az = bx, by, bz
