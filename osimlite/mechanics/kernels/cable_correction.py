"""Correction of all geodesics of a cable together, by their natural variations.

Each geodesic has four unknowns: its start moves along and across it, and rotates, and it becomes
longer. A linearization gives the corrections that remove the kinks where geodesics and lines meet,
while lengths change little. Its derivatives at the ends of a geodesic follow from Jacobi fields.

Source: A. Scholz, M. Sherman, I. Stavness, S. Delp, A. Kecskemethy, A fast multi-obstacle muscle
wrapping method using natural geodesic variations, Multibody System Dynamics 36, 2016.
"""

from __future__ import annotations

from math import radians

from osimlite.mechanics.kernels.cable_records import (
    ELEMENT,
    OBSTACLE,
    OBSTACLE_STATE,
    OBSTACLE_WORK,
)
from osimlite.mechanics.kernels.cable_surfaces import (
    END_NUMBERS,
    GEODESIC,
    GEODESIC_WORK_SIZE,
    shoot_geodesic,
)
from osimlite.mechanics.kernels.linear_algebra import (
    factor_size,
    factorise_equations,
    solve_minimum_norm,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.laws.vectors import (
    Vector,
    add_scaled,
    cross,
    dot,
    plus,
    times,
    vector,
)

UNKNOWNS = 4
"""Number of unknowns of an obstacle: the natural variations of its geodesic."""
EQUATIONS = 5
"""Number of equations of an obstacle: two per end, and one for the length."""
MAX_ROTATION_RAD = radians(10.0)
"""Largest rotation of an end in one correction (rad)."""
INDEPENDENCE = 2.0**-45.5
"""Threshold of independence per equation, Simbody's significant part of a double."""

# Start of the workspace: that of an integration; then lines, kinks, corrections and the equations.


def solver_size(obstacles: int) -> int:
    """Return the length of the workspace of a search with `obstacles` obstacles between two points."""
    count, size = EQUATIONS * obstacles, UNKNOWNS * obstacles
    return GEODESIC_WORK_SIZE + 4 * (obstacles + 1) + factor_size(count, size) + 2 * count + size


def correct_geodesics(
    elements: Ints,
    p: Floats,
    record: Floats,
    first: int,
    last: int,
    count: int,
    kink: float,
    work: Floats,
) -> bool:
    """Correct all geodesics once by the least-squares solution of the linearized equations.

    Args:
        elements: integers of the elements.
        p: numbers of the cable.
        record: record of the cable.
        first: number of the point before.
        last: number of the point after.
        count: number of touched obstacles.
        kink: largest kink before the correction.
        work: workspace of the search, with lines and kinks.

    Returns:
        Whether all geodesics exist afterwards.
    """
    size, equations = UNKNOWNS * count, EQUATIONS * count
    lines = at(work, GEODESIC_WORK_SIZE)
    values = at(lines, 4 * (count + 1))
    corrections = at(values, 2 * equations)
    a = at(corrections, size)
    for k in range(equations * size):
        a[k] = 0.0
    number, previous_obstacle = 0, first
    for k in range(first + 1, last):
        obstacle_record = at(record, elements[ELEMENT.SIZE * k + ELEMENT.RECORD])
        if obstacle_record[OBSTACLE_WORK.STATE] == OBSTACLE_STATE.TOUCHES:
            line = at(lines, 4 * number)
            next_line = at(lines, 4 * number + 4)
            row = at(a, 4 * number * size)
            set_rows(obstacle_record, OBSTACLE_WORK.GROUND_START, line, at(row, 4 * number), size)
            set_rows(
                obstacle_record,
                OBSTACLE_WORK.GROUND_END,
                next_line,
                at(row, 2 * size + 4 * number),
                size,
            )
            if number > 0:
                previous_record = at(
                    record, elements[ELEMENT.SIZE * previous_obstacle + ELEMENT.RECORD]
                )
                set_far_rows(
                    obstacle_record,
                    OBSTACLE_WORK.GROUND_START,
                    line,
                    previous_record,
                    OBSTACLE_WORK.GROUND_END,
                    at(row, 4 * number - 4),
                    size,
                )
                back = at(a, (4 * number - 2) * size + 4 * number)
                set_far_rows(
                    previous_record,
                    OBSTACLE_WORK.GROUND_END,
                    line,
                    obstacle_record,
                    OBSTACLE_WORK.GROUND_START,
                    back,
                    size,
                )
            # Penalize changes of the length in proportion to the kinks, as Scholz et al. do.
            a[(4 * count + number) * size + 4 * number + 3] = kink
            values[4 * count + number] = 0.0
            number += 1
            previous_obstacle = k
    # The threshold of independence is Simbody's.
    rank = factorise_equations(equations, size, a, INDEPENDENCE * equations)
    solve_minimum_norm(equations, size, a, rank, values, at(values, equations), corrections)
    for k in range(size):
        corrections[k] = -corrections[k]
    # Turn no end by more than MAX_ROTATION_RAD, for which the linearization holds; all geodesics
    # take the same part.
    step, number = 1.0, 0
    for k in range(first + 1, last):
        obstacle_record = at(record, elements[ELEMENT.SIZE * k + ELEMENT.RECORD])
        if obstacle_record[OBSTACLE_WORK.STATE] == OBSTACLE_STATE.TOUCHES:
            largest_rotation = largest_turn(obstacle_record, at(corrections, 4 * number))
            if largest_rotation > MAX_ROTATION_RAD:
                step = min(step, MAX_ROTATION_RAD / largest_rotation)
            number += 1
    number = 0
    for k in range(first + 1, last):
        element = at(elements, ELEMENT.SIZE * k)
        obstacle_record = at(record, element[ELEMENT.RECORD])
        if obstacle_record[OBSTACLE_WORK.STATE] == OBSTACLE_STATE.TOUCHES:
            surface = at(p, element[ELEMENT.AT] + OBSTACLE.SURFACE)
            if not reshoot_geodesics(
                surface,
                at(obstacle_record, OBSTACLE_WORK.CURVE),
                at(corrections, 4 * number),
                step,
                work,
            ):
                return False
            number += 1
    return True


def set_rows(obstacle_record: Floats, end: int, line: Floats, rows: Floats, size: int) -> None:
    """Fill the derivatives of both kinks at an end of a geodesic by its own variations.

    With the unit vector e of a line of length l and an axis a of the frame, the kink e . a changes
    by (a - (e . a) e) / l per displacement of the end, and by a x e per rotation of the frame.

    Args:
        obstacle_record: record of the obstacle.
        end: GROUND_START or GROUND_END of `OBSTACLE_WORK`.
        line: direction and length of the line at this end.
        rows: filled with two rows (2, size).
        size: length of a row.
    """
    e = vector(line, 0)
    for k in range(2):
        a = vector(obstacle_record, end + (END_NUMBERS.NORMAL if k == 0 else END_NUMBERS.ACROSS))
        shift = times(
            (1.0 if end == OBSTACLE_WORK.GROUND_START else -1.0) / line[3],
            add_scaled(a, -dot(e, a), e),
        )
        differentiate_end(obstacle_record, end, shift, cross(a, e), at(rows, k * size))


def set_far_rows(
    obstacle_record: Floats,
    end: int,
    line: Floats,
    other_record: Floats,
    other_end: int,
    rows: Floats,
    size: int,
) -> None:
    """Fill the derivatives of both kinks at an end by the geodesic at the other end of the line.

    Args:
        obstacle_record: record of the obstacle of the end.
        end: GROUND_START or GROUND_END of `OBSTACLE_WORK`.
        line: direction and length of the line between both geodesics.
        other_record: record of the other obstacle.
        other_end: end of the other geodesic, GROUND_END or GROUND_START of `OBSTACLE_WORK`.
        rows: filled with two rows (2, size).
        size: length of a row.
    """
    e = vector(line, 0)
    for k in range(2):
        a = vector(obstacle_record, end + (END_NUMBERS.NORMAL if k == 0 else END_NUMBERS.ACROSS))
        shift = times(
            (-1.0 if end == OBSTACLE_WORK.GROUND_START else 1.0) / line[3],
            add_scaled(a, -dot(e, a), e),
        )
        differentiate_end(other_record, other_end, shift, (0.0, 0.0, 0.0), at(rows, k * size))


def jacobi_fields(obstacle_record: Floats, end: int) -> tuple[float, float, float, float]:
    """Return A, R and their derivatives at an end of a geodesic.

    A is the lateral displacement per unit lateral displacement of the start, R that per unit
    rotation.

    Args:
        obstacle_record: record of the obstacle.
        end: GROUND_START or GROUND_END of `OBSTACLE_WORK`.

    Returns:
        A, R, A', R'.
    """
    if end == OBSTACLE_WORK.GROUND_START:
        # At the start: a displacement is kept, and a rotation displaces nothing yet.
        return 1.0, 0.0, 0.0, 1.0
    g = at(obstacle_record, OBSTACLE_WORK.CURVE)
    return g[GEODESIC.A], g[GEODESIC.R], g[GEODESIC.A_RATE], g[GEODESIC.R_RATE]


def differentiate_end(
    obstacle_record: Floats, end: int, shift: Vector, turn: Vector, row: Floats
) -> None:
    """Fill the derivatives by the four variations of a geodesic of a function of its end.

    Args:
        obstacle_record: record of the obstacle.
        end: GROUND_START or GROUND_END of `OBSTACLE_WORK`.
        shift: derivative of the function by the position of the end.
        turn: derivative of the function by the rotation of its frame.
        row: filled with the derivatives by the four variations (4,).
    """
    a, r, a_rate, r_rate = jacobi_fields(obstacle_record, end)
    frame = at(obstacle_record, end)
    t = vector(frame, END_NUMBERS.ALONG)
    n = vector(frame, END_NUMBERS.NORMAL)
    b = vector(frame, END_NUMBERS.ACROSS)
    # The Darboux frame along the geodesic: moving forwards rotates it by torsion about t and by
    # normal curvature about b.
    tt, nt, bt = dot(t, turn), dot(n, turn), dot(b, turn)
    forwards = dot(t, shift) + frame[END_NUMBERS.TORSION] * tt + frame[END_NUMBERS.ALONG_BENDS] * bt
    sideways = (
        dot(b, shift) - frame[END_NUMBERS.ACROSS_BENDS] * tt - frame[END_NUMBERS.TORSION] * bt
    )
    row[0] = forwards
    row[1] = a * sideways - a_rate * nt
    row[2] = r * sideways - r_rate * nt
    # A longer geodesic moves its last end forwards only.
    row[3] = forwards if end == OBSTACLE_WORK.GROUND_END else 0.0


def largest_turn(obstacle_record: Floats, corrections: Floats) -> float:
    """Return the largest component of the rotation of the ends by corrections.

    As in Simbody, only positive products count.

    Args:
        obstacle_record: record of the obstacle.
        corrections: corrections of the four variations.
    """
    largest = 0.0
    for end in (OBSTACLE_WORK.GROUND_START, OBSTACLE_WORK.GROUND_END):
        a, r, a_rate, r_rate = jacobi_fields(obstacle_record, end)
        frame = at(obstacle_record, end)
        t = vector(frame, END_NUMBERS.ALONG)
        n = vector(frame, END_NUMBERS.NORMAL)
        b = vector(frame, END_NUMBERS.ACROSS)
        forwards = add_scaled(
            times(frame[END_NUMBERS.TORSION], t), frame[END_NUMBERS.ALONG_BENDS], b
        )
        sideways = add_scaled(
            times(-frame[END_NUMBERS.ACROSS_BENDS], t), -frame[END_NUMBERS.TORSION], b
        )
        largest = max(largest, corrections[0] * largest_component(forwards))
        largest = max(
            largest, corrections[1] * largest_component(add_scaled(times(a, sideways), -a_rate, n))
        )
        largest = max(
            largest, corrections[2] * largest_component(add_scaled(times(r, sideways), -r_rate, n))
        )
        if end == OBSTACLE_WORK.GROUND_END:
            largest = max(largest, corrections[3] * largest_component(forwards))
    return largest


def largest_component(a: Vector) -> float:
    """Return the largest absolute value of a component."""
    x, y, z = a
    return max(abs(x), abs(y), abs(z))


def reshoot_geodesics(
    surface: Floats, geodesic: Floats, corrections: Floats, step: float, work: Floats
) -> bool:
    """Apply a fraction of the corrections to a geodesic.

    Args:
        surface: numbers of the surface.
        geodesic: geodesic; changed.
        corrections: corrections of the four variations of the geodesic (4,).
        step: fraction of the corrections, 0 to 1.
        work: workspace of an integration.

    Returns:
        Whether the new geodesic exists.
    """
    forwards, sideways, turn = step * corrections[0], step * corrections[1], step * corrections[2]
    length = geodesic[GEODESIC.ARC] + step * corrections[3]
    # A geodesic that would become shorter than zero shrinks to a point in its middle.
    if length < 0.0:
        forwards += 0.5 * length
        length = 0.0
    start = at(geodesic, GEODESIC.START)
    t = vector(start, END_NUMBERS.ALONG)
    n = vector(start, END_NUMBERS.NORMAL)
    b = vector(start, END_NUMBERS.ACROSS)
    point = add_scaled(add_scaled(vector(start, END_NUMBERS.POINT), forwards, t), sideways, b)
    # The tangent turns with the surface as the start moves, and by the correction of the direction.
    tilt = start[END_NUMBERS.ALONG_BENDS] * forwards - start[END_NUMBERS.TORSION] * sideways
    turning = add_scaled(times(tilt, b), -turn, n)
    return shoot_geodesic(surface, point, plus(t, cross(turning, t)), length, geodesic, work)
