"""Newton's method for all geodesics of a segment of a path, by their natural variations.

Each geodesic has four unknowns: its start moves along and across it, and rotates, and it becomes
longer. Each end has two equations: the line there has no component along the normal of the surface,
and none across the geodesic. Unlike those of a cable, the equations contain the lines and not their
directions, so that they stay nearly linear where a line is short.

The determinant of the equations is positive where the length has a minimum, and negative at a
saddle. There, springs hold the ends until it is positive, and the segment slides off towards a
shorter path.

Source: A. Scholz, M. Sherman, I. Stavness, S. Delp, A. Kecskemethy, A fast multi-obstacle muscle
wrapping method using natural geodesic variations, Multibody System Dynamics 36, 2016.
"""

from __future__ import annotations

from math import inf

from osimlite.mechanics.kernels.cable_correction import (
    UNKNOWNS,
    differentiate_end,
    reshoot_geodesics,
)
from osimlite.mechanics.kernels.cable_paths import end_to_ground
from osimlite.mechanics.kernels.cable_records import OBSTACLE_WORK
from osimlite.mechanics.kernels.cable_surfaces import (
    END_NUMBERS,
    GEODESIC,
    GEODESIC_WORK_SIZE,
    SURFACE,
)
from osimlite.mechanics.kernels.layout import Record
from osimlite.mechanics.kernels.linear_algebra import (
    factor_size,
    factorise_equations,
    solve_minimum_norm,
)
from osimlite.mechanics.kernels.pointers import Floats, at
from osimlite.mechanics.laws.vectors import Vector, cross, dot, minus, norm, times, vector


class SLOT(metaclass=Record):
    """Slot of a search."""

    OWNER = OBSTACLE_WORK.SIZE + SURFACE.SIZE
    """Number of the wrap; an obstacle's record and the numbers of a surface come before it."""
    SIZE = OWNER + 1
    """Length of a slot.

    The first slot holds the start of the segment, and the one after those in use holds its end.
"""


MAX_KINK_RAD = 1e-12
"""Largest kink (rad) at which a search ends."""
MAX_STALLED_KINK_RAD = 1e-8
"""Kink (rad) below which a search ends if it does not decrease."""
MIN_LINE_LENGTH_M = 1e-3
"""Smallest length (m) of a line by which its component across is divided."""
MIN_STIFFNESS = 1.0
"""Smallest stiffness of the springs (N/m) for a tension of 1 N."""
STIFFNESS_RATIO = 3.0
"""Ratio of successive stiffnesses."""
MAX_ROUNDS = 60
"""Largest number of rounds of a search."""
MOST_TURN = 0.2
"""Largest rotation of an end of a geodesic in a round (rad)."""
LEAST_PART = 0.1
"""Smallest part of a geodesic that must remain after a round."""
SHORT_GEODESIC_RAD = 1e-6
"""Angle (rad) of a geodesic below which it may vanish in a round."""


def search_size(count: int) -> int:
    """Return the length of the workspace of a search with `count` geodesics."""
    size = UNKNOWNS * count
    return GEODESIC_WORK_SIZE + 3 * size + factor_size(size, size)


def ends_to_ground(slot: Floats) -> None:
    """Transform both ends of a geodesic to ground."""
    end_to_ground(
        at(slot, OBSTACLE_WORK.IN_GROUND),
        at(slot, OBSTACLE_WORK.CURVE + GEODESIC.START),
        at(slot, OBSTACLE_WORK.GROUND_START),
    )
    end_to_ground(
        at(slot, OBSTACLE_WORK.IN_GROUND),
        at(slot, OBSTACLE_WORK.CURVE + GEODESIC.END),
        at(slot, OBSTACLE_WORK.GROUND_END),
    )


def line_start(chain: Floats, k: int) -> Vector:
    """Return the start of the line to a slot (m).

    Args:
        chain: slots.
        k: number of the slot.
    """
    return vector(
        chain, SLOT.SIZE * (k - 1) + (OBSTACLE_WORK.GROUND_END + END_NUMBERS.POINT if k > 1 else 0)
    )


def line_end(chain: Floats, k: int, count: int) -> Vector:
    """Return the end of the line from a slot (m).

    Args:
        chain: slots.
        k: number of the slot.
        count: number of slots in use.
    """
    return vector(
        chain,
        SLOT.SIZE * (k + 1) + (OBSTACLE_WORK.GROUND_START + END_NUMBERS.POINT if k < count else 0),
    )


def smooth_chain(chain: Floats, count: int, work: Floats) -> bool:
    """Correct all geodesics until the lines meet them without kinks.

    It also ends where a geodesic would become shorter than zero; this one then has no length.

    Args:
        chain: slots; their geodesics are changed.
        count: number of slots in use.
        work: workspace, see `search_size`.

    Returns:
        Whether the search converged, or a geodesic vanished.
    """
    size = UNKNOWNS * count
    values = at(work, GEODESIC_WORK_SIZE)
    corrections = at(values, 2 * size)
    a = at(corrections, size)
    previous_kink, stiffness = inf, 0.0
    for _ in range(MAX_ROUNDS):
        kink = fill_equations(chain, count, values, a, stiffness)
        if kink <= MAX_KINK_RAD or previous_kink <= kink < MAX_STALLED_KINK_RAD:
            return True
        previous_kink = kink
        rank = factorise_equations(size, size, a, 0.0)
        # A negative determinant marks a saddle of the length: stiffen the springs and try again
        # from here.
        if determinant_sign(size, a) < 0.0:
            stiffness = max(STIFFNESS_RATIO * stiffness, MIN_STIFFNESS)
            continue
        solve_minimum_norm(size, size, a, rank, values, at(values, size), corrections)
        # Near a minimum the springs only slow down convergence; release them step by step.
        stiffness = stiffness / STIFFNESS_RATIO if stiffness > MIN_STIFFNESS else 0.0
        step = 1.0
        for k in range(count):
            step = min(
                step,
                compute_accepted_part(
                    at(chain, SLOT.SIZE * (k + 1)), at(corrections, UNKNOWNS * k)
                ),
            )
        # A negative or undefined part cannot be taken; 0 reports a geodesic that vanishes.
        if not step > 0.0:
            return step == 0.0
        for k in range(count):
            slot = at(chain, SLOT.SIZE * (k + 1))
            if not reshoot_geodesics(
                at(slot, OBSTACLE_WORK.SIZE),
                at(slot, OBSTACLE_WORK.CURVE),
                at(corrections, UNKNOWNS * k),
                step,
                work,
            ):
                return False
            ends_to_ground(slot)
    return False


