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

import re
from collections.abc import Sequence

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later
from osimlite.base.records import dataclass
from osimlite.base.text import format_count, suggest_name
from osimlite.errors import ModelError
from osimlite.mechanics.kernels.programs import STEPS
from osimlite.mechanics.laws.formulas import FUNCTIONS, OF_TWO
from osimlite.mechanics.multibody.formula_steps import (
    UNKNOWN,
    FormulaError,
    FormulaStep,
    SimplifiedSteps,
    UnknownNameError,
)

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
PRECEDENCE = {"+": 0, "-": 0, "*": 1, "/": 1, "^": 3}
"""Precedence of each operator; a higher one binds more closely."""
SIGN = 2
"""Precedence of a sign before an operand."""
OPEN = -1
"""Precedence of a parenthesis, which only its end closes."""

_TOKEN = compile_later(
    r"(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)|(?P<name>[^-+*/^(),\d.][^-+*/^(),]*)|(?P<sign>.)"
)


@dataclass(frozen=True)
class Formula:
    """Formula as a list of steps, so that neither its length nor its depth has a limit."""

    variables: tuple[str, ...]  # names of the variables, which are in the first registers
    steps: tuple[FormulaStep, ...]  # each fills the next register; the last one gives the result

    @classmethod
    def parse(cls, text: str, variables: Sequence[str], description: str) -> Formula:
        """Return the formula that a text contains.

        Args:
            text: the formula.
            variables: names that it may use.
            description: path and property of the formula, for messages.

        Raises:
            UnknownVariableError: the formula needs an unknown variable.
            ModelError: the text is no formula.
        """  # noqa: DOC501 - FormulaError is caught here
        main, *definitions = re.sub(r"\s", "", text).split(";")
        reader = _FormulaReader(variables)
        try:
            # A definition may use those after it, so that the last one is read first.
            for definition in reversed([item for item in definitions if item]):
                name, equals, body = definition.partition("=")
                if not name or not equals:
                    raise FormulaError(f"'{definition}' has no name; write name = formula")
                reader.step_numbers[name] = reader.read(body)
            steps = reader.ending_with(reader.read(main))
        except FormulaError as wrong:
            error_class = (
                UnknownVariableError if isinstance(wrong, UnknownNameError) else ModelError
            )
            raise error_class(f"{description} is '{text}': {wrong}") from None
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
            reader.step_numbers = dict(zip("xy", step.arguments, strict=False))
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


class _Waiting(NamedTuple):
    """Operation that waits for an operand: a law of one or two numbers, or an open parenthesis."""

    law: str
    precedence: int
    before: int
    """Number of operands before its own."""
    name: str = ""
    """Name of the function, if it is a call."""


class _FormulaReader(SimplifiedSteps):
    """Reader of formulas of the same variables, with a stack of operands and one of operations."""

    def __init__(self, variables: Sequence[str]) -> None:
        super().__init__(variables)
        self._operands: list[int] = []
        self._waiting: list[_Waiting] = []

    def read(self, text: str) -> int:
        """Read a formula, and add its steps.

        Returns:
            Register of the result.

        Raises:
            FormulaError: the text is no formula.
        """
        function_name, wants_operand = "", True
        for token in _TOKEN.finditer(text):
            word = token.group()
            if wants_operand and token["name"] and text.startswith("(", token.end()):
                function_name = word
            elif wants_operand and word == "(":
                self._open_parenthesis(function_name)
                function_name = ""
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
                raise FormulaError(f"there is an unexpected '{word}'; remove it")
        if wants_operand:
            raise FormulaError("it ends too early")
        self._apply_waiting(0)
        if self._waiting:
            raise FormulaError("its parentheses do not match; close them")
        return self._operands.pop()

    def _number_of(self, token: re.Match[str]) -> int:
        """Return the register of a number or variable.

        Args:
            token: match of the number or name in the text.
        """
        word = token.group()
        if token["number"]:
            return self.add("number", value=float(word))
        if word not in self.step_numbers:
            # It may be simplified away, or be in an unused definition.
            if word not in self.unknown:
                self.unknown.append(word)
            return self.add(UNKNOWN, value=float(self.unknown.index(word)))
        return self.step_numbers[word]

    def _push_operation(
        self, law: str, precedence: int, operand_count: int, name: str = ""
    ) -> None:
        self._waiting.append(_Waiting(law, precedence, len(self._operands) - operand_count, name))

    def _open_parenthesis(self, function_name: str) -> None:
        if function_name and function_name not in FUNCTIONS:
            raise FormulaError(
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
        """End an argument or a parenthesis of a formula.

        Returns:
            Whether another operand must follow.

        Raises:
            FormulaError: the comma or parenthesis belongs to no function or opening parenthesis, or
                a function has the wrong number of arguments.
        """
        self._apply_waiting(0)
        if not self._waiting or (sign == "," and not self._waiting[-1].name):
            raise FormulaError(f"there is an unexpected '{sign}'; remove it")
        if sign == ",":
            return True
        opened = self._waiting.pop()
        if name := opened.name:
            expected = 2 if name in OF_TWO else 1
            count = len(self._operands) - opened.before
            if count != expected:
                raise FormulaError(
                    f"'{name}' takes {format_count(expected, 'argument')}, not {count}"
                )
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
