"""Tests of the built-in dynamic walker."""

from __future__ import annotations

import math

import pytest

from osimlite.io.document.printer import to_text
from osimlite.io.document.reader import read_text
from osimlite.models.dynamic_walker import dynamic_walker


def test_it_says_what_the_exercise_says() -> None:
    model = dynamic_walker()
    coordinates = [c for c in model.components() if type(c).__name__ == "Coordinate"]
    assert [(c.name, c.default_value) for c in coordinates] == [
        ("platform_rz", math.radians(-10)),
        ("Pelvis_rz", 0.0),
        ("Pelvis_tx", 0.0),
        ("Pelvis_ty", 0.835),
        ("RHip_rz", math.radians(30)),
        ("LHip_rz", math.radians(-10)),
        ("RKnee_rz", math.radians(-30)),
        ("LKnee_rz", math.radians(-30)),
    ]
    assert sum(body.mass for body in model.body_set.objects) == 6.0
    assert len(model.force_set.objects) == 10
    assert all(
        model.tree().resolve(use).target is not None for use in model.tree().uses() if use.value
    )


def test_it_is_written_and_read_back() -> None:
    text = to_text(dynamic_walker())
    model = read_text(text)
    assert to_text(model) == text
    assert all(
        model.tree().resolve(use).target is not None for use in model.tree().uses() if use.value
    )


@pytest.mark.parametrize(
    ("thigh", "shank", "width", "slope"), [(0.42, 0.4, 0.1, 3.0), (0.3, 0.5, 0.2, 0.0)]
)
def test_its_parameters_go_where_they_belong(
    thigh: float, shank: float, width: float, slope: float
) -> None:
    model = dynamic_walker(thigh_length=thigh, shank_length=shank, pelvis_width=width, slope=slope)
    at = {c.path: c for c in model.components()}
    assert at["/jointset/RightThighToPelvis/Pelvis_offset"].translation == (0.0, 0.0, width)
    assert at["/jointset/LeftThighToPelvis/Pelvis_offset"].translation == (0.0, 0.0, -width)
    assert at["/jointset/RightShankToThigh/RightThigh_offset"].translation == (0.0, -thigh / 2, 0.0)
    assert at["/jointset/RightShankToThigh/RightShank_offset"].translation == (0.0, shank / 2, 0.0)
    assert at["/contactgeometryset/LFootContact"].location == (0.0, -shank / 2, 0.0)
    assert at["/jointset/PelvisToPlatform/Pelvis_ty"].default_value == thigh + shank
    assert at["/jointset/PlatformToGround/platform_rz"].default_value == math.radians(-slope)
