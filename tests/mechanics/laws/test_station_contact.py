from __future__ import annotations

import pytest

from osimlite.mechanics.laws.station_contact import station_contact_force

CONSTANTS = 1e4, 0.01, 0.0, 0.5, 0.2, 0.05


def test_station_contact():
    still = station_contact_force(-0.02, 0.0, 0.0, 0.0, *CONSTANTS)
    # Nearly a spring of 10 kN/m that sets in at -0.001 m, and a weak one above it.
    assert still[0] == still[2] == 0.0 and still[1] == pytest.approx(1e4 * 0.019, rel=0.1)
    assert station_contact_force(0.01, 0.0, 0.0, 0.0, *CONSTANTS)[1] == pytest.approx(0.0, abs=1e-6)
    rising, falling = (
        station_contact_force(-0.02, 0.0, v, 0.0, *CONSTANTS)[1] for v in (1.0, -1.0)
    )
    assert (rising, falling) == (pytest.approx(0.99 * still[1]), pytest.approx(1.01 * still[1]))
    fx, fy, fz = station_contact_force(-0.02, 3.0, 0.0, -4.0, *CONSTANTS)
    assert (fx, fz) == (
        pytest.approx(-0.6 * 1.5 * fy, rel=1e-4),
        pytest.approx(0.8 * 1.5 * fy, rel=1e-4),
    )
