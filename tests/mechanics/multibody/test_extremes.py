"""Tests of extreme numbers and wrong words in models: a result or a one-line error, but no traceback or warning."""

from __future__ import annotations

import os
import random
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.errors import ModelError, OsimliteError
from osimlite.mechanics.multibody.extremes import any_numbers, find_extreme_number
from osimlite.mechanics.multibody.functions import PiecewiseLinear, SimmCubicSpline
from osimlite.schema.custom_joint import CustomJoint
from osimlite.schema.frames import StationDefinedFrame
from osimlite.schema.function_types import PolynomialFunction
from osimlite.schema.functions import LinearFunction
from osimlite.schema.joint_types import EllipsoidJoint
from osimlite.schema.joints import PinJoint
from osimlite.schema.model import Model
from osimlite.schema.splines import SimmSpline as Spline
from tests.suite import choose

EXTREMES = ("nan", "inf", "-inf", "1e308", "-1e308", "1e-320", "0", "-1", "1e30")
WORDS = ("", "x" * 5000, "X", "-", "+", "xyz", "ground", "/", "unassigned", "ALL", "\u00e9")
WANTED = int(os.environ.get("OSIMLITE_EDITS", choose("15", "40")))
ROOT = Path(__file__).resolve().parents[3]
MODELS = (
    "lint/skeleton.osim",
    "lint/limb.osim",
    "lint/OSIM414/pass-example.osim",
    "walker/DynamicWalkerModel.osim",
)


