"""Tests of Nimble's models rewritten for OpenSim: poses follow Nimble's formulas.

tests/oracle/test_nimble.py compares with Nimble itself.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.errors import UnsupportedError
from osimlite.mechanics.multibody.functions import SimmCubicSpline
from osimlite.translate.nimble import convert_from_nimble
from tests.cli.command import run
from tests.translate.nimble_models import (
    CUSTOM,
    NEUTRAL,
    ROTATIONS,
    X,
    Y,
    Z,
    line,
    make_custom,
    make_ellipsoid,
    make_model,
)


def find_poses(model: osimlite.Model, states: np.ndarray) -> np.ndarray:
    mechanism = osimlite.mechanism(model)
    (name,) = [name for name in mechanism.body_transforms({}) if name.endswith("b")]
    names = [coordinate.name for coordinate in model.components(osimlite.Coordinate)]
    order = sorted(names)
    return np.array(
        [mechanism.body_transforms(dict(zip(order, state, strict=True)))[name] for state in states]
    )


@pytest.mark.parametrize("case", CUSTOM)
def test_a_custom_joint_moves_as_nimbles(case: str) -> None:
    axes, names, expected = CUSTOM[case]
    states = np.random.default_rng(1).uniform(-1.0, 1.0, (20, len(names)))
    model = make_custom(axes, names)
    before = find_poses(model, states)
    changes = convert_from_nimble(model)
    after = find_poses(model, states)
    if expected is None:
        assert not changes
        np.testing.assert_array_equal(after, before)
        return
    assert [change.component for change in changes] == ["/jointset/j"]
    np.testing.assert_allclose(after, find_poses(make_custom(expected, names), states), atol=1e-15)
    assert np.abs(after - before).max() > 0.01


def rotate(axis: int, angle: float) -> np.ndarray:
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    result = np.eye(3)
    result[i, i] = result[j, j] = np.cos(angle)
    result[j, i], result[i, j] = np.sin(angle), -np.sin(angle)
    return result


def test_an_ellipsoid_joint_moves_as_nimbles() -> None:
    model = make_ellipsoid()
    radii = np.array(model["/jointset/j"].radii_x_y_z)
    (change,) = convert_from_nimble(model)
    assert "90 degrees about Z" in change.done
    # A converted model is not rotated a second time.
    assert not convert_from_nimble(model)
    mechanism = osimlite.mechanism(osimlite.read_text(osimlite.to_text(model)))
    base = np.eye(4)
    base[:3, :3] = rotate(0, 0.4) @ rotate(1, -0.5) @ rotate(2, 0.6)
    base[:3, 3] = 0.1, 0.2, 0.3
    names = ("scapula_abduction", "scapula_elevation", "scapula_upward_rot")
    for state in np.random.default_rng(2).uniform(-1.5, 1.5, (20, 3)):
        a, b, c = state
        joint = np.eye(4)
        joint[:3, :3] = rotate(1, a) @ rotate(0, -b) @ rotate(2, c)
        joint[:3, 3] = radii * joint[:3, 2]
        back = np.eye(4)
        back[:3, 3] = 0.0, -0.1, 0.0
        poses = mechanism.body_transforms(dict(zip(names, state, strict=True)))
        (pose,) = [pose for name, pose in poses.items() if name.endswith("b")]
        np.testing.assert_allclose(pose, base @ joint @ back, atol=1e-15)


def test_a_spline_continues_as_a_cubic_over_the_range() -> None:
    x, y = (0.0, 0.3, 0.7, 1.0), (0.0, 0.2, 0.1, 0.4)
    spline = osimlite.SimmSpline(x=x, y=y)
    model = make_custom(((X, spline, "a"), NEUTRAL[1], NEUTRAL[2], *NEUTRAL), "a")
    (change,) = convert_from_nimble(model)
    extended = model["/jointset/j"].spatial_transform.rotation1.function
    assert "extended to the range" in change.done and len(extended.x) == 10
    assert extended.x[0] < -2.0 and extended.x[-1] > 2.0
    before, after = SimmCubicSpline(x, y), SimmCubicSpline(extended.x, extended.y)

    def value(function: SimmCubicSpline, argument: float) -> float:
        return float(function.evaluate(np.array([argument]))[0])

    for argument in np.linspace(0.0, 1.0, 30):
        assert value(after, argument) == pytest.approx(value(before, argument), abs=1e-13)
    # Third differences of a cubic are constant.
    for start, inner in ((1.0, 0.7), (0.0, 0.0)):
        step = 0.075 if start else -0.075
        values = [value(after, start + k * step) for k in range(8)]
        thirds = np.diff(values, 3)
        inside = np.diff([value(before, inner + k * 0.075) for k in range(5 if start else 4)], 3)
        np.testing.assert_allclose(thirds, np.sign(step) * inside[0], atol=1e-12)


def test_couplers_and_prescribed_motions_are_turned_off() -> None:
    model = make_custom((*ROTATIONS, *NEUTRAL), "abc")
    model.add(
        osimlite.CoordinateCouplerConstraint(
            name="k",
            coupled_coordinates_function=line(),
            independent_coordinate_names=("a",),
            dependent_coordinate_name="b",
        )
    )
    model["/jointset/j/c"].prescribed = True
    changes = convert_from_nimble(model)
    assert [change.component for change in changes] == ["/constraintset/k", "/jointset/j/c"]
    assert not model["/constraintset/k"].isEnforced and not model["/jointset/j/c"].prescribed


@pytest.mark.parametrize(
    ("joint", "message"),
    [
        (osimlite.BallJoint(name="j"), "Nimble cannot read a BallJoint"),
        (osimlite.SliderJoint(name="j"), "Nimble cannot read a SliderJoint"),
    ],
)
def test_joints_that_nimble_cannot_read(joint: osimlite.Joint, message: str) -> None:
    with pytest.raises(UnsupportedError, match=message):
        convert_from_nimble(make_model(joint))


def test_axes_that_nimble_cannot_read() -> None:
    skew = ((0.6, 0.8, 0.0), line(), "b")
    for axes in (
        (ROTATIONS[0], skew, ROTATIONS[2]),
        ((Y, line(), "a"), (Z, line(), "b"), (X, line(), "c")),
    ):
        with pytest.raises(UnsupportedError, match="rotation axes"):
            convert_from_nimble(make_custom((*axes, *NEUTRAL), "abc"))


def test_the_command_writes_the_model_and_names_the_changes(tmp_path: Path) -> None:
    osimlite.write(make_ellipsoid(), tmp_path / "it.osim")
    code, out, _ = run("modify", "it.osim", "--from", "nimble", "-o", "new.osim", folder=tmp_path)
    assert code == 0 and "/jointset/j: Nimble rotates an EllipsoidJoint" in out
    found = run("validate", "new.osim", "--select", "OSIM417", folder=tmp_path)
    assert found.code == 0 and "No findings" in found.out
    assert "OSIM417" in run("validate", "it.osim", "--select", "OSIM417", folder=tmp_path).out
    code, out, _ = run("modify", "new.osim", "--from", "simm", folder=tmp_path)
    assert code == 2
