"""Formulas in kernels: a formula is a list of steps, each of which puts one number into a register."""

from __future__ import annotations

from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.table import written
from osimlite.mechanics.laws import formulas
from osimlite.mechanics.laws.formulas import FUNCTIONS, OF_TWO, divide, larger, power, smaller

OF_ONE = tuple(law for name, law in FUNCTIONS.items() if name not in OF_TWO)
STEPS = ("number", "+", "-", "*", "negative", "divide", "power", "smaller", "larger", *OF_ONE)
"""What a step may do, by its number."""

LINES = [
    line
    for number, law in enumerate(OF_ONE)
    for line in (f"if kind == {number}:", f"    return {law}(a)")
]
of_one = written(
    "of_one",
    __name__,
    "\n    ".join(['def of_one(kind: "int", a: "float") -> "float":', *LINES, "return 0.0\n"]),
    **{law: getattr(formulas, law) for law in OF_ONE},
)


def compute(steps: Ints, count: int, constants: Floats, registers: Floats, variables: int) -> float:
    """The result of a program.

    Args: steps: what each does, and the registers that it works on (count, 3); for a number its
        place in the constants. count: of the steps. constants: numbers of the formula. registers:
        the variables, and after them room for the results. variables: their count.
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


def of_two(one: float, two: float, steps: Ints, constants: Floats, registers: Floats) -> float:
    """The result of a program of two variables, whose count of steps stands before them."""
    registers[0], registers[1] = one, two
    return compute(at(steps, 1), steps[0], constants, registers, 2)
