"""What a law is given of a component: numbers, curves, formulas, the control."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

from osimlite.base.records import dataclass
from osimlite.errors import ModelError
from osimlite.mechanics.kernels.functions import with_reflex
from osimlite.mechanics.multibody.formula import Formula, program
from osimlite.mechanics.multibody.function_tables import table_of_one
from osimlite.mechanics.multibody.functions import Function
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.kernel_text import arguments_of


class Tail:
    """What stands behind the parts of fixed length of an item.

    Args:
        ints: place of the first integer, from the item's record on.
        numbers: place of the first number, from the item's numbers on.
        room: place of the first number of the record.
    """

    def __init__(self, ints: int, numbers: int, room: int) -> None:
        self._first = ints, numbers
        self.ints: list[int] = []
        self.numbers: list[float] = []
        self.room = room

    def put_ints(self, ints: Sequence[int]) -> int:
        """Add integers; returns their place."""
        self.ints += ints
        return self._first[0] + len(self.ints) - len(ints)

    def put_numbers(self, numbers: Sequence[float]) -> int:
        """Add numbers; returns their place."""
        self.numbers += numbers
        return self._first[1] + len(self.numbers) - len(numbers)

    def put_room(self, count: int) -> int:
        """Make room in the record; returns its place."""
        self.room += count
        return self.room - count


class Parameter(ABC):
    """Something that a law is given of a component."""

    size: int = 0  # how many numbers of fixed place it takes
    heads: int = 0  # how many integers that say where something of variable length is

    @abstractmethod
    def read(self, builder: ElementBuilder, force: Any) -> Any:
        """Its value, from a component."""

    @abstractmethod
    def arguments(self, head: int, number: int) -> list[str]:
        """What the law is called with; `head` is the place of its integers, `number` that of its numbers."""

    def functions(self) -> dict[str, Callable[..., Any]]:
        """What the arguments call, by name."""
        return {}

    @abstractmethod
    def pack(self, value: Any, tail: Tail, where: str) -> tuple[Sequence[int], Sequence[float]]:
        """Its integers and numbers; what is of variable length goes into the tail."""


@dataclass(frozen=True)
class Number(Parameter):
    """A property that is a number, or a yes or no that the law is given as 1 or 0."""

    name: str  # of the property
    accepts: Callable[[float], bool] = lambda value: True  # whether a number will do
    needs: str = ""  # what is said of one that does not, after "the <name> of '<path>' "
    size = 1

    def read(self, builder: ElementBuilder, force: Any) -> float:
        """The number."""
        value = float(getattr(force, self.name))
        builder.check(force, (value,))
        if not self.accepts(value):
            raise ModelError(f"the {self.name} of '{builder.path(force)}' {self.needs}")
        return value

    def arguments(self, head: int, number: int) -> list[str]:
        """It."""
        return [f"p[{number}]"]

    def pack(self, value: float, tail: Tail, where: str) -> tuple[Sequence[int], Sequence[float]]:
        """It."""
        return (), (value,)


def positive(name: str) -> Number:
    """A property that is a positive number."""
    return Number(name, lambda value: value > 0.0, "is not positive; give it one that is")


@dataclass(frozen=True)
class Numbers(Parameter):
    """Several numbers that are computed together."""

    count: int  # how many
    of: Callable[[ElementBuilder, Any], Sequence[float]]  # from a component and the builder

    @property
    def size(self) -> int:  # type: ignore[override]
        """How many."""
        return self.count

    def read(self, builder: ElementBuilder, force: Any) -> tuple[float, ...]:
        """The numbers."""
        values = tuple(map(float, self.of(builder, force)))
        builder.check(force, values)
        return values

    def arguments(self, head: int, number: int) -> list[str]:
        """They, one by one."""
        return [f"p[{number + k}]" for k in range(self.count)]

    def pack(
        self, value: Sequence[float], tail: Tail, where: str
    ) -> tuple[Sequence[int], Sequence[float]]:
        """They."""
        return (), value


@dataclass(frozen=True)
class Fields(Parameter):
    """Numbers that the law is given as one named tuple."""

    type: type[Any]  # the tuple; its first fields are the properties
    properties: tuple[Number, ...]  # that are numbers
    # the rest of its fields, from a component whose properties will do
    others: Callable[[ElementBuilder, Any], Sequence[float]] = lambda builder, force: ()

    @property
    def size(self) -> int:  # type: ignore[override]
        """How many."""
        return len(self.type._fields)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the properties, and of the fields that are none."""
        return (
            *(item.name for item in self.properties),
            *self.type._fields[len(self.properties) :],
        )

    def read(self, builder: ElementBuilder, force: Any) -> Any:
        """The tuple."""
        values = [item.read(builder, force) for item in self.properties]
        values += map(float, self.others(builder, force))
        builder.check(force, values)
        return self.type(*values)

    def arguments(self, head: int, number: int) -> list[str]:
        """It."""
        return [f"{self.type.__name__}({', '.join(f'p[{number + k}]' for k in range(self.size))})"]

    def functions(self) -> dict[str, Callable[..., Any]]:
        """What makes it."""
        return {self.type.__name__: self.type}

    def pack(
        self, value: Sequence[float], tail: Tail, where: str
    ) -> tuple[Sequence[int], Sequence[float]]:
        """Its numbers."""
        return (), value


