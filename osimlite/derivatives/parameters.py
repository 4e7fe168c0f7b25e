"""Parameters: numbers of a model that stay symbols, and the numbers of the kernels as functions of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from osimlite.base.text import suggest_name
from osimlite.errors import OsimliteError, SettingError, UnsupportedError
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.simulation.properties import PropertySetter, find_properties, list_property_paths

LINEARITY_TOLERANCE = 1e-11
"""Largest deviation from a linear function, relative to the largest part of the number."""
TRIAL_FACTORS = 1.125, 1.375
"""Factors of the values, with which the linear functions are found and tested."""
TRIAL_SHIFTS = 0.125, -0.0625
"""Changes of values that are zero."""


class Parameters:
    """Numbers of a model by path, and the numbers of the kernels as linear functions of them.

    Most parameters enter the kernels unchanged: masses, stiffnesses, strengths, positions. The
    linear function of each is found by changing it, and tested by changing all at once. Any other
    dependence is an error.

    Args:
        model: model; a copy, as it is changed.
        names: paths as in sweeps; a path may stand for several numbers that are equal.
        numbers_of: function that packs the model into the numbers (k,) of the kernels.

    Attributes:
        names: paths of the parameters.
        values: values of the parameters in the model (p,), in the units of the file.
        base: numbers (k,) of the kernels for zero parameters.
        slopes: pairs of the index of a parameter and its factor, by the index in the numbers of the
            kernels.

    Raises:
        SettingError: a parameter does not exist, or stands for numbers that differ.
        UnsupportedError: the numbers of the kernels are no linear function of a parameter.
    """

    def __init__(
        self, model: Model, names: Sequence[str], numbers_of: Callable[[Model], Array]
    ) -> None:
        self.names = tuple(names)
        self._setters = [_find_setters(model, name) for name in names]
        initial_values = [
            _read_value(name, setters) for name, setters in zip(names, self._setters, strict=True)
        ]
        self.values = np.array(initial_values)
        base = numbers_of(model)
        self.slopes: dict[int, list[tuple[int, float]]] = {}

        def compute_numbers(values: Array, description: str) -> Array:
            """Return the numbers of the kernels (k,) for values of the parameters.

            Args:
                values: values of the parameters (p,).
                description: the changed parameters, for messages.

            Raises:
                UnsupportedError: the model is invalid with these values, or has another structure.
            """
            self._set_values(values)
            try:
                result = numbers_of(model)
            except OsimliteError as error:
                raise UnsupportedError(f"{description} cannot be a parameter: {error}") from error
            finally:
                self._set_values(self.values)
            if len(result) != len(base):
                raise UnsupportedError(
                    f"{description} cannot be a parameter: the structure of the model depends on it"
                )
            return result

        columns = np.zeros((len(base), len(initial_values)))
        for index, name in enumerate(names):
            # The first change gives the slope, the second one tests it.
            first_change, second_change = (
                self._change_values(number, [index]) for number in range(2)
            )
            columns[:, index] = _subtract_base(compute_numbers(first_change, f"'{name}'"), base) / (
                first_change[index] - initial_values[index]
            )
            _check_linear(
                compute_numbers(second_change, f"'{name}'"),
                base,
                columns[:, [index]],
                (second_change - self.values)[[index]],
                f"'{name}'",
            )
        if len(initial_values) > 1:
            names_text = (
                " and ".join(f"'{name}'" for name in names)
                if len(names) < 4
                else "these parameters"
            )
            # Products of parameters are linear in each but not in all together.
            for number in range(2):
                values = self._change_values(number, range(len(initial_values)))
                description = f"{names_text} together"
                _check_linear(
                    compute_numbers(values, description),
                    base,
                    columns,
                    values - self.values,
                    description,
                )
        self.base = base - columns @ self.values if len(initial_values) else base
        for row, number in zip(*np.nonzero(columns), strict=True):
            self.slopes.setdefault(int(row), []).append((int(number), float(columns[row, number])))

    def _change_values(self, number: int, indices: Sequence[int] | range) -> Array:
        """Return the values with some of them changed.

        Args:
            number: 0 or 1, which of two changes.
            indices: indices of the parameters to change.

        Returns:
            Values (p,). Each is changed by another factor.
        """
        values = self.values.copy()
        for index in indices:
            # Different factors, as the same factor would cancel in quotients of parameters.
            values[index] = (
                values[index] * (TRIAL_FACTORS[number] + index / 64.0)
                if values[index]
                else TRIAL_SHIFTS[number] * (1.0 + index / 8.0)
            )
        return values

    def _set_values(self, values: Array) -> None:
        """Set the values of all parameters in the model."""
        for setters, value in zip(self._setters, values.tolist(), strict=True):
            for setter in setters:
                setter.set_value(value)


def read_parameter(model: Model, name: str) -> float:
    """Return the value of a parameter in a model.

    Args:
        model: model with the parameter.
        name: path of the parameter.

    Returns:
        Value in the unit of the file.

    Raises:
        SettingError: the parameter does not exist, or stands for numbers that differ.
    """
    return _read_value(name, _find_setters(model, name))


def _find_setters(model: Model, name: str) -> list[PropertySetter]:
    """Return the setters of all numbers to which a path leads.

    Args:
        model: model with the numbers.
        name: path of a property, which may contain patterns.

    Raises:
        SettingError: the path leads to no number.
    """
    setters = [
        property_location.make_setter(model) for property_location in find_properties(model, name)
    ]
    if not setters:
        raise SettingError(
            f"the model has no number '{name}'{suggest_name(name, list_property_paths(model))}"
        )
    return setters


def _read_value(name: str, setters: Sequence[PropertySetter]) -> float:
    """Return the common value of the numbers that a path stands for.

    Raises:
        SettingError: the numbers differ.
    """
    values = {setter.get_value() for setter in setters}
    if len(values) > 1:
        raise SettingError(
            f"'{name}' matches properties with different values; name these properties one by one"
        )
    return values.pop()


def _subtract_base(changed: Array, base: Array) -> Array:
    """Return the changes of numbers; an unchanged infinite number has not changed.

    Args:
        changed: numbers after a change (k,).
        base: numbers before it (k,).
    """
    is_equal = changed == base
    return np.where(is_equal, 0.0, changed - np.where(is_equal, 0.0, base))


def _check_linear(
    changed: Array, base: Array, columns: Array, change: Array, description: str
) -> None:
    """Check that changes of numbers lie on the linear functions.

    Args:
        changed: numbers after a change (k,).
        base: numbers before it (k,).
        columns: slopes by each changed parameter (k, m).
        change: changes of the parameters (m,).
        description: the parameters, for messages.

    Raises:
        UnsupportedError: a number deviates.
    """
    linear_changes = columns * change
    size = np.abs(base) + np.abs(linear_changes).sum(axis=1)
    if not np.all(
        np.abs(_subtract_base(changed, base) - linear_changes.sum(axis=1))
        <= LINEARITY_TOLERANCE * size
    ):
        raise UnsupportedError(
            f"{description} cannot be a symbol: the equations do not depend on it linearly; "
            "change it in the model and create the functions again"
        )


def insert_parameters(
    numbers: Sequence[float], slopes: Mapping[int, Sequence[tuple[int, float]]], p: Sequence[Any]
) -> list[Any]:
    """Return the numbers of the kernels with symbols for the parameters.

    Args:
        numbers: numbers for zero parameters.
        slopes: see `Parameters.slopes`.
        p: symbols of the parameters.

    Returns:
        Numbers, some of them expressions.
    """
    result: list[Any] = list(numbers)
    for index, terms in slopes.items():
        for number, factor in terms:
            result[index] = result[index] + (p[number] if factor == 1.0 else factor * p[number])
    return result
