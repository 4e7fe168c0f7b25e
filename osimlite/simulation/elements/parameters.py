"""Parameters of laws: numbers, curves, expressions and controls that a law takes from a component."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

from osimlite.base.records import dataclass
from osimlite.errors import ModelError
from osimlite.mechanics.kernels.functions import add_reflex
from osimlite.mechanics.multibody.formula import Formula, program
from osimlite.mechanics.multibody.function_tables import table_of_one
from osimlite.mechanics.multibody.functions import SmoothFunction
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.kernel_text import write_arguments


class Tail:
    """Data of variable length behind the fixed part of a record.

    Args:
        ints: offset of the first integer, from the start of the record.
        numbers: offset of the first number, from the record's numbers.
        record_size: size of the output record so far.
    """

    def __init__(self, ints: int, numbers: int, record_size: int) -> None:
        self._first = ints, numbers
        self.ints: list[int] = []
        self.numbers: list[float] = []
        self.record_size = record_size

    def append_ints(self, ints: Sequence[int]) -> int:
        """Append integers to the record.

        Returns:
            Offset of the first appended integer from the start of the record.
        """
        self.ints += ints
        return self._first[0] + len(self.ints) - len(ints)

    def append_numbers(self, numbers: Sequence[float]) -> int:
        """Append numbers to those of the record.

        Returns:
            Offset of the first appended number from the record's numbers.
        """
        self.numbers += numbers
        return self._first[1] + len(self.numbers) - len(numbers)

    def reserve_record(self, count: int) -> int:
        """Reserve numbers at the end of the output record.

        Returns:
            Offset of the first reserved number in the output record.
        """
        self.record_size += count
        return self.record_size - count


class Parameter(ABC):
    """One or several arguments of a law that come from a component.

    Attributes:
        size: number of numbers of fixed position.
        int_count: number of integers, which are offsets of data of variable length.
    """

    size: int = 0
    int_count: int = 0

    @abstractmethod
    def read(self, builder: ElementBuilder, force: Any) -> Any:
        """Return the value of the parameter for a component.

        Args:
            builder: builder of the model's elements.
            force: force component of the model.
        """

    @abstractmethod
    def write_arguments(self, head: int, number: int) -> list[str]:
        """Return the arguments of the law, as expressions.

        Args:
            head: index of its first integer in the record.
            number: index of its first number.
        """

    def list_functions(self) -> dict[str, Callable[..., Any]]:
        """Return the functions that the arguments call, by name.

        Returns:
            The functions by the names in the expressions.
        """
        return {}

    @abstractmethod
    def pack(self, value: Any, tail: Tail, owner: str) -> tuple[Sequence[int], Sequence[float]]:
        """Return the integers and numbers of a value; data of variable length goes into the tail.

        Args:
            value: result of `read`.
            tail: receives data of variable length.
            owner: the force, for messages.

        Returns:
            Integers and numbers of fixed position.
        """


@dataclass(frozen=True)
class Number(Parameter):
    """Property that is a number, or a boolean that the law takes as 1 or 0.

    Attributes:
        name: name of the property.
        accepts: function that returns whether a number is accepted.
        needs: message about other numbers, after "the <name> of '<path>' ".
    """

    name: str
    accepts: Callable[[float], bool] = lambda value: True
    needs: str = ""
    size = 1

    def read(self, builder: ElementBuilder, force: Any) -> float:
        """Return the number.

        Raises:
            ModelError: the number is not finite, or not accepted.
        """
        value = float(getattr(force, self.name))
        builder.check_finite(force, (value,))
        if not self.accepts(value):
            raise ModelError(f"the {self.name} of '{builder.path(force)}' {self.needs}")
        return value

    def write_arguments(self, head: int, number: int) -> list[str]:
        """Return the expression that reads the number from the record."""
        return [f"p[{number}]"]

    def pack(self, value: float, tail: Tail, owner: str) -> tuple[Sequence[int], Sequence[float]]:
        """Return no integer and the number itself.

        Returns:
            Integers and numbers of fixed position.
        """
        return (), (value,)


def require_positive(name: str) -> Number:
    """Return the parameter for a property that is a positive number."""
    return Number(name, lambda value: value > 0.0, "is not positive; give it a positive value")


class NumbersParameter(Parameter):
    """Parameter whose value is a sequence of numbers of fixed position."""

    def pack(
        self, value: Sequence[float], tail: Tail, owner: str
    ) -> tuple[Sequence[int], Sequence[float]]:
        """Return no integers and the values.

        Returns:
            Integers and numbers of fixed position.
        """
        return (), value


@dataclass(frozen=True)
class Numbers(NumbersParameter):
    """Several numbers that are computed from a component together."""

    count: int  # number of values
    of: Callable[[ElementBuilder, Any], Sequence[float]]  # function of the builder and a component

    @property
    def size(self) -> int:  # type: ignore[override]
        """Number of values that the function returns."""
        return self.count

    def read(self, builder: ElementBuilder, force: Any) -> tuple[float, ...]:
        """Return the values as floats; a ModelError if one is not finite.

        Args:
            builder: builder of the model's elements.
            force: force component of the model.

        Returns:
            `count` values.
        """
        values = tuple(map(float, self.of(builder, force)))
        builder.check_finite(force, values)
        return values

    def write_arguments(self, head: int, number: int) -> list[str]:
        """Return one expression for each value."""
        return [f"p[{number + k}]" for k in range(self.count)]


@dataclass(frozen=True)
class Fields(NumbersParameter):
    """Numbers that the law takes as one named tuple."""

    type: type[Any]  # type of the tuple; its first fields are the properties
    properties: tuple[Number, ...]  # parameters of the first fields
    # function that returns the other fields, from a component whose properties are accepted
    others: Callable[[ElementBuilder, Any], Sequence[float]] = lambda builder, force: ()

    @property
    def size(self) -> int:  # type: ignore[override]
        """Number of fields of the tuple."""
        return len(self.type._fields)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the values: those of the properties, then those of the other fields.

        Returns:
            One name for each field of the tuple.
        """
        return (
            *(item.name for item in self.properties),
            *self.type._fields[len(self.properties) :],
        )

    def read(self, builder: ElementBuilder, force: Any) -> Any:
        """Return the named tuple; a ModelError if a value is not finite or not accepted."""
        values = [item.read(builder, force) for item in self.properties]
        values += map(float, self.others(builder, force))
        builder.check_finite(force, values)
        return self.type(*values)

    def write_arguments(self, head: int, number: int) -> list[str]:
        """Return the constructor call of the named tuple."""
        return [f"{self.type.__name__}({', '.join(f'p[{number + k}]' for k in range(self.size))})"]

    def list_functions(self) -> dict[str, Callable[..., Any]]:
        """Return the type of the tuple, by name.

        Returns:
            Functions or types by name.
        """
        return {self.type.__name__: self.type}


