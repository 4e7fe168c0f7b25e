"""Curves of Bezier sections on symbols: a fixed number of search steps, with exact derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, reduce
from typing import Any

from osimlite.derivatives.symbols import (
    SX,
    casadi,
    divide,
    is_symbol,
    minus,
    plus,
    simplify_number,
    times,
)
from osimlite.mechanics.kernels.functions import FUNCTION_TYPE, evaluate_piecewise
from osimlite.mechanics.laws.bezier import (
    FIRST,
    HEAD,
    LAST,
    NODES,
    SCALE,
    SECTION,
    SECTIONS,
    START,
    X,
    Y,
    curve_value,
)

HALLEY_STEPS = 5
"""Number of steps of Halley's method: four reach rounding on all curves and damped fiber velocities."""
ROUNDING_GRID = 2.0**53
"""Number of grid points per unit to which a root is rounded: the resolution of numbers from 0.5 to 1."""


def evaluate_pieces(table: Any, z: Any, kind: int) -> tuple[Any, Any, Any]:
    """Evaluate a piecewise polynomial as :func:`osimlite.mechanics.kernels.functions.evaluate_piecewise`.

    The coefficients of the active piece are selected before anything is computed.

    Args:
        table: table of the pieces.
        z: argument.
        kind: PIECES or PIECES_OF_OPENSIM of `FUNCTION_TYPE`.

    Returns:
        Value, first and second derivative; for PIECES_OF_OPENSIM the second one is the first, as in
        OpenSim 4.6.
    """
    knots = int(simplify_number(table[2]))
    width = int(simplify_number(table[3]))
    if not is_symbol(z):
        # A number selects its piece here, so that the formula does not contain the others.
        numbers: Any = [simplify_number(number) for number in table[: 4 + knots * (1 + width)]]
        return evaluate_piecewise(numbers, float(simplify_number(z)), kind)
    below = [SX.binary(casadi.OP_LT, z, table[4 + k]) for k in range(1, knots)]
    # Exactly one of the tests in `here` holds.
    beyond = [SX(1.0), *(SX.unary(casadi.OP_NOT, test) for test in below)]
    here = [SX.binary(casadi.OP_AND, *pair) for pair in zip(beyond, [*below, SX(1.0)], strict=True)]

    # A sum of selected coefficients is one formula, where nested selections would be one for each
    # piece.
    def select_coefficient(first: int, step: int) -> Any:
        parts = [
            SX.binary(casadi.OP_IF_ELSE_ZERO, test, table[first + k * step])
            for k, test in enumerate(here)
        ]
        return reduce(plus, parts)

    t = minus(z, select_coefficient(4, 1))
    value = 0.0
    slope = 0.0
    curvature = 0.0
    # Horner's scheme for value, slope and half the curvature.
    for k in range(width - 1, -1, -1):
        curvature = plus(times(curvature, t), slope)
        slope = plus(times(slope, t), value)
        value = plus(times(value, t), select_coefficient(4 + knots + k, width))
    return value, slope, slope if kind == FUNCTION_TYPE.PIECES_OF_OPENSIM else times(2.0, curvature)


def evaluate_curve(c: Any, x: Any) -> tuple[Any, Any]:
    """Return value and slope of a curve, as :func:`osimlite.mechanics.laws.bezier.curve_value`.

    OpenSim's muscle curves are quintic Bezier curves x(u), y(u). The parameter u of x is found by a
    search, and the slope is y'(u) / x'(u).

    Args:
        c: curve.
        x: argument.

    Returns:
        Value, and slope.
    """
    count = int(simplify_number(c[SECTIONS]))
    if not is_symbol(x):
        numbers = [float(simplify_number(c[k])) for k in range(HEAD + (1 + SECTION) * count)]
        return curve_value(numbers, float(simplify_number(x)))
    start, scale, *rest = _select_section(c, [x >= c[HEAD + number] for number in range(count - 1)])
    of_x = rest[:5]
    of_y = rest[5:]
    # Within the curve the search has a root, also for arguments beyond its ends, whose results are
    # replaced below.
    off = _clamp_value(x, c[FIRST], c[LAST]) - start
    u = _find_root([-off, *of_x], off * scale / NODES)
    y = _evaluate_polynomial(of_y, u)
    slope = divide(_evaluate_slope(of_y, u), _evaluate_slope([0.0, *of_x], u))
    # Beyond its ends a curve is extrapolated linearly.
    for test, end in ((x < c[FIRST], FIRST), (x > c[LAST], LAST)):
        y = casadi.if_else(test, c[end + 1] + c[end + 2] * (x - c[end]), y)
        slope = casadi.if_else(test, c[end + 2], slope)
    return y, slope


