"""End position of a rod that bends with constant curvature, as the amount of an operation.

See :class:`osimlite.mechanics.multibody.arc.ArcPoint`. The rod of length L bends by the total
angle θ, with cos θ = cos a cos b for its two angles a and b. The end lies at
L (sin θ) / θ along the rod, and L (1 - cos θ) / θ across it.
"""

from __future__ import annotations

from math import acos, cos, sin

from osimlite.mechanics.kernels.layout import MODEL, OPERATION, OPERATION_WORK, OUTCOME, Record
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.points import operation_ints, operation_work


class ROD(metaclass=Record):
    """Table of a bent rod."""

    COMPONENT = 2
    """Component of the end position."""
    LENGTH = 3
    """Length of the rod (m)."""
    NEUTRAL = 4
    """Two angles where the arguments are zero (rad)."""
    TERMS = 6
    """Number of terms of each series."""
    SERIES = 7
    """Series by θ² of (sin θ) / θ and then of (1 - cos θ) / θ²."""


def amount_by_arc(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, operation: int
) -> int:
    """Compute an amount, its gradient, rate and curvature from the bending of a rod in two angles.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; filled with amount, rate, curvature and gradient of the operation.
        y: state.
        f: rates of the coordinates.
        operation: number of the operation.

    Returns:
        `OUTCOME.OK`.
    """
    j = operation_ints(model, operation)
    operation_record = operation_work(model, data, operation)
    first_freedom = model[j[OPERATION.ARGUMENTS]]
    second_freedom = model[j[OPERATION.ARGUMENTS] + 1]
    p = at(reals, j[OPERATION.EXTRA])
    table = at(p, 2)
    u = at(y, model[MODEL.DOFS])
    a = (y[first_freedom] if first_freedom >= 0 else p[0]) + table[ROD.NEUTRAL]
    b = (y[second_freedom] if second_freedom >= 0 else p[1]) + table[ROD.NEUTRAL + 1]
    ua = u[first_freedom] if first_freedom >= 0 else 0.0
    ub = u[second_freedom] if second_freedom >= 0 else 0.0
    value, da, db, daa, dab, dbb = evaluate_arc(table, a, b)
    data[j[OPERATION.GRADIENT]], data[j[OPERATION.GRADIENT] + 1] = da, db
    operation_record[OPERATION_WORK.AMOUNT], operation_record[OPERATION_WORK.RATE] = (
        value,
        da * ua + db * ub,
    )
    # Second derivative by time of the amount at constant speeds.
    operation_record[OPERATION_WORK.CURVATURE] = daa * ua * ua + 2.0 * dab * ua * ub + dbb * ub * ub
    return OUTCOME.OK


def evaluate_arc(
    table: Floats, a: float, b: float
) -> tuple[float, float, float, float, float, float]:
    """Return a component of the end position, and its derivatives by the two angles.

    Args:
        table: table of the function.
        a: first angle (rad).
        b: second angle (rad).

    Returns:
        Value, first derivatives by a and b, second derivatives by a a, a b and b b.
    """
    sa, ca, sb, cb = sin(a), cos(a), sin(b), cos(b)
    # Cosine of the total angle, with its derivatives by both angles.
    c, ga, gb, haa, hab, hbb = ca * cb, -sa * cb, -ca * sb, -ca * cb, sa * sb, -ca * cb
    component = int(table[ROD.COMPONENT])
    # Along the rod the factor is sin(theta) / theta; across it, the sine of the direction is taken
    # out, so that a factor (1 - cos(theta)) / (theta sin(theta)) remains.
    factor, first, second = axial_ratio(table, c) if component == 1 else transverse_ratio(table, c)
    # Chain rule from cos(theta) to both angles.
    oaa = first * haa + second * ga * ga
    oab = first * hab + second * ga * gb
    obb = first * hbb + second * gb * gb
    oa, ob = first * ga, first * gb
    # Factor for the direction in which the rod bends.
    v, va, vb, vaa, vab, vbb = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if component == 0:
        v, vb, vbb = -sb, -cb, sb
    elif component == 2:
        v, va, vb, vaa, vab, vbb = sa * cb, ca * cb, -sa * sb, -sa * cb, -ca * sb, -sa * cb
    size = table[1] * table[ROD.LENGTH]
    da, db = size * (v * oa + factor * va), size * (v * ob + factor * vb)
    daa = size * (v * oaa + factor * vaa + 2.0 * va * oa)
    dab = size * (v * oab + factor * vab + va * ob + vb * oa)
    dbb = size * (v * obb + factor * vbb + 2.0 * vb * ob)
    return size * v * factor, da, db, daa, dab, dbb


def axial_ratio(table: Floats, cosine: float) -> tuple[float, float, float]:
    """Return (sin θ) / θ and its first and second derivative by cos θ.

    Args:
        table: table of the function.
        cosine: cos θ.

    Returns:
        Value, first and second derivative.
    """
    square = angle_squared(cosine)
    h, h1, h2 = evaluate_series(at(table, ROD.SERIES), int(table[ROD.TERMS]), square)
    return differentiate_by_cosine(h, h1, h2, h, h1)


def transverse_ratio(table: Floats, cosine: float) -> tuple[float, float, float]:
    """Return (1 - cos θ) / (θ sin θ) and its first and second derivative by cos θ.

    Args:
        table: table of the function.
        cosine: cos θ.

    Returns:
        Value, first and second derivative.
    """
    square = angle_squared(cosine)
    count = int(table[ROD.TERMS])
    h, h1, h2 = evaluate_series(at(table, ROD.SERIES), count, square)
    m, m1, m2 = evaluate_series(at(table, ROD.SERIES + count), count, square)
    # Reciprocal of h with its derivatives, by which the series of (1 - cos) / theta^2 is
    # multiplied.
    k = 1.0 / h
    k1 = -h1 / (h * h)
    k2 = 2.0 * h1 * h1 / (h * h * h) - h2 / (h * h)
    return differentiate_by_cosine(m * k, m1 * k + m * k1, m2 * k + 2.0 * m1 * k1 + m * k2, h, h1)


def angle_squared(cosine: float) -> float:
    """Return the square of an angle from its cosine."""
    # Rounding may lead beyond 1.
    angle = acos(max(-1.0, min(1.0, cosine)))
    return angle * angle


def evaluate_series(terms: Floats, count: int, square: float) -> tuple[float, float, float]:
    """Evaluate a polynomial by Horner's rule.

    Args:
        terms: coefficients by rising powers.
        count: number of coefficients.
        square: argument θ².

    Returns:
        Value, first and second derivative.
    """
    value = slope = bend = 0.0
    # Horner's rule for value and derivatives at once; `bend` is half of the second derivative.
    for k in range(count - 1, -1, -1):
        bend = bend * square + slope
        slope = slope * square + value
        value = value * square + terms[k]
    return value, slope, 2.0 * bend


def differentiate_by_cosine(
    value: float, first: float, second: float, h: float, h1: float
) -> tuple[float, float, float]:
    """Convert derivatives by θ² to derivatives by c = cos θ, using d(θ²)/dc = -2 θ / sin θ = -2 / h.

    Args:
        value: value of the function.
        first: first derivative by θ².
        second: second derivative by θ².
        h: (sin θ) / θ.
        h1: derivative of h by θ².

    Returns:
        Value, first and second derivative by cos θ.
    """
    rate = -2.0 / h
    rate1 = 2.0 * h1 / (h * h)
    return value, rate * first, rate * (rate1 * first + rate * second)
