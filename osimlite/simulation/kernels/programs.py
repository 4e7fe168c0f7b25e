"""Forces by formulas: a formula is a list of steps, each of which puts one number into a register."""

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
from osimlite.forces.springs import stretch
from osimlite.simulation.kernels.layout import FINE, FREEDOMS, NUMBERS, OWN, RECORD
from osimlite.simulation.kernels.paths import measure, own_numbers, pull
from osimlite.simulation.kernels.pointers import Floats, Ints, at
from osimlite.simulation.kernels.springs import (
    BUSHING_DEVIATIONS,
    BUSHING_LOADS,
    BUSHING_RATES,
    BUSHING_REGISTERS,
    coordinate,
    deviate,
    line,
    load_bushing,
    pull_line,
)

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


def coordinate_formula(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """A force on a coordinate: its record has value, speed, then the registers.

    The integers are the degree of freedom, the count of steps and the steps; the numbers the value of a locked
    coordinate, and the constants.
    """
    i = at(s, item)
    freedom, p, found = i[OWN], at(x, i[NUMBERS]), at(w, i[RECORD])
    registers = at(found, 1)
    registers[0], registers[1] = coordinate(s, y, freedom, p[0])
    found[0] = compute(at(i, OWN + 2), i[OWN + 1], at(p, 1), registers, 2)
    if freedom >= 0:
        f[s[FREEDOMS] + freedom] += found[0]
    return FINE


def point_formula(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """A tension between two points."""
    i = at(s, item)
    p, found = at(x, i[NUMBERS]), at(w, i[RECORD])
    registers = at(found, 12)
    registers[0], registers[1] = line(s, w, i[OWN], i[OWN + 1], p, found)
    tension = compute(at(i, OWN + 3), i[OWN + 2], at(p, 12), registers, 2)
    pull_line(s, w, i[OWN], i[OWN + 1], p, found, tension)
    return FINE


def path_formula(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """A tension along a path: after those of the path stand resting length and whether a slack one has no stretch."""
    length, rate = measure(s, x, w, item)
    i, p, found = at(s, item), own_numbers(s, x, item), at(w, s[item + RECORD])
    own, registers = at(i, OWN + 1 + i[OWN]), at(found, 3)
    registers[0], registers[1] = stretch(length, p[0], p[1] > 0.0), rate
    found[2] = compute(at(own, 1), own[0], at(p, 2), registers, 2)
    pull(s, x, w, item, found[2])
    return FINE


def bushing_formula(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """A bushing whose loads are formulas of all deviations: after the links stand, for each, place and count of its
    steps and the place of its constants."""
    i = at(s, item)
    p, found = at(x, i[NUMBERS]), at(w, i[RECORD])
    deviate(s, w, i[OWN], i[OWN + 1], p, found)
    registers, loads = at(found, BUSHING_REGISTERS), at(found, BUSHING_LOADS)
    for k in range(6):
        registers[k] = found[BUSHING_DEVIATIONS + k]
    for k in range(6):
        own = at(i, OWN + 2 + 3 * k)
        value = compute(at(i, OWN + own[0]), own[1], at(p, own[2]), registers, 6)
        loads[k] = -value - p[24 + k] * found[BUSHING_RATES + k]
    load_bushing(s, w, i[OWN], i[OWN + 1], p, found)
    return FINE
