"""Cables: paths over obstacles, as in Simbody's CableSpan with the algorithm of Scholz et al.

Between two points of a cable all geodesics are corrected at once: each has four numbers, by which
its start is moved along it and across it, and turned, and by which it gets longer. They are those
that would take away what is not smooth where geodesics and lines meet, if that changed linearly,
while lengths change little. This ends at 1e-5 rad. Obstacles are left, and met, on the way.

Simbody starts each search from the path that it found last. Here all start from the path of the
default pose, as in OpenSim right after initSystem: what is found depends on the pose alone. So in a
motion directions differ from OpenSim's by what both may be wrong by, 1e-5 rad.

Source: A. Scholz, M. Sherman, I. Stavness, S. Delp, A. Kecskemethy, A fast multi-obstacle muscle
wrapping method using natural geodesic variations, Multibody System Dynamics 36, 2016.
"""

from __future__ import annotations

from math import isnan, nan, radians

from osimlite.mechanics.kernels.cable_surfaces import (
    A_RATE,
    ACROSS,
    ACROSS_BENDS,
    ALONG,
    ALONG_BENDS,
    ARC,
    END,
    END_NUMBERS,
    GEODESIC_NUMBERS,
    GEODESIC_ROOM,
    NORMAL,
    POINT,
    R_RATE,
    START,
    TORSION,
    A,
    R,
    nearest_on_line,
    shoot,
    value,
)
from osimlite.mechanics.kernels.layout import ITEM, OUTCOME
from osimlite.mechanics.kernels.linear_algebra import factor_room, factorise, minimum_norm
from osimlite.mechanics.kernels.paths import LENGTH, SPEED, TENSION
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.points import apply_force, place_frame, station, velocity
from osimlite.mechanics.laws.vectors import (
    Vector,
    along,
    cross,
    dot,
    minus,
    norm,
    plus,
    put,
    times,
    turned,
    turned_back,
    unit,
    vector,
)

COUNT, SOLVER, ELEMENTS = ITEM.OWN + 1, ITEM.OWN + 2, ITEM.OWN + 3
"""Integers of a cable: how many elements it has, where in its record room for the search is, and the elements."""
ELEMENT_INTS = 4
IS_OBSTACLE, LINK, AT, KEPT = 0, 1, 2, 3
"""Integers of an element of a cable: whether it is an obstacle or a point; its link; where its
numbers and its part of the record are.
"""
FIRST = 3
"""Where the parts of the record begin."""

PLACE, PULLED = 0, 3
"""Numbers of a point: the station that the cable runs through, and the one that it pulls at."""
BEFORE, AFTER = 3, 6
"""Its part of the record, after the place in ground: directions of the cable before and after it."""
POINT_WORK = 9

STATE, TRACKED, GEODESIC = 0, 1, 4
"""How a cable is on an obstacle: whether it touches; the point of a line that was nearest to the
surface, or that of a guess; the geodesic.
"""
TOUCH_NUMBERS = GEODESIC + GEODESIC_NUMBERS
POSE, BEGIN, SURFACE = 0, 12, 12 + TOUCH_NUMBERS
"""Numbers of an obstacle: its rotation in the link by rows and its place; how the cable is on it
before the search; the surface.
"""
IN_GROUND, GROUND_START, GROUND_END = (
    TOUCH_NUMBERS,
    TOUCH_NUMBERS + 12,
    TOUCH_NUMBERS + 12 + END_NUMBERS,
)
"""Its part of the record, after how the cable is on it: its pose in ground, and the ends of the geodesic in ground."""
OBSTACLE_WORK = GROUND_END + END_NUMBERS
TOUCHES, GUESSED, LIFTED = 0.0, 1.0, 2.0

UNKNOWNS, EQUATIONS = 4, 5
"""Unknowns of each obstacle in the search for a cable (its geodesic has four variations), and its equations."""
SMOOTH, LARGEST, ROUNDS = 1e-5, radians(10.0), 50
"""The search ends at this angle, turns an end by no more than this, and has so many rounds."""
SIGNIFICANT = 2.0**-45.5


