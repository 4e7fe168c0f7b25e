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


def test_a_used_name_is_no_reason_to_suggest_the_other_side() -> None:
    """The list has knee_angle_r, and another word that is similar to it."""
    names = ["knee_angle_l", "knee_angle_r", "knee_angle_r_beta"]
    assert find_nearest_name("knee_agle_r", names) == "knee_angle_r"
    assert find_nearest_name("knee_agle_r", names, ["knee_angle_r"]) == "knee_angle_r_beta"
    assert find_nearest_name("knee_agle_r", names, names[1:]) is None
    assert find_nearest_name("knee_agle", names, names[:1]) == "knee_angle_r"
