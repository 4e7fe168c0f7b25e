"""Check axes of a CustomJoint whose function or direction is missing in the file."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite import Body, Coordinate, Model
from osimlite.mechanics.multibody import build_mechanism
from osimlite.schema.custom_joint import CustomJoint
from osimlite.schema.functions import LinearFunction


def knuckle() -> str:
    """Return the text of a model whose body rotates about X and Y by two coordinates."""
    model = Model(name="m")
    body = model.add(
        Body(name="a", mass=1.0, mass_center=(0.1, 0.0, 0.0), inertia=(1, 1, 1, 0, 0, 0))
    )
    joint = CustomJoint(name="j", coordinates=[Coordinate(name="x"), Coordinate(name="y")])
    transform = joint.spatial_transform
    for axis, name in ((transform.rotation1, "x"), (transform.rotation2, "y")):
        axis.coordinates, axis.function = (name,), LinearFunction(coefficients=(1.0, 0.0))
    model.add(joint.between(model.ground, body))
    return osimlite.to_text(model)


def without_function(instead: str, version: str) -> str:
    text = knuckle()
    start = text.index('<TransformAxis name="rotation2">')
    rest = re.sub(
        r"<LinearFunction.*?</LinearFunction>", instead, text[start:], count=1, flags=re.S
    )
    return (text[:start] + rest).replace('Version="40600"', f'Version="{version}"')


def first_axis(text: str, y: float):
    (placed,) = build_mechanism(osimlite.read_text(text)).body_transforms({"y": y}).values()
    return placed[:3, 0]


def test_axes_that_no_one_set_are_printed_where_the_class_has_another():
    """OpenSim uses X for every axis that is missing in a file, so the default axes must be printed."""
    text = knuckle()
    assert "<axis>0 1 0</axis>" in text
    assert first_axis(text, 0.3) == pytest.approx((np.cos(0.3), 0.0, -np.sin(0.3)))


@pytest.mark.parametrize("version", ["40600", "40000", "30516"])
@pytest.mark.parametrize("instead", ["<function></function>", "<function />", ""])
def test_an_empty_function_follows_its_coordinate_and_a_missing_one_does_not(
    instead: str, version: str
):
    text = without_function(instead, version)
    moved = (np.cos(0.3), 0.0, -np.sin(0.3)) if instead else (1.0, 0.0, 0.0)
    assert first_axis(text, 0.3) == pytest.approx(moved)
    # The printed text must have an explicit function, which every reader interprets equally.
    again = osimlite.to_text(osimlite.read_text(text))
    assert first_axis(again, 0.3) == pytest.approx(moved)
    assert ("LinearFunction" in again[again.index('name="rotation2"') :]) == bool(instead)


@pytest.mark.oracle
@pytest.mark.parametrize("instead", ["<function></function>", ""])
def test_opensim_agrees(instead: str, tmp_path: Path):
    opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
    opensim.Logger.setLevelString("off")
    for version in ("40600", "30516"):
        text = without_function(instead, version)
        path = tmp_path / "m.osim"
        path.write_text(text)
        model = opensim.Model(str(path))
        state = model.initSystem()
        model.getCoordinateSet().get("y").setValue(state, 0.3, False)
        model.realizePosition(state)
        rotation = model.getBodySet().get(0).getTransformInGround(state).R()
        assert [rotation.get(row, 0) for row in range(3)] == pytest.approx(
            first_axis(text, 0.3).tolist(), abs=1e-12
        )
