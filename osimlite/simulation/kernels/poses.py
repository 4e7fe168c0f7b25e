"""Several states one after another, and what is asked for of each: one call for a whole sweep."""

from __future__ import annotations

from math import nan

from osimlite.simulation.kernels.layout import ITEM_AT, ITEMS, LAW, LAWS, OK, STATE_SIZE, VELOCITY_STAGE
from osimlite.simulation.kernels.pointers import Floats, Ints, at, call


def watch(
    s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, count: int, states: Floats, order: Ints, found: Floats
) -> int:
    """Look at states.

    Args:
        s: the structure.
        x: its numbers.
        w: room for what is found.
        y: room for a state.
        f: room for its derivative.
        count: how many states.
        states: one after another.
        order: how many places in w are looked at, how many are set to 0 before each state, these places one after the
            other; then for each state the number of the one item that is computed, -1 for all.
        found: what stands at the places, state by state; NaN in a state that cannot be computed.

    Returns:
        OK, or what the kernel of an item said last that is something else.
    """
    size, looked, cleared = s[STATE_SIZE], order[0], order[1]
    places, clears = at(order, 2), at(order, 2 + looked)
    items = at(order, 2 + looked + cleared)
    said = OK
    for number in range(count):
        for k in range(size):
            y[k] = states[size * number + k]
        for k in range(cleared):
            w[clears[k]] = 0.0
        status = call(s[LAWS], s, x, w, y, f, VELOCITY_STAGE)
        first, end = items[number], items[number] + 1
        if first < 0:
            first, end = 0, s[ITEMS]
        for k in range(first, end):
            if status == OK:
                item = s[s[ITEM_AT] + k]
                status = call(s[item + LAW], s, x, w, y, f, item)
        for k in range(looked):
            found[looked * number + k] = w[places[k]] if status == OK else nan
        said = said if status == OK else status
    return said
