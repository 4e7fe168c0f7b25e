"""Interpreter of formulas: a program is a list of steps, each of which fills one register."""

from __future__ import annotations

from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.table import compile_text
from osimlite.mechanics.laws import formulas
from osimlite.mechanics.laws.formulas import FUNCTIONS, OF_TWO, divide, larger, power, smaller

# The branches of single functions are generated, so that their order is that of FUNCTIONS in one
# place only.
OF_ONE = tuple(law for name, law in FUNCTIONS.items() if name not in OF_TWO)
"""Names of the functions of one argument, in the order of their numbers."""
STEPS = ("number", "+", "-", "*", "negative", "divide", "power", "smaller", "larger", *OF_ONE)
"""Operations of the steps; a step stores the index of its operation here."""

LINES = [
    line
    for number, law in enumerate(OF_ONE)
    for line in (f"if kind == {number}:", f"    return {law}(a)")
]
"""Text of the branches of `of_one`."""
of_one = compile_text(
    "of_one",
    __name__,
    "\n    ".join(['def of_one(kind: "int", a: "float") -> "float":', *LINES, "return 0.0\n"]),
    **{law: getattr(formulas, law) for law in OF_ONE},
)


def run_program(
    steps: Ints, count: int, constants: Floats, registers: Floats, variables: int
) -> float:
    """Return the result of a program, which is that of its last step; 0 without steps.

    Args:
        steps: operation and two registers of each step (count, 3); for the operation "number" the
            index in the constants instead of the first register.
        count: number of steps.
        constants: numbers of the formula.
        registers: the variables, then one register for the result of each step.
        variables: number of variables.
    """
    # The operations are tested in the order of STEPS.
    value = 0.0
    for k in range(count):
        operation = steps[3 * k]
        first_register = steps[3 * k + 1]
        second_register = steps[3 * k + 2]
        if operation == 0:
            value = constants[first_register]
        else:
            a, b = registers[first_register], registers[second_register]
            if operation == 1:
                value = a + b
            elif operation == 2:
                value = a - b
            elif operation == 3:
                value = a * b
            elif operation == 4:
                value = -a
            elif operation == 5:
                value = divide(a, b)
            elif operation == 6:
                value = power(a, b)
            elif operation == 7:
                value = smaller(a, b)
            elif operation == 8:
                value = larger(a, b)
            else:
                value = of_one(operation - 9, a)
        registers[variables + k] = value
    return value


def run_binary_program(
    first_value: float, second_value: float, steps: Ints, constants: Floats, registers: Floats
) -> float:
    """Run a program of two variables.

    Args:
        first_value: first variable.
        second_value: second variable.
        steps: number of steps, then the steps.
        constants: numbers of the formula.
        registers: workspace of 2 registers and one for each step.

    Returns:
        Result of the program.
    """
    registers[0], registers[1] = first_value, second_value
    return run_program(at(steps, 1), steps[0], constants, registers, 2)
