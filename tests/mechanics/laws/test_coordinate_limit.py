"""Tests of the coordinate limit force against a table from OpenSim, and of its properties."""

from __future__ import annotations

import csv
import gzip
import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from osimlite.mechanics.laws.coordinate_limit import (
    limit_constants,
    limit_dissipation,
    limit_energy,
    limit_force,
)

PROPERTIES = (
    "upper_stiffness",
    "upper_limit",
    "lower_stiffness",
    "lower_limit",
    "damping",
    "transition",
)


def test_every_row_of_opensims_table(fixtures):
    """Compare forces to 1e-9 of the sum of the magnitudes of their terms (springs, damper), and energies to 1e-9.

    That sum is the force itself unless the terms cancel; in four rows they cancel to rounding.
    OpenSim computes one step function as a difference, which loses digits next to the limit
    (1.6e-10); the rest agrees to 1e-12.
    """
    with gzip.open(fixtures / "forces" / "coordinate_limit_table.csv.gz", "rt") as text:
        rows = list(csv.DictReader(line for line in text if not line.startswith("#")))
    assert len(rows) == 2040
    acting = 0
    for row in rows:
        properties = [float(row[name]) for name in PROPERTIES]
        constants = limit_constants(*properties, row["motion_type"] == "Rotational")
        q, u = float(row["q_SI"]), float(row["qdot_SI"])
        Ku, qu, Kl, ql, D, t = constants
        force = float(row["generalized_force_SI"])
        terms = (
            limit_force(q, 0.0, Ku, qu, 0.0, ql, 0.0, t),
            limit_force(q, 0.0, 0.0, qu, Kl, ql, 0.0, t),
            limit_force(q, u, 0.0, qu, 0.0, ql, D, t),
        )
        assert abs(limit_force(q, u, *constants) - force) <= 1e-9 * sum(map(abs, terms))
        energy = float(row["potential_energy_J"])
        assert limit_energy(q, Ku, qu, Kl, ql, t) == pytest.approx(energy, rel=1e-9, abs=0.0)
        acting += force != 0.0
    assert acting > 1000


stiffness = st.floats(0.0, 1e4)
angle = st.floats(-4.0, 4.0)
speed = st.floats(-20.0, 20.0)
damping = st.floats(0.0, 100.0)
zone = st.floats(1e-3, 1.0)


@st.composite
def laws(draw):
    """Draw Ku, qu, Kl, ql, D, t with the limits in order."""
    low, high = sorted((draw(angle), draw(angle)))
    return draw(stiffness), high, draw(stiffness), low, draw(damping), draw(zone)


@given(laws(), angle, speed)
def test_nothing_between_the_limits(law, q, u):
    Ku, qu, Kl, ql, _, t = law
    if ql <= q <= qu:
        assert limit_force(q, u, *law) == 0.0
        assert limit_energy(q, Ku, qu, Kl, ql, t) == 0.0


@given(laws(), angle)
def test_spring_is_minus_the_slope_of_the_energy(law, q):
    Ku, qu, Kl, ql, _, t = law
    h = 1e-5
    slope = (limit_energy(q + h, Ku, qu, Kl, ql, t) - limit_energy(q - h, Ku, qu, Kl, ql, t)) / (
        2 * h
    )
    # In the transition zone, the third derivative of the energy is at most of the order of K / t.
    assert limit_force(q, 0.0, *law) == pytest.approx(
        -slope, rel=1e-6, abs=10 * (Ku + Kl) * h * h / t + 1e-6
    )


@given(laws(), angle, speed)
def test_damper_takes_power_and_is_the_rest_of_the_force(law, q, u):
    """Beyond a limit, damping is S D u, where the step S grows from 0 to 1 in the transition zone."""
    _, qu, _, ql, D, t = law
    x = min(max(q - qu, ql - q, 0.0) / t, 1.0)
    share = 10.0 * x**3 - 15.0 * x**4 + 6.0 * x**5
    spring = limit_force(q, 0.0, *law)
    assert spring - limit_force(q, u, *law) == pytest.approx(
        share * D * u, rel=1e-9, abs=1e-9 * (1.0 + abs(spring))
    )
    assert limit_dissipation(q, u, qu, ql, D, t) == pytest.approx(
        share * D * u * u, rel=1e-9, abs=1e-12
    )