def one_body(joint: type) -> Model:
    model = Model(name="m")
    body = model.add(osimlite.Body(name="b", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    names = [f"q{number}" for number in range(3 if joint is EllipsoidJoint else 1)]
    made = joint(name="j", coordinates=[osimlite.Coordinate(name=name) for name in names])
    model.add(made.between(model.ground, body))
    return model


def used(model: Model) -> None:
    """Apply everything that computes without a compiler to a model."""
    with np.errstate(over="warn", divide="warn", invalid="warn"):
        osimlite.validate(model, ignore="OSIM63")
        for use in (_mechanism, osimlite.to_urdf, osimlite.to_mjcf):
            try:
                use(model)
            except OsimliteError as error:
                assert "\n" not in str(error)


def _mechanism(model: Model) -> None:
    mechanism = osimlite.mechanism(model)
    q, u = mechanism.default_state()
    for compute in (
        lambda: mechanism.acceleration(q, u),
        lambda: mechanism.project_speeds(mechanism.assemble(q), u),
        lambda: mechanism.body_accelerations(q, u, u),
        lambda: mechanism.station_positions(q),
        lambda: mechanism.inverse_dynamics(q, u, u),
        lambda: mechanism.kinetic_energy(q, u) + mechanism.potential_energy(q),
    ):
        try:
            compute()
        except OsimliteError as error:
            assert "\n" not in str(error)


def changed(text: str, draw: random.Random) -> Iterator[tuple[str, str]]:
    """Yield variants of a text with one extreme number or one wrong word.

    Args:
        text: text of the model.
        draw: source of random numbers.

    Yields:
        The changed text, and a description of the change.
    """
    from tests.oracle.structural_edits import Text

    whole = Text(text)
    while True:
        element = draw.choice(whole.leaves[draw.choice(sorted(whole.leaves))])
        held = whole.inside(element).split()
        try:
            [float(word) for word in held]
        except ValueError:
            held = [draw.choice(WORDS)]
        else:
            some = [draw.randrange(len(held))] if draw.random() < 0.7 else [*range(len(held))]
            value = draw.choice(EXTREMES)
            held = [value if index in some else word for index, word in enumerate(held)]
        new = " ".join(held)
        yield f"{whole.path(element)}: {new[:60]}", whole.put((element.head, element.tail, new))


@pytest.mark.parametrize("file", MODELS)
def test_nothing_fails_of_what_a_property_holds(file: str) -> None:
    edits = changed(
        (ROOT / "fixtures" / file).read_text(),
        random.Random(f"{file} {os.environ.get('OSIMLITE_SEED', '1')}"),
    )
    for _ in range(WANTED // len(MODELS)):
        what, text = next(edits)
        try:
            model = osimlite.read_text(text)
        except OsimliteError:
            continue
        try:
            used(model)
        except Exception as error:
            raise AssertionError(what) from error


@pytest.mark.parametrize(
    "coefficients", [(1e-320, 1.0, 0.0), (1e308, 1e308, 0.0), (-1e308, 5.0, 1.0, 1e-320)]
)
def test_polynomials_of_joints(coefficients: tuple[float, ...]) -> None:
    model = one_body(CustomJoint)
    joint = model.joint_set.objects[0]
    assert isinstance(joint, CustomJoint)
    joint.SpatialTransform.rotation1.coordinates = ("q0",)
    joint.SpatialTransform.rotation1.function = PolynomialFunction(coefficients=coefficients)
    joint.coordinates[0].default_value = 3.0
    used(model)


@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan, -1e308])
def test_splines_far_outside(value: float) -> None:
    model = one_body(CustomJoint)
    joint = model.joint_set.objects[0]
    assert isinstance(joint, CustomJoint)
    joint.SpatialTransform.rotation1.coordinates = ("q0",)
    joint.SpatialTransform.rotation1.function = Spline(
        x=(0.0, 1.0, 2.0, 3.0), y=(0.0, value, 2.0, 3.0)
    )
    used(model)
    joint.SpatialTransform.rotation1.function = Spline(
        x=(0.0, 1.0, 2.0, 3.0), y=(0.0, 1.0, 0.0, 3.0)
    )
    joint.coordinates[0].default_value = value
    used(model)
    if not np.isfinite(value):
        for function in (
            SimmCubicSpline((0, 1, 2), (0, 1, 0)),
            PiecewiseLinear((0.0, 1.0), (0.0, 1.0)),
        ):
            assert np.isnan(function.derivatives(value)).all()


def test_an_ellipsoid_of_any_size() -> None:
    model = one_body(EllipsoidJoint)
    for size in (1e30, 1e308, 1e-320, np.inf, np.nan):
        model.joint_set.objects[0].radii_x_y_z = (size, 1.0, 1.0)
        used(model)


def test_the_most_extreme_number_is_named() -> None:
    model = one_body(PinJoint)
    assert find_extreme_number(model) == ""
    model.body_set.objects[0].mass = 1e30
    model.joint_set.objects[0].coordinates[0].prescribed_function = LinearFunction(
        coefficients=(1e-300, 0.0)
    )
    assert find_extreme_number(model) == "prescribed_function of '/jointset/j/q0', 1e-300,"
    model.body_set.objects[0].mass = np.nan
    assert find_extreme_number(model) == "mass of '/bodyset/b', nan,"

    @any_numbers
    def fails(of: Model, fault: Exception) -> None:
        raise fault

    for fault in (
        np.linalg.LinAlgError("no"),
        OverflowError("no"),
        ValueError("math domain error"),
    ):
        with pytest.raises(
            ModelError, match="mass of '/bodyset/b', nan, is too large or too small to compute with"
        ):
            fails(model, fault)
    with pytest.raises(ValueError, match=r"^another$"):
        fails(model, ValueError("another"))


@pytest.mark.parametrize(
    ("ab", "across", "axes"),
    [
        ("+x", "+y", "xy"),
        ("", "", "xy"),
        ("none", "Y", "xy"),
        ("zyx", "", "zx"),
        ("y", "q", "yz"),
        ("+", "-", "xy"),
    ],
)
def test_words_for_axes_are_read_by_their_first_letter(ab: str, across: str, axes: str) -> None:
    model = Model(name="m")
    points = dict(zip("abcd", ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 0)), strict=True))
    for name, place in points.items():
        model.add(osimlite.Station(name=name, socket_parent_frame="/ground", location=place))
    frame = StationDefinedFrame(name="f", ab_axis=ab, ab_x_ac_axis=across)
    for name in ("point_a", "point_b", "point_c", "origin_point"):
        setattr(
            frame, f"socket_{name}", f"/componentset/{name[-1] if name != 'origin_point' else 'd'}"
        )
    model.add(frame)
    rotation = osimlite.mechanism(model).frames["/componentset/f"].transform[:3, :3]
    # From a to b is ground's x axis, and from all three points follows the z axis.
    assert rotation["xyz".index("x"), "xyz".index(axes[0])] == pytest.approx(1.0)
    assert rotation["xyz".index("z"), "xyz".index(axes[1])] == pytest.approx(1.0)
