from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.mechanics.laws.springs import (
    blankevoort_energy,
    blankevoort_tension,
    coordinate_spring_force,
    mckibben_tension,
    path_spring_energy,
    path_spring_tension,
    path_stretch,
    point_spring_tension,
    spring_energy,
)

LENGTHS = st.floats(0.1, 3.0)


def slope(f, x, h=1e-5):
    return (f(x + h) - f(x - h)) / (2.0 * h)


@given(LENGTHS, st.floats(0.2, 2.0))
def test_elastic_forces_are_slopes_of_the_energies(length, l0):
    k, e1 = 7.0, 0.3
    tension = blankevoort_tension(length, 0.0, l0, k, e1, 5.0)
    assert tension == pytest.approx(
        slope(lambda x: blankevoort_energy(x, l0, k, e1), length), abs=2e-3
    )
    tension = path_spring_tension(length, 0.0, l0, k, 5.0)
    assert tension == pytest.approx(slope(lambda x: path_spring_energy(x, l0, k), length), abs=2e-3)
    tension = point_spring_tension(length, k, l0)
    assert tension == pytest.approx(slope(lambda x: spring_energy(x - l0, k), length), abs=1e-6)
    force = coordinate_spring_force(length, 0.0, k, l0, 3.0)
    assert -force == pytest.approx(slope(lambda x: spring_energy(x - l0, k), length), abs=1e-6)


def test_damping_of_a_ligament():
    """Damping increases over the first 0.01 of strain, and acts only while the ligament lengthens."""
    constants = 2.0, 100.0, 0.06, 8.0
    for strain, part in ((-0.1, 0.0), (0.0, 0.0), (0.005, 0.5), (0.01, 1.0), (0.2, 1.0)):
        length = 2.0 * (1.0 + strain)
        still = blankevoort_tension(length, 0.0, *constants)
        assert blankevoort_tension(length, -0.5, *constants) == still
        assert blankevoort_tension(length, 0.5, *constants) - still == pytest.approx(
            8.0 * 0.25 * part, abs=1e-12
        )


def test_values_worked_out_by_hand():
    assert coordinate_spring_force(1.0, 2.0, 3.0, 0.5, 0.25) == -2.0
    assert path_spring_tension(2.0, 0.5, 1.5, 10.0, 0.2) == pytest.approx(5.5)
    assert path_spring_tension(1.4, 0.5, 1.5, 10.0, 0.2) == 0.0
    # If it shortens faster than 1 / d, it pushes, as in OpenSim.
    assert path_spring_tension(2.0, -10.0, 1.5, 10.0, 0.2) == pytest.approx(-5.0)
    assert [path_stretch(1.0, 1.5, clamped) for clamped in (True, False)] == [0.0, -0.5]
    assert blankevoort_tension(2.2, 0.0, 2.0, 100.0, 0.06, 8.0) == pytest.approx(7.0)


def test_pneumatic_muscle():
    # The tension is zero at the length B / sqrt(3).
    assert mckibben_tension(0.1 + 0.6 / 3**0.5, 1e5, 1.5, 0.6, 0.1) == pytest.approx(0.0, abs=1e-9)
    assert mckibben_tension(0.5, 1e5, 1.5, 0.6, 0.1) == pytest.approx(
        1e5 * 0.12 / (9.0 * 3.141592653589793)
    )
