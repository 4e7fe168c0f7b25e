"""Where the surfaces of the contacts are."""

from __future__ import annotations

from osimlite.mechanics.kernels.layout import ITEM, MODEL, OUTCOME, STAGE
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.kernels.points import direction, station
from osimlite.mechanics.laws.vectors import put, vector


def contact_places(
    model: Ints,
    vectors: Floats,
    data: Floats,
    each: int,
    rows: Ints,
    states: Floats,
    room: Floats,
    places: Floats,
    count: int,
) -> int:
    """Centres of the surfaces of all contacts at many states.

    Args: model: the mechanism. vectors: its numbers, one row or several. data: room for an
        evaluation. each: length of a row of numbers. rows: which of them each state goes with (k,).
        states: (k, y). room: for a derivative (y,). places: filled with the centre of surface 1,
        its normal, and the centre of surface 2, in ground (k, P, 9). count: k.
    """
    pairs, size = model[MODEL.CONTACTS], model[MODEL.STATE_SIZE]
    for k in range(count):
        x = at(vectors, each * rows[k])
        call(model[MODEL.LAWS], model, x, data, at(states, size * k), room, STAGE.POSITION)
        for pair in range(pairs):
            i, to = (
                at(model, model[model[MODEL.CONTACT_AT] + pair]),
                at(places, 9 * (pairs * k + pair)),
            )
            a, one, two = at(x, i[ITEM.NUMBERS]), i[ITEM.OWN], i[ITEM.OWN + 1]
            put(to, 0, station(model, data, one, vector(a, 0)))
            put(to, 3, direction(model, data, one, vector(a, 3)))
            put(to, 6, station(model, data, two, vector(a, 7)))
    return OUTCOME.OK