@dataclass(frozen=True)
class Vector(Numbers):
    """Several numbers that the law takes as a pointer."""

    def read(self, builder: ElementBuilder, force: Any) -> tuple[float, ...]:
        """Return the numbers unchanged, as a tuple.

        The objects are not copied: muscles with equal curves then share one tuple in memory.

        Args:
            builder: builder of the model's elements.
            force: force component of the model.

        Returns:
            The numbers of the function.
        """
        values = tuple(self.of(builder, force))
        builder.check_finite(force, values)
        return values

    def write_arguments(self, head: int, number: int) -> list[str]:
        """Return the pointer to the first number."""
        return [f"at(p, {number})"]


@dataclass(frozen=True)
class Curve(Parameter):
    """Property that is a function of one argument; the law takes its table, for `evaluate_function`.

    Attributes:
        name: name of the property.
    """

    name: str
    int_count = 1

    def read(self, builder: ElementBuilder, force: Any) -> SmoothFunction:
        """Return the function that the property holds."""
        return builder.read_function(force, getattr(force, self.name), self.name)

    def write_arguments(self, head: int, number: int) -> list[str]:
        """Return the pointer to the table."""
        return [f"at(p, i[{head}])"]

    def pack(
        self, value: SmoothFunction, tail: Tail, owner: str
    ) -> tuple[Sequence[int], Sequence[float]]:
        """Return the offset of the table, which goes into the tail.

        Returns:
            Integers and numbers of fixed position.
        """
        return (tail.append_numbers(table_of_one(value, f"the {self.name} of {owner}")),), ()


@dataclass(frozen=True)
class ParameterGroup(Parameter):
    """Several parameters that the law takes as one named tuple."""

    type: type[Any]  # type of the tuple
    terms: tuple[Parameter, ...]  # parameter of each field

    @property
    def size(self) -> int:  # type: ignore[override]
        """Number of numbers of all its parameters."""
        return sum(term.size for term in self.terms)

    @property
    def int_count(self) -> int:  # type: ignore[override]
        """Number of integers of all its parameters."""
        return sum(term.int_count for term in self.terms)

    def read(self, builder: ElementBuilder, force: Any) -> Any:
        """Return the named tuple of the values of its parameters."""
        return self.type(*(term.read(builder, force) for term in self.terms))

    def write_arguments(self, head: int, number: int) -> list[str]:
        """Return the constructor call of the named tuple."""
        return [f"{self.type.__name__}({', '.join(write_arguments(self.terms, head, number))})"]

    def list_functions(self) -> dict[str, Callable[..., Any]]:
        """Return the type of the tuple, by name.

        Returns:
            Functions or types by name.
        """
        return {self.type.__name__: self.type}

    def pack(self, value: Any, tail: Tail, owner: str) -> tuple[Sequence[int], Sequence[float]]:
        """Return the integers and numbers of all its parameters, one after another.

        Returns:
            Integers and numbers of fixed position.
        """
        packed = [
            term.pack(item, tail, owner) for term, item in zip(self.terms, value, strict=True)
        ]
        return [integer for ints, _ in packed for integer in ints], [
            x for _, numbers in packed for x in numbers
        ]