def solver_room(obstacles: int) -> int:
    """How many numbers a search takes for so many obstacles between two points."""
    count, size = EQUATIONS * obstacles, UNKNOWNS * obstacles
    return GEODESIC_ROOM + 4 * (obstacles + 1) + factor_room(count, size) + 2 * count + size


def cable_path(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Length and speed of a cable; NaN if it is none, since a point is inside an obstacle."""
    i, p = at(model, item), at(reals, model[item + ITEM.NUMBERS])
    result = at(data, i[ITEM.RECORD])
    elements = at(i, ELEMENTS)
    for k in range(i[COUNT]):
        place_element(model, data, at(elements, ELEMENT_INTS * k), p, result)
    length, first = 0.0, 0
    for k in range(1, i[COUNT]):
        if elements[ELEMENT_INTS * k + IS_OBSTACLE] == 0:
            length += span(elements, p, result, first, k, at(result, i[SOLVER]))
            first = k
    result[LENGTH], result[SPEED] = length, speed(model, data, i[COUNT], elements, result)
    return OUTCOME.OK


def place_element(model: Ints, data: Floats, element: Ints, p: Floats, found: Floats) -> None:
    """Where an element is in ground; where an obstacle is touched at first."""
    own, kept, link = at(p, element[AT]), at(found, element[KEPT]), element[LINK]
    if element[IS_OBSTACLE] == 0:
        put(kept, 0, station(model, data, link, vector(own, PLACE)))
        return
    place_frame(model, data, link, own, vector(own, 9), at(kept, IN_GROUND))
    for k in range(TOUCH_NUMBERS):
        kept[k] = own[BEGIN + k]


def to_ground(pose: Floats, point: Vector) -> Vector:
    """A point of a surface in ground."""
    return plus(vector(pose, 9), turned(pose, point))


def span(elements: Ints, p: Floats, found: Floats, first: int, last: int, room: Floats) -> float:
    """Find the cable between two points; returns its length."""
    lines = at(room, GEODESIC_ROOM)
    count = 0
    for turn in range(ROUNDS + 1):
        for k in range(first + 1, last):
            if not touch(elements, p, found, first, k, last, room):
                return nan
        count = draw_lines(elements, found, first, last, lines)
        values = at(lines, 4 * (count + 1))
        rough = roughness(elements, found, first, last, lines, values)
        if isnan(rough):
            return nan
        if rough <= SMOOTH or turn == ROUNDS:
            break
        if not correct(elements, p, found, first, last, count, rough, room):
            return nan
    put(at(found, elements[ELEMENT_INTS * first + KEPT]), AFTER, vector(lines, 0))
    put(at(found, elements[ELEMENT_INTS * last + KEPT]), BEFORE, vector(lines, 4 * count))
    length = 0.0
    for k in range(count + 1):
        length += lines[4 * k + 3]
    for k in range(first + 1, last):
        kept = at(found, elements[ELEMENT_INTS * k + KEPT])
        if kept[STATE] == TOUCHES:
            length += kept[GEODESIC + ARC]
    return length


def touch(
    elements: Ints, p: Floats, found: Floats, first: int, number: int, last: int, room: Floats
) -> bool:
    """Tell whether the cable touches an obstacle now, and where; whether no neighbour is inside it."""
    element = at(elements, ELEMENT_INTS * number)
    own, kept = at(p, element[AT]), at(found, element[KEPT])
    geodesic, pose, surface = at(kept, GEODESIC), at(kept, IN_GROUND), at(own, SURFACE)
    if kept[STATE] != TOUCHES or not geodesic[ARC] > 0.0:
        before = neighbour(elements, found, pose, number, -1, first)
        after = neighbour(elements, found, pose, number, 1, last)
        if value(surface, before) > 0.0 or value(surface, after) > 0.0:
            return False
        way = minus(after, before)
        if kept[STATE] == GUESSED:
            kept[STATE] = TOUCHES
            if not shoot(surface, vector(kept, TRACKED), way, 0.0, geodesic, room):
                return False
        elif kept[STATE] == TOUCHES:
            point, normal = vector(geodesic, START + POINT), vector(geodesic, START + NORMAL)
            if dot(minus(before, point), normal) > 0.0 and dot(minus(after, point), normal) > 0.0:
                kept[STATE] = LIFTED
                put(kept, TRACKED, point)
        else:
            below, point = nearest_on_line(surface, before, after, vector(kept, TRACKED))
            put(kept, TRACKED, point)
            if below:
                kept[STATE] = TOUCHES
                if not shoot(surface, point, way, 0.0, geodesic, room):
                    return False
    if kept[STATE] == TOUCHES:
        end_to_ground(pose, at(geodesic, START), at(kept, GROUND_START))
        end_to_ground(pose, at(geodesic, END), at(kept, GROUND_END))
    return True


def neighbour(
    elements: Ints, found: Floats, pose: Floats, number: int, step: int, limit: int
) -> Vector:
    """The next end of the cable before (-1) or after (1) an obstacle, as this sees it."""
    k = number + step
    while k != limit and found[elements[ELEMENT_INTS * k + KEPT] + STATE] == LIFTED:
        k += step
    kept = at(found, elements[ELEMENT_INTS * k + KEPT])
    if k == limit:
        point = vector(kept, 0)
    else:
        point = to_ground(
            at(kept, IN_GROUND), vector(kept, GEODESIC + (END if step < 0 else START) + POINT)
        )
    return turned_back(pose, minus(point, vector(pose, 9)))


def end_to_ground(pose: Floats, end: Floats, ground: Floats) -> None:
    """An end of a geodesic in ground."""
    put(ground, POINT, to_ground(pose, vector(end, POINT)))
    for place in (ALONG, NORMAL, ACROSS):
        put(ground, place, turned(pose, vector(end, place)))
    for place in (ALONG_BENDS, ACROSS_BENDS, TORSION):
        ground[place] = end[place]


def draw_lines(elements: Ints, found: Floats, first: int, last: int, lines: Floats) -> int:
    """Direction and length of each straight part; returns how many obstacles are touched."""
    count = 0
    start = vector(found, elements[ELEMENT_INTS * first + KEPT])
    for k in range(first + 1, last + 1):
        kept = at(found, elements[ELEMENT_INTS * k + KEPT])
        if k == last or kept[STATE] == TOUCHES:
            way = minus(vector(kept, 0 if k == last else GROUND_START + POINT), start)
            put(lines, 4 * count, unit(way))
            lines[4 * count + 3] = norm(way)
            if k < last:
                start = vector(kept, GROUND_END + POINT)
                count += 1
    return count


def roughness(
    elements: Ints, found: Floats, first: int, last: int, lines: Floats, values: Floats
) -> float:
    """Fill in how far the lines are from the tangent of each end, towards the normal and sideways; returns the most."""
    most, number = 0.0, 0
    for k in range(first + 1, last):
        kept = at(found, elements[ELEMENT_INTS * k + KEPT])
        if kept[STATE] == TOUCHES:
            for end in (GROUND_START, GROUND_END):
                line = vector(lines, 4 * (number // 4 + (0 if end == GROUND_START else 1)))
                for axis in (NORMAL, ACROSS):
                    error = dot(line, vector(kept, end + axis))
                    if isnan(error):
                        return nan
                    values[number] = error
                    most = max(most, abs(error))
                    number += 1
    return most


def correct(
    elements: Ints,
    p: Floats,
    found: Floats,
    first: int,
    last: int,
    count: int,
    rough: float,
    room: Floats,
) -> bool:
    """Correct all geodesics once; whether there are such."""
    size, equations = UNKNOWNS * count, EQUATIONS * count
    lines = at(room, GEODESIC_ROOM)
    values = at(lines, 4 * (count + 1))
    corrections = at(values, 2 * equations)
    a = at(corrections, size)
    for k in range(equations * size):
        a[k] = 0.0
    number, before = 0, first
    for k in range(first + 1, last):
        kept = at(found, elements[ELEMENT_INTS * k + KEPT])
        if kept[STATE] == TOUCHES:
            line, next_line, row = (
                at(lines, 4 * number),
                at(lines, 4 * number + 4),
                at(a, 4 * number * size),
            )
            set_rows(kept, GROUND_START, line, at(row, 4 * number), size)
            set_rows(kept, GROUND_END, next_line, at(row, 2 * size + 4 * number), size)
            if number > 0:
                other = at(found, elements[ELEMENT_INTS * before + KEPT])
                set_far_rows(
                    kept, GROUND_START, line, other, GROUND_END, at(row, 4 * number - 4), size
                )
                back = at(a, (4 * number - 2) * size + 4 * number)
                set_far_rows(other, GROUND_END, line, kept, GROUND_START, back, size)
            # Lengths are to change little as long as the path is rough.
            a[(4 * count + number) * size + 4 * number + 3] = rough
            values[4 * count + number] = 0.0
            number, before = number + 1, k
    rank = factorise(equations, size, a, SIGNIFICANT * equations)
    minimum_norm(equations, size, a, rank, values, at(values, equations), corrections)
    for k in range(size):
        corrections[k] = -corrections[k]
    step, number = 1.0, 0
    for k in range(first + 1, last):
        kept = at(found, elements[ELEMENT_INTS * k + KEPT])
        if kept[STATE] == TOUCHES:
            most = largest_turn(kept, at(corrections, 4 * number))
            if most > LARGEST:
                step = min(step, LARGEST / most)
            number += 1
    number = 0
    for k in range(first + 1, last):
        element = at(elements, ELEMENT_INTS * k)
        kept = at(found, element[KEPT])
        if kept[STATE] == TOUCHES:
            surface = at(p, element[AT] + SURFACE)
            if not shoot_again(
                surface, at(kept, GEODESIC), at(corrections, 4 * number), step, room
            ):
                return False
            number += 1
    return True


def set_rows(kept: Floats, end: int, line: Floats, rows: Floats, size: int) -> None:
    """The derivatives of both errors at an end of a geodesic by its own four numbers."""
    e = vector(line, 0)
    for k in range(2):
        a = vector(kept, end + (NORMAL if k == 0 else ACROSS))
        shift = times((1.0 if end == GROUND_START else -1.0) / line[3], along(a, -dot(e, a), e))
        vary(kept, end, shift, cross(a, e), at(rows, k * size))


def set_far_rows(
    kept: Floats, end: int, line: Floats, other: Floats, far: int, rows: Floats, size: int
) -> None:
    """The derivatives of both errors at an end of a geodesic by the numbers of that at the far end of the line."""
    e = vector(line, 0)
    for k in range(2):
        a = vector(kept, end + (NORMAL if k == 0 else ACROSS))
        shift = times((-1.0 if end == GROUND_START else 1.0) / line[3], along(a, -dot(e, a), e))
        vary(other, far, shift, (0.0, 0.0, 0.0), at(rows, k * size))


def fields(kept: Floats, end: int) -> tuple[float, float, float, float]:
    """A, R and their derivatives at an end of a geodesic."""
    if end == GROUND_START:
        return 1.0, 0.0, 0.0, 1.0
    g = at(kept, GEODESIC)
    return g[A], g[R], g[A_RATE], g[R_RATE]


def vary(kept: Floats, end: int, shift: Vector, turn: Vector, row: Floats) -> None:
    """The derivatives by the four numbers of a geodesic, of what changes as its end shifts and turns."""
    a, r, a_rate, r_rate = fields(kept, end)
    frame = at(kept, end)
    t, n, b = vector(frame, ALONG), vector(frame, NORMAL), vector(frame, ACROSS)
    tt, nt, bt = dot(t, turn), dot(n, turn), dot(b, turn)
    forwards = dot(t, shift) + frame[TORSION] * tt + frame[ALONG_BENDS] * bt
    sideways = dot(b, shift) - frame[ACROSS_BENDS] * tt - frame[TORSION] * bt
    row[0] = forwards
    row[1] = a * sideways - a_rate * nt
    row[2] = r * sideways - r_rate * nt
    row[3] = forwards if end == GROUND_END else 0.0


def largest_turn(kept: Floats, corrections: Floats) -> float:
    """By how much corrections turn the ends of a geodesic, as Simbody has it: only those that are positive count."""
    most = 0.0
    for end in (GROUND_START, GROUND_END):
        a, r, a_rate, r_rate = fields(kept, end)
        frame = at(kept, end)
        t, n, b = vector(frame, ALONG), vector(frame, NORMAL), vector(frame, ACROSS)
        forwards = along(times(frame[TORSION], t), frame[ALONG_BENDS], b)
        sideways = along(times(-frame[ACROSS_BENDS], t), -frame[TORSION], b)
        most = max(most, corrections[0] * largest(forwards))
        most = max(most, corrections[1] * largest(along(times(a, sideways), -a_rate, n)))
        most = max(most, corrections[2] * largest(along(times(r, sideways), -r_rate, n)))
        if end == GROUND_END:
            most = max(most, corrections[3] * largest(forwards))
    return most


def largest(a: Vector) -> float:
    """The largest component, by amount."""
    x, y, z = a
    return max(abs(x), abs(y), abs(z))


def shoot_again(
    surface: Floats, geodesic: Floats, corrections: Floats, step: float, room: Floats
) -> bool:
    """Correct a geodesic by a part of its corrections; whether there is such."""
    forwards, sideways, turn = step * corrections[0], step * corrections[1], step * corrections[2]
    length = geodesic[ARC] + step * corrections[3]
    if length < 0.0:
        forwards += 0.5 * length
        length = 0.0
    start = at(geodesic, START)
    t, n, b = vector(start, ALONG), vector(start, NORMAL), vector(start, ACROSS)
    point = along(along(vector(start, POINT), forwards, t), sideways, b)
    tilt = start[ALONG_BENDS] * forwards - start[TORSION] * sideways
    turning = along(times(tilt, b), -turn, n)
    return shoot(surface, point, plus(t, cross(turning, t)), length, geodesic, room)


def speed(model: Ints, data: Floats, count: int, elements: Ints, found: Floats) -> float:
    """Lengthening speed, that of the straight parts; their ends on obstacles move with these."""
    total = 0.0
    here = vector(found, elements[KEPT])
    moves = velocity(model, data, elements[LINK], here)
    for k in range(1, count):
        element = at(elements, ELEMENT_INTS * k)
        kept = at(found, element[KEPT])
        if element[IS_OBSTACLE] == 0 or kept[STATE] == TOUCHES:
            place = 0 if element[IS_OBSTACLE] == 0 else GROUND_START + POINT
            ahead = vector(kept, place)
            ahead_moves = velocity(model, data, element[LINK], ahead)
            total += dot(unit(minus(ahead, here)), minus(ahead_moves, moves))
            here, moves = ahead, ahead_moves
            if element[IS_OBSTACLE] != 0:
                here = vector(kept, GROUND_END + POINT)
                moves = velocity(model, data, element[LINK], here)
    return total


def pull_cable(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Pull at the points of a cable and at both ends of each geodesic; a cable does not push."""
    i, p = at(model, item), at(reals, model[item + ITEM.NUMBERS])
    result, elements = at(data, i[ITEM.RECORD]), at(i, ELEMENTS)
    tension, last = result[TENSION], i[COUNT] - 1
    if tension < 0.0:
        return OUTCOME.OK
    for k in range(last + 1):
        element = at(elements, ELEMENT_INTS * k)
        own, kept, link = at(p, element[AT]), at(result, element[KEPT]), element[LINK]
        if element[IS_OBSTACLE] == 0:
            place = station(model, data, link, vector(own, PULLED))
            if k > 0:
                apply_force(model, data, link, place, times(-tension, vector(kept, BEFORE)))
            if k < last:
                apply_force(model, data, link, place, times(tension, vector(kept, AFTER)))
        elif kept[STATE] == TOUCHES:
            start, end = at(kept, GROUND_START), at(kept, GROUND_END)
            apply_force(
                model, data, link, vector(start, POINT), times(-tension, vector(start, ALONG))
            )
            apply_force(model, data, link, vector(end, POINT), times(tension, vector(end, ALONG)))
    return OUTCOME.OK
