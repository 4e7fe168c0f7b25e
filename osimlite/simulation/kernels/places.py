"""Where the surfaces of the contacts are."""

from __future__ import annotations

from osimlite.simulation.kernels.arrays import Floats, Ints, Structure, numbers_of, work_for
from osimlite.simulation.kernels.dynamics import direction, station
from osimlite.simulation.kernels.motion import place


def contact_places(s: Structure, vectors: Floats, rows: Ints, states: Floats, places: Floats) -> None:
    """Centres of the surfaces of all contacts at many states.

    Args:
        s: the mechanism.
        vectors: its numbers, one row or several (v, m).
        rows: which of them each state goes with (k,).
        states: (k, 2n).
        places: filled with the centre of surface 1, its normal, and the centre of surface 2, in ground (k, P, 9).
    """
    w, n = work_for(s), len(s.above)
    for k in range(len(states)):
        x = numbers_of(s, vectors[rows[k]])
        place(s, x, w, states[k, :n])
        for pair in range(len(s.pair_kind)):
            a, to = x.pairs[pair], places[k, pair]
            one, two = s.pair_links[pair, 0], s.pair_links[pair, 1]
            to[0], to[1], to[2] = station(w, one, a[0], a[1], a[2])
            to[3], to[4], to[5] = direction(w, one, a[3], a[4], a[5])
            to[6], to[7], to[8] = station(w, two, a[7], a[8], a[9])
