"""Paths whose length, lengthening speed and moment arms are functions of coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

from osimlite.base.records import dataclass
from osimlite.errors import ModelError
from osimlite.mechanics.kernels.function_paths import ARMS, DERIVATIVES
from osimlite.mechanics.kernels.layout import ITEM
from osimlite.mechanics.multibody.formula import Formula, program
from osimlite.mechanics.multibody.function_tables import table_of_one
from osimlite.mechanics.multibody.functions import (
    Function,
    MultivariatePolynomial,
    ScaledFunction,
    WeightedSum,
)
from osimlite.mechanics.multibody.links import Places
from osimlite.mechanics.multibody.schema_functions import convert_function
from osimlite.schema.functions import Constant, ExpressionBasedFunction, MultiplierFunction
from osimlite.schema.paths import FunctionBasedPath
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.force_records import ForceRecord
from osimlite.simulation.elements.registry import register_path


@dataclass(frozen=True)
class CoordinatePath:
    """Path that acts on coordinates only."""

    path: str  # path of its owner
    coordinates: tuple[int, ...]  # indices in the mechanism of the coordinates that it depends on
    length: Function | Formula  # length as a function of the coordinates
    # moment arms as functions of the coordinates; if empty, the negative derivatives of the length
    arms: tuple[Function | Formula, ...] = ()
    # lengthening speed as a function of the values and then the speeds of the coordinates; if None,
    # it follows from the moment arms
    speed: Function | Formula | None = None

    coupled: ClassVar[bool] = False

    def make_records(self, places: Places) -> list[ForceRecord]:
        """Return records that pull, those of the functions, and that of the path."""
        values = [places.locked_value(coordinate) for coordinate in self.coordinates]
        freedoms = [places.freedom(coordinate) for coordinate in self.coordinates]
        speeds = [freedom + len(places.freedoms) if freedom >= 0 else -1 for freedom in freedoms]
        of_values = [
            self._make_function_record(item, freedoms, values) for item in (self.length, *self.arms)
        ]
        of_speeds = (
            [
                self._make_function_record(
                    self.speed, freedoms + speeds, values + [0.0] * len(values)
                )
            ]
            if self.speed
            else []
        )
        parts = [ForceRecord("pull_coordinates", is_part=True), *of_values, *of_speeds]
        backs = [
            sum(ITEM.OWN + len(item.ints) for item in parts[index:]) for index in range(len(parts))
        ]
        arms = backs[2 : 2 + len(self.arms)] or [0] * len(values)
        ints = backs[0], len(values), backs[1], backs[-1] if of_speeds else 0, *freedoms, *arms
        return [
            *parts,
            ForceRecord("function_path", ints, record_size=ARMS + len(values), is_part=True),
        ]

    def _make_function_record(
        self, function: Function | Formula, arguments: Sequence[int], values: Sequence[float]
    ) -> ForceRecord:
        """Return the record of a function of states; a negative index stands for the value at that position."""
        size, work = len(arguments), DERIVATIVES + len(arguments)
        if isinstance(function, Formula):
            formulas = [function, *(function.derivative(k) for k in range(size))]
            ints, numbers = [size, len(formulas), *arguments], [*values]
            for steps, constants in map(program, formulas):
                ints += [len(steps) // 3, len(numbers), *steps]
                numbers += constants
            registers = size + max(len(item.steps) for item in formulas)
            return ForceRecord(
                "formula", tuple(ints), tuple(numbers), record_size=work + registers, is_part=True
            )
        if size == 1:
            table = table_of_one(function, f"a function of the path of '{self.path}'")
            return ForceRecord(
                "function_of_one",
                (1, 0, *arguments),
                (*values, *table),
                record_size=work,
                is_part=True,
            )
        factor = 1.0
        while isinstance(function, ScaledFunction):
            factor, function = factor * function.scale, function.function
        if isinstance(function, WeightedSum):
            order, coefficients = 1, (function.start, *reversed(function.weights))
        else:
            assert isinstance(function, MultivariatePolynomial)
            order, coefficients = max(map(sum, function.powers)), function.coefficients
        numbers = [*values, *(factor * coefficient for coefficient in coefficients)]
        work += size * (order + 1) + 2 * size
        return ForceRecord(
            "polynomial", (size, order, *arguments), tuple(numbers), record_size=work, is_part=True
        )


@register_path(FunctionBasedPath)
def read_function_path(builder: ElementBuilder, owner: Any) -> CoordinatePath:
    """Return the functions of an owner's path.

    Raises:
        UnsupportedError: a function has an unknown class.
        ModelError: there is no length or coordinate, or functions and coordinates do not match.
    """
    path = owner.geometry_path
    where = builder.path(path)
    named = path.coordinate_paths
    if not named:
        raise ModelError(
            f"the 'coordinate_paths' of '{where}' are empty; name at least one coordinate"
        )
    coordinates = tuple(
        builder.mechanism.coordinate_index(
            builder.path(builder.resolve_target(path, "coordinate_paths", name))
        )
        for name in named
    )
    count = len(set(coordinates))
    if count < len(coordinates):
        raise ModelError(
            f"the 'coordinate_paths' of '{where}' name a coordinate twice; name each once"
        )
    given = path.moment_arm_functions
    if given and len(given) != count:
        raise ModelError(
            f"'{where}' has {len(given)} moment_arm_functions for {count} coordinates; give one for each, or none"
        )
    arms = tuple(
        _read_function(item, count, f"'moment_arm_functions[{number}]' of '{where}'")
        for number, item in enumerate(given)
    )
    speed = path.lengthening_speed_function
    return CoordinatePath(
        builder.path(owner),
        coordinates,
        _read_function(path.length_function, count, f"'length_function' of '{where}'"),
        arms,
        _read_function(speed, 2 * count, f"'lengthening_speed_function' of '{where}'")
        if speed is not None
        else None,
    )


def _read_function(function: Any, arguments: int, where: str) -> Function | Formula:
    inner = function
    while isinstance(inner, MultiplierFunction):
        inner = inner.function
    if isinstance(inner, Constant):
        raise ModelError(
            f"{where} is a Constant, which has no arguments in OpenSim; use a LinearFunction"
        )
    if isinstance(function, ExpressionBasedFunction):
        if len(function.variables) != arguments:
            raise ModelError(
                f"{where} has {len(function.variables)} variables and gets {arguments}; name as many"
            )
        return Formula.parse(function.expression, function.variables, where)
    return convert_function(function, arguments, where)