def solve_damped_velocity(
    m: Any, active: Any, by_length: Any, elastic: Any, tendon: Any, cos: Any, curves: Any
) -> tuple[bool, Any, Any]:
    """Solve for the fiber velocity, as :func:`osimlite.mechanics.laws.millard2012_equilibrium.damped_velocity`.

    There is no tolerance: the fiber force ``share * factor + damping * velocity`` is a polynomial
    on each section of the curve, whose root is found to rounding.

    Args:
        m: numbers of the muscle.
        active: activation.
        by_length: active force-length factor.
        elastic: elastic part of the passive fiber force, normalized.
        tendon: tendon force, normalized.
        cos: cosine of the pennation angle.
        curves: curves of the muscle.

    Returns:
        Whether it was solved, the normalized velocity, and the force-velocity factor.
    """
    c = curves.velocity
    share = active * by_length
    wanted = divide(tendon, cos) - elastic

    def borne(velocity: Any, factor: Any) -> Any:
        return share * factor + m.damping * velocity

    count = int(simplify_number(c[SECTIONS]))
    first = HEAD + count
    # The force rises with the velocity, so the section follows from the forces at its ends.
    knots = [borne(c[HEAD + k], c[first + SECTION * (k + 1) + Y]) for k in range(count - 1)]
    start, _, *rest = _select_section(c, [wanted >= knot for knot in knots])
    of_x = [start, *rest[:5]]
    of_y = rest[5:]
    low, high = (borne(c[end], c[end + 1]) for end in (FIRST, LAST))
    off = _clamp_value(wanted, low, high)
    both = [borne(*pair) for pair in zip(of_x, of_y, strict=True)]
    both[0] -= off
    u = _find_root(both, divide(-both[0], sum(both[1:])))
    velocity = _evaluate_polynomial(of_x, u)
    factor = _evaluate_polynomial(of_y, u)
    # Beyond the curve both factor and velocity are linear, and so is the solution.
    for test, end, edge in ((wanted < low, FIRST, low), (wanted > high, LAST, high)):
        beyond = divide(wanted - edge, borne(1.0, c[end + 2]))
        velocity = casadi.if_else(test, c[end] + beyond, velocity)
        factor = casadi.if_else(test, c[end + 1] + c[end + 2] * beyond, factor)
    return True, velocity, factor


def _select_section(c: Any, beyond: Sequence[Any]) -> list[Any]:
    """Return start, scale and coefficients of the section behind the last knot that is exceeded.

    Args:
        c: curve.
        beyond: for each inner knot, the test whether the argument is beyond it.
    """
    first = HEAD + len(beyond) + 1
    places = [START, SCALE, *range(X, Y + 6)]
    result = [c[first + place] for place in places]
    for number, test in enumerate(beyond, 1):
        at = first + SECTION * number
        result = [
            casadi.if_else(test, c[at + place], own)
            for place, own in zip(places, result, strict=True)
        ]
    return result


def _find_root(c: Sequence[Any], u: Any) -> Any:
    """Return the root of a polynomial that rises from u = 0 to 1.

    The search has no derivatives: its result is rounded to a grid of the resolution of numbers. A
    last step of Halley's method, whose error is the third power of the previous one, brings exact
    first and second derivatives.

    Args:
        c: coefficients of the polynomial (6,).
        u: first guess.
    """
    return _make_root_function()(casadi.vertcat(*c), u)


@cache
def _make_root_function() -> Any:
    """Return `_find_root` as a CasADi function, which CasADi inserts into expressions faster than Python."""
    given = casadi.SX.sym("c", 6), casadi.SX.sym("u")
    c = casadi.vertsplit(given[0])
    u = given[1]
    for _ in range(HALLEY_STEPS):
        # A step may leave the section; its root is from 0 to 1.
        u = _clamp_value(_apply_halley_step(c, u), 0.0, 1.0)
    return casadi.Function(
        # `floor` has the derivative 0, so only the last step is differentiated.
        "search",
        given,
        [_apply_halley_step(c, casadi.floor(u * ROUNDING_GRID) / ROUNDING_GRID)],
    )


def _apply_halley_step(c: Sequence[Any], u: Any) -> Any:
    """Return the next iterate of Halley's method, u - g g' / (g'² - g g'' / 2).

    Args:
        c: coefficients of g.
        u: the iterate.

    Returns:
        The next iterate; the same one where the divisor is not positive.
    """
    value = _evaluate_polynomial(c, u)
    slope = _evaluate_slope(c, u)
    divisor = slope * slope - value * _evaluate_slope(_differentiate_polynomial(c), u) / 2.0
    return u - casadi.if_else(
        # The inner selection keeps the unused side free of a division by zero, whose NaN would
        # enter derivatives.
        divisor > 0.0,
        value * slope / casadi.if_else(divisor > 0.0, divisor, 1.0),
        0.0,
    )


def _clamp_value(x: Any, low: Any, high: Any) -> Any:
    """Return a value clamped to a range; the derivative at an end is that inside."""
    return casadi.if_else(x < low, low, casadi.if_else(x > high, high, x))


def _evaluate_polynomial(c: Sequence[Any], u: Any) -> Any:
    """Return the value of a polynomial."""
    result: Any = 0.0
    for coefficient in reversed(c):
        result = result * u + coefficient
    return result


def _evaluate_slope(c: Sequence[Any], u: Any) -> Any:
    """Return the slope of a polynomial."""
    return _evaluate_polynomial(_differentiate_polynomial(c), u)


def _differentiate_polynomial(c: Sequence[Any]) -> list[Any]:
    """Return the coefficients of the derivative of a polynomial."""
    return [k * coefficient for k, coefficient in enumerate(c)][1:]
