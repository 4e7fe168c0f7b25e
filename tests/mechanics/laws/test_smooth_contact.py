from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.mechanics.laws.hunt_crossley import combine_materials, contact_energy, contact_force
from osimlite.mechanics.laws.smooth_contact import (
    SmoothContact,
    smooth_contact_derivatives,
    smooth_contact_energy,
    smooth_contact_force,
    smooth_hertz,
    station_contact_force,
)

UP = 0.0, 1.0, 0.0
SHARP = 1e-18, 1e7
"""Parameters cf and bd or bv with which the smooth law is close to that of Hunt and Crossley."""


@given(
    st.floats(0.001, 0.1),
    st.floats(0.05, 0.5),
    st.tuples(st.floats(-1.0, 1.0), st.floats(-0.5, 0.5), st.floats(-1.0, 1.0)),
)
def test_sharp_limit_is_hunt_crossley(d, R, v):
    E, c, us, ud, uv, vt = 1e5, 0.5, 0.8, 0.4, 0.1, 0.2
    k, *_ = combine_materials(E, c, us, ud, uv, E, c, us, ud, uv)
    hertz = smooth_hertz(d, R, E, *SHARP)
    result = smooth_contact_force(hertz, c, us, ud, uv, vt, *SHARP, UP, v)
    expected = contact_force(d, R, k, c, us, ud, uv, vt, UP, v)
    size = max(map(abs, expected))
    assert np.abs(np.subtract(result, expected)).max() <= 1e-6 * size + 1e-9
    assert smooth_contact_energy(hertz, d) == pytest.approx(contact_energy(d, R, k), rel=1e-9)


def test_apart_there_is_nearly_nothing():
    assert (
        0.0 < smooth_hertz(-0.01, 0.1, 1e5, 1e-5, 300.0) < smooth_hertz(0.0, 0.1, 1e5, 1e-5, 300.0)
    )
    force = smooth_contact_force(100.0, 0.5, 0.8, 0.4, 0.1, 0.2, *SHARP, UP, (0.0, -5.0, 0.0))
    assert force == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


@given(
    st.floats(-0.005, 0.02),
    st.floats(-0.6, 0.3),
    st.floats(1e-4, 0.5),
    st.floats(0.0, 6.3),
    st.sampled_from([0.0, 1.2]),
)
def test_derivatives_are_those_of_the_force(d, approach, slip, turn, c):
    R, E, cf, bd, friction, bv, h = 0.05, 1e6, 1e-5, 300.0, (0.8, 0.4, 0.1, 0.1), 50.0, 1e-6

    def force(deeper, faster):
        v = slip * math.cos(turn), approach + faster, slip * math.sin(turn)
        hertz = smooth_hertz(d + deeper, R, E, cf, bd)
        return np.array(smooth_contact_force(hertz, c, *friction, cf, bv, UP, v))

    v = slip * math.cos(turn), approach, slip * math.sin(turn)
    constants = SmoothContact(R, E, cf, bd, c, *friction, bv)
    by_depth, by_speed, across, growth = smooth_contact_derivatives(constants, d, UP, v)
    there, scale = force(0.0, 0.0), abs(force(0.0, 0.0)[1]) + 1e-3
    assert by_depth == pytest.approx(
        (force(h, 0.0) - force(-h, 0.0))[1] / (2.0 * h), abs=1e-3 * scale
    )
    assert by_speed == pytest.approx(
        (force(0.0, h) - force(0.0, -h))[1] / (2.0 * h), abs=1e-5 * scale
    )
    assert across * slip == pytest.approx(
        math.copysign(math.hypot(there[0], there[2]), across), rel=1e-9, abs=1e-12
    )
    assert growth * there[1] == pytest.approx(by_depth, rel=1e-9, abs=1e-12)
    assert smooth_contact_derivatives(constants, -1.0, UP, v) == (
        0.0,
        0.0,
        0.0,
        0.0,
    )


STATION_CONSTANTS = 1e4, 0.01, 0.0, 0.5, 0.2, 0.05


def test_station_contact():
    still = station_contact_force(-0.02, 0.0, 0.0, 0.0, *STATION_CONSTANTS)
    # The force is close to a spring of 10 kN/m that begins at -0.001 m, and to a weak one above it.
    assert still[0] == still[2] == 0.0 and still[1] == pytest.approx(1e4 * 0.019, rel=0.1)
    assert station_contact_force(0.01, 0.0, 0.0, 0.0, *STATION_CONSTANTS)[1] == pytest.approx(
        0.0, abs=1e-6
    )
    rising, falling = (
        station_contact_force(-0.02, 0.0, v, 0.0, *STATION_CONSTANTS)[1] for v in (1.0, -1.0)
    )
    assert (rising, falling) == (pytest.approx(0.99 * still[1]), pytest.approx(1.01 * still[1]))
    fx, fy, fz = station_contact_force(-0.02, 3.0, 0.0, -4.0, *STATION_CONSTANTS)
    assert (fx, fz) == (
        pytest.approx(-0.6 * 1.5 * fy, rel=1e-4),
        pytest.approx(0.8 * 1.5 * fy, rel=1e-4),
    )
