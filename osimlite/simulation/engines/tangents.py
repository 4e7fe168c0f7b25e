"""Numbers that carry their derivatives along several directions v, as a type of numba (R. E. Wengert, 1964).

A kernel that is compiled for vectors of these computes J v beside its values, exactly, from the text that it has: which
way it takes, and where its searches end, is decided by the values, as in machine code of floats. What else such numbers
need, laws say by :mod:`osimlite.forces.carried`. What has no rule here is an error of the compiler, which names it.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import ir  # type: ignore[import-untyped]
from numba.core import types
from numba.core.datamodel.models import PrimitiveModel
from numba.core.typeconv.castgraph import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, lower_cast, register_model

from osimlite.forces.carried import is_nothing, settled

DOUBLE, PLACE = ir.DoubleType(), ir.IntType(32)
PLAIN = types.Number, types.Boolean
"""What has no derivatives."""


class Dual(types.Type):
    """A float with its derivatives along so many directions."""

    def __init__(self, directions: int) -> None:
        self.directions = directions
        super().__init__(name=f"Dual({directions})")

    def unify(self, context: Any, other: Any) -> Any:
        """What a variable is that is one or the other."""
        return self if isinstance(other, PLAIN) else None

    def can_convert_from(self, context: Any, other: Any) -> Any:
        """Any number is one without derivatives."""
        return Conversion.safe if isinstance(other, PLAIN) else None


class Duals(types.CPointer):
    """A vector of such numbers: in memory the derivatives follow each value without a gap."""


@register_model(Dual)
class _DualModel(PrimitiveModel):
    def __init__(self, manager: Any, kind: Dual) -> None:
        super().__init__(manager, kind, ir.LiteralStructType([DOUBLE, ir.VectorType(DOUBLE, kind.directions)]))


@register_model(Duals)
class _DualsModel(PrimitiveModel):
    def __init__(self, manager: Any, kind: Duals) -> None:
        super().__init__(manager, kind, ir.ArrayType(DOUBLE, 1 + kind.dtype.directions).as_pointer())


# --------------------------------------------------------------------------------------------------- parts
def _parts(builder: Any, kinds: Sequence[Any], given: Sequence[Any]) -> list[tuple[Any, Any]]:
    """The value of each number, and its derivatives; None if it has none."""
    return [
        (builder.extract_value(number, 0), builder.extract_value(number, 1))
        if isinstance(kind, Dual)
        else (number, None)
        for kind, number in zip(kinds, given, strict=True)
    ]


def _made(builder: Any, value: Any, change: Any) -> Any:
    number = ir.Constant(ir.LiteralStructType([DOUBLE, change.type]), ir.Undefined)
    return builder.insert_value(builder.insert_value(number, value, 0), change, 1)


def _times(builder: Any, factor: Any, change: Any) -> Any:
    """A number times derivatives."""
    first = builder.insert_element(ir.Constant(change.type, ir.Undefined), factor, PLACE(0))
    everywhere = ir.Constant(ir.VectorType(PLACE, change.type.count), None)
    return builder.fmul(builder.shuffle_vector(first, first, everywhere), change)


def _python(context: Any, builder: Any, function: Callable[..., Any], result: Any, *given: Any) -> Any:
    """What a function of floats gives."""
    if not hasattr(function, "__code__"):
        called = function
        function = (lambda x: called(x)) if len(given) == 1 else lambda x, y: called(x, y)
    kinds = [types.float64] * len(given)
    return context.compile_internal(builder, function, signature(result, *kinds), given)


# ------------------------------------------------------------------------------------------------ memory
def _place(builder: Any, directions: int, vector: Any, number: Any) -> tuple[Any, Any]:
    """Addresses of a number and of its derivatives."""
    first = builder.bitcast(builder.gep(vector, [number]), DOUBLE.as_pointer())
    rest = builder.gep(first, [PLACE(1)])
    return first, builder.bitcast(rest, ir.VectorType(DOUBLE, directions).as_pointer())


@lower_builtin(operator.getitem, Duals, types.Integer)
def _load(context: Any, builder: Any, sig: Any, given: Any) -> Any:
    places = _place(builder, sig.args[0].dtype.directions, *given)
    return _made(builder, *(builder.load(place, align=8) for place in places))


@lower_builtin(operator.setitem, Duals, types.Integer, types.Any)
def _store(context: Any, builder: Any, sig: Any, given: Any) -> None:
    ((value, change),) = _parts(builder, sig.args[2:], given[2:])
    first, rest = _place(builder, change.type.count, *given[:2])
    builder.store(value, first, align=8)
    builder.store(change, rest, align=8)


def _plain(context: Any, builder: Any, source: Any, target: Any, given: Any) -> Any:
    """A number without derivatives."""
    value = context.cast(builder, given, source, types.float64)
    return _made(builder, value, ir.Constant(ir.VectorType(DOUBLE, target.directions), None))


for _kind in PLAIN:
    lower_cast(_kind, Dual)(_plain)


# ------------------------------------------------------------------------------------------------- rules
def _typed(function: Any, count: int, rule: Callable[[Any, Sequence[Any]], Any]) -> None:
    """What a function of so many numbers gives, any if 0, and what it takes them as: if one of them is a dual."""

    class Rule(AbstractTemplate):
        def generic(self, given: Sequence[Any], named: Any) -> Any:
            dual = next((kind for kind in given if isinstance(kind, Dual)), None)
            numbers = all(isinstance(kind, (Dual, *PLAIN)) for kind in given)
            if dual is None or not numbers or len(given) != (count or len(given)):
                return None
            return rule(dual, [kind if isinstance(kind, Dual) else types.float64 for kind in given])

    infer_global(function)(Rule)


def _lowered(function: Any, count: int, lowering: Callable[..., Any]) -> None:
    """How it is computed, of duals and floats."""
    kinds: list[Any] = [[Dual]] if count == 1 else [[Dual, Dual], [Dual, types.Float], [types.Float, Dual]]
    for given in kinds:
        lower_builtin(function, *given)(lowering)


def _formula(functions: Sequence[Any], formula: Callable[..., Any]) -> None:
    """Arithmetic: value and derivatives from those of two numbers."""

    def lowering(context: Any, builder: Any, sig: Any, given: Any) -> Any:
        (x, dx), (y, dy) = _parts(builder, sig.args, given)
        return _made(builder, *formula(builder, x, dx, y, dy))

    for function in functions:
        _typed(function, 2, lambda dual, given: signature(dual, *given))
        _lowered(function, 2, lowering)


def _add(b: Any, x: Any, dx: Any, y: Any, dy: Any) -> Any:
    return b.fadd(x, y), dy if dx is None else dx if dy is None else b.fadd(dx, dy)


def _subtract(b: Any, x: Any, dx: Any, y: Any, dy: Any) -> Any:
    return b.fsub(x, y), b.fneg(dy) if dx is None else dx if dy is None else b.fsub(dx, dy)


def _multiply(b: Any, x: Any, dx: Any, y: Any, dy: Any) -> Any:
    terms = [_times(b, factor, change) for factor, change in ((y, dx), (x, dy)) if change is not None]
    return b.fmul(x, y), terms[0] if len(terms) == 1 else b.fadd(*terms)


def _divide(b: Any, x: Any, dx: Any, y: Any, dy: Any) -> Any:
    value, inverse = b.fdiv(x, y), b.fdiv(DOUBLE(1.0), y)
    if dy is None:
        return value, _times(b, inverse, dx)
    less = _times(b, value, dy)
    return value, _times(b, inverse, b.fneg(less) if dx is None else b.fsub(dx, less))


_formula((operator.add, operator.iadd), _add)
_formula((operator.sub, operator.isub), _subtract)
_formula((operator.mul, operator.imul), _multiply)
_formula((operator.truediv, operator.itruediv), _divide)


def _compared(function: Any, sign: str) -> None:
    """A comparison of the values."""

    def lowering(context: Any, builder: Any, sig: Any, given: Any) -> Any:
        (x, _), (y, _) = _parts(builder, sig.args, given)
        return (builder.fcmp_unordered if sign == "!=" else builder.fcmp_ordered)(sign, x, y)

    _typed(function, 2, lambda dual, given: signature(types.boolean, *given))
    _lowered(function, 2, lowering)


for _sign in ("<", "<=", ">", ">=", "==", "!="):
    _compared(getattr(operator, {"<": "lt", "<=": "le", ">": "gt", ">=": "ge", "==": "eq", "!=": "ne"}[_sign]), _sign)


def _extreme(function: Any, sign: str) -> None:
    """The least or the largest of several numbers, with Python's order of comparisons."""

    def lowering(context: Any, builder: Any, sig: Any, given: Any) -> Any:
        (best, *others) = given
        for other in others:
            test = builder.fcmp_ordered(sign, builder.extract_value(other, 0), builder.extract_value(best, 0))
            best = builder.select(test, other, best)
        return best

    _typed(function, 0, lambda dual, given: signature(dual, *[dual] * len(given)))
    lower_builtin(function, types.VarArg(Dual))(lowering)


