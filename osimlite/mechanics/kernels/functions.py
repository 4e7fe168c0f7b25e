"""Functions of coordinates from a table of numbers: kind, a factor for the whole function, and what the kind needs."""

from __future__ import annotations

from math import cos, sin

from osimlite.mechanics.kernels.layout import ITEM, MODEL, OPERATION, OPERATION_WORK, OUTCOME, WORK
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.points import operation_ints, operation_work

PIECES, SINE, STEP, PIECES_OF_OPENSIM, MONOMIALS, MONOMIALS_OF_OPENSIM, ARC = 0, 1, 2, 3, 4, 5, 6
"""Kinds: polynomials between knots, a sine, a smooth step; from MONOMIALS on those of several
arguments, a sum of products of their powers, and the end of a bent rod. Those of OpenSim have what
OpenSim 4.6 takes for the second derivatives of a MultivariatePolynomialFunction, which is the
gradient in every column.
"""


def value_at(table: Floats, z: float) -> tuple[float, float, float]:
    """Value, slope and second derivative of a function of one number."""
    kind, factor = int(table[0]), table[1]
    value = slope = curvature = 0.0
    if kind == SINE:
        angle = table[3] * z + table[4]
        value = table[2] * sin(angle) + table[5]
        slope = table[2] * table[3] * cos(angle)
        curvature = -table[2] * table[3] * table[3] * sin(angle)
    elif kind == STEP:
        rate = 1.0 / (table[3] - table[2])
        t, rise = (z - table[2]) * rate, table[5] - table[4]
        if 0.0 < t < 1.0:
            slope = 30.0 * rise * rate * t * t * (1.0 - t) * (1.0 - t)
            curvature = 60.0 * rise * rate * rate * t * (1.0 - t) * (1.0 - 2.0 * t)
        t = min(max(t, 0.0), 1.0)
        value = table[4] + rise * t * t * t * (10.0 - 15.0 * t + 6.0 * t * t)
    else:
        value, slope, curvature = pieces_at(table, z, kind)
    return factor * value, factor * slope, factor * curvature


def pieces_at(table: Floats, z: float, kind: int) -> tuple[float, float, float]:
    """Likewise of polynomials between knots."""
    value = slope = curvature = 0.0
    knots, width = int(table[2]), int(table[3])
    low, high = 0, knots
    while high - low > 1:
        middle = (low + high) // 2
        if z < table[4 + middle]:
            high = middle
        else:
            low = middle
    piece, t = at(table, 4 + knots + low * width), z - table[4 + low]
    for k in range(width - 1, -1, -1):
        curvature = curvature * t + slope
        slope = slope * t + value
        value = value * t + piece[k]
    return value, slope, slope if kind == PIECES_OF_OPENSIM else 2.0 * curvature


def amount_by_one(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, operation: int
) -> int:
    """Amount of an operation by a function of one coordinate, with its derivatives."""
    j, a = (
        operation_ints(model, operation),
        operation_work(model, data, operation),
    )
    freedom = model[j[OPERATION.ARGUMENTS]]
    value, slope, curvature = value_at(
        at(reals, j[OPERATION.EXTRA] + 1), y[freedom] if freedom >= 0 else reals[j[OPERATION.EXTRA]]
    )
    speed = y[model[MODEL.DOFS] + freedom] if freedom >= 0 else 0.0
    a[OPERATION_WORK.AMOUNT], a[OPERATION_WORK.RATE], a[OPERATION_WORK.CURVATURE] = (
        value,
        slope * speed,
        curvature * speed * speed,
    )
    data[j[OPERATION.GRADIENT]] = slope
    return OUTCOME.OK


def amount_by_several(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, operation: int
) -> int:
    """Amount of an operation by a polynomial of several coordinates, with its derivatives."""
    j, a = (
        operation_ints(model, operation),
        operation_work(model, data, operation),
    )
    size, arguments, constants, gradient = (
        j[OPERATION.ARGUMENT_COUNT],
        at(model, j[OPERATION.ARGUMENTS]),
        at(reals, j[OPERATION.EXTRA]),
        at(data, j[OPERATION.GRADIENT]),
    )
    a[OPERATION_WORK.AMOUNT], a[OPERATION_WORK.RATE], a[OPERATION_WORK.CURVATURE] = several_at(
        size, arguments, constants, y, at(y, model[MODEL.DOFS]), gradient
    )
    return OUTCOME.OK


def several_at(
    size: int, arguments: Ints, constants: Floats, y: Floats, rates: Floats, gradient: Floats
) -> tuple[float, float, float]:
    """Value, rate and second derivative of a polynomial of several coordinates; fills its gradient.

    Args:
        size: count of the arguments.
        arguments: degrees of freedom, -1 for a number that does not change.
        constants: such numbers, and the table of the polynomial after them.
        y: values of the degrees of freedom.
        rates: of these values.
        gradient: by the arguments (size,).
    """
    table = at(constants, size)
    factor, count = table[1], int(table[2])
    value = rate = curvature = 0.0
    for index in range(size):
        gradient[index] = 0.0
    for term in range(count):
        coefficient, powers = factor * table[3 + term], at(table, 3 + count + term * size)
        value += coefficient * product(size, arguments, constants, y, powers, -1, -1)
        for one in range(size):
            if powers[one] == 0.0:
                continue
            first = (
                coefficient * powers[one] * product(size, arguments, constants, y, powers, one, -1)
            )
            gradient[one] += first
            if arguments[one] < 0:
                continue
            rate += first * rates[arguments[one]]
            for two in range(size):
                power = powers[two] - (1.0 if one == two else 0.0)
                if power == 0.0 or arguments[two] < 0:
                    continue
                second = (
                    coefficient
                    * powers[one]
                    * power
                    * product(size, arguments, constants, y, powers, one, two)
                )
                curvature += second * rates[arguments[one]] * rates[arguments[two]]
    if int(table[0]) == MONOMIALS_OF_OPENSIM:
        total = 0.0
        for index in range(size):
            total += rates[arguments[index]] if arguments[index] >= 0 else 0.0
        curvature = rate * total
    return value, rate, curvature


def product(
    size: int, arguments: Ints, constants: Floats, y: Floats, powers: Floats, one: int, two: int
) -> float:
    """Product of powers of all arguments; the powers of arguments `one` and `two` (-1 for none) are one less."""
    total = 1.0
    for index in range(size):
        power = int(powers[index]) - (1 if index == one else 0) - (1 if index == two else 0)
        total *= (y[arguments[index]] if arguments[index] >= 0 else constants[index]) ** power
    return total


def set_controls(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Each control is the sum of some functions of time.

    Of the record, from OWN on, the integers are the count of the controls, for each of them how
    many functions there are up to it, and the places of the functions' tables among the numbers.
    """
    i = at(model, item)
    count, numbers, values = i[ITEM.OWN], at(reals, i[ITEM.NUMBERS]), at(data, i[ITEM.RECORD])
    ends, tables = at(i, ITEM.OWN + 1), at(i, ITEM.OWN + 1 + count)
    place = 0
    for control in range(count):
        total = 0.0
        while place < ends[control]:
            value, _, _ = value_at(at(numbers, tables[place]), data[WORK.TIME])
            total += value
            place += 1
        values[control] = total
    return OUTCOME.OK


def with_reflex(data: Floats, place: int, gain: float, rate: float) -> float:
    """The control at a place, to which its gain (s/m) adds while the muscle lengthens at a rate (m/s)."""
    total: float = data[place] + gain * max(rate, 0.0)
    data[place] = total
    return total