@dataclass(frozen=True)
class Vector(Numbers):
    """Several numbers, of which the law is given the place."""

    def read(self, builder: ElementBuilder, force: Any) -> tuple[float, ...]:
        """The numbers as they are: muscles share those of their curves."""
        values = tuple(self.of(builder, force))
        builder.check(force, values)
        return values

    def arguments(self, head: int, number: int) -> list[str]:
        """Where they begin."""
        return [f"at(p, {number})"]


@dataclass(frozen=True)
class Curve(Parameter):
    """A property that is a function of one number; the law is given its table, for `value_at`."""

    name: str
    heads = 1

    def read(self, builder: ElementBuilder, force: Any) -> Function:
        """The function."""
        return builder.function(force, getattr(force, self.name), self.name)

    def arguments(self, head: int, number: int) -> list[str]:
        """Its table."""
        return [f"at(p, i[{head}])"]

    def pack(
        self, value: Function, tail: Tail, where: str
    ) -> tuple[Sequence[int], Sequence[float]]:
        """Place of the table."""
        return (tail.put_numbers(table_of_one(value, f"the {self.name} of {where}")),), ()


@dataclass(frozen=True)
class Together(Parameter):
    """Several of these that the law is given as one named tuple."""

    type: type[Any]  # the tuple
    terms: tuple[Parameter, ...]  # what is in each of its fields

    @property
    def size(self) -> int:  # type: ignore[override]
        """How many numbers."""
        return sum(term.size for term in self.terms)

    @property
    def heads(self) -> int:  # type: ignore[override]
        """How many integers."""
        return sum(term.heads for term in self.terms)

    def read(self, builder: ElementBuilder, force: Any) -> Any:
        """The tuple."""
        return self.type(*(term.read(builder, force) for term in self.terms))

    def arguments(self, head: int, number: int) -> list[str]:
        """It."""
        return [f"{self.type.__name__}({', '.join(arguments_of(self.terms, head, number))})"]

    def functions(self) -> dict[str, Callable[..., Any]]:
        """What makes it."""
        return {self.type.__name__: self.type}

    def pack(self, value: Any, tail: Tail, where: str) -> tuple[Sequence[int], Sequence[float]]:
        """Their integers and numbers, one after another."""
        packed = [term.pack(own, tail, where) for term, own in zip(self.terms, value, strict=True)]
        return [place for ints, _ in packed for place in ints], [
            x for _, numbers in packed for x in numbers
        ]


