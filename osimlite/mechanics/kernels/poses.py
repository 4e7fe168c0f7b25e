"""Evaluation of several states in one call, with selected results of each."""

from __future__ import annotations

from math import nan

from osimlite.mechanics.kernels.dynamics import add_generalized_forces, clear_wrenches
from osimlite.mechanics.kernels.layout import ITEM, MODEL, OUTCOME, STAGE, WORK
from osimlite.mechanics.kernels.paths import pull_path
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call


def evaluate_states(
    model: Ints,
    reals: Floats,
    data: Floats,
    y: Floats,
    f: Floats,
    stage: int,
    states: Floats,
    order: Ints,
    results: Floats,
) -> int:
    """Evaluate states, or their inverse dynamics, up to the first that fails.

    The time of a state that fails is left in `data`, and the state itself in y.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: workspace of an evaluation.
        y: workspace of a state.
        f: workspace for the rates of a state.
        stage: stage of each evaluation, see `STAGE`.
        states: time, state, and accelerations if there are any, one after another.
        order: numbers of states and of accelerations per state, address of the law, number of results,
            and their indices, in data and behind it in f.
        results: filled with the results, state by state.

    Returns:
        `OUTCOME.OK`, or the outcome of the evaluation that failed.
    """
    size = model[MODEL.STATE_SIZE]
    work_size = model[MODEL.WORK_SIZE]
    count = order[0]
    moving = order[1]
    law = order[2]
    selected = order[3]
    for number in range(count):
        input = at(states, (1 + size + moving) * number)
        data[WORK.TIME] = input[0]
        for k in range(size):
            y[k] = input[1 + k]
        # Accelerations are inputs of inverse dynamics, and stand where f holds generalized forces.
        for k in range(moving):
            f[model[MODEL.DOFS] + k] = input[1 + size + k]
        status = call(law, model, reals, data, y, f, stage)
        if status != OUTCOME.OK:
            return status
        row = at(results, selected * number)
        for k in range(selected):
            offset = order[4 + k]
            # Indices beyond data refer to f, so that one list selects from both.
            row[k] = data[offset] if offset < work_size else f[offset - work_size]
    return OUTCOME.OK


def push_each_actuator(
    model: Ints,
    reals: Floats,
    data: Floats,
    y: Floats,
    f: Floats,
    law: int,
    states: Floats,
    order: Ints,
    results: Floats,
) -> int:
    """Compute the generalized forces that are missing without actuators, and those of each actuator.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: workspace of an evaluation.
        y: workspace of a state.
        f: workspace for the rates of a state.
        law: address of `dynamics.inverse`.
        states: time, state and accelerations, one after another.
        order: numbers of states and of actuators; then for each actuator its item, the index of its
            control, the item of its path and the index of its tension per unit control, both -1
            without a path.
        results: filled with the missing generalized forces (n,), then the generalized forces for a
            control of 1 (n,) and the tension of each actuator, for each state.

    Returns:
        `OUTCOME.OK`, or the outcome of the evaluation that failed.
    """
    size = model[MODEL.STATE_SIZE]
    freedoms = model[MODEL.DOFS]
    count = order[0]
    actuators = order[1]
    applied = at(f, freedoms)
    for number in range(count):
        input = at(states, (1 + size + freedoms) * number)
        row = at(results, (freedoms + actuators * (freedoms + 1)) * number)
        data[WORK.TIME] = input[0]
        for k in range(size):
            y[k] = input[1 + k]
        for k in range(freedoms):
            # Inverse dynamics takes accelerations and returns the missing generalized forces in the
            # same place.
            applied[k] = input[1 + size + k]
        status = call(law, model, reals, data, y, f, 0)
        if status != OUTCOME.OK:
            return status
        for k in range(freedoms):
            row[k] = applied[k]
        for actuator in range(actuators):
            actuator_record = at(order, 2 + 4 * actuator)
            actuator_row = at(row, freedoms + actuator * (freedoms + 1))
            # One actuator at a time, from empty wrenches.
            clear_wrenches(model, data)
            for k in range(freedoms):
                applied[k] = 0.0
            if actuator_record[2] >= 0:
                actuator_row[freedoms] = data[actuator_record[3]]
                pull_path(model, reals, data, y, f, actuator_record[2], data[actuator_record[3]])
            else:
                # All other controls are 0, and forces are linear in the control.
                data[actuator_record[1]] = 1.0
                status = call(
                    model[actuator_record[0] + ITEM.LAW],
                    model,
                    reals,
                    data,
                    y,
                    f,
                    actuator_record[0],
                )
                data[actuator_record[1]], actuator_row[freedoms] = 0.0, 1.0
                if status != OUTCOME.OK:
                    return status
            add_generalized_forces(model, data, applied)
            for k in range(freedoms):
                actuator_row[k] = applied[k]
    return OUTCOME.OK


def evaluate_items(
    model: Ints,
    reals: Floats,
    data: Floats,
    y: Floats,
    f: Floats,
    count: int,
    states: Floats,
    order: Ints,
    results: Floats,
) -> int:
    """Evaluate some items at several states.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: workspace of an evaluation.
        y: workspace of a state.
        f: workspace for the rates of a state.
        count: number of states.
        states: states, one after another.
        order: number of results, number of entries of data to clear before each state, the indices of
            both; then for each state the number of the item to evaluate, -1 for all.
        results: filled with the results, state by state; NaN for a state that fails.

    Returns:
        `OUTCOME.OK`, or the last outcome that differs from it.
    """
    # The list has three parts: indices of results, indices to clear, and items.
    size, selected, cleared = model[MODEL.STATE_SIZE], order[0], order[1]
    offsets = at(order, 2)
    clears = at(order, 2 + selected)
    path_indices = at(order, 2 + selected + cleared)
    outcome = OUTCOME.OK
    for number in range(count):
        for k in range(size):
            y[k] = states[size * number + k]
        # Records of items that do not run keep old values, unless they are cleared.
        for k in range(cleared):
            data[clears[k]] = 0.0
        status = call(model[MODEL.LAWS], model, reals, data, y, f, STAGE.VELOCITY)
        first = path_indices[number]
        end = path_indices[number] + 1
        if first < 0:
            first = 0
            end = model[MODEL.ITEMS]
        for k in range(first, end):
            if status == OUTCOME.OK:
                item = model[model[MODEL.ITEM_AT] + k]
                status = call(model[item + ITEM.LAW], model, reals, data, y, f, item)
        for k in range(selected):
            # A state that fails must not look like a result.
            results[selected * number + k] = data[offsets[k]] if status == OUTCOME.OK else nan
        outcome = outcome if status == OUTCOME.OK else status
    return outcome
