"""Tests of the curves of Millard's muscles against OpenSim's values, slopes and integrals."""

from __future__ import annotations

import gzip
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.base.load import make_module_name
from osimlite.mechanics.laws import muscle_curves
from osimlite.mechanics.laws.bezier import LAST, curve_integral, curve_value

MORE = {
    "force_velocity_inverse": lambda *numbers: muscle_curves.force_velocity(*numbers, inverse=True)
}


def curves(fixtures):
    for result in json.loads(
        gzip.decompress((fixtures / "muscles" / "curves.json.gz").read_bytes())
    ):
        if result["curve"].endswith("Curve"):
            name = make_module_name(result["curve"].removesuffix("Curve"))
            make = MORE.get(name) or getattr(muscle_curves, name)
            yield (
                result,
                make(*[value for key, value in result["params"].items() if key != "fitted"]),
            )


def test_values_slopes_and_integrals(fixtures):
    for result, numbers in curves(fixtures):
        whole = curve_integral(numbers, numbers[LAST])
        for index, x in enumerate(result["x"]):
            y, slope = curve_value(numbers, x)
            assert y == pytest.approx(result["y"][index], rel=1e-12, abs=1e-13)
            if result["dy"]:
                assert slope == pytest.approx(result["dy"][index], rel=1e-11, abs=1e-11)
            if result["integral"]:
                # OpenSim's integral is a spline, least accurate near the ends; for compression it
                # starts at the other end.
                own = curve_integral(numbers, x)
                own = whole - own if "Compressive" in result["curve"] else own
                assert own == pytest.approx(result["integral"][index], abs=2e-5)


share = st.floats(0.0, 1.0)


@given(share, share, share, share, share)
def test_the_inverse_is_one(near, more, isometric, one, other):
    """The inverse curve undoes the curve, as precisely as its slope permits."""
    numbers = (
        0.1 + 0.4 * near,
        0.11 + 0.8 * more,
        1.5 + 8.0 * isometric,
        0.05,
        0.2,
        1.5,
        one,
        other,
    )
    numbers = (0.5 * numbers[1], *numbers[1:])
    there, back = (
        muscle_curves.force_velocity(*numbers, inverse=inverse) for inverse in (False, True)
    )
    for k in range(-13, 14):
        factor, slope = curve_value(there, 0.1 * k)
        velocity, inverse_slope = curve_value(back, factor)
        assert velocity == pytest.approx(0.1 * k, abs=1e-13 + 1e-14 / slope)
        assert slope * inverse_slope == pytest.approx(1.0, rel=1e-8)


@given(share, share, st.floats(0.9, 2.0))
def test_the_integral_has_the_curve_as_its_slope(low, curviness, x):
    numbers = muscle_curves.fiber_force_length(0.0, 0.6, 0.1 + 1.4 * low, 4.0, curviness)
    h = 1e-4
    rise = (curve_integral(numbers, x + h) - curve_integral(numbers, x - h)) / (2.0 * h)
    assert rise == pytest.approx(curve_value(numbers, x)[0], abs=1e-5)
    assert curve_integral(numbers, 1.0) == 0.0


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: muscle_curves.active_force_length(0.5, 0.4, 1.8, 0.8, 0.0), "do not rise"),
        (
            lambda: muscle_curves.active_force_length(0.4, 0.7, 1.8, 4.0, 0.0),
            "shallow_ascending_slope",
        ),
        (
            lambda: muscle_curves.force_velocity(0.0, 0.2, 5.0, 0.0, 0.5, 1.4, 0.6, 0.9),
            "eccentric_slope_near_vmax",
        ),
        (
            lambda: muscle_curves.force_velocity(0.0, 0.2, 5.0, 0.0, 0.1, 1.4, 0.6, 1.1),
            "curviness is not from 0 to 1",
        ),
        (
            lambda: muscle_curves.fiber_force_length(0.0, 0.6, 0.2, 1.0, 0.5),
            "stiffness_at_one_norm_force",
        ),
        (
            lambda: muscle_curves.fiber_force_length(0.0, 0.6, 0.2),
            "stiffness_at_low_force and the optional properties",
        ),
        (lambda: muscle_curves.tendon_force_length(0.05, 40.0, 1.0, 0.5), "norm_force_at_toe_end"),
        (
            lambda: muscle_curves.fiber_compressive_force_length(0.5, -1.0, 0.5),
            "stiffness_at_zero_length",
        ),
        (
            lambda: muscle_curves.fiber_compressive_force_cos_pennation(95.0),
            "engagement_angle_in_degrees",
        ),
    ],
)
def test_what_makes_no_curve(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_slopes_that_meet_beside_their_section_make_no_curve() -> None:
    # OpenSim 4.6 refuses this curve: x decreases at first, so that it cannot be inverted.
    with pytest.raises(ValueError, match="do not intersect between"):
        muscle_curves.active_force_length(
            0.7128559333577094, 0.9806258776360097, 4.995436, 2.3516971896065857, 0.0
        )
