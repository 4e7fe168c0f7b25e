"""Straight-line scalar code, written for one model.

A model has a fixed set of bodies, joints and forces, so most of a general routine's loops, look-ups and
multiplications by 0 and 1 can be done once, before the first step. A `Script` collects assignments of sums of products
and leaves out whatever is known beforehand; Python compiles the result. For a walker, that is ten times as fast as
3-vectors in numpy.

A scalar is a number that is known already, or the name of a variable.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from types import MappingProxyType
from typing import Any

Scalar = float | str
Vector = tuple[Scalar, Scalar, Scalar]
Matrix = tuple[Vector, Vector, Vector]
"""Three rows."""

ARITHMETIC = {"sin": math.sin, "cos": math.cos, "inf": math.inf, "nan": math.nan}
"""What any code may call; numbers that are known beforehand print as `inf` or `nan` where they overflow."""

ZERO: Vector = (0.0, 0.0, 0.0)


class Script:
    """The body of one function of straight-line code, with a few branches.

    Args:
        name: of the function.
        parameters: names of its arguments.
    """

    def __init__(self, name: str, parameters: Sequence[str]) -> None:
        self._name = name
        self._lines = [f"def {name}({', '.join(parameters)}):"]
        self._indent = "    "
        self._count = 0
        self._known: dict[Any, Any] = {}

    # ------------------------------------------------------------------------------------------ statements
    def line(self, text: str) -> None:
        """Add a statement as it is."""
        self._lines.append(self._indent + text)

    @contextmanager
    def block(self, header: str) -> Iterator[None]:
        """Add a statement with a body; what is computed in the body is not known after it."""
        self.line(header)
        indent, known = self._indent, self._known
        self._indent, self._known = indent + "    ", dict(known)
        yield
        self._indent, self._known = indent, known

    def assign(self, expression: str) -> str:
        """Give an expression a name."""
        name = self.fresh()
        self.line(f"{name} = {expression}")
        return name

    def fresh(self) -> str:
        """A name that nothing else has."""
        self._count += 1
        return f"v{self._count}"

    def once(self, key: Any, make: Callable[[], Any]) -> Any:
        """What `make` returned for this key the first time, as long as that is still known."""
        if key not in self._known:
            self._known[key] = make()
        return self._known[key]

    def source(self) -> str:
        """The text of the function."""
        return "\n".join([*self._lines, "    pass", ""])

    def function(self, names: Mapping[str, Any] = MappingProxyType({})) -> Callable[..., Any]:
        """Compile the function; `names` is what it may use besides its arguments and `ARITHMETIC`."""
        scope = {**ARITHMETIC, **names}
        exec(compile(self.source(), f"<{self._name}>", "exec"), scope)
        result: Callable[..., Any] = scope[self._name]
        return result

    # ----------------------------------------------------------------------------------------- expressions
    def sum(self, *terms: Sequence[Scalar]) -> Scalar:
        """A sum of products: a number if all is known, a variable that equals it if there is one."""
        constant, products = 0.0, dict[tuple[str, ...], float]()
        for term in terms:
            factor = 1.0
            names: list[str] = []
            for scalar in term:
                if isinstance(scalar, str):
                    names.append(scalar)
                else:
                    factor *= scalar
            if not names:
                constant += factor
            elif factor != 0.0:
                key = tuple(sorted(names))
                products[key] = products.get(key, 0.0) + factor
        products = {key: factor for key, factor in products.items() if factor != 0.0}
        if not products:
            return constant
        if constant == 0.0 and len(products) == 1:
            ((key, factor),) = products.items()
            if factor == 1.0 and len(key) == 1:
                return key[0]
        return self._named(constant, products)

    def _named(self, constant: float, products: dict[tuple[str, ...], float]) -> str:
        # A product that needs no sign first, so that no negation is computed.
        items = sorted(products.items(), key=lambda item: item[1] < 0.0)
        text = "" if constant == 0.0 else repr(constant)
        for names, factor in items:
            size = abs(factor)
            product = "*".join(names if size == 1.0 else (repr(size), *names))
            if text:
                text += f" - {product}" if factor < 0.0 else f" + {product}"
            else:
                text = f"-{product}" if factor < 0.0 else product
        return str(self.once(text, lambda: self.assign(text)))

    def dot(self, a: Vector, b: Vector) -> Scalar:
        """Scalar product."""
        return self.sum(*zip(a, b, strict=True))

    def cross(self, a: Vector, b: Vector) -> Vector:
        """Vector product."""
        (ax, ay, az), (bx, by, bz) = a, b
        return (
            self.sum((ay, bz), (-1.0, az, by)),
            self.sum((az, bx), (-1.0, ax, bz)),
            self.sum((ax, by), (-1.0, ay, bx)),
        )

    def combine(self, *terms: tuple[Scalar, Vector]) -> Vector:
        """Sum of vectors times scalars."""
        x, y, z = (self.sum(*((scalar, vector[axis]) for scalar, vector in terms)) for axis in range(3))
        return x, y, z

    def apply(self, matrix: Matrix, vector: Vector) -> Vector:
        """Matrix times vector."""
        x, y, z = (self.dot(row, vector) for row in matrix)
        return x, y, z

    def multiply(self, a: Matrix, b: Matrix) -> Matrix:
        """Matrix times matrix."""
        columns = [self.apply(a, (b[0][k], b[1][k], b[2][k])) for k in range(3)]
        x, y, z = ((columns[0][row], columns[1][row], columns[2][row]) for row in range(3))
        return x, y, z


def vector(values: Any) -> Vector:
    """Three known numbers, from anything that holds them."""
    x, y, z = (float(value) for value in values)
    return x, y, z


def matrix(values: Any) -> Matrix:
    """Nine known numbers, from anything that holds them in rows."""
    x, y, z = (vector(row) for row in values)
    return x, y, z
