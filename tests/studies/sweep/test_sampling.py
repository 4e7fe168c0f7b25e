"""Tests of samples: reproducible, independent of the division into blocks, and of the right distribution."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.errors import SettingError
from osimlite.studies.sweep.sampling import SAMPLERS, Samples, choose_samples
from osimlite.studies.sweep.variables import Slope, Start, Variable

pytest.importorskip("scipy", reason="needs scipy (extra 'sweep')")


def variable(name, low=0.0, high=1.0, count=None, is_log=False):
    return Variable(name, Start((name,), False), low, high, count, is_log)


THREE = (
    variable("a", -1.0, 2.0, 4),
    variable("b", 1e3, 1e6, 3, is_log=True),
    variable("c", 5.0, 5.0, 1),
)


@given(
    st.sampled_from(SAMPLERS),
    st.integers(1, 200),
    st.integers(0, 5),
    st.lists(st.integers(0, 200), max_size=4),
)
def test_any_pieces_make_the_whole(sampler, count, seed, cuts):
    result = Samples(THREE, sampler, 12 if sampler == "grid" else count, seed)
    whole = result.make_block(0, result.count)
    assert whole.shape == (result.count, 3)
    ends = sorted({0, result.count, *(cut for cut in cuts if cut < result.count)})
    pieces = [result.make_block(a, b - a) for a, b in pairwise(ends)]
    assert np.array_equal(np.concatenate(pieces), whole)
    assert (whole >= [item.low for item in THREE]).all() and (
        whole <= [item.high for item in THREE]
    ).all()


@given(
    st.sampled_from(SAMPLERS),
    st.lists(st.tuples(st.integers(0, 100), st.integers(1, 100)), max_size=6),
)
def test_pieces_come_in_any_order(sampler, pieces):
    result = Samples(THREE, sampler, 12 if sampler == "grid" else 150, 1)
    whole = Samples(THREE, sampler, result.count, 1).make_block(0, result.count)
    for first, count in pieces:
        assert np.array_equal(result.make_block(first, count), whole[first : first + count])


def test_grid_has_every_combination_and_both_ends():
    result = choose_samples(THREE)
    assert result.sampler == "grid" and result.count == 12
    rows = result.make_block(0, 100)
    assert len({tuple(row) for row in rows}) == 12
    assert sorted(set(rows[:, 0])) == [-1.0, 0.0, 1.0, 2.0]
    assert sorted(set(rows[:, 1])) == pytest.approx([1e3, 10**4.5, 1e6], rel=1e-12)
    assert {rows[0, 1], rows[2, 1]} == {1e3, 1e6}
    assert set(rows[:, 2]) == {5.0}


@given(st.integers(1, 3000), st.integers(0, 100))
def test_latin_hypercube_has_one_in_every_layer(count, seed):
    rows = Samples((variable("a"), variable("b")), "lhs", count, seed).make_block(0, count)
    for column in rows.T:
        assert sorted(np.floor(column * count).astype(int)) == list(range(count))


def test_latin_hypercube_is_not_ordered():
    rows = Samples(tuple(variable(name) for name in "abcd"), "lhs", 4096, 1).make_block(0, 4096)
    assert (
        abs(np.corrcoef(np.column_stack((np.arange(4096), rows)), rowvar=False) - np.eye(5)).max()
        < 0.06
    )


def test_seeds_differ_and_samples_fill_the_cube():
    for sampler in ("random", "sobol", "lhs"):
        one, two, again = (
            Samples(THREE[:1], sampler, 1024, seed).make_block(0, 1024) for seed in (1, 2, 1)
        )
        assert np.array_equal(one, again) and not np.array_equal(one, two)
        assert np.histogram(one, bins=8, range=(-1.0, 2.0))[0] == pytest.approx(128, abs=45)


def test_sobol_is_scipys_own():
    rows = Samples((variable("a"), variable("b")), "sobol", 64, 3).make_block(10, 54)
    # This import takes longer than all tests here, and collecting them does not need it.
    from scipy.stats import qmc  # type: ignore[import-untyped]

    expected = qmc.Sobol(2, scramble=True, rng=np.random.default_rng(3)).random(64)[10:]
    assert np.array_equal(rows, expected)


def test_a_block_of_many_needs_no_more_memory_than_the_block():
    import tracemalloc

    result = Samples((variable("a"), variable("b")), "lhs", 10**12)
    tracemalloc.start()
    assert result.make_block(10**11, 100).shape == (100, 2)
    assert tracemalloc.get_traced_memory()[1] < 1e6
    tracemalloc.stop()


def test_what_does_not_go_together_is_said():
    free = variable("a", 0.0, 1.0)
    with pytest.raises(SettingError, match="did you mean 'sobol'"):
        choose_samples([free], "sobl", 5)
    with pytest.raises(SettingError, match="a=LOW:HIGH:COUNT"):
        choose_samples([free], "grid")
    with pytest.raises(SettingError, match="--samples"):
        choose_samples([free])
    with pytest.raises(SettingError, match="12 points"):
        choose_samples(THREE, "grid", 5)
    with pytest.raises(SettingError, match="leave out one of the two, or select a sampler"):
        choose_samples(THREE, None, 5)
    assert choose_samples(THREE, "lhs", 5).count == 5
    with pytest.raises(SettingError, match="at least 1"):
        choose_samples([free], "random", 0)
    assert choose_samples([Variable("slope", Slope(), 0.1, 0.1, 1)]).count == 1
