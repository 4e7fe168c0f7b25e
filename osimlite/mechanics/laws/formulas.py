"""What may stand in the formula of an expression-based force.

As in C, and other than in Python, an argument outside of a function's domain gives a number that is
not finite. The names and meanings are those of Lepton, the library of formulas that OpenSim uses.
The exponential of more than 709.78 is too large for a float.
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
"""The law for each of Lepton's functions."""

OF_TWO = ("min", "max")


def divide(a: float, b: float) -> float:
    """a / b, infinite for b = 0."""
    if b != 0.0:
        return a / b
    if a == 0.0 or a != a:
        return nan
    return copysign(inf, a) * copysign(1.0, b)


def power(a: float, b: float) -> float:
    """a to the power b; not a number for negative a and a b that is not whole."""
    if a == 0.0:
        return 1.0 if b == 0.0 else inf if b < 0.0 else 0.0
    if a != a or b != b:
        return nan
    # The remainder stays a float: where floor() gives an integer of 64 bits, b may be too large for
    # it.
    if a < 0.0 and (b - b != 0.0 or b % 1.0 != 0.0):
        return nan
    size = inf if b * log(abs(a)) > 709.78 else abs(a) ** b
    return -size if a < 0.0 and b % 2.0 == 1.0 else size


def square_root(x: float) -> float:
    """Not a number for negative x."""
    return sqrt(x) if x >= 0.0 else nan


def exponential(x: float) -> float:
    """e to the power x."""
    return inf if x > 709.78 else exp(x)


def logarithm(x: float) -> float:
    """Natural logarithm."""
    return log(x) if x > 0.0 else -inf if x == 0.0 else nan


def sine(x: float) -> float:
    """Sine of x in rad."""
    return sin(x) if x - x == 0.0 else nan


def cosine(x: float) -> float:
    """Cosine of x in rad."""
    return cos(x) if x - x == 0.0 else nan


def tangent(x: float) -> float:
    """Tangent of x in rad."""
    return tan(x) if x - x == 0.0 else nan


def secant(x: float) -> float:
    """1 / cos x."""
    return 1.0 / cos(x) if x - x == 0.0 else nan


def cosecant(x: float) -> float:
    """1 / sin x, infinite at 0."""
    return 1.0 / sin(x) if x != 0.0 and x - x == 0.0 else copysign(inf, x) if x == 0.0 else nan


def cotangent(x: float) -> float:
    """1 / tan x, infinite at 0."""
    return 1.0 / tan(x) if x != 0.0 and x - x == 0.0 else copysign(inf, x) if x == 0.0 else nan


def arcsine(x: float) -> float:
    """Not a number beyond -1 and 1."""
    return asin(x) if -1.0 <= x <= 1.0 else nan


def arccosine(x: float) -> float:
    """Not a number beyond -1 and 1."""
    return acos(x) if -1.0 <= x <= 1.0 else nan


def arctangent(x: float) -> float:
    """Between -pi/2 and pi/2."""
    return atan(x)


def hyperbolic_sine(x: float) -> float:
    """(e^x - e^-x) / 2."""
    return sinh(x) if abs(x) < 709.78 or x != x else copysign(inf, x)


def hyperbolic_cosine(x: float) -> float:
    """(e^x + e^-x) / 2."""
    return cosh(x) if abs(x) < 709.78 or x != x else inf


def hyperbolic_tangent(x: float) -> float:
    """sinh x / cosh x."""
    return tanh(x)


def error_function(x: float) -> float:
    """2 / sqrt(pi) times the integral of exp(-t^2) from 0 to x."""
    return erf(x)


def complementary_error_function(x: float) -> float:
    """1 - erf x."""
    return erfc(x)


def unit_step(x: float) -> float:
    """1 from 0 on, 0 before."""
    return 1.0 if x >= 0.0 else 0.0


def is_zero(x: float) -> float:
    """1 at 0, 0 elsewhere."""
    return 1.0 if x == 0.0 else 0.0


def square(x: float) -> float:
    """x^2."""
    return x * x


def cube(x: float) -> float:
    """x^3."""
    return x * x * x


def reciprocal(x: float) -> float:
    """1 / x, infinite at 0."""
    return 1.0 / x if x != 0.0 else copysign(inf, x)


def smaller(a: float, b: float) -> float:
    """The smaller of two numbers."""
    return b if b < a else a


def larger(a: float, b: float) -> float:
    """The larger of two numbers."""
    return b if a < b else a


def magnitude(x: float) -> float:
    """x without its sign."""
    return abs(x)
