"""Functions that the formula of an expression-based force may contain.

As in C, and unlike in Python, an argument outside of a function's domain gives a number that is not
finite. Names and meanings are those of Lepton, the formula library of OpenSim. The exponential of
more than 709.78 is too large for a float.
"""

from __future__ import annotations

from math import (
    acos,
    asin,
    atan,
    copysign,
    cos,
    cosh,
    erf,
    erfc,
    exp,
    inf,
    log,
    nan,
    sin,
    sinh,
    sqrt,
    tan,
    tanh,
)

FUNCTIONS = {
    "sqrt": "square_root",
    "exp": "exponential",
    "log": "logarithm",
    "sin": "sine",
    "cos": "cosine",
    "sec": "secant",
    "csc": "cosecant",
    "tan": "tangent",
    "cot": "cotangent",
    "asin": "arcsine",
    "acos": "arccosine",
    "atan": "arctangent",
    "sinh": "hyperbolic_sine",
    "cosh": "hyperbolic_cosine",
    "tanh": "hyperbolic_tangent",
    "erf": "error_function",
    "erfc": "complementary_error_function",
    "step": "unit_step",
    "delta": "is_zero",
    "square": "square",
    "cube": "cube",
    "recip": "reciprocal",
    "min": "smaller",
    "max": "larger",
    "abs": "magnitude",
}
"""Name of the function here for each of Lepton's functions."""

OF_TWO = ("min", "max")
"""Lepton's functions of two arguments."""


def divide(a: float, b: float) -> float:
    """Return a / b as C does: infinite for b = 0, not a number for 0 / 0.

    Args:
        a: numerator.
        b: denominator.
    """
    if b != 0.0:
        return a / b
    # IEEE division: 0/0 is NaN, and the sign of an infinite result includes the sign of zero.
    if a == 0.0 or a != a:
        return nan
    return copysign(inf, a) * copysign(1.0, b)


def power(a: float, b: float) -> float:
    """Return a to the power b; not a number for negative a and a fractional b.

    Args:
        a: base.
        b: exponent.
    """
    # 0^b needs no logarithm.
    if a == 0.0:
        return 1.0 if b == 0.0 else inf if b < 0.0 else 0.0
    if a != a or b != b:
        return nan
    # The remainder stays a float: where floor() gives an integer of 64 bits, b may be too large for
    # it. b - b is not 0 for an infinite b.
    if a < 0.0 and (b - b != 0.0 or b % 1.0 != 0.0):
        return nan
    # Python raises OverflowError where C returns infinity, hence the test by logarithms.
    size = inf if b * log(abs(a)) > 709.78 else abs(a) ** b
    return -size if a < 0.0 and b % 2.0 == 1.0 else size


def square_root(x: float) -> float:
    """Return the square root of x; not a number for negative x."""
    return sqrt(x) if x >= 0.0 else nan


def exponential(x: float) -> float:
    """Return e to the power x."""
    return inf if x > 709.78 else exp(x)


def logarithm(x: float) -> float:
    """Return the natural logarithm of x."""
    return log(x) if x > 0.0 else -inf if x == 0.0 else nan


def sine(x: float) -> float:
    """Return the sine of x (rad)."""
    # x - x is not 0 for infinite and undefined x, where Python's sin raises ValueError.
    return sin(x) if x - x == 0.0 else nan


def cosine(x: float) -> float:
    """Return the cosine of x (rad)."""
    return cos(x) if x - x == 0.0 else nan


def tangent(x: float) -> float:
    """Return the tangent of x (rad)."""
    return tan(x) if x - x == 0.0 else nan


def secant(x: float) -> float:
    """Return 1 / cos x."""
    return 1.0 / cos(x) if x - x == 0.0 else nan


def cosecant(x: float) -> float:
    """Return 1 / sin x, infinite at 0."""
    # 1 / 0 raises in Python; the sign of zero decides between both infinities.
    return 1.0 / sin(x) if x != 0.0 and x - x == 0.0 else copysign(inf, x) if x == 0.0 else nan


def cotangent(x: float) -> float:
    """Return 1 / tan x, infinite at 0."""
    return 1.0 / tan(x) if x != 0.0 and x - x == 0.0 else copysign(inf, x) if x == 0.0 else nan


def arcsine(x: float) -> float:
    """Return the arcsine of x (rad); not a number beyond -1 and 1."""
    return asin(x) if -1.0 <= x <= 1.0 else nan


def arccosine(x: float) -> float:
    """Return the arccosine of x (rad); not a number beyond -1 and 1."""
    return acos(x) if -1.0 <= x <= 1.0 else nan


def arctangent(x: float) -> float:
    """Return the arctangent of x (rad), between -pi/2 and pi/2."""
    return atan(x)


def hyperbolic_sine(x: float) -> float:
    """Return (e^x - e^-x) / 2."""
    # Python's sinh overflows beyond 709.78 with an exception.
    return sinh(x) if abs(x) < 709.78 or x != x else copysign(inf, x)


def hyperbolic_cosine(x: float) -> float:
    """Return (e^x + e^-x) / 2."""
    return cosh(x) if abs(x) < 709.78 or x != x else inf


def hyperbolic_tangent(x: float) -> float:
    """Return sinh x / cosh x."""
    return tanh(x)


def error_function(x: float) -> float:
    """Return 2 / sqrt(pi) times the integral of exp(-t^2) from 0 to x."""
    return erf(x)


def complementary_error_function(x: float) -> float:
    """Return 1 - erf x."""
    return erfc(x)


def unit_step(x: float) -> float:
    """Return 1 for x >= 0, else 0."""
    return 1.0 if x >= 0.0 else 0.0


def is_zero(x: float) -> float:
    """Return 1 for x = 0, else 0."""
    return 1.0 if x == 0.0 else 0.0


def square(x: float) -> float:
    """Return the square x^2 of a number."""
    return x * x


def cube(x: float) -> float:
    """Return the cube x^3 of a number."""
    return x * x * x


def reciprocal(x: float) -> float:
    """Return 1 / x, infinite at 0."""
    return 1.0 / x if x != 0.0 else copysign(inf, x)


def smaller(a: float, b: float) -> float:
    """Return the smaller of two numbers.

    If one of them is not a number, the first one is returned, as C++ std::min does.

    Args:
        a: first number.
        b: second number.
    """
    return b if b < a else a


def larger(a: float, b: float) -> float:
    """Return the larger of two numbers.

    If one of them is not a number, the first one is returned, as C++ std::max does.

    Args:
        a: first number.
        b: second number.
    """
    return b if a < b else a


def magnitude(x: float) -> float:
    """Return the absolute value of a number."""
    return abs(x)
