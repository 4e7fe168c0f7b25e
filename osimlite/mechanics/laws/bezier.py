"""Smooth curves of quintic Bezier sections, as in OpenSim's SmoothSegmentedFunction.

A section is a corner: it leaves its first end along one line and reaches its last end along
another; the greater its curviness (0 to 1), the nearer it comes to the intersection of the lines
(M. Millard et al., Journal of Biomechanical Engineering 135, 2013, appendix A). Its control points
are p, q, q, r, r, s, so that x(u) and y(u) are polynomials of degree 5 in u, from 0 to 1. To
evaluate y at x, u is found by Halley's method. Beyond the ends of a curve it continues linearly.

A packed curve is an array of numbers: a head of HEAD numbers, x at the end of each section, and
SECTION numbers of each section (coefficients of x and y, and start values of the search for u).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import hypot

from osimlite.mechanics.laws.dual_numbers import differentiate_root, strip_derivatives

Point = tuple[float, float, float]
"""A point of a curve: x, y, and the slope there."""
Numbers = tuple[float, ...]
"""Numbers of a curve."""

SECTIONS = 0
"""Index in a curve of the number of its sections."""
FIRST = 1
"""Offset of the first end, a `Point`."""
LAST = 4
"""Offset of the last end, a `Point`."""
HEAD = 7
"""Length of the head of a curve."""
START = 0
"""Index in a section of x at its first end."""
SCALE = 1
"""Index of NODES over its width."""
X = 2
"""Offset of the coefficients of x from the power 1 on."""
Y = 7
"""Offset of the coefficients of y from the power 0 on."""
STARTS = 13
"""Offset of the start values of u: at NODES + 1 equidistant x, u and its increment to the next."""
NODES = 64
"""Number of intervals of a section with a start value of u."""
SECTION = STARTS + 2 * (NODES + 1)
"""Length of a section."""
MAX_HALLEY_STEPS = 20
"""Largest number of steps of Halley's method."""
STEP_TOLERANCE = 3e-6
"""Step after which the search ends, since the remaining error is below rounding."""


def curve_size(sections: int) -> int:
    """Return the length of a curve of `sections` sections."""
    return HEAD + (1 + SECTION) * sections


def make_curve(points: Sequence[Point], curviness: Sequence[float]) -> Numbers:
    """Return the numbers of a curve through points.

    Args:
        points: points of the curve.
        curviness: curviness of the sections between them, each from 0 to 1.

    Raises:
        ValueError: the lines through two points do not meet in a corner between them.
    """
    # zip stops at the shortest sequence: n points have n - 1 sections.
    sections = zip(points, points[1:], curviness, strict=False)
    numbers = [x for item in sections for x in _make_section(*item)]
    return (
        float(len(curviness)),
        *points[0],
        *points[-1],
        *(x for x, _, _ in points[1:]),
        *numbers,
    )


@lru_cache(maxsize=1024)
def _make_section(first: Point, last: Point, curviness: float) -> Numbers:
    """Return the numbers of a section.

    Args:
        first: first end (x, y, slope).
        last: last end (x, y, slope).
        curviness: curviness, from 0 to 1.

    Returns:
        SECTION numbers, in the order of START, SCALE, X, Y and STARTS.

    Raises:
        ValueError: the curviness is not from 0 to 1, or the slopes make no corner.
    """
    (x0, y0, slope0), (x1, y1, slope1) = first, last
    if not 0.0 <= curviness <= 1.0:
        raise ValueError("its curviness is not from 0 to 1")
    # Intersection of the lines; for parallel lines OpenSim takes the middle. 2^-26 is the square
    # root of the machine precision, OpenSim's limit for equal slopes.
    x = (
        (y1 - y0 - x1 * slope1 + x0 * slope0) / (slope0 - slope1)
        if abs(slope0 - slope1) > 2.0**-26
        else (x1 + x0) / 2
    )
    y = (x - x1) * slope1 + y1
    # The corner must be nearer to both ends than these are to each other, else the curve would bend
    # back.
    if not max(hypot(x - x0, y - y0), hypot(x - x1, y - y1)) < hypot(x1 - x0, y1 - y0):
        raise ValueError(
            f"its tangents at {x0:g} and {x1:g} intersect too far away from the curve section"
        )
    # Beside the section, the corner makes x(u) fall first. OpenSim then cannot invert x(u).
    if not x0 <= x <= x1:
        raise ValueError(f"its tangents at {x0:g} and {x1:g} do not intersect between these values")
    # OpenSim maps curviness 0 to 1 onto 0.1 to 0.9, so that x(u) stays strictly increasing.
    c = 0.1 + 0.8 * curviness
    _, *of_x = _section_coefficients(x0, x0 + c * (x - x0), x1 + c * (x - x1), x1)
    of_y = _section_coefficients(y0, y0 + c * (y - y0), y1 + c * (y - y1), y1)
    return (x0, NODES / (x1 - x0), *of_x, *of_y, *_list_starts(of_x, x1 - x0))


