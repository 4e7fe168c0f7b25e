"""Many curves of Bezier sections asked at once, as :mod:`osimlite.mechanics.laws.bezier` asks one, to the last bit.

What is asked has a lane each, whose numbers lie side by side: the steps of the search are the same
for all lanes, and a processor takes as many at a time as it can.
"""

from __future__ import annotations

from typing import Any

from osimlite.mechanics.kernels.pointers import Floats, at
from osimlite.mechanics.laws.bezier import (
    FIRST,
    LAST,
    ROUNDS,
    STARTS,
    X,
    Y,
    beyond_sum,
    end_of_sum,
    first_place,
    first_place_of_sum,
    missed,
    nearer_place,
    on_section,
    value_at,
)

LANES = 64
"""So many can be asked at once."""
COEFFICIENTS = STARTS - X
VALUE, INSIDE, GOES_ON, REST, U, OF_X, ROWS = 0, 1, 2, 3, 4, 5, 5 + COEFFICIENTS
"""Rows of the room, each of LANES numbers: the answer; 0 where the argument is outside of the
curve, and the answer there at once; whether the search has to go on, how far the argument is from
the start of its section, the place on that, and its coefficients.
"""


def ask(x: Floats, room: Floats, number: int, place: int, z: float) -> None:
    """Ask for the curve at a place among the numbers of the model."""
    c: Any = at(x, place)
    lane = at(room, number)
    end = FIRST if not z >= c[FIRST] else LAST
    if end == FIRST or z > c[LAST]:
        lane[LANES * VALUE] = c[end + 1] + c[end + 2] * (z - c[end])
        # A search that is at its end.
        lane[LANES * INSIDE] = lane[LANES * REST] = lane[LANES * U] = 0.0
        lane[LANES * OF_X] = 1.0
        return
    section, rest, u = first_place(c, z)
    lane[LANES * INSIDE], lane[LANES * REST], lane[LANES * U] = 1.0, rest, u
    for k in range(COEFFICIENTS):
        lane[LANES * (OF_X + k)] = c[section + X + k]


def ask_sum(
    x: Floats, room: Floats, number: int, place: int, of_y: float, of_x: float, total: float
) -> None:
    """Ask where a sum of a curve and its argument is a total, see :func:`osimlite.mechanics.laws.bezier.value_of_sum`."""
    c: Any = at(x, place)
    lane = at(room, number)
    end = end_of_sum(c, of_y, of_x, total)
    if end > 0:
        lane[LANES * VALUE] = beyond_sum(c, of_y, of_x, total, end)
        lane[LANES * INSIDE] = lane[LANES * U] = 0.0
        lane[LANES * REST], lane[LANES * OF_X] = total - total, 1.0
        for k in range(1, COEFFICIENTS):
            lane[LANES * (OF_X + k)] = 0.0
        return
    section, rest, u = first_place_of_sum(c, of_y, of_x, total)
    lane[LANES * INSIDE], lane[LANES * REST], lane[LANES * U] = 1.0, rest, u
    for k in range(Y - X):
        lane[LANES * (OF_X + k)] = of_y * c[section + Y + 1 + k] + of_x * c[section + X + k]
    for k in range(Y - X, COEFFICIENTS):
        lane[LANES * (OF_X + k)] = c[section + X + k]


def missed_of(room: Any, number: int) -> float:
    """How far a search has ended from where it was to."""
    return missed(
        room, LANES * OF_X + number, LANES, room[LANES * U + number], room[LANES * REST + number]
    )


def value_of(room: Floats, number: int) -> float:
    """The value of what was asked."""
    return room[LANES * VALUE + number]


def answer(room: Any, asked: int, rounds: int) -> None:
    """Answer all that was asked; as a rule a search takes so many rounds, which all go together."""
    for lane in range(asked):
        room[LANES * GOES_ON + lane] = 1.0
    for _ in range(rounds):
        for lane in range(asked):
            step(room, lane)
    for lane in range(asked):
        tell(room, lane)
    for lane in range(asked):
        if room[LANES * GOES_ON + lane] > 0.0:
            u, rest = room[LANES * U + lane], room[LANES * REST + lane]
            u, _, _, _ = on_section(room, LANES * OF_X + lane, LANES, u, rest, ROUNDS - rounds)
            room[LANES * U + lane] = u
            tell(room, lane)


def step(room: Any, lane: int) -> None:
    """A round of a search that goes on."""
    before, is_going = room[LANES * U + lane], room[LANES * GOES_ON + lane] > 0.0
    u, goes_on = nearer_place(room, LANES * OF_X + lane, LANES, before, room[LANES * REST + lane])
    room[LANES * U + lane] = u if is_going else before
    room[LANES * GOES_ON + lane] = 1.0 if is_going and goes_on else 0.0


def tell(room: Any, lane: int) -> None:
    """What a search has come to."""
    value, _ = value_at(room, LANES * OF_X + lane, LANES, room[LANES * U + lane])
    is_inside = room[LANES * INSIDE + lane] > 0.0
    room[LANES * VALUE + lane] = value if is_inside else room[LANES * VALUE + lane]
