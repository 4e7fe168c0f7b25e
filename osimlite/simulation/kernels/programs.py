"""Formulas in kernels: a formula is a list of steps, each of which puts one number into a register."""

from __future__ import annotations

from osimlite.forces.formulas import (
    arccosine,
    arcsine,
    arctangent,
    complementary_error_function,
    cosecant,
    cosine,
    cotangent,
    cube,
    divide,
    error_function,
    exponential,
    hyperbolic_cosine,
    hyperbolic_sine,
    hyperbolic_tangent,
    is_zero,
    larger,
    logarithm,
    magnitude,
    power,
    reciprocal,
    secant,
    sine,
    smaller,
    square,
    square_root,
    tangent,
    unit_step,
)
from osimlite.simulation.elements.formula import Formula
from osimlite.simulation.kernels.pointers import Floats, Ints, at

STEPS = (
    "number",
    "+",
    "-",
    "*",
    "negative",
    "divide",
    "power",
    "smaller",
    "larger",
    "square_root",
    "exponential",
    "logarithm",
    "sine",
    "cosine",
    "secant",
    "cosecant",
    "tangent",
    "cotangent",
    "arcsine",
    "arccosine",
    "arctangent",
    "hyperbolic_sine",
    "hyperbolic_cosine",
    "hyperbolic_tangent",
    "error_function",
    "complementary_error_function",
    "unit_step",
    "is_zero",
    "square",
    "cube",
    "reciprocal",
    "magnitude",
)
"""What a step may do, by its number."""


def compute(steps: Ints, count: int, constants: Floats, registers: Floats, variables: int) -> float:
    """The result of a program.

    Args:
        steps: what each does, and the registers that it works on (count, 3); for a number its place in the constants.
        count: of the steps.
        constants: numbers of the formula.
        registers: the variables, and after them room for the results.
        variables: their count.
    """
    value = 0.0
    for k in range(count):
        kind, one, two = steps[3 * k], steps[3 * k + 1], steps[3 * k + 2]
        if kind == 0:
            value = constants[one]
        else:
            a, b = registers[one], registers[two]
            if kind == 1:
                value = a + b
            elif kind == 2:
                value = a - b
            elif kind == 3:
                value = a * b
            elif kind == 4:
                value = -a
            elif kind == 5:
                value = divide(a, b)
            elif kind == 6:
                value = power(a, b)
            elif kind == 7:
                value = smaller(a, b)
            elif kind == 8:
                value = larger(a, b)
            else:
                value = of_one(kind - 9, a)
        registers[variables + k] = value
    return value


def of_one(kind: int, a: float) -> float:
    """A function of one number."""
    value = 0.0
    if kind == 0:
        value = square_root(a)
    elif kind == 1:
        value = exponential(a)
    elif kind == 2:
        value = logarithm(a)
    elif kind == 3:
        value = sine(a)
    elif kind == 4:
        value = cosine(a)
    elif kind == 5:
        value = secant(a)
    elif kind == 6:
        value = cosecant(a)
    elif kind == 7:
        value = tangent(a)
    elif kind == 8:
        value = cotangent(a)
    elif kind == 9:
        value = arcsine(a)
    elif kind == 10:
        value = arccosine(a)
    elif kind == 11:
        value = arctangent(a)
    elif kind == 12:
        value = hyperbolic_sine(a)
    elif kind == 13:
        value = hyperbolic_cosine(a)
    elif kind == 14:
        value = hyperbolic_tangent(a)
    elif kind == 15:
        value = error_function(a)
    elif kind == 16:
        value = complementary_error_function(a)
    elif kind == 17:
        value = unit_step(a)
    elif kind == 18:
        value = is_zero(a)
    elif kind == 19:
        value = square(a)
    elif kind == 20:
        value = cube(a)
    elif kind == 21:
        value = reciprocal(a)
    elif kind == 22:
        value = magnitude(a)
    return value


def of_two(one: float, two: float, steps: Ints, constants: Floats, registers: Floats) -> float:
    """The result of a program of two variables, whose count of steps stands before them."""
    registers[0], registers[1] = one, two
    return compute(at(steps, 1), steps[0], constants, registers, 2)


def program(formula: Formula) -> tuple[list[int], list[float]]:
    """Steps and constants of a formula, as `compute` takes them."""
    steps: list[int] = []
    constants: list[float] = []
    for step in formula.steps:
        one, two, *_ = *step.arguments, 0, 0
        if step.law == "number":
            one = len(constants)
            constants.append(step.value)
        steps += STEPS.index(step.law), one, two
    return steps, constants
