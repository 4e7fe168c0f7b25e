from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.mechanics.laws.bushing import (
    bushing_dissipation,
    bushing_load,
    xyz_angles,
    xyz_moment,
    xyz_rates,
)

TURNS = st.floats(-3.0, 3.0)
TILTS = st.floats(-1.5, 1.5)


def rotation(a, b, c):
    x = np.array([[1, 0, 0], [0, cos(a), -sin(a)], [0, sin(a), cos(a)]])
    y = np.array([[cos(b), 0, sin(b)], [0, 1, 0], [-sin(b), 0, cos(b)]])
    z = np.array([[cos(c), -sin(c), 0], [sin(c), cos(c), 0], [0, 0, 1]])
    return x @ y @ z


def angles(r):
    return xyz_angles(r[0, 0], r[0, 1], r[0, 2], r[1, 0], r[1, 1], r[1, 2], r[2, 2])


@given(TURNS, TILTS, TURNS)
def test_angles(a, b, c):
    assert angles(rotation(a, b, c)) == pytest.approx((a, b, c), abs=1e-12)


@pytest.mark.parametrize("b", [0.5 * pi, -0.5 * pi])
@given(a=TURNS, c=TURNS)
def test_angles_where_two_axes_are_one(b, a, c):
    r = rotation(a, b, c)
    assert rotation(*angles(r)) == pytest.approx(r, abs=1e-7)


@given(TURNS, TILTS, TURNS, st.tuples(TURNS, TURNS, TURNS))
def test_rates_and_moment(a, b, c, rates):
    """Compare rates with differences of rotations; moments and rates have the same power."""
    h = 1e-6
    before, after = (
        rotation(*(np.array((a, b, c)) + sign * h * np.array(rates))) for sign in (-1.0, 1.0)
    )
    spin = rotation(a, b, c).T @ (after - before) / (2.0 * h)
    w = spin[2, 1], spin[0, 2], spin[1, 0]
    result = xyz_rates(b, c, *w)
    assert result == pytest.approx(rates, abs=1e-6 / cos(b))
    loads = 1.0, -2.0, 0.5
    assert np.dot(xyz_moment(b, c, *loads), w) == pytest.approx(
        np.dot(loads, result), abs=1e-9 / cos(b)
    )


def test_load():
    assert bushing_load(0.5, 2.0, 3.0, 0.25) == -2.0


@given(TURNS, TURNS, st.floats(0.0, 10.0))
def test_dissipation_is_what_the_damper_takes(v, x, c):
    taken = -v * (bushing_load(x, v, 3.0, c) - bushing_load(x, 0.0, 3.0, c))
    assert bushing_dissipation(v, c) == pytest.approx(taken, abs=1e-12)
