"""Reader of formulas of expression-based forces.

The grammar is that of Lepton, which OpenSim uses: numbers, variables, + - * / ^, parentheses,
functions, and after semicolons definitions ``name = formula`` for the text before them. ^ binds
most closely and from the right; a sign binds less closely than ^ and more closely than *. White
space is ignored.

As in Lepton, a formula is simplified while it is read: ``0*x`` is 0, ``x-x`` is 0 and ``x/x`` is 1,
whatever x is. What is simplified away may be NaN, or an unknown name.

Python's `ast` cannot read these formulas: it refuses names such as ``lambda`` and numbers such as
``007``, which Lepton accepts; it reads ``^`` as a bitwise operator below ``+`` in precedence; and it
ends at 200 nested parentheses or at sums of some thousand terms, which polynomials fitted to paths
have.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from typing import NamedTuple

from osimlite.base.records import dataclass
from osimlite.base.text import format_count, join_words, suggest_name
from osimlite.errors import ModelError
from osimlite.mechanics.kernels.programs import STEPS
from osimlite.mechanics.laws import formulas
from osimlite.mechanics.laws.formulas import FUNCTIONS, OF_TWO

DERIVATIVES = {
    "+": ("1", "1"),
    "-": ("1", "-1"),
    "*": ("y", "x"),
    "negative": ("-1",),
    "divide": ("1/y", "-x/(y*y)"),
    "power": ("y*x^(y-1)", "log(x)*x^y"),
    "smaller": ("1-step(x-y)", "step(x-y)"),
    "larger": ("step(x-y)", "1-step(x-y)"),
    "square_root": ("0.5/sqrt(x)",),
    "exponential": ("exp(x)",),
    "logarithm": ("1/x",),
    "sine": ("cos(x)",),
    "cosine": ("-sin(x)",),
    "secant": ("sec(x)*tan(x)",),
    "cosecant": ("-csc(x)*cot(x)",),
    "tangent": ("square(sec(x))",),
    "cotangent": ("-square(csc(x))",),
    "arcsine": ("1/sqrt(1-x*x)",),
    "arccosine": ("-1/sqrt(1-x*x)",),
    "arctangent": ("1/(1+x*x)",),
    "hyperbolic_sine": ("cosh(x)",),
    "hyperbolic_cosine": ("sinh(x)",),
    "hyperbolic_tangent": ("1-square(tanh(x))",),
    "error_function": ("1.1283791670955126*exp(-x*x)",),
    "complementary_error_function": ("-1.1283791670955126*exp(-x*x)",),
    "square": ("2*x",),
    "cube": ("3*x*x",),
    "reciprocal": ("-1/(x*x)",),
    "magnitude": ("2*step(x)-1",),
}
"""Derivatives of each law by its arguments x and y; step functions have none."""

LAWS = {"/": "divide", "^": "power"}
"""Name of the law of a sign, where it is not the sign itself."""
_UNKNOWN = "unknown"
"""Law of a step that stands for an unknown name."""
_SIGNS: dict[str, Callable[..., float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "negative": lambda a: -a,
}
PRECEDENCE = {"+": 0, "-": 0, "*": 1, "/": 1, "^": 3}
"""Precedence of each operator; a higher one binds more closely."""
SIGN = 2
"""Precedence of a sign before an operand."""
OPEN = -1
"""Precedence of a parenthesis, which only its end closes."""

_TOKEN = re.compile(
    r"(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)|(?P<name>[^-+*/^(),\d.][^-+*/^(),]*)|(?P<sign>.)"
)


class FormulaStep(NamedTuple):
    """One operation of a formula, which fills one register."""

    law: str  # "number", "negative", "+", "-", "*", or the name of a law
    arguments: tuple[int, ...] = ()  # registers of the operands
    value: float = 0.0  # value of a number


@dataclass(frozen=True)
class Formula:
    """Formula as a list of steps, so that neither its length nor its depth has a limit."""

    variables: tuple[str, ...]  # names of the variables, which are in the first registers
    steps: tuple[FormulaStep, ...]  # each fills the next register; the last one gives the result

    @classmethod
    def parse(cls, text: str, variables: Sequence[str], where: str) -> Formula:
        """Read a formula.

        Args:
            text: the formula.
            variables: names that it may use.
            where: path and property of the formula, for messages.

        Raises:
            UnknownVariableError: it needs an unknown variable.
            ModelError: the text is no formula.
        """
        main, *definitions = re.sub(r"\s", "", text).split(";")
        reader = _FormulaReader(variables)
        try:
            # A definition may use those after it, so that the last one is read first.
            for definition in reversed([item for item in definitions if item]):
                name, equals, body = definition.partition("=")
                if not name or not equals:
                    raise _Wrong(f"'{definition}' has no name; write name = formula")
                reader.known[name] = reader.read(body)
            steps = reader.ending_with(reader.read(main))
        except _Wrong as wrong:
            error_class = UnknownVariableError if isinstance(wrong, _UnknownName) else ModelError
            raise error_class(f"{where} is '{text}': {wrong}") from None
        return cls(tuple(variables), steps)

    def derivative(self, variable: int) -> Formula:
        """Return the derivative by one of the variables.

        Forward differentiation: each step adds the products of its partial derivatives and the
        derivatives of its arguments.

        Args:
            variable: index of the variable.
        """
        reader = _FormulaReader(self.variables)
        reader.append_steps(self.steps)
        first = len(self.variables)
        derivatives = {variable: reader.add("number", value=1.0)}
        for index, step in enumerate(self.steps, start=first):
            # The rules are formulas in x and y, which are the registers of the arguments here.
            reader.known = dict(zip("xy", step.arguments, strict=False))
            for argument, rule in zip(step.arguments, DERIVATIVES.get(step.law, ()), strict=False):
                if argument in derivatives:
                    contribution = reader.add("*", reader.read(rule), derivatives[argument])
                    derivatives[index] = (
                        reader.add("+", derivatives[index], contribution)
                        if index in derivatives
                        else contribution
                    )
        last_register = first + len(self.steps) - 1
        return Formula(
            self.variables,
            reader.ending_with(
                derivatives[last_register]
                if last_register in derivatives
                else reader.add("number", value=0.0)
            ),
        )


class UnknownVariableError(ModelError):
    """Error of a formula that can be read but contains an unknown variable."""


class _Wrong(Exception):
    """Error of a formula, without its position in the model."""


class _UnknownName(_Wrong):
    """Error of a formula that needs an unknown name."""


def _evaluate_law(law: str, *numbers: float | None) -> float:
    """Return the result of a law for numbers.

    Args:
        law: sign or name of a law.
        numbers: its arguments.
    """
    return float((_SIGNS.get(law) or getattr(formulas, law))(*numbers))


class _Waiting(NamedTuple):
    """Operation that waits for an operand: a law of one or two numbers, or an open parenthesis."""

    law: str
    precedence: int
    before: int
    """Number of operands before its own."""
    name: str = ""
    """Name of the function, if it is a call."""


class _FormulaReader:
    """Reader of formulas of the same variables, with a stack of operands and one of operations.

    Attributes:
        known: registers of the names that may be used.
        unknown: unknown names that were used.
        steps: steps of all formulas so far.
    """

    def __init__(self, variables: Sequence[str]) -> None:
        self.known = {name: index for index, name in enumerate(variables)}
        self.unknown: list[str] = []
        self.steps: list[FormulaStep] = []
        self._registers: dict[FormulaStep, int] = {}
        self._numbers: dict[float, int] = {}
        self._derived: set[int] = set()
        self._first = len(variables)
        self._operands: list[int] = []
        self._waiting: list[_Waiting] = []

    def add(self, law: str, *arguments: int, value: float = 0.0) -> int:
        """Add a step, or a simpler one with the same result, and return its register.

        Args:
            law: law of the step.
            arguments: registers of the operands.
            value: value of a number.
        """
        if law in ("number", _UNKNOWN):
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
            _Wrong: a step stands for an unknown name, or is NaN for all values of the variables.
        """
        needed, waiting = set[int](), [result]
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
        """Add a step unless the same one exists, and return its register.

        Args:
            law: law of the step.
            arguments: registers of the operands.
            value: value of a number.
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
            factor: factor.
            register: register of the multiplied step.
        """
        inner = self._factor_of_multiple(register)
        if inner is not None:
            factor, register = factor * inner[0], inner[1]
        elif (number := self._get_constant(register)) is not None:
            return self._append_derived_number(factor * number)
        return self._append_step("*", self._append_step("number", value=factor), register)

    def _simplify(
        self, law: str, arguments: Sequence[int], constants: Sequence[float | None]
    ) -> int:
        """Add a step with an argument that is not a number, by the rules of Lepton's optimizer.

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
        left_negated, right_negated = (
            self._get_argument("negative", left),
            self._get_argument("negative", right),
        )
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
        left_negated, right_negated = (
            self._get_argument("negative", left),
            self._get_argument("negative", right),
        )
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
        """
        if step.law == _UNKNOWN:
            word = self.unknown[int(step.value)]
            suggestion = suggest_name(word, self.known)
            available = (
                f"there is {join_words(list(self.known))}" if self.known else "it has no variables"
            )
            raise _UnknownName(f"there is no '{word}'{suggestion}; {available}")
        if step.law == "number" and math.isnan(step.value):
            raise _Wrong("a part of it without variables is not a number, such as 0/0; remove it")

    def read(self, text: str) -> int:
        """Read a formula and return the register of its result.

        Raises:
            _Wrong: the text is no formula.
        """
        called, wants_operand = "", True
        for token in _TOKEN.finditer(text):
            word = token.group()
            if wants_operand and token["name"] and text.startswith("(", token.end()):
                called = word
            elif wants_operand and word == "(":
                self._open_parenthesis(called)
                called = ""
            elif wants_operand and word == "-":
                self._push_operation("negative", SIGN, 0)
            elif wants_operand and not token["sign"]:
                self._operands.append(self._number_of(token))
                wants_operand = False
            elif not wants_operand and word in PRECEDENCE:
                # ^ is applied from the right, so it waits for a following ^; the others do not.
                self._apply_waiting(PRECEDENCE[word] + (word == "^"))
                self._push_operation(LAWS.get(word, word), PRECEDENCE[word], 1)
                wants_operand = True
            elif not wants_operand and word in (",", ")"):
                wants_operand = self._end_part(word)
            else:
                raise _Wrong(f"there is an unexpected '{word}'; remove it")
        if wants_operand:
            raise _Wrong("it ends too early; complete it")
        self._apply_waiting(0)
        if self._waiting:
            raise _Wrong("its parentheses do not match; close them")
        return self._operands.pop()

    def _number_of(self, token: re.Match[str]) -> int:
        """Return the register of a number or variable.

        Args:
            token: match of the number or name in the text.
        """
        word = token.group()
        if token["number"]:
            return self.add("number", value=float(word))
        if word not in self.known:
            # It may be simplified away, or be in an unused definition.
            if word not in self.unknown:
                self.unknown.append(word)
            return self.add(_UNKNOWN, value=float(self.unknown.index(word)))
        return self.known[word]

    def _push_operation(
        self, law: str, precedence: int, operand_count: int, name: str = ""
    ) -> None:
        self._waiting.append(_Waiting(law, precedence, len(self._operands) - operand_count, name))

    def _open_parenthesis(self, function_name: str) -> None:
        if function_name and function_name not in FUNCTIONS:
            raise _Wrong(
                f"there is no function '{function_name}'{suggest_name(function_name, FUNCTIONS)}"
            )
        self._push_operation(FUNCTIONS.get(function_name, ""), OPEN, 0, function_name)

    def _apply_waiting(self, least: int) -> None:
        """Apply all waiting operations that bind at least as closely as a precedence."""
        while self._waiting and self._waiting[-1].precedence >= least:
            self._apply_operation(self._waiting.pop())

    def _apply_operation(self, waiting: _Waiting) -> None:
        arguments = self._operands[waiting.before :]
        self._operands[waiting.before :] = [self.add(waiting.law, *arguments)]

    def _end_part(self, sign: str) -> bool:
        """End an argument or a parenthesis, and return whether another operand must follow."""
        self._apply_waiting(0)
        if not self._waiting or (sign == "," and not self._waiting[-1].name):
            raise _Wrong(f"there is an unexpected '{sign}'; remove it")
        if sign == ",":
            return True
        opened = self._waiting.pop()
        if name := opened.name:
            expected, count = 2 if name in OF_TWO else 1, len(self._operands) - opened.before
            if count != expected:
                raise _Wrong(f"'{name}' takes {format_count(expected, 'argument')}, not {count}")
            self._apply_operation(opened)
        return False


def program(formula: Formula) -> tuple[list[int], list[float]]:
    """Return a formula as the kernels need it.

    Args:
        formula: the formula.

    Returns:
        Operation and two registers of each step, and the constants, see `programs.run_program`.
    """
    steps: list[int] = []
    constants: list[float] = []
    for step in formula.steps:
        first_argument, second_argument, *_ = *step.arguments, 0, 0
        if step.law == "number":
            first_argument = len(constants)
            constants.append(step.value)
        steps += STEPS.index(step.law), first_argument, second_argument
    return steps, constants
