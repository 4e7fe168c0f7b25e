from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.mechanics.laws.elastic_foundation import (
    FoundationSpring,
    spring_in_half_space,
    spring_in_sphere,
    spring_load,
)
from osimlite.mechanics.laws.vectors import ZERO

MATERIAL = 100.0, 0.5, 0.8, 0.4, 0.1, 0.2


UP = 0.0, 1.0, 0.0


def test_nearest_points():
    depth, point = spring_in_half_space(UP, UP, (2.0, 0.7, 3.0))
    assert (depth, *point) == pytest.approx((0.3, 2.0, 1.0, 3.0))
    assert spring_in_half_space(UP, UP, (2.0, 1.7, 3.0))[0] == pytest.approx(-0.7)
    center = 1.0, 0.0, 0.0
    depth, point = spring_in_sphere(center, 2.0, (1.0, 0.5, 0.0))
    assert (depth, *point) == pytest.approx((1.5, 1.0, 2.0, 0.0))
    assert spring_in_sphere(center, 2.0, (1.0, 2.5, 0.0))[0] == pytest.approx(-0.5)
    # At the centre no direction to the surface is shortest.
    assert spring_in_sphere(center, 2.0, center)[0] == 0.0


def force(d, v, material=MATERIAL):
    """Return force and energy of a spring, with the origin as mesh centre and as reference point of torques."""
    pushed, torque, energy = spring_load(FoundationSpring(*material), ZERO, d, d, v, ZERO)
    assert torque == ZERO
    return pushed, energy


def test_force_by_hand():
    # 100 N/m, 0.1 m deep, approach at 0.2 m/s, slip at the transition velocity: mu = us + uv w.
    f, deep = 100.0 * 0.1 * (1.0 + 0.5 * 0.2), (0.0, 0.1, 0.0)
    slipping, energy = force(deep, (0.2, 0.2, 0.0))
    assert slipping == pytest.approx((f * (0.8 + 0.1 * 0.2), f, 0.0))
    assert energy == pytest.approx(0.5)
    assert force(deep, (0.0, 0.2, 0.0))[0] == pytest.approx((0.0, f, 0.0))
    # The spring neither pulls nor rubs when it separates quickly, nor without penetration.
    assert force(deep, (0.2, -2.0, 0.0)) == ((0.0, 0.0, 0.0), energy)
    assert force((0.0, 0.0, 0.0), (0.2, 2.0, 0.0)) == ((0.0, 0.0, 0.0), 0.0)


def test_without_a_transition_friction_is_dynamic():
    deep, slip = (0.0, 0.1, 0.0), (0.2, 0.2, 0.0)
    limit, _ = force(deep, slip, (*MATERIAL[:5], 1e-9))
    assert force(deep, slip, (*MATERIAL[:5], 0.0))[0] == pytest.approx(limit)


NUMBER = st.floats(-3.0, 3.0)
TRIPLE = st.tuples(NUMBER, NUMBER, NUMBER)


@given(TRIPLE, TRIPLE, TRIPLE, TRIPLE, TRIPLE)
def test_torque_and_motion_about_any_point(middle, end, about, velocity, spin):
    (rx, ry, rz), (wx, wy, wz) = [b - a for a, b in zip(about, end, strict=True)], spin
    there = [
        v + x
        for v, x in zip(
            velocity, (wy * rz - wz * ry, wz * rx - wx * rz, wx * ry - wy * rx), strict=True
        )
    ]
    (fx, fy, fz), torque, energy = spring_load(
        FoundationSpring(*MATERIAL), middle, end, about, velocity, spin
    )
    same, none, stored = spring_load(
        FoundationSpring(*MATERIAL), middle, end, end, tuple(there), spin
    )
    assert (fx, fy, fz, energy) == pytest.approx((*same, stored)) and none == ZERO
    assert torque == pytest.approx(
        [ry * fz - rz * fy, rz * fx - rx * fz, rx * fy - ry * fx], abs=1e-12
    )
