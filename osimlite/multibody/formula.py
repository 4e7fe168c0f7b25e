"""Formulas of expression-based forces.

The grammar is that of Lepton, which OpenSim uses: numbers, variables, + - * / ^, parentheses, functions, and after
semicolons definitions ``name = formula`` that the text before them may use. ^ binds most closely and from the right,
a sign less closely than ^ and more closely than *. White space means nothing.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from osimlite.errors import ModelError
from osimlite.forces.formulas import FUNCTIONS, OF_TWO
from osimlite.kernels.programs import STEPS
from osimlite.records import dataclass
from osimlite.text import counted, did_you_mean, listed

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
"""The derivatives of a law by its arguments x and y; steps have none."""

LAWS = {"/": "divide", "^": "power"}
"""The law for a sign, where that is not called like it."""
PRECEDENCE = {"+": 0, "-": 0, "*": 1, "/": 1, "^": 3}
SIGN, OPEN = 2, -1
"""Of a sign before an operand, and of what only a parenthesis closes."""

_TOKEN = re.compile(
    r"(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)|(?P<name>[^-+*/^(),\d.][^-+*/^(),]*)|(?P<sign>.)"
)


class Step(NamedTuple):
    """One number of a formula."""

    law: str  # "number", "negative", "+", "-", "*", or the name of a law
    arguments: tuple[int, ...] = ()  # registers that it is applied to
    value: float = 0.0  # the number, if it is one


@dataclass(frozen=True)
class Formula:
    """A formula as a list of steps, so that neither its length nor its depth has a limit."""

    variables: tuple[str, ...]  # names of what it is computed from, in the first registers
    steps: tuple[Step, ...]  # each gives the number of the next register; the last one gives the result

    @classmethod
    def parse(cls, text: str, variables: Sequence[str], where: str) -> Formula:
        """Read a formula.

        Args:
            text: the formula.
            variables: names it may use.
            where: the path and property it stands in, for messages.

        Raises:
            ModelError: it is no formula.
        """
        main, *definitions = re.sub(r"\s", "", text).split(";")
        reader = _Reader(variables)
        try:
            for definition in reversed([item for item in definitions if item]):
                name, equals, body = definition.partition("=")
                if not name or not equals:
                    raise _Wrong(f"'{definition}' has no name; write name = formula")
                reader.known[name] = reader.read(body)
            result = reader.read(main)
        except _Wrong as wrong:
            raise ModelError(f"{where} is '{text}': {wrong}") from None
        return cls(tuple(variables), reader.ending_with(result))

    def derivative(self, variable: int) -> Formula:
        """The derivative by one of the variables."""
        reader = _Reader(self.variables)
        reader.steps += self.steps
        first = len(self.variables)
        derivatives = {variable: reader.add("number", value=1.0)}
        for index, step in enumerate(self.steps, start=first):
            reader.known = dict(zip("xy", step.arguments, strict=False))
            for argument, rule in zip(step.arguments, DERIVATIVES.get(step.law, ()), strict=False):
                if argument in derivatives:
                    part = reader.add("*", reader.read(rule), derivatives[argument])
                    derivatives[index] = reader.add("+", derivatives[index], part) if index in derivatives else part
        last = first + len(self.steps) - 1
        return Formula(
            self.variables,
            reader.ending_with(derivatives[last] if last in derivatives else reader.add("number", value=0.0)),
        )


class _Wrong(Exception):
    """What is wrong with a formula."""


class _Waiting(NamedTuple):
    """What waits for an operand: a law of one or two numbers, or what a parenthesis opened."""

    law: str
    precedence: int
    before: int
    """Count of the operands that were there before its own."""
    name: str = ""
    """Of the function, if it is a call."""


class _Reader:
    """Reads formulas of the same variables, with a stack of operands and one of what waits for them.

    Attributes:
        known: registers of the names that may be used.
        steps: of all formulas so far.
    """

    def __init__(self, variables: Sequence[str]) -> None:
        self.known = {name: index for index, name in enumerate(variables)}
        self.steps: list[Step] = []
        self._first = len(variables)
        self._operands: list[int] = []
        self._waiting: list[_Waiting] = []

    def add(self, law: str, *arguments: int, value: float = 0.0) -> int:
        """Add a step: its register."""
        self.steps.append(Step(law, arguments, value))
        return self._first + len(self.steps) - 1

    def ending_with(self, result: int) -> tuple[Step, ...]:
        """The steps, the last of which gives a result."""
        if result < self._first + len(self.steps) - 1 or not self.steps:
            self.add("+", result, self.add("number", value=0.0))
        return tuple(self.steps)

    def read(self, text: str) -> int:
        """The register of a formula."""
        called, wants_operand = "", True
        for token in _TOKEN.finditer(text):
            word = token.group()
            if wants_operand and token["name"] and text.startswith("(", token.end()):
                called = word
            elif wants_operand and word == "(":
                self._open(called)
                called = ""
            elif wants_operand and word == "-":
                self._wait("negative", SIGN, 0)
            elif wants_operand and not token["sign"]:
                self._operands.append(self._number_of(token))
                wants_operand = False
            elif not wants_operand and word in PRECEDENCE:
                # ^ takes what stands right of it first, the others what stands left.
                self._apply(PRECEDENCE[word] + (word == "^"))
                self._wait(LAWS.get(word, word), PRECEDENCE[word], 1)
                wants_operand = True
            elif not wants_operand and word in (",", ")"):
                wants_operand = self._end_part(word)
            else:
                raise _Wrong(f"there is an unexpected '{word}'; remove it")
        if wants_operand:
            raise _Wrong("it ends too early; complete it")
        self._apply(0)
        if self._waiting:
            raise _Wrong("its parentheses do not match; close them")
        return self._operands.pop()

    def _number_of(self, token: re.Match[str]) -> int:
        word = token.group()
        if token["number"]:
            return self.add("number", value=float(word))
        if word not in self.known:
            near = did_you_mean(word, self.known)
            raise _Wrong(f"there is no '{word}'{near}; there is {listed(list(self.known))}")
        return self.known[word]

    def _wait(self, law: str, precedence: int, taken: int, name: str = "") -> None:
        self._waiting.append(_Waiting(law, precedence, len(self._operands) - taken, name))

    def _open(self, called: str) -> None:
        if called and called not in FUNCTIONS:
            raise _Wrong(f"there is no function '{called}'{did_you_mean(called, FUNCTIONS)}")
        self._wait(FUNCTIONS.get(called, ""), OPEN, 0, called)

    def _apply(self, least: int) -> None:
        """Apply what binds at least as closely as this to the operands it waits for."""
        while self._waiting and self._waiting[-1].precedence >= least:
            self._take(self._waiting.pop())

    def _take(self, waiting: _Waiting) -> None:
        arguments = self._operands[waiting.before :]
        self._operands[waiting.before :] = [self.add(waiting.law, *arguments)]

    def _end_part(self, sign: str) -> bool:
        """End an argument or a parenthesis; whether another operand must follow."""
        self._apply(0)
        if not self._waiting or (sign == "," and not self._waiting[-1].name):
            raise _Wrong(f"there is an unexpected '{sign}'; remove it")
        if sign == ",":
            return True
        opened = self._waiting.pop()
        if name := opened.name:
            wanted, given = 2 if name in OF_TWO else 1, len(self._operands) - opened.before
            if given != wanted:
                raise _Wrong(f"'{name}' takes {counted(wanted, 'argument')}, not {given}")
            self._take(opened)
        return False


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