def _section_coefficients(p: float, q: float, r: float, s: float) -> tuple[float, ...]:
    """Return coefficients, by rising powers, for the control points p, q, q, r, r, s.

    Args:
        p: coordinate (x or y) of the first end.
        q: coordinate of the control point on the line through the first end.
        r: coordinate of the control point on the line through the last end.
        s: coordinate of the last end.

    Returns:
        Six coefficients, from power 0 to power 5.
    """
    return p, 5 * (q - p), 10 * (p - q), 10 * (r - p), 5 * (p + 2 * q - 3 * r), s - p + 5 * (r - q)


def _list_starts(x: Sequence[float], width: float) -> list[float]:
    """Return the start values of the search for u; they need not be exact.

    Args:
        x: coefficients of x from power 1 on.
        width: difference of x between both ends.

    Returns:
        u and its increment to the next of NODES + 1 equidistant x, alternately.
    """
    result: list[float] = []
    u = step = 0.0
    for node in range(NODES + 1):
        # u rises with x, so the root lies between the last node's u and 1; the line through the
        # last node is a good first guess.
        low = u
        high = 1.0
        u = min(u + step, 1.0)
        for _ in range(MAX_HALLEY_STEPS):
            # Newton's method, or bisection where it would leave the interval.
            residual = _evaluate_without_constant(x, u) - width * node / NODES
            slope = _evaluate_derivative(x, u)
            low, high = (u, high) if residual < 0.0 else (low, u)
            previous_u = u
            u = u - residual / slope if slope > 0.0 else -1.0
            if not low <= u <= high:
                u = 0.5 * (low + high)
            # Newton's method converges quadratically; 1e-11 is far below what the search needs.
            if abs(u - previous_u) < STEP_TOLERANCE * STEP_TOLERANCE:
                break
        slope = _evaluate_derivative(x, u)
        step = width / NODES / slope if slope > 0.0 else 0.0
        result += [u, step]
    return result


def _evaluate_without_constant(x: Sequence[float], u: float) -> float:
    return u * (x[0] + u * (x[1] + u * (x[2] + u * (x[3] + u * x[4]))))


def _evaluate_derivative(x: Sequence[float], u: float) -> float:
    return x[0] + u * (2.0 * x[1] + u * (3.0 * x[2] + u * (4.0 * x[3] + u * 5.0 * x[4])))


def curve_value(c: Sequence[float], x: float) -> tuple[float, float]:
    """Return y and slope of a curve; if x carries derivatives, so does y.

    Args:
        c: numbers of the curve.
        x: argument.

    Returns:
        y and slope.
    """
    # Written with `not`, so that NaN takes this branch and gives NaN instead of an index out of
    # range.
    if not x >= c[FIRST]:
        return c[FIRST + 1] + c[FIRST + 2] * (x - c[FIRST]), c[FIRST + 2]
    if x > c[LAST]:
        return c[LAST + 1] + c[LAST + 2] * (x - c[LAST]), c[LAST + 2]
    # Search without derivatives, then add them once by the implicit function theorem.
    plain_x = strip_derivatives(x)
    k, remainder, u = find_section(c, plain_x)
    _, _, y, slope = search_section(c, k + X, 1, u, remainder, MAX_HALLEY_STEPS)
    return differentiate_root(y, slope * (plain_x - x), 1.0), slope


def find_section(c: Sequence[float], x: float) -> tuple[int, float, float]:
    """Find the section that contains x, and a start value of u.

    Args:
        c: numbers of the curve.
        x: argument within the curve.

    Returns:
        Offset of the section, distance of x from its start, and the start value of u.
    """
    count = int(c[SECTIONS])
    number = 0
    while number < count - 1 and x >= c[HEAD + number]:
        number += 1
    k = HEAD + count + SECTION * number
    remainder = x - c[k + START]
    fraction = remainder * c[k + SCALE]
    node = min(int(fraction), NODES - 1)
    fraction -= node
    s = k + STARTS + 2 * node
    u0 = c[s]
    d0 = c[s + 1]
    u1 = c[s + 2]
    d1 = c[s + 3]
    # Cubic Hermite interpolation of u between two nodes: most searches then need one step.
    u = u0 + fraction * (
        d0 + fraction * (3.0 * (u1 - u0) - 2.0 * d0 - d1 + fraction * (2.0 * (u0 - u1) + d0 + d1))
    )
    return k, remainder, u