_extreme(min, "<")
_extreme(max, ">")


def _through(function: Any, *slopes: Callable[..., float], value: Callable[..., float] | None = None) -> None:
    """A function whose derivative by each of its arguments is one of these and of its value."""

    def lowering(context: Any, builder: Any, sig: Any, given: Any) -> Any:
        parts = _parts(builder, sig.args, given)
        values = [x for x, _ in parts]
        result = _python(context, builder, value or function, types.float64, *values)
        terms = [
            _times(builder, _python(context, builder, slope, types.float64, *values, result), change)
            for slope, (_, change) in zip(slopes, parts, strict=True)
            if change is not None
        ]
        return _made(builder, result, terms[0] if len(terms) == 1 else builder.fadd(*terms))

    _typed(function, len(slopes), lambda dual, given: signature(dual, *given))
    _lowered(function, len(slopes), lowering)


# Where a slope has no end, at the edge of what a function is defined for, it counts as 0.
_through(operator.neg, lambda x, f: -1.0)
_through(abs, lambda x, f: -1.0 if x < 0.0 else 1.0)
_through(float, lambda x, f: 1.0, value=lambda x: x)
_through(math.sqrt, lambda x, f: 0.5 / f if x > 0.0 else 0.0)
_through(math.sin, lambda x, f: math.cos(x))
_through(math.cos, lambda x, f: -math.sin(x))
_through(math.tan, lambda x, f: 1.0 + f * f)
_through(math.asin, lambda x, f: 1.0 / math.sqrt(1.0 - x * x) if abs(x) < 1.0 else 0.0)
_through(math.acos, lambda x, f: -1.0 / math.sqrt(1.0 - x * x) if abs(x) < 1.0 else 0.0)
_through(math.atan, lambda x, f: 1.0 / (1.0 + x * x))
_through(math.exp, lambda x, f: f)
_through(math.log, lambda x, f: 1.0 / x)
_through(math.sinh, lambda x, f: math.cosh(x))
_through(math.cosh, lambda x, f: math.sinh(x))
_through(math.tanh, lambda x, f: 1.0 - f * f)
_through(math.erf, lambda x, f: 1.1283791670955126 * math.exp(-x * x))
_through(math.erfc, lambda x, f: -1.1283791670955126 * math.exp(-x * x))
_through(math.radians, lambda x, f: 0.017453292519943295)
_through(math.atan2, lambda y, x, f: x / (x * x + y * y), lambda y, x, f: -y / (x * x + y * y))
_through(math.copysign, lambda x, y, f: 1.0 if (x < 0.0) == (f < 0.0) else -1.0, lambda x, y, f: 0.0)
_through(operator.mod, lambda x, y, f: 1.0, lambda x, y, f: (f - x) / y)
_through(
    operator.pow,
    lambda x, y, f: y * x ** (y - 1.0) if y != 0.0 else 0.0,
    lambda x, y, f: f * math.log(x) if x > 0.0 else 0.0,
)


