"""Newton's method for all geodesics of a piece of a path at once, by their natural variations.

Each geodesic has four unknowns: its start moves along it and across it, and turns, and it gets
longer. Each of its ends has two equations: the line there has no part along the normal of the
surface, and none across the geodesic. Unlike those of a cable they are about whole lines, and not
about their directions, so that they stay nearly linear where a line is short.

What the ends do across their geodesics changes the length as the equations across tell. So their
determinant is positive where the length is least, and negative at a saddle; there springs hold the
ends until it is positive, and the piece slides off towards where it is shorter.

Source: A. Scholz, M. Sherman, I. Stavness, S. Delp, A. Kecskemethy, A fast multi-obstacle muscle
wrapping method using natural geodesic variations, Multibody System Dynamics 36, 2016.
"""

from __future__ import annotations

from math import inf

from osimlite.mechanics.kernels.cable_paths import (
    GEODESIC,
    GROUND_END,
    GROUND_START,
    IN_GROUND,
    OBSTACLE_WORK,
    UNKNOWNS,
    end_to_ground,
    shoot_again,
    vary,
)
from osimlite.mechanics.kernels.cable_surfaces import (
    ACROSS,
    ACROSS_BENDS,
    ALONG_BENDS,
    ARC,
    END,
    GEODESIC_ROOM,
    NORMAL,
    POINT,
    START,
    SURFACE_NUMBERS,
)
from osimlite.mechanics.kernels.linear_algebra import factor_room, factorise, minimum_norm
from osimlite.mechanics.kernels.pointers import Floats, at
from osimlite.mechanics.laws.vectors import Vector, cross, dot, minus, norm, times, vector

OWNER = OBSTACLE_WORK + SURFACE_NUMBERS
SLOT = OWNER + 1
"""Of a slot: an obstacle of a cable; the surface; whose it is. Of slots in a row the first has the
place where a piece begins, and the one after those in use the place where it ends.
"""

SMOOTH, STALLED, NEAR = 1e-12, 1e-8, 1e-3
"""Angles (rad) at which a search ends, and below which it ends if they get no less; lines that are
shorter than this (m) count as so long.
"""
STIFF, STIFFER = 1.0, 3.0
"""How stiff springs are at least (N/m) if the string is pulled by 1 N, and how many times stiffer the next ones."""
ROUNDS, MOST_TURN, LEAST_PART, SHORT = 60, 0.2, 0.1, 1e-6
"""Of a search: its rounds; by how much (rad) an end of a geodesic may turn in a round; what must be
left of a geodesic after it, unless that is so short (rad).
"""


def search_room(count: int) -> int:
    """How many numbers a search takes for so many geodesics."""
    size = UNKNOWNS * count
    return GEODESIC_ROOM + 3 * size + factor_room(size, size)


def to_ground(slot: Floats) -> None:
    """Both ends of a geodesic in ground."""
    end_to_ground(at(slot, IN_GROUND), at(slot, GEODESIC + START), at(slot, GROUND_START))
    end_to_ground(at(slot, IN_GROUND), at(slot, GEODESIC + END), at(slot, GROUND_END))


def end_before(chain: Floats, k: int) -> Vector:
    """Where the line to a slot begins."""
    return vector(chain, SLOT * (k - 1) + (GROUND_END + POINT if k > 1 else 0))


def start_after(chain: Floats, k: int, count: int) -> Vector:
    """Where the line from a slot ends."""
    return vector(chain, SLOT * (k + 1) + (GROUND_START + POINT if k < count else 0))