def search_section(
    c: Sequence[float], p: int, stride: int, u: float, remainder: float, rounds: int
) -> tuple[float, bool, float, float]:
    """Find u on a section by Halley's method, and evaluate y there.

    Args:
        c: array that contains the coefficients of x and y.
        p: offset of the first coefficient.
        stride: distance between coefficients.
        u: start of the search.
        remainder: distance of x from the start of the section.
        rounds: largest number of steps.

    Returns:
        u, whether more steps are necessary, y and slope.
    """
    continues = True
    for _ in range(rounds):
        u, continues = take_halley_step(c, p, stride, u, remainder)
        if not continues:
            break
    y, slope = evaluate_section(c, p, stride, u)
    return u, continues, y, slope


def take_halley_step(
    c: Sequence[float], p: int, stride: int, u: float, remainder: float
) -> tuple[float, bool]:
    """Take one step of Halley's method for u, where x(u) has a requested value.

    Args:
        c: array that contains the coefficients of x and y.
        p: offset of the first coefficient.
        stride: distance between coefficients.
        u: start of the step.
        remainder: distance of x from the start of the section.

    Returns:
        u, and whether more steps are necessary.
    """
    a = c[p]
    b = c[p + stride]
    d = c[p + 2 * stride]
    e = c[p + 3 * stride]
    f = c[p + 4 * stride]
    # Two halves of the polynomial, which a processor evaluates in parallel.
    v = u * u
    residual = u * ((a + u * b) + v * ((d + u * e) + v * f)) - remainder
    run = (a + u * (2.0 * b)) + v * ((3.0 * d + u * (4.0 * e)) + v * (5.0 * f))
    bend = (b + u * (3.0 * d)) + v * (6.0 * e + u * (10.0 * f))
    # Halley's step f f' / (f'^2 - f f'' / 2). `bend` is half of the second derivative. Where the
    # divisor is not positive, x(u) is too flat for a step, and the search ends.
    divisor = run * run - residual * bend
    is_convergent = divisor > 0.0
    step = residual * run / (divisor if is_convergent else 1.0)
    u = min(max(u - step, 0.0), 1.0) if is_convergent else u
    return u, is_convergent and not abs(step) < STEP_TOLERANCE


def evaluate_section(c: Sequence[float], p: int, stride: int, u: float) -> tuple[float, float]:
    """Return y and its slope by x at a parameter of a section.

    Args:
        c: array that contains the coefficients of x and y.
        p: offset of the first coefficient.
        stride: distance between coefficients.
        u: parameter of the section, from 0 to 1.

    Returns:
        y and slope.
    """
    a = c[p]
    b = c[p + stride]
    d = c[p + 2 * stride]
    e = c[p + 3 * stride]
    f = c[p + 4 * stride]
    v = u * u
    q = p + 5 * stride
    g = c[q]
    h = c[q + stride]
    i = c[q + 2 * stride]
    j = c[q + 3 * stride]
    k = c[q + 4 * stride]
    m = c[q + 5 * stride]
    # The slope dy/dx is (dy/du) / (dx/du); `run` and `rise` are these derivatives.
    run = (a + u * (2.0 * b)) + v * ((3.0 * d + u * (4.0 * e)) + v * (5.0 * f))
    rise = (h + u * (2.0 * i)) + v * ((3.0 * j + u * (4.0 * k)) + v * (5.0 * m))
    return (g + u * h) + v * ((i + u * j) + v * (k + u * m)), rise / run


def search_residual(c: Sequence[float], p: int, stride: int, u: float, remainder: float) -> float:
    """Return x(u) less the requested x, the residual of the search.

    Args:
        c: array that contains the coefficients of x and y.
        p: offset of the first coefficient.
        stride: distance between coefficients.
        u: parameter of the section.
        remainder: requested distance of x from the start of the section.
    """
    a = c[p]
    b = c[p + stride]
    d = c[p + 2 * stride]
    e = c[p + 3 * stride]
    f = c[p + 4 * stride]
    v = u * u
    return u * ((a + u * b) + v * ((d + u * e) + v * f)) - remainder


