"""Paths whose length, lengthening speed and moment arms are functions of coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

from osimlite.base.records import dataclass
from osimlite.base.text import format_count
from osimlite.errors import ModelError
from osimlite.mechanics.kernels.function_paths import FUNCTION_PATH_WORK, FUNCTION_WORK
from osimlite.mechanics.kernels.layout import ITEM
from osimlite.mechanics.multibody.formula import Formula, program
from osimlite.mechanics.multibody.function_tables import table_of_one
from osimlite.mechanics.multibody.functions import (
    MultivariatePolynomial,
    ScaledFunction,
    SmoothFunction,
    WeightedSum,
)
from osimlite.mechanics.multibody.links import LinkMap
from osimlite.mechanics.multibody.schema_functions import convert_function
from osimlite.schema.function_types import ExpressionBasedFunction
from osimlite.schema.functions import Constant, MultiplierFunction
from osimlite.schema.paths import FunctionBasedPath
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.force_records import ForceRecord
from osimlite.simulation.elements.registry import register_path


@dataclass(frozen=True)
class CoordinatePath:
    """Path that acts on coordinates only.

    Attributes:
        path: component path of its owner.
        coordinates: indices in the mechanism of the coordinates that it depends on.
        length: length (m) as a function of the coordinates.
        arms: moment arms as functions of the coordinates; if empty, the negative derivatives of the
            length.
        speed: lengthening speed (m/s) as a function of the values and then the speeds of the
            coordinates; if None, it follows from the moment arms.
    """

    path: str
    coordinates: tuple[int, ...]
    length: SmoothFunction | Formula
    arms: tuple[SmoothFunction | Formula, ...] = ()
    speed: SmoothFunction | Formula | None = None

    coupled: ClassVar[bool] = False

    def make_records(self, link_map: LinkMap) -> list[ForceRecord]:
        """Return the records of the path.

        Args:
            link_map: placement of the bodies in the links of the tree.

        Returns:
            The record that pulls, those of the functions, and last that of the path.
        """
        values = [link_map.get_locked_value(coordinate) for coordinate in self.coordinates]
        freedoms = [link_map.freedom(coordinate) for coordinate in self.coordinates]
        speeds = [freedom + len(link_map.freedoms) if freedom >= 0 else -1 for freedom in freedoms]
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
        # The record of the path refers to the others by the distance back to them.
        backs = [
            sum(ITEM.DETAILS + len(item.ints) for item in parts[index:])
            for index in range(len(parts))
        ]
        arms = backs[2 : 2 + len(self.arms)] or [0] * len(values)
        ints = backs[0], len(values), backs[1], backs[-1] if of_speeds else 0, *freedoms, *arms
        return [
            *parts,
            ForceRecord(
                "function_path",
                ints,
                record_size=FUNCTION_PATH_WORK.ARMS + len(values),
                is_part=True,
            ),
        ]

    def _make_function_record(
        self, function: SmoothFunction | Formula, arguments: Sequence[int], values: Sequence[float]
    ) -> ForceRecord:
        """Return the record of a function of states.

        Args:
            function: the function.
            arguments: index in y of each argument, -1 for a locked coordinate.
            values: value of each argument that is locked.
        """
        size = len(arguments)
        work = FUNCTION_WORK.DERIVATIVES + len(arguments)
        if isinstance(function, Formula):
            # A formula is differentiated symbolically, and its derivatives are formulas of the same
            # record.
            formulas = [function, *(function.derivative(k) for k in range(size))]
            ints = [size, len(formulas), *arguments]
            numbers = [*values]
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
        # Factors are multiplied into the coefficients, so that one kernel evaluates all
        # polynomials.
        while isinstance(function, ScaledFunction):
            factor = factor * function.scale
            function = function.function
        if isinstance(function, WeightedSum):
            order = 1
            coefficients = (function.start, *reversed(function.weights))
        else:
            assert isinstance(function, MultivariatePolynomial)
            order = max(map(sum, function.powers))
            coefficients = function.coefficients
        numbers = [*values, *(factor * coefficient for coefficient in coefficients)]
        work += size * (order + 1) + 2 * size
        return ForceRecord(
            "polynomial", (size, order, *arguments), tuple(numbers), record_size=work, is_part=True
        )


@register_path(FunctionBasedPath)
def read_function_path(builder: ElementBuilder, owner: Any) -> CoordinatePath:
    """Return the functions of an owner's path.

    Args:
        builder: builder of the model's elements.
        owner: component with the path.

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
    moment_arm_functions = path.moment_arm_functions
    if moment_arm_functions and len(moment_arm_functions) != count:
        raise ModelError(
            f"'{where}' has {format_count(len(moment_arm_functions), 'moment_arm_function')} for "
            f"{format_count(count, 'coordinate')}; give one for each, or none"
        )
    arms = tuple(
        _read_function(item, count, f"'moment_arm_functions[{number}]' of '{where}'")
        for number, item in enumerate(moment_arm_functions)
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


def _read_function(function: Any, arguments: int, description: str) -> SmoothFunction | Formula:
    inner = function
    while isinstance(inner, MultiplierFunction):
        inner = inner.function
    if isinstance(inner, Constant):
        raise ModelError(
            f"{description} is a Constant; in OpenSim, a Constant cannot depend on coordinates. Use a LinearFunction"
        )
    if isinstance(function, ExpressionBasedFunction):
        if len(function.variables) != arguments:
            raise ModelError(
                f"{description} has {format_count(len(function.variables), 'variable')} for "
                f"{format_count(arguments, 'argument')}; name one variable for each"
            )
        return Formula.parse(function.expression, function.variables, description)
    return convert_function(function, arguments, description)