@dataclass(frozen=True)
class Expression(Parameter):
    """Property that is an expression; the law takes its steps, constants and registers, for `compute`."""

    name: str  # name of the property
    variables: tuple[str, ...]  # names of its variables
    int_count = 3

    def read(self, builder: ElementBuilder, force: Any) -> Formula:
        """Return the parsed expression; an error names the property."""
        where = f"the {self.name} of '{builder.path(force)}'"
        return Formula.parse(getattr(force, self.name), self.variables, where)

    def write_arguments(self, head: int, number: int) -> list[str]:
        """Return the pointers to steps, constants and registers."""
        return [f"at(i, i[{head}])", f"at(p, i[{head + 1}])", f"at(record, i[{head + 2}])"]

    def pack(self, value: Formula, tail: Tail, owner: str) -> tuple[Sequence[int], Sequence[float]]:
        """Return the offsets of the steps (after their count), the constants and the registers.

        Returns:
            Integers and numbers of fixed position.
        """
        steps, constants = program(value)
        # A step is three integers: operation and operands.
        count = len(steps) // 3
        # Each register may carry its derivatives with respect to the variables.
        registers = tail.reserve_record((1 + len(self.variables)) * (len(self.variables) + count))
        return (tail.append_ints((count, *steps)), tail.append_numbers(constants), registers), ()


@dataclass(frozen=True)
class Expressions(Parameter):
    """Properties that are expressions in the same variables.

    The law takes the steps of each, preceded by their count and the offset of its constants; the
    numbers that these offsets refer to; and the registers, which all expressions use.
    """

    names: tuple[str, ...]  # names of the properties
    variables: tuple[str, ...]  # names of their variables
    int_count = 2

    def read(self, builder: ElementBuilder, force: Any) -> tuple[Formula, ...]:
        """Return the parsed expressions, a tuple in the order of `names`.

        Args:
            builder: builder of the model's elements.
            force: force component of the model.

        Returns:
            One formula for each name.
        """
        return tuple(Expression(name, self.variables).read(builder, force) for name in self.names)

    def write_arguments(self, head: int, number: int) -> list[str]:
        """Return the pointers to steps, numbers and registers."""
        return [f"at(i, i[{head}])", "p", f"at(record, i[{head + 1}])"]

    def pack(
        self, value: Sequence[Formula], tail: Tail, owner: str
    ) -> tuple[Sequence[int], Sequence[float]]:
        """Return the offsets of the steps and of the registers.

        Returns:
            Integers and numbers of fixed position.
        """
        ints: list[int] = []
        most = 0
        for formula in value:
            steps, constants = program(formula)
            ints += (len(steps) // 3, tail.append_numbers(constants), *steps)
            # One expression is evaluated after another, so that all use the same registers.
            most = max(most, len(steps) // 3)
        return (tail.append_ints(ints), tail.reserve_record(len(self.variables) + most)), ()


@dataclass(frozen=True)
class Control(Parameter):
    """Controls of an actuator, as many as it has."""

    count: int
    int_count = 1

    def read(self, builder: ElementBuilder, force: Any) -> Any:
        """Return the index of its first control among those of the model."""
        return builder.controls.find_first(builder, force)

    def write_arguments(self, head: int, number: int) -> list[str]:
        """Return one expression for each control, which reads it from the work vector."""
        return [f"data[model[MODEL.WORK_CONTROL] + i[{head}] + {k}]" for k in range(self.count)]

    def pack(self, value: Any, tail: Tail, owner: str) -> tuple[Sequence[int], Sequence[float]]:
        """Return the index and no numbers.

        Returns:
            Integers and numbers of fixed position.
        """
        return (value,), ()


@dataclass(frozen=True)
class ReflexControl(Control):
    """Control of a muscle, to which a stretch reflex may add."""

    count: int = 1
    size = 1

    def read(self, builder: ElementBuilder, force: Any) -> Any:
        """Return the index of the control, and the gain of the reflex, s/m."""
        return super().read(builder, force), builder.controls.compute_gain(builder, force)

    def write_arguments(self, head: int, number: int) -> list[str]:
        """Return the expression of the control with the reflex."""
        return [f"add_reflex(data, model[MODEL.WORK_CONTROL] + i[{head}], p[{number}], rate)"]

    def list_functions(self) -> dict[str, Callable[..., Any]]:
        """Return the function that adds the reflex, by name.

        Returns:
            Functions or types by name.
        """
        return {"add_reflex": add_reflex}

    def pack(
        self, value: tuple[int, float], tail: Tail, owner: str
    ) -> tuple[Sequence[int], Sequence[float]]:
        """Return the index and the gain.

        Returns:
            Integers and numbers of fixed position.
        """
        return value[:1], value[1:]
