"""Tests of functions with unusual numbers: values equal those that OpenSim 4.6 computes (measured)."""

from __future__ import annotations

import pytest

from osimlite.errors import ModelError
from osimlite.mechanics.multibody.schema_functions import convert_function
from osimlite.schema.function_types import PolynomialFunction, StepFunction
from osimlite.schema.functions import LinearFunction
from osimlite.schema.splines import (
    GCVSpline,
    PiecewiseConstantFunction,
    PiecewiseLinearFunction,
    SimmSpline,
)

PLACES = (-1.0, 0.0, 0.3, 0.5, 1.0, 2.0, 5.0)

MEASURED = [
    (PiecewiseLinearFunction(x=(0.2,), y=(7.0,)), (7.0,) * 7),
    (PiecewiseConstantFunction(x=(0.2,), y=(7.0,)), (7.0,) * 7),
    (
        PiecewiseLinearFunction(x=(0.0, 1.0, 1.0, 2.0), y=(0.0, 1.0, 3.0, 4.0)),
        (-1.0, 0.0, 0.3, 0.5, 3.0, 4.0, 7.0),
    ),
    (
        PiecewiseLinearFunction(x=(0.0, 1.0, 2.0), y=(0.0, 1.0, 3.0, 4.0)),
        (-1.0, 0.0, 0.3, 0.5, 1.0, 3.0, 9.0),
    ),
    (
        SimmSpline(x=(0.0, 1.0, 2.0), y=(0.0, 1.0, 3.0, 4.0)),
        (-0.5, 0.0, 0.195, 0.375, 1.0, 3.0, 10.5),
    ),
    (
        GCVSpline(half_order=2, x=(0, 1, 2, 3, 4, 5), y=(0, 1, 3, 4, 5, 6, 7, 8)),
        (-0.660287, 0.0, 0.207258, 0.372608, 1.0, 3.0, 6.0),
    ),
    (
        GCVSpline(half_order=5, x=tuple(range(11)), y=(0, 1, 3, 4, 5, 6, 7, 8, 8, 9, 9)),
        (8.028064, 0.0, -0.156307, 0.026269, 1.0, 3.0, 6.0),
    ),
    (
        StepFunction(
            transition_start_time=1.0, transition_end_time=0.0, start_value=1.0, end_value=2.0
        ),
        (2.0, 2.0, 1.83692, 1.5, 1.0, 1.0, 1.0),
    ),
    (LinearFunction(coefficients=(1.0, 5.0, 7.0)), (4.0, 5.0, 5.3, 5.5, 6.0, 7.0, 10.0)),
    (PolynomialFunction(), (1.0,) * 7),
]


@pytest.mark.parametrize(("function", "values"), MEASURED, ids=lambda item: type(item).__name__)
def test_a_function_has_the_values_of_opensim(function, values):
    result = convert_function(function, 1, "it")
    assert [result.evaluate((place,))[0] for place in PLACES] == pytest.approx(values, abs=1e-6)


def test_a_linear_function_takes_the_coefficient_behind_the_weights_for_the_constant():
    # OpenSim's calcValue of (1, 5, 7) at (1, 1) is 13, and that of (1, 2, 3, 4) is 6.
    for coefficients, value in (((1.0, 5.0, 7.0), 13.0), ((1.0, 2.0, 3.0, 4.0), 6.0)):
        function = convert_function(LinearFunction(coefficients=coefficients), 2, "it")
        assert function.evaluate((1.0, 1.0))[0] == value


@pytest.mark.parametrize(
    "function",
    [
        LinearFunction(coefficients=(1.0,)),
        SimmSpline(x=(0.0, 1.0, 2.0), y=(0.0, 1.0)),
        SimmSpline(x=(0.0,), y=(1.0,)),
        GCVSpline(x=(0.0, 1.0, 2.0), y=(0.0, 1.0, 3.0)),
        PiecewiseLinearFunction(x=(0.0, 0.0, 1.0), y=(0.0, 1.0, 3.0)),
        StepFunction(transition_start_time=1.0, transition_end_time=1.0),
    ],
    ids=lambda item: type(item).__name__,
)
def test_what_has_no_value_is_refused(function):
    with pytest.raises(ModelError):
        convert_function(function, 1, "it")
