"""Tests of functions in formulas, which return C's values where Python's own functions would raise an error."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.mechanics.laws import formulas

ANY = st.floats(allow_nan=True, allow_infinity=True)


@given(ANY, ANY)
def test_nothing_raises_and_all_are_as_in_c(a, b):
    with np.errstate(all="ignore"):
        assert formulas.divide(a, b) == pytest.approx(
            np.float64(a) / np.float64(b), nan_ok=True, rel=1e-15
        )
    for name in ("smaller", "larger", "power"):
        getattr(formulas, name)(a, b)


@given(st.floats(-50, 50), st.one_of(st.integers(-9, 9).map(float), st.floats(-9, 9)))
def test_power_is_that_of_c(a, b):
    with np.errstate(all="ignore"):
        expected = np.power(np.float64(abs(a) if a == 0.0 else a), np.float64(b))
    assert formulas.power(a, b) == pytest.approx(expected, rel=1e-14, nan_ok=True)


REFERENCES = {
    "square_root": np.sqrt,
    "exponential": np.exp,
    "logarithm": np.log,
    "sine": np.sin,
    "cosine": np.cos,
    "tangent": np.tan,
    "arcsine": np.arcsin,
    "arccosine": np.arccos,
    "arctangent": np.arctan,
    "hyperbolic_sine": np.sinh,
    "hyperbolic_cosine": np.cosh,
    "hyperbolic_tangent": np.tanh,
    "secant": lambda x: 1.0 / np.cos(x),
    "cosecant": lambda x: 1.0 / np.sin(x),
    "cotangent": lambda x: 1.0 / np.tan(x),
    "reciprocal": lambda x: 1.0 / x,
    "magnitude": np.abs,
    "unit_step": lambda x: float(x >= 0.0),
    "is_zero": lambda x: float(x == 0.0),
    "error_function": math.erf,
    "complementary_error_function": math.erfc,
}


@pytest.mark.parametrize("name", REFERENCES)
@given(
    st.one_of(
        st.floats(-709, 709),
        st.sampled_from([0.0, -0.0, math.inf, -math.inf, math.nan, 1e300, 711.0]),
    )
)
def test_functions(name, x):
    with np.errstate(all="ignore"):
        expected = float(REFERENCES[name](np.float64(x)))
    assert getattr(formulas, name)(x) == pytest.approx(expected, rel=1e-13, abs=1e-300, nan_ok=True)
