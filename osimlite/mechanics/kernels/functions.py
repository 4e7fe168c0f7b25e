"""Functions of coordinates and of time, each in a table of numbers, and controls.

A table begins with the kind of the function and a factor for all of it; the rest depends on the
kind. A control is a sum of functions of time.
"""

from __future__ import annotations

from math import cos, sin

from osimlite.mechanics.kernels.layout import (
    ITEM,
    MODEL,
    OPERATION,
    OPERATION_WORK,
    OUTCOME,
    WORK,
    Record,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.points import operation_ints, operation_work


class FUNCTION_TYPE(metaclass=Record):
    """Types of functions, as their tables name them."""

    PIECES = 0
    """Polynomials between knots."""
    SINE = 1
    """Sine a sin(w t + phi) + offset."""
    STEP = 2
    """A quintic step between two values."""
    PIECES_OF_OPENSIM = 3
    """Polynomials between knots, with OpenSim 4.6's second derivative."""
    MONOMIALS = 4
    """Sum of products of powers; the kinds from here on have several arguments."""
    MONOMIALS_OF_OPENSIM = 5
    """Sum of products of powers, with OpenSim 4.6's second derivatives.

    OpenSim 4.6 uses the gradient in every column in place of the second derivatives of a
    MultivariatePolynomialFunction.
"""
    ARC = 6
    """End of a bent rod, see :mod:`osimlite.mechanics.kernels.constant_curvature`."""


def evaluate_function(table: Floats, z: float) -> tuple[float, float, float]:
    """Evaluate a function of one argument.

    Args:
        table: table of the function.
        z: argument.

    Returns:
        Value, first and second derivative.
    """
    function_type = int(table[0])
    factor = table[1]
    value = slope = curvature = 0.0
    if function_type == FUNCTION_TYPE.SINE:
        angle = table[3] * z + table[4]
        value = table[2] * sin(angle) + table[5]
        slope = table[2] * table[3] * cos(angle)
        curvature = -table[2] * table[3] * table[3] * sin(angle)
    elif function_type == FUNCTION_TYPE.STEP:
        # Quintic step: S(t) = 10 t^3 - 15 t^4 + 6 t^5 between both ends, constant outside.
        rate = 1.0 / (table[3] - table[2])
        t = (z - table[2]) * rate
        rise = table[5] - table[4]
        if 0.0 < t < 1.0:
            slope = 30.0 * rise * rate * t * t * (1.0 - t) * (1.0 - t)
            curvature = 60.0 * rise * rate * rate * t * (1.0 - t) * (1.0 - 2.0 * t)
        t = min(max(t, 0.0), 1.0)
        value = table[4] + rise * t * t * t * (10.0 - 15.0 * t + 6.0 * t * t)
    else:
        value, slope, curvature = evaluate_piecewise(table, z, function_type)
    return factor * value, factor * slope, factor * curvature


def evaluate_piecewise(table: Floats, z: float, function_type: int) -> tuple[float, float, float]:
    """Evaluate a function that consists of polynomials between knots.

    Args:
        table: table of the function.
        z: argument.
        function_type: PIECES or PIECES_OF_OPENSIM of `FUNCTION_TYPE`.

    Returns:
        Value, first and second derivative.
    """
    value = slope = curvature = 0.0
    knots, width = int(table[2]), int(table[3])
    # Binary search for the piece. The first one also holds before its knot, the last one after.
    low, high = 0, knots
    while high - low > 1:
        middle = (low + high) // 2
        if z < table[4 + middle]:
            high = middle
        else:
            low = middle
    piece = at(table, 4 + knots + low * width)
    t = z - table[4 + low]
    # Horner's rule for value and derivatives at once; `curvature` is half of the second derivative.
    for k in range(width - 1, -1, -1):
        curvature = curvature * t + slope
        slope = slope * t + value
        value = value * t + piece[k]
    # OpenSim 4.6 returns the first derivative as the second one for some piecewise functions.
    return (
        value,
        slope,
        slope if function_type == FUNCTION_TYPE.PIECES_OF_OPENSIM else 2.0 * curvature,
    )


def amount_by_one(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, operation: int
) -> int:
    """Compute the amount of an operation by a function of one coordinate, with its derivatives.

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
    a = operation_work(model, data, operation)
    freedom = model[j[OPERATION.ARGUMENTS]]
    value, slope, curvature = evaluate_function(
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
    """Compute the amount of an operation by a polynomial of several coordinates.

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
    a = operation_work(model, data, operation)
    size = j[OPERATION.ARGUMENT_COUNT]
    arguments = at(model, j[OPERATION.ARGUMENTS])
    constants = at(reals, j[OPERATION.EXTRA])
    gradient = at(data, j[OPERATION.GRADIENT])
    a[OPERATION_WORK.AMOUNT], a[OPERATION_WORK.RATE], a[OPERATION_WORK.CURVATURE] = (
        evaluate_monomials(size, arguments, constants, y, at(y, model[MODEL.DOFS]), gradient)
    )
    return OUTCOME.OK


def evaluate_monomials(
    size: int, arguments: Ints, constants: Floats, y: Floats, rates: Floats, gradient: Floats
) -> tuple[float, float, float]:
    """Evaluate a polynomial of several coordinates and fill its gradient.

    Args:
        size: number of arguments.
        arguments: degrees of freedom of the arguments, -1 for a constant one.
        constants: values of constant arguments (size,), then the table of the polynomial.
        y: values of the degrees of freedom.
        rates: rates of the degrees of freedom.
        gradient: filled with the derivatives by the arguments (size,).

    Returns:
        Value, rate, and the second derivative by time at constant rates.
    """
    table = at(constants, size)
    factor = table[1]
    count = int(table[2])
    value = rate = curvature = 0.0
    for index in range(size):
        gradient[index] = 0.0
    for term in range(count):
        coefficient = factor * table[3 + term]
        powers = at(table, 3 + count + term * size)
        # Each derivative is a product of powers of its own: dividing the value by an argument would
        # fail at 0.
        value += coefficient * multiply_powers(size, arguments, constants, y, powers, -1, -1)
        for first_argument in range(size):
            if powers[first_argument] == 0.0:
                continue
            first = (
                coefficient
                * powers[first_argument]
                * multiply_powers(size, arguments, constants, y, powers, first_argument, -1)
            )
            gradient[first_argument] += first
            # Constant arguments have a gradient, which workspace expects, but no rate.
            if arguments[first_argument] < 0:
                continue
            rate += first * rates[arguments[first_argument]]
            for second_argument in range(size):
                power = powers[second_argument] - (
                    1.0 if first_argument == second_argument else 0.0
                )
                if power == 0.0 or arguments[second_argument] < 0:
                    continue
                second = (
                    coefficient
                    * powers[first_argument]
                    * power
                    * multiply_powers(
                        size, arguments, constants, y, powers, first_argument, second_argument
                    )
                )
                curvature += (
                    second * rates[arguments[first_argument]] * rates[arguments[second_argument]]
                )
    # OpenSim's error: the gradient stands in place of each row of the second derivatives.
    if int(table[0]) == FUNCTION_TYPE.MONOMIALS_OF_OPENSIM:
        total = 0.0
        for index in range(size):
            total += rates[arguments[index]] if arguments[index] >= 0 else 0.0
        curvature = rate * total
    return value, rate, curvature


def multiply_powers(
    size: int,
    arguments: Ints,
    constants: Floats,
    y: Floats,
    powers: Floats,
    first_argument: int,
    second_argument: int,
) -> float:
    """Return the product of powers of all arguments.

    Args:
        size: number of arguments.
        arguments: degrees of freedom of the arguments, -1 for a constant one.
        constants: values of constant arguments (size,).
        y: values of the degrees of freedom.
        powers: powers (size,).
        first_argument: argument whose power is reduced by 1, -1 for none.
        second_argument: argument whose power is reduced by 1 (once more), -1 for none.
    """
    total = 1.0
    for index in range(size):
        # Powers are integers, so that negative arguments have defined results.
        power = (
            int(powers[index])
            - (1 if index == first_argument else 0)
            - (1 if index == second_argument else 0)
        )
        total *= (y[arguments[index]] if arguments[index] >= 0 else constants[index]) ** power
    return total


def set_controls(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Compute each control as the sum of some functions of time.

    The integers of the record from DETAILS on are the number of controls, the cumulative number of
    functions of each control, and the offsets of the functions' tables among the numbers.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the controls are filled.
        y: state.
        f: rates of the coordinates.
        item: offset of the record of the controls in the model.

    Returns:
        `OUTCOME.OK`.
    """
    i = at(model, item)
    count = i[ITEM.DETAILS]
    numbers = at(reals, i[ITEM.NUMBERS])
    values = at(data, i[ITEM.RECORD])
    ends = at(i, ITEM.DETAILS + 1)
    tables = at(i, ITEM.DETAILS + 1 + count)
    function_number = 0
    for control in range(count):
        total = 0.0
        while function_number < ends[control]:
            value, _, _ = evaluate_function(at(numbers, tables[function_number]), data[WORK.TIME])
            total += value
            function_number += 1
        values[control] = total
    return OUTCOME.OK


def add_reflex(data: Floats, offset: int, gain: float, rate: float) -> float:
    """Add a stretch reflex to a control.

    The reflex is gain max(v, 0): a muscle that shortens causes none.

    Args:
        data: results with the controls.
        offset: offset of the control in data.
        gain: gain of the reflex (s/m).
        rate: lengthening speed v of the muscle (m/s).

    Returns:
        Control with the reflex.
    """
    total: float = data[offset] + gain * max(rate, 0.0)
    data[offset] = total
    return total
