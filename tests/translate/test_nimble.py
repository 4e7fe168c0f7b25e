"""Tests of Nimble's models rewritten for OpenSim: poses follow Nimble's formulas.

tests/oracle/test_nimble.py compares with Nimble itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.errors import UnsupportedError
from osimlite.mechanics.multibody.functions import SimmCubicSpline
from osimlite.translate.nimble import convert_from_nimble
from tests.cli.command import run

PLACES = ("rotation1", "rotation2", "rotation3", "translation1", "translation2", "translation3")
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
Axis = tuple[tuple[float, float, float], osimlite.Function, str]


def line(slope: float = 1.0, offset: float = 0.0) -> osimlite.LinearFunction:
    return osimlite.LinearFunction(coefficients=(slope, offset))


def constant(value: float = 0.0) -> osimlite.Constant:
    return osimlite.Constant(value=value)


def poly(*coefficients: float) -> osimlite.PolynomialFunction:
    return osimlite.PolynomialFunction(coefficients=coefficients)


def make_model(joint: osimlite.Joint) -> osimlite.Model:
    model = osimlite.Model(name="m")
    inertia = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
    body = model.add(osimlite.Body(name="b", mass=1.0, inertia=inertia))
    model.add(
        joint.between(
            model.ground,
            body,
            at=(0.1, 0.2, 0.3),
            turned=(0.4, -0.5, 0.6),
            child_at=(0.0, 0.1, 0.0),
        )
    )
    return model


def make_custom(axes: Sequence[Axis], names: Sequence[str]) -> osimlite.Model:
    transform = {
        place: osimlite.TransformAxis(
            name=place, axis=axis, function=function, coordinates=(name,) if name else ()
        )
        for place, (axis, function, name) in zip(PLACES, axes, strict=True)
    }
    return make_model(
        osimlite.CustomJoint(
            name="j",
            coordinates=[osimlite.Coordinate(name=name, range=(-2.0, 2.0)) for name in names],
            spatial_transform=osimlite.SpatialTransform(**transform),
        )
    )


def make_ellipsoid() -> osimlite.Model:
    names = ("scapula_abduction", "scapula_elevation", "scapula_upward_rot")
    coordinates = [osimlite.Coordinate(name=name) for name in names]
    return make_model(
        osimlite.EllipsoidJoint(name="j", coordinates=coordinates, radii_x_y_z=(0.07, -0.15, 0.09))
    )


ROTATIONS = (
    (Z, line(), "a"),
    (X, line(), "b"),
    (Y, line(), "c"),
)
NEUTRAL = ((X, constant(), ""), (Y, constant(), ""), (Z, constant(), ""))
CUSTOM: dict[str, tuple[Sequence[Axis], str, Sequence[Axis] | None]] = {
    # axes of the file; coordinates; axes that describe Nimble's motion, None if it is OpenSim's
    "offset of one rotation": (
        (
            (Z, line(1.0, 0.3), "a"),
            (X, constant(0.4), ""),
            (Y, constant(), ""),
            (X, constant(), ""),
            (Y, constant(0.2), ""),
            (Z, constant(), ""),
        ),
        "a",
        ((Z, line(), "a"), *NEUTRAL[:2], *NEUTRAL),
    ),
    "slope of one translation": (
        (*NEUTRAL, (X, constant(), ""), (Y, line(0.5, 0.1), "a"), (Z, constant(), "")),
        "a",
        (*NEUTRAL, NEUTRAL[0], (Y, line(), "a"), NEUTRAL[2]),
    ),
    "slopes of two rotations": (
        (
            (Z, constant(0.1), ""),
            (X, line(2.0), "a"),
            (Y, line(-1.0, 0.2), "b"),
            NEUTRAL[0],
            (Y, constant(0.2), ""),
            NEUTRAL[2],
        ),
        "ab",
        ((Z, constant(), ""), (X, line(), "a"), (Y, line(-1.0), "b"), *NEUTRAL),
    ),
    "translations beside three rotations": (
        (*ROTATIONS, (X, line(), "a"), (Y, constant(0.2), ""), NEUTRAL[2]),
        "abc",
        (*ROTATIONS, *NEUTRAL),
    ),
    "names in another order": (
        ((Z, line(), "b"), (X, line(), "a"), (Y, line(), "c"), *NEUTRAL),
        "abc",
        (*ROTATIONS, *NEUTRAL),
    ),
    "flipped translations of a free joint": (
        (
            *ROTATIONS,
            ((-1.0, 0.0, 0.0), line(), "d"),
            (Y, line(2.0), "e"),
            (Z, line(1.0, 0.3), "f"),
        ),
        "abcdef",
        (*ROTATIONS, (X, line(), "d"), (Y, line(), "e"), (Z, line(), "f")),
    ),
    "negative translation beside a curve": (
        (
            (X, line(), "a"),
            NEUTRAL[1],
            NEUTRAL[2],
            ((-1.0, 0.0, 0.0), poly(1.0, 0.2), "a"),
            (Y, constant(0.1), ""),
            NEUTRAL[2],
        ),
        "a",
        ((X, line(), "a"), NEUTRAL[1], NEUTRAL[2], NEUTRAL[0], (Y, constant(0.1), ""), NEUTRAL[2]),
    ),
    "offset with a negative slope beside a curve": (
        ((X, line(-1.0, 0.1), "a"), (Y, poly(1.0, 0.2), "a"), NEUTRAL[2], *NEUTRAL),
        "a",
        ((X, line(-1.0, -0.1), "a"), (Y, poly(1.0, 0.2), "a"), NEUTRAL[2], *NEUTRAL),
    ),
    "slopes and offsets beside a curve": (
        (
            (X, poly(1.0, 0.0), "a"),
            (Y, line(2.0, 0.1), "b"),
            (Z, constant(0.2), ""),
            (X, constant(0.3), ""),
            NEUTRAL[1],
            NEUTRAL[2],
        ),
        "ab",
        None,
    ),
    "negative slope": (
        (((0.6, 0.8, 0.0), line(-1.0), "a"), NEUTRAL[1], NEUTRAL[2], *NEUTRAL),
        "a",
        None,
    ),
    "translations in another order": (
        (
            (X, line(), "a"),
            (Y, poly(1.0, 0.2), "a"),
            NEUTRAL[2],
            (Y, line(2.0), "a"),
            (X, constant(0.1), ""),
            NEUTRAL[2],
        ),
        "a",
        None,
    ),
}


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
