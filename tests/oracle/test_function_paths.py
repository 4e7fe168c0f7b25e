"""Compare paths that are functions of coordinates with a live OpenSim 4.6."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.schema.function_types import (
    ExpressionBasedFunction,
    MultivariatePolynomialFunction,
    PolynomialFunction,
    Sine,
    StepFunction,
)
from osimlite.schema.functions import LinearFunction, MultiplierFunction
from osimlite.schema.path_forces import PathSpring
from osimlite.schema.paths import FunctionBasedPath
from osimlite.schema.splines import PiecewiseLinearFunction, SimmSpline

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

from tests.oracle.force_carrier import JOINTS, carrier, compare  # noqa: E402
from tests.oracle.opensim_paths import compare_paths  # noqa: E402

RNG = np.random.default_rng(3)


def polynomial(dimension, order):
    """Return a multivariate polynomial with random coefficients up to an order."""
    count = 1
    for k in range(order):
        count = count * (dimension + k + 1) // (k + 1)
    return MultivariatePolynomialFunction(
        dimension=dimension, order=order, coefficients=tuple(RNG.uniform(-0.3, 0.3, count).tolist())
    )


def expression(text, *variables):
    return ExpressionBasedFunction(expression=text, variables=variables)


ONE, OTHER, LAST = "/jointset/j1/q1_0", "/jointset/j0/q0_0", "/jointset/j2/q2_0"
SPLINE = SimmSpline(x=(-2.0, -0.5, 0.1, 0.6, 2.0), y=(0.1, 0.3, 0.2, -0.1, 0.4))
OF_TWO = (
    "0.3*sin(x)*y+exp(-x)/(2+y)+sqrt(2+x)-log(3+y)*tanh(x)+max(x,y)*0.1+min(x,0.2)*abs(y)+cube(y)-square(x)",
    "atan(x)+asin(y/3)+acos(x/4)*cos(y)+sec(x)-csc(2+y)+tan(x)*cot(2+y)+sinh(x)+cosh(y)+erf(x)-erfc(y)+recip(3+x)",
    "(2+x)^(y+1)+2^x+(3+y)^2+step(x)*y+delta(y)-k*x;k=x/(3-y)",
)
# Coordinates, length function, moment arm functions and speed function of each path.
PATHS = {
    "a spline": ((ONE,), SPLINE, (), None),
    "a polynomial of one": (
        (OTHER,),
        PolynomialFunction(coefficients=(1.0, 2.0, 3.0, 4.0)),
        (),
        None,
    ),
    "a multiple of a sine": (
        (LAST,),
        MultiplierFunction(scale=-0.4, function=Sine(omega=1.3, offset=2.0)),
        (),
        None,
    ),
    "lines": ((ONE,), PiecewiseLinearFunction(x=(-1.0, 0.0, 0.7), y=(0.4, 0.2, 0.5)), (), None),
    "a step": (
        (ONE,),
        StepFunction(transition_start_time=-0.5, transition_end_time=0.6, end_value=0.3),
        (),
        None,
    ),
    "a linear function": ((ONE, LAST), LinearFunction(coefficients=(0.3, -0.2, 1.0)), (), None),
    "a polynomial of three": ((LAST, ONE, OTHER), polynomial(3, 5), (), None),
    "a multiple of a polynomial": (
        (ONE, OTHER),
        MultiplierFunction(scale=0.3, function=polynomial(2, 3)),
        (),
        None,
    ),
    "other moment arms": (
        (ONE, OTHER),
        polynomial(2, 2),
        (polynomial(2, 3), polynomial(2, 1)),
        None,
    ),
    "another speed": ((ONE, OTHER), polynomial(2, 2), (), polynomial(4, 2)),
    "all others": ((ONE,), SPLINE, (Sine(amplitude=0.3),), expression("v*q+0.1", "q", "v")),
    **{
        f"formula {k}": ((ONE, OTHER), expression(text, "x", "y"), (), None)
        for k, text in enumerate(OF_TWO)
    },
}


@pytest.fixture(params=list(JOINTS.values()), ids=list(JOINTS))
def model(request):
    """Return a model with a spring along each path of `PATHS`, for each kind of joints."""
    model = carrier(request.param)
    for number, (coordinates, length, arms, speed) in enumerate(PATHS.values()):
        path = FunctionBasedPath(
            name="path",
            coordinate_paths=coordinates,
            length_function=length,
            lengthening_speed_function=speed,
        )
        path.moment_arm_functions += arms
        spring = PathSpring(
            name=f"spring{number}", resting_length=0.2, stiffness=30.0, dissipation=0.4
        )
        spring.geometry_path = path
        model.add(spring)
    return model


def test_motion(model, tmp_path):
    assert compare(model, tmp_path, counted=0)


@pytest.mark.parametrize("is_coupled", [False, True])
def test_lengths_speeds_and_moment_arms(model, is_coupled, tmp_path):
    if is_coupled:
        constraint = osimlite.CoordinateCouplerConstraint(
            name="coupler",
            independent_coordinate_names=("q0_0",),
            dependent_coordinate_name="q2_0",
            coupled_coordinates_function=Sine(amplitude=0.4, omega=1.3, phase=0.2, offset=0.1),
        )
        model.add(constraint)
    osimlite.write(model, tmp_path / "model.osim")
    compare_paths(tmp_path / "model.osim", poses=4)
