"""Tests of finding roots of several independent functions at once."""

from __future__ import annotations

import numpy as np
import pytest

from osimlite.tools.root_solver import find_roots


def test_each_function_has_its_zero() -> None:
    wanted = np.array([0.3, 0.01, 0.7, 0.999])

    def function(x: np.ndarray) -> np.ndarray:
        return np.array(
            [x[0] - 0.3, np.tanh(40.0 * (x[1] - 0.01)), x[2] ** 3 - 0.343, np.expm1(x[3] - 0.999)]
        )

    found = find_roots(function, np.zeros(4), np.ones(4), 1e-10)
    assert found == pytest.approx(wanted, abs=1e-10)
    # Roots of linear functions are exact at any tolerance.
    assert find_roots(function, np.zeros(4), np.ones(4), 4e-3)[0] == pytest.approx(0.3, abs=1e-15)
    assert find_roots(function, np.zeros(4), np.ones(4), 4e-3) == pytest.approx(wanted, abs=4e-3)


def test_without_a_zero_it_is_the_nearer_end() -> None:
    found = find_roots(lambda x: x + np.array([1.0, -2.0]), np.zeros(2), np.ones(2), 1e-6)
    assert found == pytest.approx([0.0, 1.0], abs=1e-6)
    assert find_roots(lambda x: x - 0.5, np.full(1, 0.2), np.full(1, 0.2), 1e-6).tolist() == [0.2]