def solve_sum(c: Sequence[float], of_y: float, of_x: float, total: float) -> tuple[float, float]:
    """Find y of a curve where ``of_y * y + of_x * x`` has a total.

    On a section the sum is a polynomial in u, too, which is increasing for an increasing curve and
    positive factors.

    Note:
        The velocity of damped fibers is such a root: y is the force-velocity factor, x the
        velocity.

    Args:
        c: numbers of the curve.
        of_y: factor of y.
        of_x: factor of x.
        total: value of the sum.

    Returns:
        y, and the residual of the sum.
    """
    end = end_beyond_sum(c, of_y, of_x, total)
    if end > 0:
        return extrapolate_sum(c, of_y, of_x, total, end), total - total
    k, remainder, u = find_section_of_sum(c, of_y, of_x, total)
    # Coefficients of the sum in one array, as `search_section` takes them.
    sum_coefficients = (
        of_y * c[k + Y + 1] + of_x * c[k + X],
        of_y * c[k + Y + 2] + of_x * c[k + X + 1],
        of_y * c[k + Y + 3] + of_x * c[k + X + 2],
        of_y * c[k + Y + 4] + of_x * c[k + X + 3],
        of_y * c[k + Y + 5] + of_x * c[k + X + 4],
        c[k + Y],
        c[k + Y + 1],
        c[k + Y + 2],
        c[k + Y + 3],
        c[k + Y + 4],
        c[k + Y + 5],
    )
    u, _, y, _ = search_section(sum_coefficients, 0, 1, u, remainder, MAX_HALLEY_STEPS)
    return y, search_residual(sum_coefficients, 0, 1, u, remainder)


def end_beyond_sum(c: Sequence[float], of_y: float, of_x: float, total: float) -> int:
    """Return the end of a curve that a sum is beyond, FIRST or LAST; 0 if neither.

    Args:
        c: numbers of the curve.
        of_y: factor of y.
        of_x: factor of x.
        total: value of the sum.
    """
    if not total >= of_y * c[FIRST + 1] + of_x * c[FIRST]:
        return FIRST
    return LAST if total > of_y * c[LAST + 1] + of_x * c[LAST] else 0


def extrapolate_sum(c: Sequence[float], of_y: float, of_x: float, total: float, end: int) -> float:
    """Return y beyond an end of a curve, where a sum has a total.

    Args:
        c: numbers of the curve.
        of_y: factor of y.
        of_x: factor of x.
        total: value of the sum.
        end: FIRST or LAST, from `end_beyond_sum`.
    """
    x = c[end]
    y = c[end + 1]
    slope = c[end + 2]
    return y + slope * ((total - (of_y * y + of_x * x)) / (of_y * slope + of_x))


def find_section_of_sum(
    c: Sequence[float], of_y: float, of_x: float, total: float
) -> tuple[int, float, float]:
    """Find the section that contains a sum, and a rough start value of u.

    Args:
        c: numbers of the curve.
        of_y: factor of y.
        of_x: factor of x.
        total: value of the sum, between those at the ends of the curve.

    Returns:
        Offset of the section, difference of the sum from its value at the start, and u.
    """
    count = int(c[SECTIONS])
    number = 0
    k = HEAD + count
    start = of_y * c[k + Y] + of_x * c[k + START]
    end = of_y * c[LAST + 1] + of_x * c[LAST]
    while number < count - 1:
        # Compare with the sum at the first end of the following section; the sum increases along
        # the curve.
        following = k + SECTION
        knot = of_y * c[following + Y] + of_x * c[following + START]
        if not total >= knot:
            end = knot
            break
        k = following
        start = knot
        number += 1
    return k, total - start, (total - start) / (end - start)


def curve_integral(c: Sequence[float], x: float) -> float:
    """Return the integral of a curve from its first end to x.

    It is exact, while OpenSim's is a spline with an error of about 1e-9.

    Args:
        c: numbers of the curve.
        x: upper limit.
    """
    total = 0.0
    excess = x - c[FIRST]
    # Before the first end the curve is a line through it, so the integral is that of a trapezoid.
    if excess <= 0.0:
        return (c[FIRST + 1] + 0.5 * c[FIRST + 2] * excess) * excess
    section, remainder, u = find_section(c, min(x, c[LAST]))
    u, *_ = search_section(c, section + X, 1, u, remainder, MAX_HALLEY_STEPS)
    for k in range(HEAD + int(c[SECTIONS]), section, SECTION):
        total += _section_integral(c, k, 1.0)
    total += _section_integral(c, section, u)
    excess = max(x - c[LAST], 0.0)
    return total + (c[LAST + 1] + 0.5 * c[LAST + 2] * excess) * excess


def _section_integral(c: Sequence[float], k: int, u: float) -> float:
    """Return the integral of y over x of a section up to u.

    Args:
        c: numbers of the curve.
        k: offset of the section.
        u: upper limit of the parameter.
    """
    x, y = c[k + X : k + Y], c[k + Y : k + STARTS]
    # The integral of y dx = y(u) x'(u) du, term by term: u^i times j u^(j - 1).
    return sum(
        b * j * a * u ** (i + j) / (i + j) for i, b in enumerate(y) for j, a in enumerate(x, 1)
    )
