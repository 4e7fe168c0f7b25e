from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from osimlite.mechanics.multibody.spatial import (
    angles_xyz,
    cross,
    invert_transform,
    make_offset,
    make_transform,
    quaternion_of,
    rotation_about,
    rotation_xyz,
    skew_matrix,
)
from tests.mechanics.multibody.independent.motion import RelativeMotion

vectors = st.tuples(*[st.floats(-3.0, 3.0)] * 3).map(np.array)
seeds = st.integers(0, 2**32 - 1)
AXES = np.eye(3)


@given(vectors, vectors)
def test_cross_and_skew_are_the_cross_product(a, b):
    assert cross(a, b) == pytest.approx(np.cross(a, b), abs=1e-15)
    assert skew_matrix(a) @ b == pytest.approx(np.cross(a, b), abs=1e-14)


@given(vectors)
def test_body_fixed_angles_are_three_turns_in_a_row(angles):
    turns = [rotation_about(axis, angle) for axis, angle in zip(AXES, angles, strict=True)]
    assert rotation_xyz(angles) == pytest.approx(turns[0] @ turns[1] @ turns[2], abs=1e-15)


@given(vectors, st.sampled_from([None, np.pi]))
def test_quaternions_turn_as_their_rotations(angles, third):
    if third is not None:
        # The scalar part of the quaternion is zero after half a turn.
        angles = np.array((0.0, 0.0, third))
    rotation = rotation_xyz(angles)
    w, *v = quaternion_of(rotation)
    about = skew_matrix(np.array(v))
    # Of two million random rotations, five differ by 9 units of 2^-53, which is just below 1e-15.
    assert np.eye(3) + 2.0 * about @ (w * np.eye(3) + about) == pytest.approx(rotation, abs=2e-15)
    assert quaternion_of(np.array([np.eye(3), rotation]))[1] == pytest.approx((w, *v), abs=0.0)


# Near a right angle, 1 - |sine| has few digits of the second angle, and rounding errors are large in
# the other two.
@example(np.array((2.14, 0.0, 2.8)), np.pi / 2 - 1.3e-7)
@example(np.array((0.3, 0.0, 0.25)), -1.5707963)
@example(np.array((0.3, 0.0, 0.25)), np.pi / 2 - 1e-12)
@example(np.array((0.3, 0.0, 0.25)), np.pi / 2 - 5e-16)
@given(vectors, st.sampled_from([None, -np.pi / 2, np.pi / 2]))
def test_angles_of_a_rotation_make_that_rotation(angles, second):
    if second is not None:
        angles[1] = second
    exact, other = rotation_xyz(angles), rotation_xyz(np.array((0.4, 0.5, 0.6)))
    for rotation in (exact, other.T @ (other @ exact)):  # without and with rounding errors
        result = angles_xyz(rotation)
        assert abs(result[1]) <= np.pi / 2
        assert rotation_xyz(result) == pytest.approx(rotation, abs=1e-14)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_angles_near_a_right_angle_are_those_of_opensim(sign):
    """OpenSim 4.6 returns these angles; from 4 machine epsilons to the right angle, it sets the third to zero."""
    for distance in (1e-6, 1.3e-7, 2.7e-8, 1e-12, 1e-15):
        angles = np.array((0.3, sign * (np.pi / 2 - distance), 0.25))
        assert angles_xyz(rotation_xyz(angles)) == pytest.approx(angles, abs=1e-15, rel=0.0)
    for distance in (0.0, 5e-16):
        angles = np.array((0.3, sign * (np.pi / 2 - distance), 0.25))
        expected = (0.3 + sign * 0.25, sign * (np.pi / 2 - distance), 0.0)
        assert angles_xyz(rotation_xyz(angles)) == pytest.approx(expected, abs=1e-15, rel=0.0)


def test_a_rotation_keeps_its_axis_and_turns_the_right_way():
    axis = np.array((1.0, 2.0, 2.0)) / 3.0
    turn = rotation_about(axis, 0.7)
    assert turn @ axis == pytest.approx(axis, abs=1e-15)
    assert turn @ turn.T == pytest.approx(np.eye(3), abs=1e-15)
    assert rotation_about(AXES[2], np.pi / 2) @ AXES[0] == pytest.approx(AXES[1], abs=1e-15)


@given(vectors, vectors)
def test_inverse_undoes_an_offset(translation, orientation):
    matrix = make_offset(translation, orientation)
    assert matrix[:3, 3] == pytest.approx(translation)
    assert invert_transform(matrix) @ matrix == pytest.approx(np.eye(4), abs=1e-14)
    assert make_transform() == pytest.approx(np.eye(4))


def _motion(seed):
    rng = np.random.default_rng(seed)
    block = rng.normal(size=(6, 5))
    return RelativeMotion(rotation_xyz(rng.uniform(-1, 1, 3)), rng.normal(size=3), block)


def _same(one, other):
    assert one.matrix == pytest.approx(other.matrix, abs=1e-12)
    assert one.block == pytest.approx(other.block, abs=1e-11)


@given(seeds, seeds, seeds)
def test_relative_motions_form_a_group(first, second, third):
    a, b, c = _motion(first), _motion(second), _motion(third)
    _same(a.then(b).then(c), a.then(b.then(c)))
    _same(a.inverse().inverse(), a)
    _same(a.then(b).inverse(), b.inverse().then(a.inverse()))
    _same(a.then(a.inverse()), RelativeMotion.fixed(np.eye(4), 3))
