"""Tests of the formulas of expression-based forces: grammar, generated code and error messages."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.errors import ModelError
from osimlite.mechanics.kernels.programs import STEPS, run_binary_program
from osimlite.mechanics.laws.formulas import FUNCTIONS
from osimlite.mechanics.multibody.formula import Formula, program
from tests.suite import choose


def value(text, q=0.7, u=-1.3):
    steps, constants = program(Formula.parse(text, ("q", "u"), "the expression"))
    count = len(steps) // 3
    return run_binary_program(
        q, u, np.array([count, *steps]), np.array(constants), np.zeros(2 + count)
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1+2*3", 7.0),
        ("2-3-4", -5.0),
        ("8/4/2", 1.0),
        ("-2^2", -4.0),
        ("2^-1", 0.5),
        ("2^3^2", 512.0),
        ("-3*2", -6.0),
        ("6/-2*3", -9.0),
        ("--3", 3.0),
        (" ( 1 + q ) * u ", 1.7 * -1.3),
        ("1.5e-1 + 2.E+1 + .5", 20.65),
        ("min(q, max(u, 2))", 0.7),
        ("a+b; b=2*c; c=q*q", None),
    ],
)
def test_values(text, expected):
    if expected is None:
        with pytest.raises(ModelError, match="there is no 'a'"):
            value(text)
        text, expected = "b + c; b = 2*c; c = q*q", 3 * 0.49
    assert value(text) == pytest.approx(expected, rel=1e-15)


def test_definitions_that_double_are_written_once():
    names = [f"x{number}" for number in range(60)]
    text = names[0] + "".join(
        f"; {a} = {b}*0.5 + {b}*0.5" for a, b in zip(names, [*names[1:], "q"], strict=True)
    )
    assert value(text) == pytest.approx(0.7)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("0*x", 0.0),
        ("q + x - x", None),
        ("x/x", 1.0),
        ("x - x + q", 0.7),
        ("x^0 + 0^y", 1.0),
        ("2*x - x*2 + q", 0.7),
        ("-x*-y - x*y", 0.0),
        ("(1/x)*x", 1.0),
        ("sqrt(square(u))", 1.3),
        ("0*log(q - q)", 0.0),
        ("0*q/0", 1.0),
        ("(0/q)^0", 0.0),
        ("q; a = b", 0.7),
        ("0*a; a = b", 0.0),
    ],
)
def test_what_drops_out_may_be_unknown_or_nan(text, expected):
    """Lepton, by which OpenSim simplifies formulas before it evaluates them, removes such terms too."""
    if expected is None:
        with pytest.raises(ModelError, match="there is no 'x'"):
            value(text)
    else:
        assert value(text) == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("1*x", "there is no 'x'"),
        ("x + 0", "there is no 'x'"),
        ("x/(1/0)", "there is no 'x'"),
        ("x*cos(0)", "there is no 'x'"),
        ("0*(1/0)", "not a number"),
        ("min(q, 0/0)", "not a number"),
        ("0*(x", "parentheses"),
    ],
)
def test_what_does_not_drop_out_is_refused(text, says):
    with pytest.raises(ModelError, match=says):
        value(text)


LONG = choose(8_000, 20_000)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("+".join(["q"] * LONG), LONG * 0.7),
        ("-".join(["q"] * LONG), 0.7 - (LONG - 1) * 0.7),
        ("^".join(["q"] * LONG), None),
        ("(" * LONG + "q" + ")" * LONG, 0.7),
        ("-" * LONG + "q", 0.7),
        ("min(q, " * LONG + "q" + ")" * LONG, 0.7),
        ("q+(" * LONG + "q" + ")" * LONG, (LONG + 1) * 0.7),
        (";".join(["a0", *(f"a{k}=a{k + 1}+1" for k in range(LONG)), f"a{LONG}=q"]), LONG + 0.7),
    ],
    ids=[
        "sum",
        "difference",
        "power",
        "parentheses",
        "signs",
        "calls",
        "nested sums",
        "definitions",
    ],
)
def test_no_length_and_no_depth_is_too_much(text, expected):
    result = value(text)
    # The nested power converges to the solution of x = 0.7^x.
    assert result == pytest.approx(0.7**result if expected is None else expected)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "ends too early"),
        ("q +", "ends too early"),
        ("(q", "parentheses"),
        ("q)", r"unexpected '\)'"),
        ("qq", "there is no 'qq'"),
        ("sine(q)", "there is no function 'sine'"),
        ("min(q)", "takes 2 arguments, not 1"),
        ("sin(q, u)", "takes 1 argument, not 2"),
        ("+q", r"unexpected '\+'"),
        ("q;3", "has no name"),
        ("2q", "unexpected 'q'"),
        ("(" * 300 + "q", "parentheses"),
        ("q, u", "unexpected ','"),
        ("(q, u)", "unexpected ','"),
        ("min()", r"unexpected '\)'"),
        ("__import__('os')", "there is no function"),
        ("q.real", "there is no 'q.real'"),
    ],
)
def test_what_is_wrong_is_said(text, message):
    with pytest.raises(ModelError, match=message) as caught:
        value(text)
    assert str(caught.value).startswith("the expression is '")


@given(st.text(alphabet="qu0123.e+-*/^(),; =sincoatl", max_size=30))
def test_no_text_does_worse_than_a_model_error(text):
    try:
        result = value(text)
    except ModelError:
        return
    assert isinstance(result, float)


def test_every_function_is_a_law():
    assert set(FUNCTIONS.values()) <= set(STEPS)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_derivatives_of_functions(name):
    inner = "0.3*q-0.1*u*q"
    text = (
        f"{name}({inner})" if name not in ("min", "max") else f"{name}({inner},u)*{name}(q,{inner})"
    )
    assert_derivatives(text)


@pytest.mark.parametrize(
    "text", ["q", "u", "3", "q-q*u", "-q/u", "q^3+(q+1)^(u*q)", "a*q;a=q*u", "2^(q*u)"]
)
def test_derivatives(text):
    assert_derivatives(text)


def assert_derivatives(text, q=0.7, u=-1.3, step=1e-6):
    formula = Formula.parse(text, ("q", "u"), "the expression")
    for variable, (dq, du) in enumerate(((step, 0.0), (0.0, step))):
        steps, constants = program(formula.derivative(variable))
        count = len(steps) // 3
        result = run_binary_program(
            q, u, np.array([count, *steps]), np.array(constants), np.zeros(2 + count)
        )
        expected = (value(text, q + dq, u + du) - value(text, q - dq, u - du)) / (2 * step)
        assert result == pytest.approx(expected, rel=1e-8, abs=1e-9)
