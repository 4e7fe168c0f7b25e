"""Many curves of Bezier sections asked at once, as :mod:`osimlite.forces.bezier` asks one, to the last bit.

What is asked has a lane each, whose numbers lie side by side: the steps of the search are the same for all lanes, and a
processor takes as many at a time as it can.
"""

from __future__ import annotations

from typing import Any

from osimlite.forces.bezier import FIRST, LAST, ROUNDS, STARTS, X, first_place, on_section
from osimlite.kernels.pointers import Floats, at

LANES = 64
"""So many can be asked at once."""
COEFFICIENTS = STARTS - X
VALUE, SLOPE, INSIDE, GOES_ON, REST, U, OF_X, ROWS = 0, 1, 2, 3, 4, 5, 6, 6 + COEFFICIENTS
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
    section, rest, u = first_place(c, z)
    lane[LANES * INSIDE], lane[LANES * REST], lane[LANES * U] = 1.0, rest, u
    for k in range(COEFFICIENTS):
        lane[LANES * (OF_X + k)] = c[section + X + k]


def value_of(room: Floats, number: int) -> float:
    """The value of what was asked."""
    return room[LANES * VALUE + number]


def slope_of(room: Floats, number: int) -> float:
    """Its slope."""
    return room[LANES * SLOPE + number]


def answer(room: Any, asked: int) -> None:
    """Answer all that was asked."""
    for lane in range(asked):
        search(room, lane, 1)
    for lane in range(asked):
        if room[LANES * GOES_ON + lane] > 0.0:
            search(room, lane, ROUNDS - 1)


def search(room: Any, lane: int, rounds: int) -> None:
    """Some steps of a search at most."""
    u, rest = room[LANES * U + lane], room[LANES * REST + lane]
    u, goes_on, value, slope = on_section(room, LANES * OF_X + lane, LANES, u, rest, rounds)
    is_inside = room[LANES * INSIDE + lane] > 0.0
    room[LANES * U + lane], room[LANES * GOES_ON + lane] = u, 1.0 if goes_on else 0.0
    room[LANES * VALUE + lane] = value if is_inside else room[LANES * VALUE + lane]
    room[LANES * SLOPE + lane] = slope if is_inside else room[LANES * SLOPE + lane]
