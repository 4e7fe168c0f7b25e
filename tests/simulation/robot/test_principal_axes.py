from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from osimlite.mechanics.multibody.spatial import rotation_xyz
from osimlite.simulation.robot.robot import breaks_triangle_rule, principal_axes
from osimlite.simulation.robot.urdf import roll_pitch_yaw

sizes = st.floats(1e-6, 1e3)
angles = st.one_of(st.floats(-4.0, 4.0), st.sampled_from([0.0, np.pi / 2, -np.pi / 2, np.pi]))


@given(st.tuples(sizes, sizes, sizes), st.tuples(angles, angles, angles))
def test_axes_and_moments_give_the_tensor_back(moments, turn):
    rotation = rotation_xyz(np.array(turn))
    inertia = rotation @ np.diag(moments) @ rotation.T
    inertia = (inertia + inertia.T) / 2.0
    result, axes = principal_axes(inertia)
    scale = max(moments)
    assert np.abs(axes @ np.diag(result) @ axes.T - inertia).max() < 1e-14 * scale
    assert np.abs(axes @ axes.T - np.eye(3)).max() < 1e-14 and np.linalg.det(axes) > 0.0
    assert np.abs(np.sort(result) - np.sort(moments)).max() < 1e-14 * scale


@given(st.tuples(sizes, sizes, sizes))
def test_a_diagonal_tensor_keeps_its_axes(moments):
    result, axes = principal_axes(np.diag(moments))
    assert (result == np.array(moments)).all() and (axes == np.eye(3)).all()


def test_axes_turn_as_little_as_they_can():
    rotation = rotation_xyz(np.array((0.05, -0.03, 0.02)))
    _, axes = principal_axes(rotation @ np.diag((3.0, 1.0, 2.0)) @ rotation.T)
    assert np.abs(axes - rotation).max() < 1e-12


@given(st.tuples(angles, angles, angles))
def test_roll_pitch_yaw_gives_the_rotation_back(turn):
    rotation = rotation_xyz(np.array(turn))
    roll, pitch, yaw = roll_pitch_yaw(rotation)
    (sr, sp, sy), (cr, cp, cy) = np.sin((roll, pitch, yaw)), np.cos((roll, pitch, yaw))
    z = np.array(((cy, -sy, 0), (sy, cy, 0), (0, 0, 1)))
    y = np.array(((cp, 0, sp), (0, 1, 0), (-sp, 0, cp)))
    x = np.array(((1, 0, 0), (0, cr, -sr), (0, sr, cr)))
    assert np.abs(z @ y @ x - rotation).max() < 1e-15 * 4


def test_the_triangle_rule():
    assert breaks_triangle_rule(np.array((1.0, 1.0, 2.1)))
    assert breaks_triangle_rule(np.array((-0.1, 1.0, 1.0)))
    assert not breaks_triangle_rule(np.array((0.1, 0.2, 0.1 + 0.2)))
    assert not breaks_triangle_rule(np.zeros(3))
