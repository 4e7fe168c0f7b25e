"""Tests of errors about function-based paths that make no sense."""

from __future__ import annotations

import pytest

import osimlite
from osimlite.errors import ModelError, UnsupportedError
from osimlite.schema.base import Unknown
from osimlite.schema.function_types import (
    ExpressionBasedFunction,
    MultivariatePolynomialFunction,
    PolynomialFunction,
    Sine,
)
from osimlite.schema.functions import Constant, MultiplierFunction
from osimlite.schema.path_forces import PathSpring
from osimlite.schema.paths import FunctionBasedPath
from tests.simulation.force_cases import with_force

ONE, TWO = ("/jointset/j2/q2_0",), ("/jointset/j2/q2_0", "/jointset/j0/q0_3")
PLANE = MultivariatePolynomialFunction(dimension=2, order=1, coefficients=(0.3, 0.2, -0.1))
TWICE = {"coordinate_paths": (*ONE, *ONE), "length_function": PLANE}


def spring(moment_arm_functions=(), **properties):
    path = FunctionBasedPath(**properties)
    path.moment_arm_functions += moment_arm_functions
    return with_force(lambda: PathSpring(name="a", geometry_path=path))


@pytest.mark.parametrize(
    ("properties", "says"),
    [
        ({"coordinate_paths": ONE}, "'length_function' of '/forceset/a/path' is missing"),
        ({"length_function": Sine()}, "name at least one coordinate"),
        (
            {"coordinate_paths": ("/jointset/j2/q",), "length_function": Sine()},
            "names '/jointset/j2/q'",
        ),
        (
            {"coordinate_paths": TWO, "length_function": Sine()},
            "it takes 1 variable, but 2 arguments are listed",
        ),
        (TWICE, "name each once"),
        (
            {"coordinate_paths": ONE, "length_function": Constant(value=1.0)},
            "cannot depend on coordinates",
        ),
        (
            {"coordinate_paths": ONE, "length_function": MultiplierFunction(function=Constant())},
            "cannot depend on coordinates",
        ),
        (
            {"coordinate_paths": TWO, "length_function": PLANE, "moment_arm_functions": [PLANE]},
            "1 moment_arm_function for 2 coordinates",
        ),
        (
            {
                "coordinate_paths": TWO,
                "length_function": PLANE,
                "lengthening_speed_function": PLANE,
            },
            "'lengthening_speed_function' of .* 4 arguments are listed",
        ),
        (
            {
                "coordinate_paths": TWO,
                "length_function": ExpressionBasedFunction(expression="q", variables=("q",)),
            },
            "has 1 variable for 2 arguments",
        ),
        (
            {
                "coordinate_paths": ONE,
                "length_function": ExpressionBasedFunction(expression="p", variables=("q",)),
            },
            "there is no 'p'",
        ),
    ],
)
def test_impossible(properties, says):
    with pytest.raises(ModelError, match=says):
        osimlite.paths(spring(**properties))


def test_an_unknown_function_is_named():
    with pytest.raises(UnsupportedError, match=r"'length_function' of '/forceset/a/.*' is a Bump"):
        osimlite.paths(spring(coordinate_paths=ONE, length_function=Unknown(class_name="Bump")))


def test_a_constant_polynomial():
    model = spring(
        coordinate_paths=TWO,
        length_function=MultivariatePolynomialFunction(dimension=2, order=0, coefficients=(0.7,)),
    )
    paths = osimlite.paths(model)
    assert paths.lengths({}) == {"/forceset/a": 0.7}
    assert paths.moment_arms({}) == {"/forceset/a": {}}


def test_moment_arm_functions_are_taken_as_they_are():
    paths = osimlite.paths(
        spring(
            [PolynomialFunction(coefficients=(2.0, 0.5))],
            coordinate_paths=ONE,
            length_function=Sine(),
        )
    )
    pose = {"q2_0": 0.3}
    assert paths.moment_arms(pose) == {"/forceset/a": {ONE[0]: pytest.approx(1.1)}}
    assert paths.speeds(pose, {"q2_0": 2.0}) == {"/forceset/a": pytest.approx(-2.2)}
