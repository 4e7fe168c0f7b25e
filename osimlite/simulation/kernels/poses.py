"""Several states one after another, and what is asked for of each: one call for a whole sweep."""

from __future__ import annotations

from math import nan

from osimlite.simulation.kernels.layout import (
    FREEDOMS,
    ITEM_AT,
    ITEMS,
    LAW,
    LAWS,
    OK,
    STATE_SIZE,
    TIME,
    VELOCITY_STAGE,
    WORK_SIZE,
)
from osimlite.simulation.kernels.pointers import Floats, Ints, at, call


def look(
    s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, stage: int, states: Floats, order: Ints, found: Floats
) -> int:
    """Evaluate states, or accelerate them, up to the first that cannot be: its time is in `w` then, and itself in y.

    Args:
        s: the structure.
        x: its numbers.
        w: room for what is found.
        y: room for a state.
        f: room for its derivative.
        stage: up to which each is evaluated.
        states: time, state, and accelerations if they are given, one after another.
        order: how many states, how many accelerations, the address of what is called for each state, how many places
            are looked at, and these places: of w, and behind it of f.
        found: what stands at the places, state by state.
    """
    size, room, count, moving, law, looked = s[STATE_SIZE], s[WORK_SIZE], order[0], order[1], order[2], order[3]
    for number in range(count):
        given = at(states, (1 + size + moving) * number)
        w[TIME] = given[0]
        for k in range(size):
            y[k] = given[1 + k]
        for k in range(moving):
            f[s[FREEDOMS] + k] = given[1 + size + k]
        status = call(law, s, x, w, y, f, stage)
        if status != OK:
            return status
        row = at(found, looked * number)
        for k in range(looked):
            place = order[4 + k]
            row[k] = w[place] if place < room else f[place - room]
    return OK


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
