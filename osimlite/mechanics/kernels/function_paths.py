"""Paths whose length, speed and moment arms are functions of coordinates, and these functions.

A function is an item. Its arguments are coordinates, or coordinates and their speeds; its record
begins with its value, followed by the derivatives by the arguments.
"""

from __future__ import annotations

from osimlite.mechanics.kernels.functions import evaluate_function
from osimlite.mechanics.kernels.layout import ITEM, MODEL, OUTCOME, Record
from osimlite.mechanics.kernels.paths import PATH_WORK
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.kernels.programs import run_program


class FUNCTION_PATH(metaclass=Record):
    """Integers of a path whose length is a function of coordinates."""

    COUNT = ITEM.DETAILS + 1
    """Number of its coordinates."""
    LENGTH_BACK = ITEM.DETAILS + 2
    """Distance back to the item of the length function."""
    SPEED_BACK = ITEM.DETAILS + 3
    """Distance back to the item of the speed function, 0 if moment arms give the speed."""
    COORDINATES = ITEM.DETAILS + 4
    """Degrees of freedom of the coordinates, -1 for a locked one.

    They are followed by the distances back to the items of the moment arms, 0 for a moment arm that is
    the negative derivative of the length.
"""


class FUNCTION_PATH_WORK(metaclass=Record):
    """Record of such a path behind that of any path, see `PATH_WORK`."""

    ARMS = 3
    """Moment arms (m)."""


class FUNCTION(metaclass=Record):
    """Integers of a function."""

    COUNT = ITEM.DETAILS
    """Number of its arguments."""
    ORDER = ITEM.DETAILS + 1
    """Order of a polynomial, or number of programs of a formula."""
    ARGUMENTS = ITEM.DETAILS + 2
    """Indices of the arguments in a state, -1 for a constant one.

    The numbers of a function begin with the values of constant arguments.
"""


class FUNCTION_WORK(metaclass=Record):
    """Record of a function, which begins with its value."""

    DERIVATIVES = 1
    """Derivatives by the arguments."""


