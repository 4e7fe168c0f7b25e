"""Curves of Bezier sections on symbols: the search for a place on a section as so many of its steps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from osimlite.backends.symbols import casadi, divide, is_symbol, largest, plain, smallest
from osimlite.forces.bezier import FIRST, HEAD, LAST, NODES, SCALE, SECTION, SECTIONS, START, X, Y, curve_value

VELOCITIES = 5
"""Steps of Newton's method for the velocity of a damped fiber."""
STEPS = 7
"""Of Halley's method from halfway between a straight line and the steeper end: all curves are met to rounding."""


def curve_value_on_symbols(c: Any, x: Any) -> tuple[Any, Any]:
    """As :func:`osimlite.forces.bezier.curve_value`; the derivatives are exact where the search has come to its end."""
    count = int(plain(c[SECTIONS]))
    if not is_symbol(x):
        numbers = [float(plain(c[k])) for k in range(HEAD + (1 + SECTION) * count)]
        return curve_value(numbers, float(plain(x)))
    start, scale, *rest = _section(c, x, count)
    of_x, of_y = rest[:5], rest[5:]
    inside = _between(x, c[FIRST], c[LAST])
    off = inside - start
    u = _place(of_x, off, off * scale / NODES)
    run = _slope([0.0, *of_x], u)
    y, slope = _value(of_y, u), divide(_slope(of_y, u), run)
    for test, end in ((x < c[FIRST], FIRST), (x > c[LAST], LAST)):
        y = casadi.if_else(test, c[end + 1] + c[end + 2] * (x - c[end]), y)
        slope = casadi.if_else(test, c[end + 2], slope)
    return y, slope


def damped_velocity_on_symbols(
    m: Any, active: Any, by_length: Any, elastic: Any, tendon: Any, cos: Any, curves: Any
) -> tuple[bool, Any, Any]:
    """As :func:`osimlite.forces.millard2012_equilibrium.damped_velocity`: so many of Newton's steps."""
    wanted = divide(tendon, largest(cos, 0.01)) - elastic
    share = active * by_length
    guess = divide(wanted, largest(active, 0.01) * largest(by_length, 0.01))
    velocity, _ = curve_value_on_symbols(curves.inverse, guess)
    velocity = smallest(largest(velocity, -1.0), 1.0)
    for _ in range(VELOCITIES):
        factor, slope = curve_value_on_symbols(curves.velocity, velocity)
        velocity = velocity - divide(share * factor + m.damping * velocity - wanted, share * slope + m.damping)
    return True, velocity, curve_value_on_symbols(curves.velocity, velocity)[0]


def _section(c: Any, x: Any, count: int) -> list[Any]:
    """Start, scale and coefficients of the section that has x."""
    first = HEAD + count
    places = [START, SCALE, *range(X, Y + 6)]
    result = [c[first + place] for place in places]
    for number in range(1, count):
        beyond = x >= c[HEAD + number - 1]
        at = first + SECTION * number
        result = [casadi.if_else(beyond, c[at + place], own) for place, own in zip(places, result, strict=True)]
    return result


def _place(x: Sequence[Any], off: Any, u: Any) -> Any:
    """u at which the polynomial of x is `off` beyond its first end, from a first guess on."""
    for _ in range(STEPS):
        value, slope = _value([0.0, *x], u) - off, _slope([0.0, *x], u)
        bend = x[1] + u * (3.0 * x[2] + u * (6.0 * x[3] + u * (10.0 * x[4])))
        divisor = slope * slope - value * bend
        step = divide(value * slope, casadi.if_else(divisor > 0.0, divisor, 1.0))
        u = _between(u - casadi.if_else(divisor > 0.0, step, 0.0), 0.0, 1.0)
    return u


def _between(x: Any, low: Any, high: Any) -> Any:
    """x, or the end that it is beyond; the derivative at an end is that within."""
    return casadi.if_else(x < low, low, casadi.if_else(x > high, high, x))


def _value(c: Sequence[Any], u: Any) -> Any:
    result: Any = 0.0
    for coefficient in reversed(c):
        result = result * u + coefficient
    return result


def _slope(c: Sequence[Any], u: Any) -> Any:
    return _value([k * coefficient for k, coefficient in enumerate(c)][1:], u)
