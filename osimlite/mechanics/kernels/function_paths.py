"""Paths of which length, speed and moment arms are functions of coordinates, and the laws of such functions.

A function is an item. Its arguments are coordinates, or coordinates and their speeds; its record
begins with the value, which the derivatives by the arguments follow.
"""

from __future__ import annotations

from osimlite.mechanics.kernels.functions import value_at
from osimlite.mechanics.kernels.layout import ITEM, MODEL, OUTCOME
from osimlite.mechanics.kernels.paths import LENGTH, SPEED, TENSION
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.kernels.programs import compute

COUNT, LENGTH_BACK, SPEED_BACK, COORDINATES = ITEM.OWN + 1, ITEM.OWN + 2, ITEM.OWN + 3, ITEM.OWN + 4
"""Integers of a path: how many coordinates it depends on; how far before it the items of length and
speed stand, 0 if the speed follows from the moment arms; the degrees of freedom of the coordinates
(-1 for a locked one), and after them how far before it the items of the moment arms stand, 0 for
one that is the derivative of the length times -1.
"""
ARMS = 3
"""The rest of its record: the moment arms."""

SIZE, ORDER, ARGUMENTS = ITEM.OWN, ITEM.OWN + 1, ITEM.OWN + 2
"""Integers of a function: how many arguments it has; the order of a polynomial, or how many
programs a formula has; the places of the arguments in a state (-1 for what does not change). Its
numbers begin with the arguments that do not.
"""
DERIVATIVES = 1


def function_path(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Length and speed of a FunctionBasedPath, and its moment arms."""
    i, result = at(model, item), at(data, model[item + ITEM.RECORD])
    count, coordinates = i[COUNT], at(i, COORDINATES)
    length = called(model, reals, data, y, f, item - i[LENGTH_BACK])
    speed = 0.0
    for k in range(count):
        back = coordinates[count + k]
        arm = (
            called(model, reals, data, y, f, item - back)[0]
            if back > 0
            else -length[DERIVATIVES + k]
        )
        result[ARMS + k] = arm
        if coordinates[k] >= 0:
            speed -= arm * f[coordinates[k]]
    if i[SPEED_BACK] > 0:
        speed = called(model, reals, data, y, f, item - i[SPEED_BACK])[0]
    result[LENGTH], result[SPEED] = length[0], speed
    return OUTCOME.OK


def called(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> Floats:
    """The record of a function after it was computed."""
    call(model[item + ITEM.LAW], model, reals, data, y, f, item)
    return at(data, model[item + ITEM.RECORD])


def pull_coordinates(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int
) -> int:
    """Apply the tension of a path by its moment arms."""
    i, result = at(model, item), at(data, model[item + ITEM.RECORD])
    for k in range(i[COUNT]):
        freedom = i[COORDINATES + k]
        if freedom >= 0:
            f[model[MODEL.DOFS] + freedom] += result[ARMS + k] * result[TENSION]
    return OUTCOME.OK


def function_of_one(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int
) -> int:
    """Of a function of one argument, by its table."""
    i, p, result = (
        at(model, item),
        at(reals, model[item + ITEM.NUMBERS]),
        at(data, model[item + ITEM.RECORD]),
    )
    place = i[ARGUMENTS]
    result[0], result[DERIVATIVES], _ = value_at(at(p, 1), y[place] if place >= 0 else p[0])
    return OUTCOME.OK


def polynomial(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Of a MultivariatePolynomialFunction.

    The terms are sorted by the power of the first argument, then of the next. In the record stand,
    after the derivatives, the powers of each argument, which powers the term has, and its factors
    up to each argument.
    """
    i, p, result = (
        at(model, item),
        at(reals, model[item + ITEM.NUMBERS]),
        at(data, model[item + ITEM.RECORD]),
    )
    size, width = i[SIZE], i[ORDER] + 1
    powers = at(result, DERIVATIVES + size)
    exponents, factors = at(powers, size * width), at(powers, size * width + size)
    for k in range(size):
        place = i[ARGUMENTS + k]
        argument = y[place] if place >= 0 else p[k]
        powers[k * width] = 1.0
        for power in range(1, width):
            powers[k * width + power] = powers[k * width + power - 1] * argument
        result[DERIVATIVES + k] = exponents[k] = 0.0
    value, term, total = 0.0, 0, 0
    while True:
        product = p[size + term]
        for k in range(size):
            factors[k] = product
            product *= powers[k * width + int(exponents[k])]
        value += product
        after = 1.0
        for k in range(size - 1, -1, -1):
            power = int(exponents[k])
            if power > 0:
                result[DERIVATIVES + k] += (
                    factors[k] * (power * powers[k * width + power - 1]) * after
                )
            after *= powers[k * width + power]
        # The next term.
        k = size - 1
        while k > 0 and total == i[ORDER]:
            total -= int(exponents[k])
            exponents[k] = 0.0
            k -= 1
        if total == i[ORDER]:
            break
        exponents[k] += 1.0
        total += 1
        term += 1
    result[0] = value
    return OUTCOME.OK


def formula(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Value and derivatives of an ExpressionBasedFunction.

    After its arguments stand the programs of the value and of the derivatives, if these are asked
    for: the count of steps, the place of the constants, and the steps. The registers are in the
    record.
    """
    i, p, result = (
        at(model, item),
        at(reals, model[item + ITEM.NUMBERS]),
        at(data, model[item + ITEM.RECORD]),
    )
    size = i[SIZE]
    program, registers = at(i, ARGUMENTS + size), at(result, DERIVATIVES + size)
    for number in range(i[ORDER]):
        for k in range(size):
            place = i[ARGUMENTS + k]
            registers[k] = y[place] if place >= 0 else p[k]
        result[number] = compute(at(program, 2), program[0], at(p, program[1]), registers, size)
        program = at(program, 2 + 3 * program[0])
    return OUTCOME.OK
