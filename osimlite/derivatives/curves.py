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


def evaluate_pieces(table: Any, z: Any, function_type: int) -> tuple[Any, Any, Any]:
    """Evaluate a piecewise polynomial as :func:`osimlite.mechanics.kernels.functions.evaluate_piecewise`.

    The coefficients of the active piece are selected before anything is computed.

    Args:
        table: table of the pieces.
        z: argument.
        function_type: PIECES or PIECES_OF_OPENSIM of `FUNCTION_TYPE`.

    Returns:
        Value, first and second derivative; for PIECES_OF_OPENSIM the second one is the first, as in
        OpenSim 4.6.
    """
    knots = int(simplify_number(table[2]))
    width = int(simplify_number(table[3]))
    if not is_symbol(z):
        # A number selects its piece here, so that the formula does not contain the others.
        numbers: Any = [simplify_number(number) for number in table[: 4 + knots * (1 + width)]]
        return evaluate_piecewise(numbers, float(simplify_number(z)), function_type)
    is_below = [SX.binary(casadi.OP_LT, z, table[4 + k]) for k in range(1, knots)]
    # Exactly one of the tests in `is_in_piece` holds.
    is_beyond = [SX(1.0), *(SX.unary(casadi.OP_NOT, test) for test in is_below)]
    is_in_piece = [
        SX.binary(casadi.OP_AND, *pair)
        for pair in zip(is_beyond, [*is_below, SX(1.0)], strict=True)
    ]

    # A sum of selected coefficients is one formula, where nested selections would be one for each
    # piece.
    def select_coefficient(first_index: int, step: int) -> Any:
        selected_terms = [
            SX.binary(casadi.OP_IF_ELSE_ZERO, test, table[first_index + k * step])
            for k, test in enumerate(is_in_piece)
        ]
        return reduce(plus, selected_terms)

    t = minus(z, select_coefficient(4, 1))
    value = 0.0
    slope = 0.0
    curvature = 0.0
    # Horner's scheme for value, slope and half the curvature.
    for k in range(width - 1, -1, -1):
        curvature = plus(times(curvature, t), slope)
        slope = plus(times(slope, t), value)
        value = plus(times(value, t), select_coefficient(4 + knots + k, width))
    return (
        value,
        slope,
        slope if function_type == FUNCTION_TYPE.PIECES_OF_OPENSIM else times(2.0, curvature),
    )


def evaluate_curve(curve: Any, x: Any) -> tuple[Any, Any]:
    """Return value and slope of a curve, as :func:`osimlite.mechanics.laws.bezier.curve_value`.

    OpenSim's muscle curves are quintic Bezier curves x(u), y(u). The parameter u of x is found by a
    search, and the slope is y'(u) / x'(u).

    Args:
        curve: curve.
        x: argument.

    Returns:
        Value, and slope.
    """
    count = int(simplify_number(curve[SECTIONS]))
    if not is_symbol(x):
        numbers = [float(simplify_number(curve[k])) for k in range(HEAD + (1 + SECTION) * count)]
        return curve_value(numbers, float(simplify_number(x)))
    start, scale, *coefficients = _select_section(
        curve, [x >= curve[HEAD + number] for number in range(count - 1)]
    )
    of_x = coefficients[:5]
    of_y = coefficients[5:]
    # Within the curve the search has a root, also for arguments beyond its ends, whose results are
    # replaced below.
    distance = _clamp_value(x, curve[FIRST], curve[LAST]) - start
    u = _find_root([-distance, *of_x], distance * scale / NODES)
    y = _evaluate_polynomial(of_y, u)
    slope = divide(_evaluate_slope(of_y, u), _evaluate_slope([0.0, *of_x], u))
    # Beyond its ends a curve is extrapolated linearly.
    for test, end in ((x < curve[FIRST], FIRST), (x > curve[LAST], LAST)):
        y = casadi.if_else(test, curve[end + 1] + curve[end + 2] * (x - curve[end]), y)
        slope = casadi.if_else(test, curve[end + 2], slope)
    return y, slope