@dataclass(frozen=True)
class Expression(Parameter):
    """A property that is a formula; the law is given its steps, constants and registers, for `compute`."""

    name: str  # of the property
    variables: tuple[str, ...]  # that it may name
    heads = 3

    def read(self, builder: ElementBuilder, force: Any) -> Formula:
        """The formula."""
        where = f"the {self.name} of '{builder.path(force)}'"
        return Formula.parse(getattr(force, self.name), self.variables, where)

    def arguments(self, head: int, number: int) -> list[str]:
        """Steps, constants, registers."""
        return [f"at(i, i[{head}])", f"at(p, i[{head + 1}])", f"at(found, i[{head + 2}])"]

    def pack(self, value: Formula, tail: Tail, where: str) -> tuple[Sequence[int], Sequence[float]]:
        """Places of steps (their count first), constants and registers."""
        steps, constants = program(value)
        count = len(steps) // 3
        # Where they are to carry derivatives, these are by the variables.
        registers = tail.put_room((1 + len(self.variables)) * (len(self.variables) + count))
        return (tail.put_ints((count, *steps)), tail.put_numbers(constants), registers), ()


@dataclass(frozen=True)
class Expressions(Parameter):
    """Properties that are formulas in the same variables.

    The law is given the steps of each, with their count and the place of its constants before them;
    the numbers that these places count from; and the registers that they share.
    """

    names: tuple[str, ...]  # of the properties
    variables: tuple[str, ...]  # that they may name
    heads = 2

    def read(self, builder: ElementBuilder, force: Any) -> tuple[Formula, ...]:
        """The formulas."""
        return tuple(Expression(name, self.variables).read(builder, force) for name in self.names)

    def arguments(self, head: int, number: int) -> list[str]:
        """Steps, numbers, registers."""
        return [f"at(i, i[{head}])", "p", f"at(found, i[{head + 1}])"]

    def pack(
        self, value: Sequence[Formula], tail: Tail, where: str
    ) -> tuple[Sequence[int], Sequence[float]]:
        """Places of the steps and of the registers."""
        ints: list[int] = []
        most = 0
        for formula in value:
            steps, constants = program(formula)
            ints += (len(steps) // 3, tail.put_numbers(constants), *steps)
            most = max(most, len(steps) // 3)
        return (tail.put_ints(ints), tail.put_room(len(self.variables) + most)), ()


@dataclass(frozen=True)
class Control(Parameter):
    """What the controllers set: the controls of an actuator, as many as it has."""

    count: int
    heads = 1

    def read(self, builder: ElementBuilder, force: Any) -> Any:
        """Number of the first of them among those of the model."""
        return builder.controls.first_of(builder, force)

    def arguments(self, head: int, number: int) -> list[str]:
        """They, one by one."""
        return [f"data[model[MODEL.WORK_CONTROL] + i[{head}] + {k}]" for k in range(self.count)]

    def pack(self, value: Any, tail: Tail, where: str) -> tuple[Sequence[int], Sequence[float]]:
        """The number."""
        return (value,), ()


@dataclass(frozen=True)
class ReflexControl(Control):
    """The control of a muscle, to which its own lengthening may add."""

    count: int = 1
    size = 1

    def read(self, builder: ElementBuilder, force: Any) -> Any:
        """Its number, and the gain of the reflex, s/m."""
        return super().read(builder, force), builder.controls.gain(builder, force)

    def arguments(self, head: int, number: int) -> list[str]:
        """The control."""
        return [f"with_reflex(data, model[MODEL.WORK_CONTROL] + i[{head}], p[{number}], rate)"]

    def functions(self) -> dict[str, Callable[..., Any]]:
        """What adds."""
        return {"with_reflex": with_reflex}

    def pack(
        self, value: tuple[int, float], tail: Tail, where: str
    ) -> tuple[Sequence[int], Sequence[float]]:
        """Number and gain."""
        return value[:1], value[1:]
