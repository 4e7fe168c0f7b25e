"""The controls of actuators, and what a stretch reflex adds to one."""

from __future__ import annotations

from osimlite.mechanics.kernels.functions import value_at
from osimlite.mechanics.kernels.layout import ITEM, OUTCOME, WORK
from osimlite.mechanics.kernels.pointers import Floats, Ints, at


def set_controls(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Each control is the sum of some functions of time.

    Of the record, from OWN on, the integers are the count of the controls, for each of them how
    many functions there are up to it, and the places of the functions' tables among the numbers.
    """
    i = at(model, item)
    count, numbers, values = i[ITEM.OWN], at(reals, i[ITEM.NUMBERS]), at(data, i[ITEM.RECORD])
    ends, tables = at(i, ITEM.OWN + 1), at(i, ITEM.OWN + 1 + count)
    place = 0
    for control in range(count):
        total = 0.0
        while place < ends[control]:
            value, _, _ = value_at(at(numbers, tables[place]), data[WORK.TIME])
            total += value
            place += 1
        values[control] = total
    return OUTCOME.OK


def with_reflex(data: Floats, place: int, gain: float, rate: float) -> float:
    """The control at a place, to which its gain (s/m) adds while the muscle lengthens at a rate (m/s)."""
    total: float = data[place] + gain * max(rate, 0.0)
    data[place] = total
    return total
