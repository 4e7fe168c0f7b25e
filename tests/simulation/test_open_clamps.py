"""Tests of initial states that OpenSim 4.6 accepts beyond a clamp or at a right angle; its values were measured."""

from __future__ import annotations

from math import pi

import pytest

import osimlite
from osimlite.io.document.reader import read_text
from tests.lint.verdict_cases import CASES


def test_a_clamped_coordinate_that_a_constraint_carries_beyond_its_range_moves_as_in_opensim(
    shared,
):
    model = osimlite.read(
        shared / "cases" / "model-21-clamped-refusal" / "c08c_coupler_beyond_clamp.osim"
    )
    trajectory = osimlite.simulate(model, to=0.05, engine="compiled")
    assert trajectory.values[-1].tolist() == pytest.approx([0.28254625717212184, 3.0], abs=1e-9)


def test_a_prescribed_coordinate_follows_its_function_beyond_a_clamp(shared):
    model = osimlite.read(
        shared / "cases" / "model-21-clamped-refusal" / "d03e_prescribed_beyond_clamp.osim"
    )
    assert osimlite.simulate(model, to=0.05, engine="compiled").values[-1].tolist() == [5.0]


def test_clamps_still_hold_where_another_pose_meets_the_constraints():
    text = next(case for case in CASES if case.name == "a coupler beyond a clamp").text
    model = read_text(text.replace("<locked>true</locked>", ""))
    q, _ = osimlite.mechanism(model).default_state()
    assert q.max() <= 2.0 + 1e-9


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_ball_joint_starts_beside_a_right_angle(sign):
    name = "a ball at 90 degrees" if sign > 0.0 else "a ball at -90 degrees"
    model = read_text(next(case for case in CASES if case.name == name).text)
    mechanism = osimlite.mechanism(model)
    q, _ = mechanism.default_state()
    index = mechanism.coordinate_index("y")
    assert abs(q[index] - sign * 0.5 * pi) <= 1.1e-6
    assert mechanism.rate_matrix(q).shape == (5, 5)
    trajectory = osimlite.simulate(model, to=0.01, engine="compiled")
    assert abs(trajectory.values[-1][index] - sign * 0.5 * pi) < 1e-5
