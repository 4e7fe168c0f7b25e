"""Tests of the names that findings suggest."""

from __future__ import annotations

import pytest

from osimlite.lint.words import find_nearest_name

FLEXIONS = ["/jointset/knee_l/flexion", "/jointset/knee_r/flexion"]


@pytest.mark.parametrize(
    ("text", "valid_texts", "nearest"),
    [
        # The last names are equal, and the rest of the path states the side.
        ("/r/flexion", FLEXIONS, FLEXIONS[1]),
        ("/jointset/walker_knee_r/flxion", FLEXIONS, FLEXIONS[1]),
        # The last name lost its side, which the path still states.
        ("/f/tfl_r/tflP4", ["/f/tfl_l/tfl_l-P4", "/f/tfl_r/tfl_r-P4"], "/f/tfl_r/tfl_r-P4"),
        ("/bodyset/femr_l", ["/bodyset/femur_r", "/bodyset/femur_l"], "/bodyset/femur_l"),
        ("/bodyset/femur_l", ["/bodyset/femur_r", "/bodyset/tibia_l"], "/bodyset/femur_r"),
        ("mass", FLEXIONS, None),
    ],
)
def test_the_nearest_path_is_on_the_same_side(
    text: str, valid_texts: list[str], nearest: str | None
) -> None:
    assert find_nearest_name(text, valid_texts) == nearest
