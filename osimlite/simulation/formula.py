"""Formulas of expression-based forces: from their text to straight-line code.

The grammar is that of Lepton, which OpenSim uses: numbers, variables, + - * / ^, parentheses, functions, and after
semicolons definitions ``name = formula`` that the text before them may use. ^ binds most closely and from the right,
a sign less closely than ^ and more closely than *. White space means nothing.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from osimlite.errors import ModelError
from osimlite.simulation.script import Scalar
from osimlite.text import did_you_mean, listed

if TYPE_CHECKING:
    from osimlite.simulation.field import Writer

FUNCTIONS = {
    "sqrt": "square_root",
    "exp": "exponential",
    "log": "logarithm",
    "sin": "sine",
    "cos": "cosine",
    "sec": "secant",
    "csc": "cosecant",
    "tan": "tangent",
    "cot": "cotangent",
    "asin": "arcsine",
    "acos": "arccosine",
    "atan": "arctangent",
    "sinh": "hyperbolic_sine",
    "cosh": "hyperbolic_cosine",
    "tanh": "hyperbolic_tangent",
    "erf": "error_function",
    "erfc": "complementary_error_function",
    "step": "unit_step",
    "delta": "is_zero",
    "square": "square",
    "cube": "cube",
    "recip": "reciprocal",
    "min": "smaller",
    "max": "larger",
    "abs": "magnitude",
}
"""The law for each of Lepton's functions."""

OF_TWO = ("min", "max")
PRECEDENCE = {"+": 0, "-": 0, "*": 1, "/": 1, "^": 3}
SIGN = 2
DEEPEST = 100
"""Nesting beyond this is refused."""

_TOKEN = re.compile(
    r"(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)|(?P<name>[^-+*/^(),\d.][^-+*/^(),]*)|(?P<sign>.)"
)


@dataclass(frozen=True)
class Formula:
    """A formula: a number, the name of a variable, or a law applied to formulas.

    Attributes:
        head: name of the law, "+", "-", "*", "variable", "number" or "negative".
        parts: its arguments.
    """

    head: str
    parts: tuple[Formula, ...] = ()
    name: str = ""
    value: float = 0.0

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
        known = {name: cls("variable", name=name) for name in variables}
        try:
            for definition in reversed([item for item in definitions if item]):
                name, equals, body = definition.partition("=")
                if not name or not equals:
                    raise _Wrong(f"'{definition}' has no name; write name = formula")
                known[name] = _Reader(body, known).all()
            return _Reader(main, known).all()
        except _Wrong as wrong:
            raise ModelError(f"{where} is '{text}': {wrong}") from None

    def write(self, writer: Writer, variables: Mapping[str, Scalar]) -> Scalar:
        """Write the code; `variables` are the scalars of their names."""
        if self.head == "number":
            return self.value
        if self.head == "variable":
            return variables[self.name]
        # What a definition names is computed once, however often it is used.
        key = ("formula", id(self), *variables.values())
        scalar: Scalar = writer.script.once(key, lambda: self._apply(writer, variables))
        return scalar

    def _apply(self, writer: Writer, variables: Mapping[str, Scalar]) -> Scalar:
        parts = [part.write(writer, variables) for part in self.parts]
        if self.head in "+-":
            return writer.script.sum((parts[0],), (1.0 if self.head == "+" else -1.0, parts[1]))
        if self.head == "*":
            return writer.script.sum(tuple(parts))
        if self.head == "negative":
            return writer.script.sum((-1.0, parts[0]))
        called: Scalar = writer.call(self.head, *parts)
        return called


class _Wrong(Exception):
    """What is wrong with a formula."""


@dataclass
class _Reader:
    """Reads one formula by climbing precedences."""

    text: str
    known: Mapping[str, Formula]
    tokens: list[re.Match[str]] = field(init=False)
    place: int = 0
    depth: int = 0

    def __post_init__(self) -> None:
        self.tokens = list(_TOKEN.finditer(self.text))

    def all(self) -> Formula:
        found = self.formula(0)
        if self.place < len(self.tokens):
            raise _Wrong(f"there is an unexpected '{self.next}'; remove it")
        return found

    @property
    def next(self) -> str:
        return self.tokens[self.place].group() if self.place < len(self.tokens) else ""

    def formula(self, least: int) -> Formula:
        self.depth += 1
        if self.depth > DEEPEST:
            raise _Wrong(f"it is nested more than {DEEPEST} deep; name its parts after a semicolon")
        found = self.operand()
        while self.next in PRECEDENCE and self.next and PRECEDENCE[self.next] >= least:
            sign = self.next
            self.place += 1
            other = self.formula(PRECEDENCE[sign] + (sign != "^"))
            found = Formula({"/": "divide", "^": "power"}.get(sign, sign), (found, other))
        self.depth -= 1
        return found

    def operand(self) -> Formula:
        if self.place >= len(self.tokens):
            raise _Wrong("it ends too early; complete it")
        token = self.tokens[self.place]
        self.place += 1
        if token["number"]:
            return Formula("number", value=float(token.group()))
        if token["name"]:
            if self.next == "(":
                return self.call(token.group())
            if token.group() not in self.known:
                near = did_you_mean(token.group(), self.known)
                raise _Wrong(f"there is no '{token.group()}'{near}; there is {listed(list(self.known))}")
            return self.known[token.group()]
        if token.group() == "(":
            found = self.formula(0)
            self.close()
            return found
        if token.group() == "-":
            return Formula("negative", (self.formula(SIGN),))
        raise _Wrong(f"there is an unexpected '{token.group()}'; remove it")

    def call(self, name: str) -> Formula:
        if name not in FUNCTIONS:
            raise _Wrong(f"there is no function '{name}'{did_you_mean(name, FUNCTIONS)}")
        parts: list[Formula] = []
        while self.next == ("," if parts else "("):
            self.place += 1
            parts.append(self.formula(0))
        self.close()
        wanted = 2 if name in OF_TWO else 1
        if len(parts) != wanted:
            raise _Wrong(f"'{name}' takes {wanted} argument{'s' * (wanted > 1)}, not {len(parts)}")
        return Formula(FUNCTIONS[name], tuple(parts))

    def close(self) -> None:
        if self.next != ")":
            raise _Wrong("its parentheses do not match; close them")
        self.place += 1
