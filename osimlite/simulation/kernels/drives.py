"""Actuators and prescribed forces, which go with the time."""

from __future__ import annotations

from math import sqrt

from osimlite.forces.springs import mckibben_tension
from osimlite.simulation.kernels.functions import value_at
from osimlite.simulation.kernels.layout import FINE, FREEDOMS, NUMBERS, OWN, RECORD, TIME
from osimlite.simulation.kernels.paths import measure, own_numbers, pull
from osimlite.simulation.kernels.pointers import Floats, Ints, at
from osimlite.simulation.kernels.points import direction, push, station, turn

COORDINATE, TORQUE, POINT, TWO_POINTS = 0, 1, 2, 3
"""What an actuator drives."""


def drive(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """An actuator.

    Its integers are what it drives, a degree of freedom or two links, where its two vectors are (a link or -1), the
    count of its functions and the places of their tables; its numbers two vectors, the optimal force, the tables.
    """
    i = at(s, item)
    p, found, own = at(x, i[NUMBERS]), at(w, i[RECORD]), at(i, OWN)
    value = p[6] * control(at(own, 5), p, w[TIME])
    found[0] = value
    if value == 0.0:
        return FINE
    what, one, two = own[0], own[1], own[2]
    if what == COORDINATE:
        if one >= 0:
            f[s[FREEDOMS] + one] += value
    elif what == TORQUE:
        ax, ay, az = direction(s, w, own[3], p[0], p[1], p[2])
        turn(s, w, one, value * ax, value * ay, value * az)
        turn(s, w, two, -value * ax, -value * ay, -value * az)
    elif what == POINT:
        px, py, pz = station(s, w, own[3], p[0], p[1], p[2])
        ax, ay, az = direction(s, w, own[4], p[3], p[4], p[5])
        push(s, w, one, px, py, pz, value * ax, value * ay, value * az)
    else:
        ax, ay, az = station(s, w, own[3], p[0], p[1], p[2])
        bx, by, bz = station(s, w, own[4], p[3], p[4], p[5])
        gx, gy, gz = ax - bx, ay - by, az - bz
        length = sqrt(gx * gx + gy * gy + gz * gz)
        size = value / length if length > 0.0 else 0.0
        push(s, w, one, ax, ay, az, size * gx, size * gy, size * gz)
        push(s, w, two, ax, ay, az, -size * gx, -size * gy, -size * gz)
    return FINE


def control(places: Ints, p: Floats, t: float) -> float:
    """The sum of some functions of time, whose number stands before the places of their tables."""
    total = 0.0
    for k in range(places[0]):
        value, _, _ = value_at(at(p, places[1 + k]), t)
        total += value
    return total


def path_drive(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """A tension along a path by a control, or by a pressure if there are numbers of turns, thread and cord."""
    length, _ = measure(s, x, w, item)
    i, p, found = at(s, item), own_numbers(s, x, item), at(w, s[item + RECORD])
    value = p[0] * control(at(i, OWN + 1 + i[OWN]), p, w[TIME])
    found[2] = mckibben_tension(length, value, p[1], p[2], p[3]) if p[1] != 0.0 else value
    pull(s, x, w, item, found[2])
    return FINE


def prescribed(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """A force at a point, and a torque, that are functions of time.

    Its integers are the links of three frames (where the force acts, along whose axes force and torque are, in which
    the point is), whether there are a force, a point and a torque, and the places of nine tables; its numbers rotation
    by columns and origin of the frames in their links, and the tables. Its record has the force, the point in the first
    frame, and the torque.
    """
    i = at(s, item)
    p, found, own = at(x, i[NUMBERS]), at(w, i[RECORD]), at(i, OWN)
    for k in range(9):
        if own[3 + k // 3] > 0:
            found[k], _, _ = value_at(at(p, own[6 + k]), w[TIME])
    link = own[0]
    if own[3] > 0:
        turn_vector(s, w, own[1], at(p, 12), found)
        px, py, pz = station(s, w, link, p[9], p[10], p[11])
        if own[4] > 0:
            ox, oy, oz = px, py, pz
            turn_vector(s, w, own[2], at(p, 24), at(found, 3))
            px, py, pz = station(s, w, own[2], p[33], p[34], p[35])
            px, py, pz = px + found[3], py + found[4], pz + found[5]
            ax, ay, az = px - ox, py - oy, pz - oz
            for k in range(3):
                ex, ey, ez = direction(s, w, link, p[3 * k], p[3 * k + 1], p[3 * k + 2])
                found[3 + k] = ex * ax + ey * ay + ez * az
        push(s, w, link, px, py, pz, found[0], found[1], found[2])
    if own[5] > 0:
        turn_vector(s, w, own[1], at(p, 12), at(found, 6))
        turn(s, w, link, found[6], found[7], found[8])
    return FINE


def turn_vector(s: Ints, w: Floats, link: int, axes: Floats, vector: Floats) -> None:
    """From along the axes of a frame, which are given by columns in its link, to along those of ground."""
    a, b, c = vector[0], vector[1], vector[2]
    vector[0], vector[1], vector[2] = direction(
        s,
        w,
        link,
        axes[0] * a + axes[3] * b + axes[6] * c,
        axes[1] * a + axes[4] * b + axes[7] * c,
        axes[2] * a + axes[5] * b + axes[8] * c,
    )