def function_path(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Compute length, speed and moment arms of a FunctionBasedPath.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the record of the path is filled.
        y: state.
        f: rates of the coordinates.
        item: offset of the item in the model.

    Returns:
        `OUTCOME.OK`.
    """
    i = at(model, item)
    result = at(data, model[item + ITEM.RECORD])
    count = i[FUNCTION_PATH.COUNT]
    coordinates = at(i, FUNCTION_PATH.COORDINATES)
    length = evaluate_item(model, reals, data, y, f, item - i[FUNCTION_PATH.LENGTH_BACK])
    speed = 0.0
    for k in range(count):
        back = coordinates[count + k]
        arm = (
            evaluate_item(model, reals, data, y, f, item - back)[0]
            if back > 0
            else -length[FUNCTION_WORK.DERIVATIVES + k]
        )
        result[FUNCTION_PATH_WORK.ARMS + k] = arm
        if coordinates[k] >= 0:
            # OpenSim defines moment arms as negative derivatives of the length.
            speed -= arm * f[coordinates[k]]
    if i[FUNCTION_PATH.SPEED_BACK] > 0:
        speed = evaluate_item(model, reals, data, y, f, item - i[FUNCTION_PATH.SPEED_BACK])[0]
    result[PATH_WORK.LENGTH], result[PATH_WORK.SPEED] = length[0], speed
    return OUTCOME.OK


def evaluate_item(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int
) -> Floats:
    """Evaluate the function of an item, and fill its output record.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the record of the item is filled.
        y: state.
        f: rates of the coordinates.
        item: offset of the item in the model.

    Returns:
        Part of `data` that begins with the output record of the item.
    """
    call(model[item + ITEM.LAW], model, reals, data, y, f, item)
    return at(data, model[item + ITEM.RECORD])


def pull_coordinates(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int
) -> int:
    """Apply the tension of a path to its coordinates by its moment arms.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results with the record of the path.
        y: state.
        f: rates of the coordinates, then generalized forces; changed.
        item: offset of the item in the model.

    Returns:
        `OUTCOME.OK`.
    """
    i = at(model, item)
    result = at(data, model[item + ITEM.RECORD])
    for k in range(i[FUNCTION_PATH.COUNT]):
        freedom = i[FUNCTION_PATH.COORDINATES + k]
        if freedom >= 0:
            f[model[MODEL.DOFS] + freedom] += (
                result[FUNCTION_PATH_WORK.ARMS + k] * result[PATH_WORK.TENSION]
            )
    return OUTCOME.OK


def function_of_one(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int
) -> int:
    """Evaluate a function of one argument and its derivative by its table.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the record of the function is filled.
        y: state.
        f: rates of the coordinates.
        item: offset of the item in the model.

    Returns:
        `OUTCOME.OK`.
    """
    i = at(model, item)
    p = at(reals, model[item + ITEM.NUMBERS])
    result = at(data, model[item + ITEM.RECORD])
    freedom = i[FUNCTION.ARGUMENTS]
    result[0], result[FUNCTION_WORK.DERIVATIVES], _ = evaluate_function(
        at(p, 1), y[freedom] if freedom >= 0 else p[0]
    )
    return OUTCOME.OK


def polynomial(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Evaluate a MultivariatePolynomialFunction and its gradient.

    The terms are sorted by the power of the first argument, then of the next. The record holds, after
    the derivatives, the powers of each argument, the exponents of the current term, and its partial
    products up to each argument.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the record of the function is filled.
        y: state.
        f: rates of the coordinates.
        item: offset of the item in the model.

    Returns:
        `OUTCOME.OK`.
    """
    i = at(model, item)
    p = at(reals, model[item + ITEM.NUMBERS])
    result = at(data, model[item + ITEM.RECORD])
    size = i[FUNCTION.COUNT]
    width = i[FUNCTION.ORDER] + 1
    powers = at(result, FUNCTION_WORK.DERIVATIVES + size)
    exponents = at(powers, size * width)
    factors = at(powers, size * width + size)
    for k in range(size):
        freedom = i[FUNCTION.ARGUMENTS + k]
        # Powers once per argument, since many terms share them.
        argument = y[freedom] if freedom >= 0 else p[k]
        powers[k * width] = 1.0
        for power in range(1, width):
            powers[k * width + power] = powers[k * width + power - 1] * argument
        result[FUNCTION_WORK.DERIVATIVES + k] = exponents[k] = 0.0
    value, term, total = 0.0, 0, 0
    while True:
        product = p[size + term]
        for k in range(size):
            factors[k] = product
            product *= powers[k * width + int(exponents[k])]
        value += product
        later_product = 1.0
        # Derivatives by the product before the argument, that of its power, and the product after
        # it: no division.
        for k in range(size - 1, -1, -1):
            power = int(exponents[k])
            if power > 0:
                result[FUNCTION_WORK.DERIVATIVES + k] += (
                    factors[k] * (power * powers[k * width + power - 1]) * later_product
                )
            later_product *= powers[k * width + power]
        # Count exponents up like digits, as long as their sum does not exceed the order.
        k = size - 1
        while k > 0 and total == i[FUNCTION.ORDER]:
            total -= int(exponents[k])
            exponents[k] = 0.0
            k -= 1
        if total == i[FUNCTION.ORDER]:
            break
        exponents[k] += 1.0
        total += 1
        term += 1
    result[0] = value
    return OUTCOME.OK


def formula(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Evaluate an ExpressionBasedFunction and its requested derivatives.

    The integers after the arguments are the programs of the value and of the derivatives: the number of
    steps, the offset of the constants, and the steps. The registers are in the record.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the record of the function is filled.
        y: state.
        f: rates of the coordinates.
        item: offset of the item in the model.

    Returns:
        `OUTCOME.OK`.
    """
    i = at(model, item)
    p = at(reals, model[item + ITEM.NUMBERS])
    result = at(data, model[item + ITEM.RECORD])
    size = i[FUNCTION.COUNT]
    program = at(i, FUNCTION.ARGUMENTS + size)
    registers = at(result, FUNCTION_WORK.DERIVATIVES + size)
    for number in range(i[FUNCTION.ORDER]):
        for k in range(size):
            freedom = i[FUNCTION.ARGUMENTS + k]
            registers[k] = y[freedom] if freedom >= 0 else p[k]
        result[number] = run_program(at(program, 2), program[0], at(p, program[1]), registers, size)
        program = at(program, 2 + 3 * program[0])
    return OUTCOME.OK
