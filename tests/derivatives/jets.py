"""Exact first and second derivatives of the kernels by automatic differentiation (R. E. Wengert, 1964).

The kernels run as Python on numbers that carry their derivatives. This is independent of the way in
which CasADi traces the kernels: branches are taken as in machine code.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from osimlite.mechanics.kernels.dynamics import evaluate
from osimlite.mechanics.kernels.layout import MODEL, STAGE, WORK
from osimlite.mechanics.laws.dual_numbers import differentiate_root, is_exact_zero
from osimlite.simulation.elements.laws import find_function
from osimlite.simulation.engines.linking import PYTHON_CODE, Program


class Jet:
    """Number with its derivatives.

    Attributes:
        v: value.
        g: gradient (n,).
        a: derivative along one direction.
        h: derivative of the gradient along that direction (n,).
    """

    __array_ufunc__ = None
    __slots__ = "a", "g", "h", "v"

    def __init__(self, v: float, g: Any, a: float, h: Any) -> None:
        self.v, self.g, self.a, self.h = v, g, a, h

    def through(self, f: float, slope: float, bend: float) -> Jet:
        """Return a function of this number, given its value and its first and second derivatives."""
        return Jet(f, slope * self.g, slope * self.a, slope * self.h + (bend * self.a) * self.g)

    def __add__(self, b: Any) -> Jet:
        if isinstance(b, Jet):
            return Jet(self.v + b.v, self.g + b.g, self.a + b.a, self.h + b.h)
        return Jet(self.v + b, self.g, self.a, self.h)

    def __mul__(self, b: Any) -> Jet:
        if not isinstance(b, Jet):
            return Jet(self.v * b, self.g * b, self.a * b, self.h * b)
        h = self.v * b.h + b.v * self.h + self.a * b.g + b.a * self.g
        return Jet(self.v * b.v, self.v * b.g + b.v * self.g, self.v * b.a + b.v * self.a, h)

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self) -> Jet:
        return Jet(-self.v, -self.g, -self.a, -self.h)

    def __sub__(self, b: Any) -> Jet:
        return self + -b

    def __rsub__(self, b: Any) -> Jet:
        return -self + b

    def __truediv__(self, b: Any) -> Jet:
        return self * (1.0 / b)

    def __rtruediv__(self, b: Any) -> Any:
        if self.v == 0.0:
            return b * math.inf
        inverse = 1.0 / self.v
        return self.through(inverse, -inverse * inverse, 2.0 * inverse**3) * b

    def __pow__(self, b: Any) -> Any:
        if isinstance(b, Jet):
            return MATHEMATICS["exp"](MATHEMATICS["log"](self) * b)
        slope = b * self.v ** (b - 1) if b else 0.0
        return self.through(
            self.v**b, slope, b * (b - 1) * self.v ** (b - 2) if b and b != 1 else 0.0
        )

    def __rpow__(self, b: float) -> Jet:
        rate, value = math.log(b), b**self.v
        return self.through(value, rate * value, rate * rate * value)

    def __mod__(self, b: Any) -> Jet:
        rest = self.v % float(b)
        times = round((self.v - rest) / float(b))
        return self - times * b

    def __abs__(self) -> Jet:
        return -self if self.v < 0.0 else self

    def __float__(self) -> float:
        return float(self.v)

    def __int__(self) -> int:
        return int(self.v)

    def __bool__(self) -> bool:
        return bool(self.v != 0.0)

    def __lt__(self, b: Any) -> bool:
        return self.v < float(b)

    def __le__(self, b: Any) -> bool:
        return self.v <= float(b)

    def __gt__(self, b: Any) -> bool:
        return self.v > float(b)

    def __ge__(self, b: Any) -> bool:
        return self.v >= float(b)

    def __eq__(self, b: object) -> bool:
        return self.v == float(b)  # type: ignore[arg-type]

    __hash__ = None  # type: ignore[assignment]


def _bell(x: float) -> float:
    return 2.0 / math.sqrt(math.pi) * math.exp(-x * x)


SLOPES: dict[str, Callable[[float, float], tuple[float, float]]] = {
    "sin": lambda x, f: (math.cos(x), -f),
    "cos": lambda x, f: (-math.sin(x), -f),
    "tan": lambda x, f: (1.0 + f * f, 2.0 * f * (1.0 + f * f)),
    "asin": lambda x, f: ((1.0 - x * x) ** -0.5, x * (1.0 - x * x) ** -1.5),
    "acos": lambda x, f: (-((1.0 - x * x) ** -0.5), -x * (1.0 - x * x) ** -1.5),
    "atan": lambda x, f: (1.0 / (1.0 + x * x), -2.0 * x / (1.0 + x * x) ** 2),
    "exp": lambda x, f: (f, f),
    "expm1": lambda x, f: (f + 1.0, f + 1.0),
    "log": lambda x, f: (1.0 / x, -1.0 / (x * x)),
    "log1p": lambda x, f: (1.0 / (1.0 + x), -1.0 / (1.0 + x) ** 2),
    "log10": lambda x, f: (1.0 / (x * math.log(10.0)), -1.0 / (x * x * math.log(10.0))),
    "sinh": lambda x, f: (math.cosh(x), f),
    "cosh": lambda x, f: (math.sinh(x), f),
    "tanh": lambda x, f: (1.0 - f * f, -2.0 * f * (1.0 - f * f)),
    "erf": lambda x, f: (_bell(x), -2.0 * x * _bell(x)),
    "erfc": lambda x, f: (-_bell(x), 2.0 * x * _bell(x)),
    "sqrt": lambda x, f: (0.5 / f, -0.25 / (f * x)) if x > 0.0 else (0.0, 0.0),
}
"""First and second derivatives of functions at x, where their value is f."""


def _of_one(name: str) -> Callable[[Any], Any]:
    plain, slopes = getattr(math, name), SLOPES[name]

    def function(x: Any) -> Any:
        if not isinstance(x, Jet):
            return plain(x)
        value = plain(x.v)
        return x.through(value, *slopes(x.v, value))

    return function


def _angle(y: Any, x: Any) -> Any:
    if not (isinstance(x, Jet) or isinstance(y, Jet)):
        return math.atan2(y, x)
    # The quotient with the smaller magnitude avoids a division by zero; its arctangent has the same
    # derivatives.
    part = MATHEMATICS["atan"](y / x) if abs(x) > abs(y) else -MATHEMATICS["atan"](x / y)
    return part + (math.atan2(float(y), float(x)) - part.v)


def _copy_sign(x: Any, y: float) -> Any:
    """Return x with the sign of y; the slope at x = 0 is that of `SLOPES` in `dual_numbers.py`."""
    if not isinstance(x, Jet):
        return math.copysign(x, y)
    value = math.copysign(x.v, y)
    # |x| has no derivative at 0: a number that is not negative keeps its derivatives unless its
    # sign changes.
    same_sign = (x.v < 0.0) == (value < 0.0)
    return x.through(value, 1.0 if same_sign else -1.0, 0.0)


MATHEMATICS: dict[str, Callable[..., Any]] = {name: _of_one(name) for name in SLOPES} | {
    "atan2": _angle,
    "radians": lambda x: x * (math.pi / 180.0),
    "degrees": lambda x: x * (180.0 / math.pi),
    "hypot": lambda *x: MATHEMATICS["sqrt"](sum(each * each for each in x)),
    "copysign": lambda x, y: _copy_sign(x, float(y)),
    "floor": lambda x: math.floor(float(x)),
    "ceil": lambda x: math.ceil(float(x)),
    "isnan": lambda x: math.isnan(float(x)),
    "isfinite": lambda x: math.isfinite(float(x)),
}


def _differentiate_root(root: Any, error: Any, slope: Any) -> Any:
    if not isinstance(error, Jet):
        return root
    by, own = 1.0 / float(slope), root if isinstance(root, Jet) else Jet(root, 0.0, 0.0, 0.0)
    return Jet(own.v, own.g - by * error.g, own.a - by * error.a, own.h)


def _is_exact_zero(number: Any) -> bool:
    return number == 0.0 and not (isinstance(number, Jet) and (np.any(number.g) or number.a))


SAID = {differentiate_root: _differentiate_root, is_exact_zero: _is_exact_zero}
"""Functions that laws call to define derivatives, and their counterparts for jets."""
OURS = "osimlite.mechanics.laws", "osimlite.mechanics.kernels", "osimlite.simulation.elements"
"""Packages that contain kernels and laws."""


@contextmanager
def use_jets(functions: list[Any]) -> Iterator[None]:
    """Replace the mathematics of functions, and of all functions that they call, by that of jets."""
    done: dict[int, Any] = {}
    changed: list[tuple[dict[str, Any], str, Any]] = []
    while functions:
        scope = functions.pop().__globals__
        if id(scope) in done:
            continue
        done[id(scope)] = scope
        for name, value in [*scope.items()]:
            if getattr(value, "__module__", "") == "math":
                changed.append((scope, name, value))
                scope[name] = MATHEMATICS[value.__name__]
            elif value is differentiate_root or value is is_exact_zero:
                changed.append((scope, name, value))
                scope[name] = SAID[value]
            elif getattr(value, "__module__", "").startswith(OURS) and hasattr(
                value, "__globals__"
            ):
                functions.append(value)
        changed.append((scope, "float", float))
        scope["float"] = lambda x: x if isinstance(x, Jet) else float(x)
    try:
        yield
    finally:
        for scope, name, value in changed:
            if value is float:
                del scope[name]
            else:
                scope[name] = value


def differentiate_by_jets(
    packed: Any, t: float, y: list[float], controls: list[float], along: Any
) -> tuple[Any, Any, Any]:
    """Compute the state derivative with its first and second derivatives.

    Args:
        packed: the packed model.
        t: time (s).
        y: state (n,) in the order of the packed model.
        controls: controls of the actuators.
        along: direction (n,) of the second derivative.

    Returns:
        State derivative (n,), its Jacobian by the state (n, n), and the derivative of the Jacobian
        along the direction (n, n).
    """
    program = Program(packed, PYTHON_CODE)
    s = program.ints
    s[MODEL.CONTROLS] = 0
    w = np.zeros(int(s[MODEL.WORK_SIZE])).astype(object)
    w[WORK.TIME] = t
    first = s[MODEL.WORK_CONTROL]
    w[first : first + len(controls)] = controls
    one, none = np.eye(len(y)), np.zeros(len(y))
    state = np.array(
        [Jet(v, one[k], float(along[k]), none) for k, v in enumerate(y)] + [None], dtype=object
    )[:-1]
    f = np.zeros(len(y)).astype(object)
    kernels = [*packed.laws, *(k for k in packed.kernels.values() if isinstance(k, str))]
    with use_jets([evaluate, *map(find_function, kernels)]):
        evaluate(s, packed.numbers.astype(object), w, state, f, STAGE.ACCELERATION)
    found = [each if isinstance(each, Jet) else Jet(float(each), none, 0.0, none) for each in f]
    value, slopes, bends = (np.array([getattr(e, part) for e in found]) for part in ("v", "g", "h"))
    return value, slopes.reshape(one.shape), bends.reshape(one.shape)