def solve_damped_velocity(
    m: Any, active: Any, by_length: Any, elastic: Any, tendon: Any, cos: Any, curves: Any
) -> tuple[bool, Any, Any]:
    """Solve for the fiber velocity, as :func:`osimlite.mechanics.laws.millard2012_equilibrium.find_damped_velocity`.

    There is no tolerance: the fiber force ``active_factor * factor + damping * velocity`` is a polynomial
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
    curve = curves.velocity
    active_factor = active * by_length
    target_force = divide(tendon, cos) - elastic

    def compute_force(velocity: Any, factor: Any) -> Any:
        return active_factor * factor + m.damping * velocity

    count = int(simplify_number(curve[SECTIONS]))
    first_section = HEAD + count
    # The force rises with the velocity, so the section follows from the forces at its ends.
    knots = [
        compute_force(curve[HEAD + k], curve[first_section + SECTION * (k + 1) + Y])
        for k in range(count - 1)
    ]
    start, _, *coefficients = _select_section(curve, [target_force >= knot for knot in knots])
    of_x = [start, *coefficients[:5]]
    of_y = coefficients[5:]
    lowest_force, highest_force = (
        compute_force(curve[end], curve[end + 1]) for end in (FIRST, LAST)
    )
    clamped_force = _clamp_value(target_force, lowest_force, highest_force)
    force_coefficients = [compute_force(*pair) for pair in zip(of_x, of_y, strict=True)]
    force_coefficients[0] -= clamped_force
    u = _find_root(force_coefficients, divide(-force_coefficients[0], sum(force_coefficients[1:])))
    velocity = _evaluate_polynomial(of_x, u)
    factor = _evaluate_polynomial(of_y, u)
    # Beyond the curve both factor and velocity are linear, and so is the solution.
    for test, end, end_force in (
        (target_force < lowest_force, FIRST, lowest_force),
        (target_force > highest_force, LAST, highest_force),
    ):
        excess_velocity = divide(target_force - end_force, compute_force(1.0, curve[end + 2]))
        velocity = casadi.if_else(test, curve[end] + excess_velocity, velocity)
        factor = casadi.if_else(test, curve[end + 1] + curve[end + 2] * excess_velocity, factor)
    return True, velocity, factor


def _select_section(curve: Any, is_beyond_knot: Sequence[Any]) -> list[Any]:
    """Return start, scale and coefficients of the section behind the last knot that is exceeded.

    Args:
        curve: packed Bezier curve.
        is_beyond_knot: condition that the argument exceeds a knot, for each inner knot.
    """
    first_section = HEAD + len(is_beyond_knot) + 1
    entry_offsets = [START, SCALE, *range(X, Y + 6)]
    result = [curve[first_section + entry_offset] for entry_offset in entry_offsets]
    for number, test in enumerate(is_beyond_knot, 1):
        section = first_section + SECTION * number
        result = [
            casadi.if_else(test, curve[section + entry_offset], coefficient)
            for entry_offset, coefficient in zip(entry_offsets, result, strict=True)
        ]
    return result


def _find_root(coefficients: Sequence[Any], u: Any) -> Any:
    """Return the root of a polynomial that rises from u = 0 to 1.

    The search has no derivatives: its result is rounded to a grid of the resolution of numbers. A
    last step of Halley's method, whose error is the third power of the previous one, brings exact
    first and second derivatives.

    Args:
        coefficients: coefficients of the polynomial (6,).
        u: first guess.
    """
    return _make_root_function()(casadi.vertcat(*coefficients), u)


@cache
def _make_root_function() -> Any:
    """Return `_find_root` as a CasADi function, which CasADi inserts into expressions faster than Python."""
    arguments = casadi.SX.sym("c", 6), casadi.SX.sym("u")
    coefficients = casadi.vertsplit(arguments[0])
    u = arguments[1]
    for _ in range(HALLEY_STEPS):
        # A step may leave the section; its root is from 0 to 1.
        u = _clamp_value(_apply_halley_step(coefficients, u), 0.0, 1.0)
    return casadi.Function(
        # `floor` has the derivative 0, so only the last step is differentiated.
        "search",
        arguments,
        [_apply_halley_step(coefficients, casadi.floor(u * ROUNDING_GRID) / ROUNDING_GRID)],
    )


def _apply_halley_step(coefficients: Sequence[Any], u: Any) -> Any:
    """Return the next iterate of Halley's method, u - g g' / (g'² - g g'' / 2).

    Args:
        coefficients: coefficients of g.
        u: the iterate.

    Returns:
        The next iterate; the same one where the divisor is not positive.
    """
    value = _evaluate_polynomial(coefficients, u)
    slope = _evaluate_slope(coefficients, u)
    divisor = (
        slope * slope - value * _evaluate_slope(_differentiate_polynomial(coefficients), u) / 2.0
    )
    return u - casadi.if_else(
        # The inner selection keeps the unused side free of a division by zero, whose NaN would
        # enter derivatives.
        divisor > 0.0,
        value * slope / casadi.if_else(divisor > 0.0, divisor, 1.0),
        0.0,
    )


def _clamp_value(x: Any, lower: Any, upper: Any) -> Any:
    """Return a value clamped to a range; the derivative at an end is that inside."""
    return casadi.if_else(x < lower, lower, casadi.if_else(x > upper, upper, x))


def _evaluate_polynomial(coefficients: Sequence[Any], u: Any) -> Any:
    """Return the value of a polynomial."""
    result: Any = 0.0
    for coefficient in reversed(coefficients):
        result = result * u + coefficient
    return result


def _evaluate_slope(coefficients: Sequence[Any], u: Any) -> Any:
    """Return the slope of a polynomial."""
    return _evaluate_polynomial(_differentiate_polynomial(coefficients), u)


def _differentiate_polynomial(coefficients: Sequence[Any]) -> list[Any]:
    """Return the coefficients of the derivative of a polynomial."""
    return [power * coefficient for power, coefficient in enumerate(coefficients)][1:]
