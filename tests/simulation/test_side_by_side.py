"""Laws compiled by several processes: the shares, what they bring, and what is done where one fails."""

from __future__ import annotations

from itertools import chain

import pytest

pytest.importorskip("numba", reason="needs numba (extra 'fast')")

from osimlite.kernels.table import LAW_MODULES
from osimlite.simulation.elements.laws import law_function
from osimlite.simulation.engines import machine_code, object_code, side_by_side

LAWS = ("contact_places", "place_drift")


@pytest.fixture
def cold(tmp_path, monkeypatch):
    """No law is ready or in a file; everything is worth a process. Yields the shares that processes got."""
    monkeypatch.setattr(object_code, "_folders", lambda: [tmp_path])
    monkeypatch.setattr(machine_code, "_addresses", {})
    monkeypatch.setattr(side_by_side, "SHARE", 1)
    monkeypatch.setattr(side_by_side, "cores", lambda: 2)
    given = []

    class Counted(side_by_side.Helper):
        def __init__(self, names):
            given.append(list(names))
            super().__init__(names)

    monkeypatch.setattr(side_by_side, "Helper", Counted)
    return given


def test_a_helper_brings_its_share(cold, monkeypatch):
    monkeypatch.setattr(side_by_side, "made", lambda name, own=side_by_side.made: here.append(name) or own(name))
    here = []
    machine_code.make_ready(LAWS)
    assert set(machine_code._addresses) == set(LAWS) and all(machine_code._addresses.values())
    assert len(cold) == len(here) == 1 and {*cold[0], *here} == set(LAWS)
    # Both are in files now.
    for law in LAWS:
        assert object_code.load(law, machine_code.digest_of(law_function(law)))


@pytest.mark.parametrize("program", ["raise SystemExit(1)", 'print(\'["place_drift", "old", "", ""]\')'])
def test_what_a_helper_does_not_bring_is_compiled_here(cold, monkeypatch, program):
    monkeypatch.setattr(side_by_side, "PROGRAM", program)
    machine_code.make_ready(LAWS)
    assert set(machine_code._addresses) == set(LAWS) and len(cold) == 1


def test_shares():
    laws = list(LAW_MODULES)
    groups = side_by_side.shares(laws, 4)
    assert len(groups) == 4 and sorted(chain(*groups)) == sorted(laws)
    sizes = [sum(map(side_by_side.size_of, group)) for group in groups]
    assert max(sizes) < 1.3 * min(sizes)
    # Little is not worth a process, and nobody gets nothing.
    assert side_by_side.shares(LAWS, 4) == [list(LAWS)]
