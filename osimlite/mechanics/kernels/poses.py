"""Several states one after another, and what is asked for of each: one call for a whole sweep."""

from __future__ import annotations

from math import nan

from osimlite.mechanics.kernels.dynamics import clear_wrenches, generalized_forces
from osimlite.mechanics.kernels.layout import ITEM, MODEL, OUTCOME, STAGE, WORK
from osimlite.mechanics.kernels.paths import pull_path
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call


def look(
    model: Ints,
    reals: Floats,
    data: Floats,
    y: Floats,
    f: Floats,
    stage: int,
    states: Floats,
    order: Ints,
    found: Floats,
) -> int:
    """Evaluate states, or accelerate them, up to the first that cannot be: its time is in `data` then, and itself in y.

    Args: model: the structure. reals: its numbers. data: room for what is found. y: room for a
        state. f: room for its derivative. stage: up to which each is evaluated. states: time,
        state, and accelerations if they are given, one after another. order: how many states, how
        many accelerations, the address of what is called for each state, how many places are looked
        at, and these places: of data, and behind it of f. found: what stands at the places, state
        by state.
    """
    size, room, count, moving, law, looked = (
        model[MODEL.STATE_SIZE],
        model[MODEL.WORK_SIZE],
        order[0],
        order[1],
        order[2],
        order[3],
    )
    for number in range(count):
        given = at(states, (1 + size + moving) * number)
        data[WORK.TIME] = given[0]
        for k in range(size):
            y[k] = given[1 + k]
        for k in range(moving):
            f[model[MODEL.DOFS] + k] = given[1 + size + k]
        status = call(law, model, reals, data, y, f, stage)
        if status != OUTCOME.OK:
            return status
        row = at(found, looked * number)
        for k in range(looked):
            place = order[4 + k]
            row[k] = data[place] if place < room else f[place - room]
    return OUTCOME.OK


def push_each(
    model: Ints,
    reals: Floats,
    data: Floats,
    y: Floats,
    f: Floats,
    law: int,
    states: Floats,
    order: Ints,
    found: Floats,
) -> int:
    """What is missing of accelerations while no actuator pushes, and what each pushes by a control of 1; see `look`.

    Args: model: the structure. reals: its numbers. data: room for what is found. y: room for a
        state. f: room for its derivative. law: address of `inverse`. states: time, state and
        accelerations, one after another. order: how many states, how many actuators, and of each
        its item, the place of its control, the item of its path and the place of what it pulls with
        by a control of 1; these two are -1 if it has no path. found: generalized forces that are
        missing (n,), and of each actuator those that it gives (n,) and what it pulls with, state by
        state.
    """
    size, freedoms, count, actuators = (
        model[MODEL.STATE_SIZE],
        model[MODEL.DOFS],
        order[0],
        order[1],
    )
    applied = at(f, freedoms)
    for number in range(count):
        given = at(states, (1 + size + freedoms) * number)
        row = at(found, (freedoms + actuators * (freedoms + 1)) * number)
        data[WORK.TIME] = given[0]
        for k in range(size):
            y[k] = given[1 + k]
        for k in range(freedoms):
            applied[k] = given[1 + size + k]
        status = call(law, model, reals, data, y, f, 0)
        if status != OUTCOME.OK:
            return status
        for k in range(freedoms):
            row[k] = applied[k]
        for actuator in range(actuators):
            own = at(order, 2 + 4 * actuator)
            to = at(row, freedoms + actuator * (freedoms + 1))
            clear_wrenches(model, data)
            for k in range(freedoms):
                applied[k] = 0.0
            if own[2] >= 0:
                to[freedoms] = data[own[3]]
                pull_path(model, reals, data, y, f, own[2], data[own[3]])
            else:
                data[own[1]] = 1.0
                status = call(model[own[0] + ITEM.LAW], model, reals, data, y, f, own[0])
                data[own[1]], to[freedoms] = 0.0, 1.0
                if status != OUTCOME.OK:
                    return status
            generalized_forces(model, data, applied)
            for k in range(freedoms):
                to[k] = applied[k]
    return OUTCOME.OK


def watch(
    model: Ints,
    reals: Floats,
    data: Floats,
    y: Floats,
    f: Floats,
    count: int,
    states: Floats,
    order: Ints,
    found: Floats,
) -> int:
    """Look at states.

    Args: model: the structure. reals: its numbers. data: room for what is found. y: room for a
        state. f: room for its derivative. count: how many states. states: one after another. order:
        how many places in data are looked at, how many are set to 0 before each state, these places
        one after the other; then for each state the number of the one item that is computed, -1 for
        all. found: what stands at the places, state by state; NaN in a state that cannot be
        computed.

    Returns:
        OK, or what the kernel of an item said last that is something else.
    """
    size, looked, cleared = model[MODEL.STATE_SIZE], order[0], order[1]
    places, clears = at(order, 2), at(order, 2 + looked)
    items = at(order, 2 + looked + cleared)
    said = OUTCOME.OK
    for number in range(count):
        for k in range(size):
            y[k] = states[size * number + k]
        for k in range(cleared):
            data[clears[k]] = 0.0
        status = call(model[MODEL.LAWS], model, reals, data, y, f, STAGE.VELOCITY)
        first, end = items[number], items[number] + 1
        if first < 0:
            first, end = 0, model[MODEL.ITEMS]
        for k in range(first, end):
            if status == OUTCOME.OK:
                item = model[model[MODEL.ITEM_AT] + k]
                status = call(model[item + ITEM.LAW], model, reals, data, y, f, item)
        for k in range(looked):
            found[looked * number + k] = data[places[k]] if status == OUTCOME.OK else nan
        said = said if status == OUTCOME.OK else status
    return said
