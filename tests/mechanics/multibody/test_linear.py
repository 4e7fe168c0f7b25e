from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.mechanics.multibody.linear import solve_with_null_space


@given(st.integers(0, 5), st.integers(0, 3), st.integers(1, 7), st.integers(0, 2**32 - 1))
def test_repeated_equations_say_nothing_new(count, repeated, size, seed):
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(count, size))
    again = rng.normal(size=(repeated, count)) @ rows
    x = rng.normal(size=size)
    both = np.concatenate([rows, again])
    shortest, free = solve_with_null_space(both, both @ x)
    assert both @ shortest == pytest.approx(both @ x, abs=1e-7)
    assert free.shape == (size, size - min(count, size))
    assert free.T @ free == pytest.approx(np.eye(free.shape[1]), abs=1e-12)
    assert both @ free == pytest.approx(np.zeros((len(both), free.shape[1])), abs=1e-7)
    assert free.T @ shortest == pytest.approx(np.zeros(free.shape[1]), abs=1e-7)


def test_contradictions_are_shared():
    shortest, free = solve_with_null_space(np.array(((1.0, 0.0), (2.0, 0.0))), np.array((1.0, 6.0)))
    # The equations say x = 1 and x = 3; their scale does not matter.
    assert shortest == pytest.approx((2.0, 0.0))
    assert np.abs(free[:, 0]) == pytest.approx((0.0, 1.0))
