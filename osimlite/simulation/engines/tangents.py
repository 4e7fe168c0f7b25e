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
from numba.extending import intrinsic, lower_builtin, lower_cast, register_model

from osimlite.forces.carried import carrying, carrying_room, is_nothing, plain, settled, slope_of
from osimlite.simulation.engines.carrying import SLOPES

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


for _function, _slopes in SLOPES.items():
    _through(_function, *_slopes, value=(lambda x: x) if _function is float else None)


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


@intrinsic
def _plain_part(context: Any, number: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        ((value, _),) = _parts(builder, signature.args, given)
        return value

    return signature(types.float64, number if isinstance(number, Dual) else types.float64), generate


@intrinsic(prefer_literal=True)
def _carrying(context: Any, number: Any, direction: Any, directions: Any) -> Any:
    place, count = direction.literal_value, directions.literal_value

    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return _made(
            builder, given[0], ir.Constant(ir.VectorType(DOUBLE, count), [float(k == place) for k in range(count)])
        )

    return signature(Dual(count), types.float64, direction, directions), generate


@intrinsic(prefer_literal=True)
def _carrying_room(context: Any, vector: Any, directions: Any) -> Any:
    room = Duals(Dual(directions.literal_value))

    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return builder.bitcast(given[0], context.get_value_type(room))

    return signature(room, vector, directions), generate


@intrinsic(prefer_literal=True)
def _slope_of(context: Any, number: Any, direction: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        ((_, change),) = _parts(builder, signature.args[:1], given[:1])
        return DOUBLE(0.0) if change is None else builder.extract_element(change, PLACE(direction.literal_value))

    return signature(types.float64, number, direction), generate


INSTRUCTIONS: dict[Any, Any] = {
    settled: settled,
    is_nothing: is_nothing,
    plain: _plain_part,
    carrying: _carrying,
    carrying_room: _carrying_room,
    slope_of: _slope_of,
}
"""Functions of ours that machine code, that of floats too, has its own of."""