@given(laws(), angle, speed)
def test_mirror(law, q, u):
    """The upper and the lower limit are mirror images."""
    Ku, qu, Kl, ql, D, t = law
    assert limit_force(-q, -u, Kl, -ql, Ku, -qu, D, t) == -limit_force(q, u, *law)
    assert limit_energy(-q, Kl, -ql, Ku, -qu, t) == limit_energy(q, Ku, qu, Kl, ql, t)


@given(laws(), speed, st.sampled_from(["limit", "zone"]))
def test_continuous_at_the_limit_and_at_the_end_of_the_zone(law, u, place):
    Ku, qu, Kl, ql, D, t = law
    q = qu if place == "limit" else qu + t
    before, after = limit_force(q - 1e-9, u, *law), limit_force(q + 1e-9, u, *law)
    if q - 1e-9 > ql or place == "zone":
        assume(qu - ql > 1e-8)
        assert after == pytest.approx(before, abs=1e-8 * (Ku + (Ku * t + D * abs(u)) / t + 1.0))
    e_before, e_after = (limit_energy(q + e, Ku, qu, Kl, ql, t) for e in (-1e-9, 1e-9))
    assert e_after == pytest.approx(e_before, abs=1e-8 * (Ku * (t + 1e-3) + Kl * 1e-3 + 1e-6))


def test_beyond_the_zone_it_is_a_plain_spring_and_damper():
    law = limit_constants(0.5, 0.0, 0.25, -140.0, 0.025, 5.0, True)
    D = 0.025 * 180 / math.pi
    above, below = (limit_force(math.radians(degrees), 0.3, *law) for degrees in (6.0, -150.0))
    assert above == pytest.approx(-0.5 * 6.0 - D * 0.3, rel=1e-12)
    assert below == pytest.approx(0.25 * 10.0 - D * 0.3, rel=1e-12)


def test_half_way_through_the_zone_half_of_it_acts():
    law = 2.0, 1.0, 3.0, -1.0, 0.5, 0.2
    assert limit_force(1.1, 4.0, *law) == pytest.approx(-0.5 * (2.0 * 0.1 + 0.5 * 4.0))
    assert limit_force(-1.1, 4.0, *law) == pytest.approx(0.5 * (3.0 * 0.1 - 0.5 * 4.0))


def test_only_rotational_coordinates_are_converted():
    plain = 10.0, 2.0, 20.0, -3.0, 0.7, 0.1
    assert limit_constants(*plain, False) == (10.0, 2.0, 20.0, -3.0, 0.7, 0.1)
    w = math.pi / 180
    assert limit_constants(*plain, True) == pytest.approx(
        (10 / w, 2 * w, 20 / w, -3 * w, 0.7 / w, 0.1 * w)
    )


@pytest.mark.parametrize("q", [1.5, -1.5])
def test_without_stiffness_the_damper_remains(q):
    """OpenSim divides 0 by 0 here."""
    assert limit_force(q, 2.0, 0.0, 1.0, 0.0, -1.0, 0.5, 0.1) == pytest.approx(-1.0)


@pytest.mark.parametrize("q", [1.5, -1.5])
@pytest.mark.parametrize("t", [0.0, -0.1])
def test_without_transition_the_limit_is_sharp(q, t):
    law = 10.0, 1.0, 10.0, -1.0, 0.5, t
    assert limit_force(q, 2.0, *law) == pytest.approx(-math.copysign(5.0, q) - 1.0)
    assert limit_energy(q, 10.0, 1.0, 10.0, -1.0, t) == pytest.approx(10.0 * 0.25 / 2)


def test_limits_that_cross_act_both_at_once():
    law = 10.0, -1.0, 10.0, 1.0, 0.0, 0.1
    assert limit_force(0.0, 0.0, *law) == pytest.approx(0.0)
    assert limit_force(0.5, 0.0, *law) == pytest.approx(-10.0 * 1.5 + 10.0 * 0.5)