def compute_accepted_part(slot: Floats, corrections: Floats) -> float:
    """Return the part of its corrections that a geodesic may take.

    It is 0 if the geodesic would become shorter than zero, and its length is then set to zero.

    Args:
        slot: slot; its length may be set to zero.
        corrections: corrections of its four variations; that of the length may be bounded.
    """
    start = at(slot, OBSTACLE_WORK.GROUND_START)
    arc = slot[OBSTACLE_WORK.CURVE + GEODESIC.ARC]
    # Rotation of the ends by displacements, estimated by the curvature at the start.
    bends = max(abs(start[END_NUMBERS.ALONG_BENDS]), abs(start[END_NUMBERS.ACROSS_BENDS]))
    turn = max(
        abs(corrections[2]),
        bends * max(abs(corrections[0]), abs(corrections[1]), abs(corrections[3])),
    )
    fraction = MOST_TURN / turn if turn > MOST_TURN else 1.0
    # Keep a part of the length, unless the geodesic is so short already that it may vanish.
    if not arc + fraction * corrections[3] > LEAST_PART * arc:
        if (
            arc + corrections[3] <= 0.0
            and arc * abs(start[END_NUMBERS.ALONG_BENDS]) < SHORT_GEODESIC_RAD
        ):
            slot[OBSTACLE_WORK.CURVE + GEODESIC.ARC] = fraction = 0.0
        else:
            corrections[3] = (LEAST_PART - 1.0) * arc
    return fraction


def determinant_sign(size: int, a: Floats) -> float:
    """Return the sign of the determinant of square equations that were factorised.

    The determinant is that of the reflections, which the signs of the diagonal contain, times that
    of the permutation.

    Args:
        size: number of equations.
        a: factor of the equations.
    """
    diagonal = at(a, size * size)
    order = at(a, size * size + size)
    sign = 1.0
    for r in range(size):
        sign = -sign if diagonal[r] < 0.0 else sign
        for k in range(r):
            # Every inversion of the order changes the sign.
            sign = -sign if order[k] > order[r] else sign
    return sign


def fill_equations(chain: Floats, count: int, values: Floats, a: Floats, stiffness: float) -> float:
    """Fill left sides (4 n, 4 n) and right sides of the equations.

    Args:
        chain: slots.
        count: number n of geodesics.
        values: filled with the right sides.
        a: filled with the left sides.
        stiffness: stiffness of the springs (N/m).

    Returns:
        The largest kink (rad).
    """
    size = UNKNOWNS * count
    largest_kink = 0.0
    for k in range(size * size):
        a[k] = 0.0
    for k in range(1, count + 1):
        slot = at(chain, SLOT.SIZE * k)
        for side in range(2):
            end, sign, neighbour = (
                (OBSTACLE_WORK.GROUND_START, 1.0, k - 1)
                if side == 0
                else (OBSTACLE_WORK.GROUND_END, -1.0, k + 1)
            )
            end_point = vector(slot, end + END_NUMBERS.POINT)
            line = (
                minus(end_point, line_start(chain, k))
                if side == 0
                else minus(line_end(chain, k, count), end_point)
            )
            # A kink is the component across over the length; very short lines are not divided by.
            distance = max(norm(line), MIN_LINE_LENGTH_M)
            for across in range(2):
                axis = vector(
                    slot, end + (END_NUMBERS.ACROSS if across == 1 else END_NUMBERS.NORMAL)
                )
                row = UNKNOWNS * (k - 1) + 2 * side + across
                values[row] = -dot(line, axis)
                largest_kink = max(largest_kink, abs(values[row]) / distance)
                differentiate_end(
                    slot,
                    # A spring at each end adds to the derivative by its displacement; it does not
                    # change the right side.
                    end,
                    times(sign * (1.0 + stiffness * distance), axis),
                    cross(axis, line),
                    at(a, size * row + UNKNOWNS * (k - 1)),
                )
                # The other end of the line is on a neighbouring geodesic: its displacement has the
                # opposite effect.
                if 0 < neighbour <= count:
                    neighbour_end = (
                        OBSTACLE_WORK.GROUND_END if side == 0 else OBSTACLE_WORK.GROUND_START
                    )
                    neighbour_row = at(a, size * row + UNKNOWNS * (neighbour - 1))
                    differentiate_end(
                        at(chain, SLOT.SIZE * neighbour),
                        neighbour_end,
                        times(-sign, axis),
                        (0.0, 0.0, 0.0),
                        neighbour_row,
                    )
    return largest_kink
