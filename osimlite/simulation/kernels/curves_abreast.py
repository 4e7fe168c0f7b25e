"""Many curves of Bezier sections asked at once, as :mod:`osimlite.forces.bezier` asks one, to the last bit.

What is asked has a lane each, whose numbers lie side by side: the steps of the search are the same for all lanes, and a
processor takes as many at a time as it can.
"""

from __future__ import annotations

from typing import Any

from osimlite.forces.bezier import (
    FIRST,
    LAST,
    ROUNDS,
    START,
    Rising,
    X,
    first_place,
    nearer_place,
    on_section,
    section_with,
)
from osimlite.simulation.kernels.pointers import Floats, at

LANES = 64
"""So many can be asked at once."""
VALUE, SLOPE, INSIDE, GOES_ON, REST, U, OF_X, AT_START, OF_Y, ROWS = 0, 1, 2, 3, 4, 5, 6, 11, 12, 17
"""Rows of the room, each of LANES numbers: the answer; 0 where the argument is outside of the curve, and the answer
there at once; whether the search has to go on, how far the argument is from the start of its section, the place on
that, and its coefficients."""


def ask(x: Floats, room: Floats, number: int, place: int, z: float) -> None:
    """Ask for the curve at a place among the numbers of the model."""
    c: Any = at(x, place)
    lane = at(room, number)
    end = FIRST if not z >= c[FIRST] else LAST
    if end == FIRST or z > c[LAST]:
        lane[LANES * VALUE], lane[LANES * SLOPE] = c[end + 1] + c[end + 2] * (z - c[end]), c[end + 2]
        # A search that is at its end.
        lane[LANES * INSIDE] = lane[LANES * REST] = lane[LANES * U] = 0.0
        lane[LANES * OF_X] = 1.0
        return
    section = section_with(c, z)
    rest = z - c[section + START]
    lane[LANES * INSIDE], lane[LANES * REST], lane[LANES * U] = 1.0, rest, first_place(c, section, rest)
    for k in range(11):
        lane[LANES * (OF_X + k)] = c[section + X + k]


def value_of(room: Floats, number: int) -> float:
    """The value of what was asked."""
    return room[LANES * VALUE + number]


def slope_of(room: Floats, number: int) -> float:
    """Its slope."""
    return room[LANES * SLOPE + number]


def answer(room: Floats, asked: int) -> None:
    """Answer all that was asked."""
    for number in range(asked):
        lane = at(room, number)
        place, goes_on = nearer_place(lane[LANES * U], lane[LANES * REST], rising(lane, OF_X))
        lane[LANES * U], lane[LANES * GOES_ON] = place, 1.0 if goes_on else 0.0
    for number in range(asked):
        lane = at(room, number)
        rounds = 1
        while lane[LANES * GOES_ON] > 0.0 and rounds < ROUNDS:
            place, goes_on = nearer_place(lane[LANES * U], lane[LANES * REST], rising(lane, OF_X))
            lane[LANES * U], lane[LANES * GOES_ON] = place, 1.0 if goes_on else 0.0
            rounds += 1
    for number in range(asked):
        lane = at(room, number)
        start = lane[LANES * AT_START]
        value, slope = on_section(lane[LANES * U], rising(lane, OF_X), start, rising(lane, OF_Y))
        is_inside = lane[LANES * INSIDE] > 0.0
        lane[LANES * VALUE] = value if is_inside else lane[LANES * VALUE]
        lane[LANES * SLOPE] = slope if is_inside else lane[LANES * SLOPE]


def rising(lane: Floats, row: int) -> Rising:
    """Coefficients of a lane."""
    return Rising(
        lane[LANES * row],
        lane[LANES * (row + 1)],
        lane[LANES * (row + 2)],
        lane[LANES * (row + 3)],
        lane[LANES * (row + 4)],
    )
