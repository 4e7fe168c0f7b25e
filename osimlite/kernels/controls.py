"""The controls of actuators, and what a stretch reflex adds to one."""

from __future__ import annotations

from osimlite.kernels.functions import value_at
from osimlite.kernels.layout import ITEM, OUTCOME, WORK
from osimlite.kernels.pointers import Floats, Ints, at


def set_controls(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """Each control is the sum of some functions of time.

    Of the record, from OWN on, the integers are the count of the controls, for each of them how many functions there
    are up to it, and the places of the functions' tables among the numbers.
    """
    i = at(s, item)
    count, numbers, values = i[ITEM.OWN], at(x, i[ITEM.NUMBERS]), at(w, i[ITEM.RECORD])
    ends, tables = at(i, ITEM.OWN + 1), at(i, ITEM.OWN + 1 + count)
    place = 0
    for control in range(count):
        total = 0.0
        while place < ends[control]:
            value, _, _ = value_at(at(numbers, tables[place]), w[WORK.TIME])
            total += value
            place += 1
        values[control] = total
    return OUTCOME.OK


def with_reflex(w: Floats, place: int, gain: float, rate: float) -> float:
    """The control at a place, to which its gain (s/m) adds while the muscle lengthens at a rate (m/s)."""
    total: float = w[place] + gain * max(rate, 0.0)
    w[place] = total
    return total
