"""Steps of formulas, simplified while they are added.

As in Lepton, which OpenSim uses, ``0*x`` is 0, ``x-x`` is 0 and ``x/x`` is 1, whatever x is. What is
simplified away may be NaN, or an unknown name.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.text import join_words, suggest_name
from osimlite.mechanics.laws import formulas

UNKNOWN = "unknown"
"""Law of a step that stands for an unknown name."""
_SIGNS: dict[str, Callable[..., float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "negative": lambda a: -a,
}


class FormulaStep(NamedTuple):
    """One operation of a formula, which fills one register."""

    law: str  # "number", "negative", "+", "-", "*", or the name of a law
    arguments: tuple[int, ...] = ()  # registers of the operands
    value: float = 0.0  # value of a number


class FormulaError(Exception):
    """Error of a formula, without its position in the model."""


class UnknownNameError(FormulaError):
    """Error of a formula that needs an unknown name."""


def _evaluate_law(law: str, *numbers: float | None) -> float:
    """Return the result of a law for numbers.

    Args:
        law: operator, or name of a function of `formulas`.
        numbers: arguments of the law.
    """
    return float((_SIGNS.get(law) or getattr(formulas, law))(*numbers))


class SimplifiedSteps:
    """Steps of formulas of the same variables, each simplified as Lepton does when it is added.

    Args:
        variables: names of the variables, which are in the first registers.

    Attributes:
        step_numbers: registers of the names that may be used.
        unknown: unknown names that were used.
        steps: steps of all formulas so far.
    """

    def __init__(self, variables: Sequence[str]) -> None:
        self.step_numbers = {name: index for index, name in enumerate(variables)}
        self.unknown: list[str] = []
        self.steps: list[FormulaStep] = []
        self._registers: dict[FormulaStep, int] = {}
        self._numbers: dict[float, int] = {}
        self._derived: set[int] = set()
        self._first = len(variables)

    def add(self, law: str, *arguments: int, value: float = 0.0) -> int:
        """Add a step, or a simpler one with the same result.

        Args:
            law: law of the step.
            arguments: registers of the operands.
            value: value of a number.

        Returns:
            Register of the result.
        """
        if law in ("number", UNKNOWN):
            return self._append_step(law, value=value)
        constants = [self._get_constant(argument) for argument in arguments]
        # Lepton computes what is written in numbers alone, and only then applies its rules: 0/0 is
        # NaN, 0*q/0 is 1.
        if self._derived.isdisjoint(arguments) and None not in constants:
            return self._append_step("number", value=_evaluate_law(law, *constants))
        return self._simplify(law, arguments, constants)

    def append_steps(self, steps: Sequence[FormulaStep]) -> None:
        """Append the steps of another formula of the same variables as they are."""
        for step in steps:
            self._registers.setdefault(step, self._first + len(self.steps))
            self.steps.append(step)

    def ending_with(self, result: int) -> tuple[FormulaStep, ...]:
        """Return the steps that a result needs; the last one gives it.

        Args:
            result: register of the result.

        Returns:
            Steps, in the order in which they fill registers.

        Raises:
            FormulaError: a step stands for an unknown name, or is NaN for all values of the variables.
        """
        needed = set[int]()
        waiting = [result]
        while waiting:
            register = waiting.pop()
            if register >= self._first and register not in needed:
                needed.add(register)
                waiting += self._get_step(register).arguments
        new_registers = {register: register for register in range(self._first)}
        steps: list[FormulaStep] = []
        for register in sorted(needed):
            step = self._get_step(register)
            self._expect_meaning(step)
            new_registers[register] = self._first + len(steps)
            steps.append(
                step._replace(
                    arguments=tuple(new_registers[argument] for argument in step.arguments)
                )
            )
        if not steps:
            # The result is a variable, but a formula ends with a step: add 0.
            steps = [FormulaStep("number"), FormulaStep("+", (result, self._first))]
        return tuple(steps)

    def _append_step(self, law: str, *arguments: int, value: float = 0.0) -> int:
        """Add a step unless the same one exists.

        Args:
            law: law of the step.
            arguments: registers of the operands.
            value: value of a number.

        Returns:
            Register of the new or existing step.
        """
        step = FormulaStep(law, arguments, value)
        if step not in self._registers:
            self._registers[step] = self._first + len(self.steps)
            self.steps.append(step)
        return self._registers[step]

    def _append_derived_number(self, value: float) -> int:
        """Return the register of a number that a rule gives.

        Such numbers are distinguished from written ones, to which Lepton applies no rules.
        """
        if value not in self._numbers:
            self._numbers[value] = self._first + len(self.steps)
            self._derived.add(self._numbers[value])
            self.steps.append(FormulaStep("number", value=value))
        return self._numbers[value]

    def _is_same(self, first_register: int, second_register: int) -> bool:
        first = self._get_constant(first_register)
        return first_register == second_register or (
            first is not None and first == self._get_constant(second_register)
        )

    def _get_step(self, register: int) -> FormulaStep:
        return (
            self.steps[register - self._first]
            if register >= self._first
            else FormulaStep("variable", (register,))
        )

    def _get_constant(self, register: int) -> float | None:
        step = self._get_step(register)
        return step.value if step.law == "number" else None

    def _get_argument(self, law: str, register: int) -> int | None:
        """Return the argument of a step of one law, None for a step of another law.

        Args:
            law: law of one number.
            register: register of the step.
        """
        step = self._get_step(register)
        return step.arguments[0] if step.law == law else None

    def _factor_of_multiple(self, register: int) -> tuple[float, int] | None:
        """Return the factor and the register of a multiple, None for another step."""
        step = self._get_step(register)
        factor = self._get_constant(step.arguments[0]) if step.law == "*" else None
        return None if factor is None else (factor, step.arguments[1])

    def _scale(self, factor: float, register: int) -> int:
        """Return the register of a multiple; a multiple of a multiple has one factor.

        Args:
            factor: factor of the multiple.
            register: register of the multiplied step.
        """
        inner = self._factor_of_multiple(register)
        if inner is not None:
            factor = factor * inner[0]
            register = inner[1]
        elif (number := self._get_constant(register)) is not None:
            return self._append_derived_number(factor * number)
        return self._append_step("*", self._append_step("number", value=factor), register)

    def _simplify(
        self, law: str, arguments: Sequence[int], constants: Sequence[float | None]
    ) -> int:
        """Return the register of a step after applying the rules of Lepton's optimizer to it.

        Args:
            law: law of the step.
            arguments: registers of the operands.
            constants: values of operands that are numbers, else None.
        """
        match law:
            case "+":
                return self._add_up(*arguments, *constants)
            case "-":
                return self._subtract(*arguments, *constants)
            case "*":
                return self._multiply(*arguments, *constants)
            case "divide":
                return self._divide(*arguments, *constants)
            case "power":
                return self._raise(*arguments, *constants)
            case "negative":
                return self._negate(*arguments)
            # Lepton's rule: the root of a square is the absolute value.
            case "square_root" if (inner := self._get_argument("square", arguments[0])) is not None:
                return self._append_step("magnitude", inner)
            case "square" if (inner := self._get_argument("square_root", arguments[0])) is not None:
                return inner
        return self._append_step(law, *arguments)

    def _add_up(
        self, left: int, right: int, left_constant: float | None, right_constant: float | None
    ) -> int:
        """Return the register of a sum, simplified as Lepton does.

        Args:
            left: register of the first term.
            right: register of the second term.
            left_constant: value of the first term if it is a constant, else None.
            right_constant: value of the second term if it is a constant, else None.
        """
        if left_constant == 0.0:
            return right
        if right_constant == 0.0:
            return left
        # Lepton puts the constant first.
        if right_constant is not None:
            return self._append_step("+", right, left)
        if left_constant is None:
            if (negated := self._get_argument("negative", right)) is not None:
                return (
                    self._append_step("-", left, negated)
                    if left != negated
                    else self._append_derived_number(0.0)
                )
            if (negated := self._get_argument("negative", left)) is not None:
                return (
                    self._append_step("-", right, negated)
                    if right != negated
                    else self._append_derived_number(0.0)
                )
        return self._append_step("+", left, right)

    def _subtract(
        self, left: int, right: int, left_constant: float | None, right_constant: float | None
    ) -> int:
        """Return the register of a difference, with arguments as in `_add_up`."""
        if self._is_same(left, right):
            return self._append_derived_number(0.0)
        if left_constant == 0.0:
            return self._negate(right)
        if right_constant is not None:
            return self._add_up(
                self._append_step("number", value=-right_constant),
                left,
                -right_constant,
                left_constant,
            )
        if (negated := self._get_argument("negative", right)) is not None:
            return self._add_up(left, negated, left_constant, None)
        return self._append_step("-", left, right)

    def _multiply(
        self, left: int, right: int, left_constant: float | None, right_constant: float | None
    ) -> int:
        """Return the register of a product, with arguments as in `_add_up`."""
        if left_constant == 0.0 or right_constant == 0.0:
            return self._append_derived_number(0.0)
        if left_constant == 1.0:
            return right
        if right_constant == 1.0:
            return left
        if left_constant is not None:
            return self._scale(left_constant, right)
        if right_constant is not None:
            return self._scale(right_constant, left)
        left_negated = self._get_argument("negative", left)
        right_negated = self._get_argument("negative", right)
        if left_negated is not None or right_negated is not None:
            product = self.add(
                "*",
                left if left_negated is None else left_negated,
                right if right_negated is None else right_negated,
            )
            return (
                product
                if left_negated is not None and right_negated is not None
                else self.add("negative", product)
            )
        if (divisor := self._get_argument("reciprocal", right)) is not None:
            return self.add("divide", left, divisor)
        if (divisor := self._get_argument("reciprocal", left)) is not None:
            return self.add("divide", right, divisor)
        if self._is_same(left, right):
            return self.add("square", left)
        if left == self._get_argument("square", right) or right == self._get_argument(
            "square", left
        ):
            return self._append_step(
                "cube", left if left == self._get_argument("square", right) else right
            )
        return self._append_step("*", left, right)

    def _divide(
        self, left: int, right: int, left_constant: float | None, right_constant: float | None
    ) -> int:
        """Return the register of a quotient, with arguments as in `_add_up`."""
        if self._is_same(left, right):
            return self._append_derived_number(1.0)
        if left_constant == 0.0:
            return self._append_derived_number(0.0)
        if left_constant == 1.0:
            return self._append_step("reciprocal", right)
        if right_constant is not None:
            return (
                left
                if right_constant == 1.0
                else self._scale(_evaluate_law("divide", 1.0, right_constant), left)
            )
        left_negated = self._get_argument("negative", left)
        right_negated = self._get_argument("negative", right)
        if left_negated is not None or right_negated is not None:
            ratio = self.add(
                "divide",
                left if left_negated is None else left_negated,
                right if right_negated is None else right_negated,
            )
            return (
                ratio
                if left_negated is not None and right_negated is not None
                else self.add("negative", ratio)
            )
        if (factor := self._get_argument("reciprocal", right)) is not None:
            return self.add("*", left, factor)
        return self._append_step("divide", left, right)

    def _raise(
        self, base: int, exponent: int, base_constant: float | None, exponent_constant: float | None
    ) -> int:
        """Return the register of a power, simplified as Lepton does.

        Args:
            base: register of the base.
            exponent: register of the exponent.
            base_constant: value of the base if it is a constant, else None.
            exponent_constant: value of the exponent if it is a constant, else None.
        """
        if base_constant == 0.0 or base_constant == 1.0:
            return self._append_derived_number(base_constant)
        if exponent_constant == 0.0:
            return self._append_derived_number(1.0)
        if exponent_constant == 1.0:
            return base
        laws = {-1.0: "reciprocal", 2.0: "square", 3.0: "cube", 0.5: "square_root"}
        if exponent_constant in laws:
            return self.add(laws[exponent_constant], base)
        return self._append_step("power", base, exponent)

    def _negate(self, register: int) -> int:
        """Return the register of the negative of a register, simplified as Lepton does."""
        if (inner := self._get_argument("negative", register)) is not None:
            return inner
        if (number := self._get_constant(register)) is not None:
            return self._append_derived_number(-number)
        if (multiple := self._factor_of_multiple(register)) is not None:
            return self._scale(-multiple[0], multiple[1])
        return self._append_step("negative", register)

    def _expect_meaning(self, step: FormulaStep) -> None:
        """Raise an error for a step without meaning.

        Lepton does not terminate for NaN.

        Raises:
            UnknownNameError: the step stands for an unknown name.
            FormulaError: the step is a number, and this is NaN.
        """
        if step.law == UNKNOWN:
            word = self.unknown[int(step.value)]
            suggestion = suggest_name(word, self.step_numbers)
            available = (
                f"known names are {join_words(list(self.step_numbers))}"
                if self.step_numbers
                else "the formula has no variables"
            )
            raise UnknownNameError(f"there is no '{word}'; {available}{suggestion}")
        if step.law == "number" and math.isnan(step.value):
            raise FormulaError(
                "a part of it without variables is not a number, such as 0/0; remove it"
            )