def smooth(chain: Floats, count: int, room: Floats) -> bool:
    """Correct all geodesics until lines go over into them without a bend; whether that came to an end.

    It does so too where one of them would get shorter than nothing, which then has no length.
    """
    size = UNKNOWNS * count
    values = at(room, GEODESIC_ROOM)
    corrections = at(values, 2 * size)
    a = at(corrections, size)
    before, stiff = inf, 0.0
    for _ in range(ROUNDS):
        rough = equations(chain, count, values, a, stiff)
        if rough <= SMOOTH or before <= rough < STALLED:
            return True
        before = rough
        rank = factorise(size, size, a, 0.0)
        if determinant_sign(size, a) < 0.0:
            stiff = max(STIFFER * stiff, STIFF)
            continue
        minimum_norm(size, size, a, rank, values, at(values, size), corrections)
        stiff = stiff / STIFFER if stiff > STIFF else 0.0
        step = 1.0
        for k in range(count):
            step = min(step, part_of(at(chain, SLOT * (k + 1)), at(corrections, UNKNOWNS * k)))
        if not step > 0.0:
            return step == 0.0
        for k in range(count):
            slot = at(chain, SLOT * (k + 1))
            if not shoot_again(
                at(slot, OBSTACLE_WORK),
                at(slot, GEODESIC),
                at(corrections, UNKNOWNS * k),
                step,
                room,
            ):
                return False
            to_ground(slot)
    return False


def part_of(slot: Floats, corrections: Floats) -> float:
    """The part of its corrections that a geodesic may take; 0 if it gets shorter than nothing, which it then is."""
    start, arc = at(slot, GROUND_START), slot[GEODESIC + ARC]
    bends = max(abs(start[ALONG_BENDS]), abs(start[ACROSS_BENDS]))
    turn = max(
        abs(corrections[2]),
        bends * max(abs(corrections[0]), abs(corrections[1]), abs(corrections[3])),
    )
    part = MOST_TURN / turn if turn > MOST_TURN else 1.0
    if not arc + part * corrections[3] > LEAST_PART * arc:
        if arc + corrections[3] <= 0.0 and arc * abs(start[ALONG_BENDS]) < SHORT:
            slot[GEODESIC + ARC] = part = 0.0
        else:
            corrections[3] = (LEAST_PART - 1.0) * arc
    return part


def determinant_sign(size: int, a: Floats) -> float:
    """The sign of the determinant of square equations that were turned into a factor."""
    diagonal, order, sign = at(a, size * size), at(a, size * size + size), 1.0
    for r in range(size):
        sign = -sign if diagonal[r] < 0.0 else sign
        for k in range(r):
            sign = -sign if order[k] > order[r] else sign
    return sign


def equations(chain: Floats, count: int, values: Floats, a: Floats, stiff: float) -> float:
    """Fill in the equations: left sides a (4 n, 4 n), right sides; returns by how much an angle misses, at most."""
    size, most = UNKNOWNS * count, 0.0
    for k in range(size * size):
        a[k] = 0.0
    for k in range(1, count + 1):
        slot = at(chain, SLOT * k)
        for side in range(2):
            end, sign, other = (
                (GROUND_START, 1.0, k - 1) if side == 0 else (GROUND_END, -1.0, k + 1)
            )
            here = vector(slot, end + POINT)
            line = (
                minus(here, end_before(chain, k))
                if side == 0
                else minus(start_after(chain, k, count), here)
            )
            distance = max(norm(line), NEAR)
            for across in range(2):
                axis = vector(slot, end + (ACROSS if across == 1 else NORMAL))
                row = UNKNOWNS * (k - 1) + 2 * side + across
                values[row] = -dot(line, axis)
                most = max(most, abs(values[row]) / distance)
                vary(
                    slot,
                    end,
                    times(sign * (1.0 + stiff * distance), axis),
                    cross(axis, line),
                    at(a, size * row + UNKNOWNS * (k - 1)),
                )
                if 0 < other <= count:
                    far, of = (
                        GROUND_END if side == 0 else GROUND_START,
                        at(a, size * row + UNKNOWNS * (other - 1)),
                    )
                    vary(at(chain, SLOT * other), far, times(-sign, axis), (0.0, 0.0, 0.0), of)
    return most