def _of_value(function: Any, result: Any, value: Callable[..., Any]) -> None:
    """A function that has no derivatives."""

    def lowering(context: Any, builder: Any, sig: Any, given: Any) -> Any:
        ((x, _),) = _parts(builder, sig.args, given)
        return _python(context, builder, value, result, x)

    _typed(function, 1, lambda dual, given: signature(result, *given))
    _lowered(function, 1, lowering)


_of_value(bool, types.boolean, lambda x: x != 0.0)
_of_value(operator.not_, types.boolean, lambda x: x == 0.0)
_of_value(int, types.int64, lambda x: int(x))
_of_value(math.floor, types.int64, math.floor)
_of_value(math.ceil, types.int64, math.ceil)
_of_value(math.isnan, types.boolean, math.isnan)
_of_value(math.isfinite, types.boolean, math.isfinite)


# ---------------------------------------------------------------------------------------- what laws say
@infer_global(settled)
class _Settled(AbstractTemplate):
    def generic(self, given: Sequence[Any], named: Any) -> Any:
        kinds = [kind if isinstance(kind, Dual) else types.float64 for kind in given]
        return signature(next((kind for kind in kinds[:2] if isinstance(kind, Dual)), types.float64), *kinds)


@lower_builtin(settled, types.Any, types.Any, types.Any)
def _settle(context: Any, builder: Any, sig: Any, given: Any) -> Any:
    (root, own), (_, error), (slope, _) = _parts(builder, sig.args, given)
    if error is None:
        return given[0]
    step = _times(builder, builder.fdiv(DOUBLE(1.0), slope), error)
    return _made(builder, root, builder.fneg(step) if own is None else builder.fsub(own, step))


@infer_global(is_nothing)
class _Nothing(AbstractTemplate):
    def generic(self, given: Sequence[Any], named: Any) -> Any:
        return signature(types.boolean, *given)


@lower_builtin(is_nothing, types.Any)
def _compare_to_nothing(context: Any, builder: Any, sig: Any, given: Any) -> Any:
    ((value, change),) = _parts(builder, sig.args, given)
    result = builder.fcmp_ordered("==", value, DOUBLE(0.0))
    for k in range(change.type.count if change is not None else 0):
        one = builder.extract_element(change, PLACE(k))
        result = builder.and_(result, builder.fcmp_ordered("==", one, DOUBLE(0.0)))
    return result


INSTRUCTIONS: dict[Any, Any] = {settled: settled, is_nothing: is_nothing}
"""Functions of ours that machine code, that of floats too, has its own of."""
