"""Many curves of Bezier sections asked at once, as :mod:`osimlite.forces.bezier` asks one, to the last bit.

What is asked first is sorted into lanes, whose numbers lie side by side: the steps of the search are then the same for
all lanes, and a processor takes as many at a time as it can.
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
PLACE, ARGUMENT, VALUE, SLOPE = 0, 1, 2, 3
"""Rows of the room, each of LANES numbers: of what is asked, where the curve is among the numbers of the model, and the
argument; then the answer."""
OWNER, GOES_ON, REST, U, OF_X, AT_START, OF_Y = 4, 5, 6, 7, 8, 13, 14
"""Of a lane, which that is, whether the search has to go on, how far the argument is from the start of its section, the
place on the section, and its coefficients; at the end REST and U are the answer."""
ROWS = 19


def ask(room: Floats, number: int, place: int, argument: float) -> None:
    """Ask for a curve."""
    room[LANES * PLACE + number] = place
    room[LANES * ARGUMENT + number] = argument


def value_of(room: Floats, number: int) -> float:
    """The value of what was asked."""
    return room[LANES * VALUE + number]


def slope_of(room: Floats, number: int) -> float:
    """Its slope."""
    return room[LANES * SLOPE + number]


def curves_at(x: Floats, room: Floats, asked: int) -> None:
    """Answer all that was asked."""
    lanes = 0
    for number in range(asked):
        c: Any = at(x, int(room[LANES * PLACE + number]))
        z = room[LANES * ARGUMENT + number]
        end = FIRST if not z >= c[FIRST] else LAST
        if end == FIRST or z > c[LAST]:
            room[LANES * VALUE + number] = c[end + 1] + c[end + 2] * (z - c[end])
            room[LANES * SLOPE + number] = c[end + 2]
            continue
        lane = at(room, lanes)
        section = section_with(c, z)
        lane[LANES * OWNER], lane[LANES * REST] = number, z - c[section + START]
        lane[LANES * U] = first_place(c, section, lane[LANES * REST])
        for k in range(11):
            lane[LANES * (OF_X + k)] = c[section + X + k]
        lanes += 1
    for number in range(lanes):
        lane = at(room, number)
        place, goes_on = nearer_place(lane[LANES * U], lane[LANES * REST], rising(lane, OF_X))
        lane[LANES * U], lane[LANES * GOES_ON] = place, 1.0 if goes_on else 0.0
    for number in range(lanes):
        lane = at(room, number)
        rounds = 1
        while lane[LANES * GOES_ON] > 0.0 and rounds < ROUNDS:
            place, goes_on = nearer_place(lane[LANES * U], lane[LANES * REST], rising(lane, OF_X))
            lane[LANES * U], lane[LANES * GOES_ON] = place, 1.0 if goes_on else 0.0
            rounds += 1
    for number in range(lanes):
        lane = at(room, number)
        start = lane[LANES * AT_START]
        lane[LANES * REST], lane[LANES * U] = on_section(lane[LANES * U], rising(lane, OF_X), start, rising(lane, OF_Y))
    for number in range(lanes):
        lane = at(room, number)
        owner = int(lane[LANES * OWNER])
        room[LANES * VALUE + owner], room[LANES * SLOPE + owner] = lane[LANES * REST], lane[LANES * U]


def rising(lane: Floats, row: int) -> Rising:
    """Coefficients of a lane."""
    return Rising(
        lane[LANES * row],
        lane[LANES * (row + 1)],
        lane[LANES * (row + 2)],
        lane[LANES * (row + 3)],
        lane[LANES * (row + 4)],
    )
