"""Numbers of a model that stay symbols: how the numbers that the kernels work on follow from them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from osimlite.base.text import suggest_name
from osimlite.errors import OsimliteError, SettingError, UnsupportedError
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.simulation.properties import Setter, places, spellings

LINEARITY_TOLERANCE = 1e-11
"""What the numbers of a model may be off from a straight line, over the largest part of them."""
TRIAL_FACTORS = 1.125, 1.375
"""What the values are multiplied by to find the lines and to test them."""
TRIAL_SHIFTS = 0.125, -0.0625
"""What values of zero are changed by instead."""


class Parameters:
    """Numbers of a model by their paths, and the numbers of the kernels as linear functions of them.

    Most parameters are handed on as they are: masses, stiffnesses, strengths, places. What becomes
    of each is found by changing it, and tested with all of them changed at once; another way in
    which numbers depend on one is refused.

    Args:
        model: of which they are numbers; a copy that may be changed.
        names: paths, as of sweeps; one may stand for several numbers that are the same.
        numbers_of: what makes the numbers (k,) of the kernels, of the model as it is then.

    Attributes: names: as given. values: of the parameters in the model (p,), in the units of the
        file. base: the numbers (k,) of the kernels where the parameters are zero. slopes: by place
        in these numbers, for each parameter that it depends on, its number and its factor.

    Raises:
        SettingError: there is no such number, or several that differ.
        UnsupportedError: the numbers of the kernels depend on a parameter in another way.
    """

    def __init__(
        self, model: Model, names: Sequence[str], numbers_of: Callable[[Model], Array]
    ) -> None:
        self.names = tuple(names)
        self._setters = [_find_setters(model, name) for name in names]
        given = [
            _read_value(name, setters) for name, setters in zip(names, self._setters, strict=True)
        ]
        self.values = np.array(given)
        base = numbers_of(model)
        self.slopes: dict[int, list[tuple[int, float]]] = {}

        def numbers_at(values: Array, what: str) -> Array:
            self._set_values(values)
            try:
                result = numbers_of(model)
            except OsimliteError as error:
                raise UnsupportedError(f"{what} cannot be a parameter: {error}") from error
            finally:
                self._set_values(self.values)
            if len(result) != len(base):
                raise UnsupportedError(
                    f"{what} cannot be a parameter: more of the model depends on it than numbers"
                )
            return result

        columns = np.zeros((len(base), len(given)))
        for k, name in enumerate(names):
            one, two = (self._change_values(number, [k]) for number in range(2))
            columns[:, k] = _subtract_base(numbers_at(one, f"'{name}'"), base) / (one[k] - given[k])
            _check_linear(
                numbers_at(two, f"'{name}'"),
                base,
                columns[:, [k]],
                (two - self.values)[[k]],
                f"'{name}'",
            )
        if len(given) > 1:
            every = (
                " and ".join(f"'{name}'" for name in names)
                if len(names) < 4
                else "these parameters"
            )
            for number in range(2):
                values = self._change_values(number, range(len(given)))
                what = f"{every} together"
                _check_linear(numbers_at(values, what), base, columns, values - self.values, what)
        self.base = base - columns @ self.values if len(given) else base
        for place, number in zip(*np.nonzero(columns), strict=True):
            self.slopes.setdefault(int(place), []).append(
                (int(number), float(columns[place, number]))
            )

    def _change_values(self, number: int, which: Sequence[int] | range) -> Array:
        values = self.values.copy()
        for k in which:
            # Not all by the same factor, which quotients would not notice.
            values[k] = (
                values[k] * (TRIAL_FACTORS[number] + k / 64.0)
                if values[k]
                else TRIAL_SHIFTS[number] * (1.0 + k / 8.0)
            )
        return values

    def _set_values(self, values: Array) -> None:
        for setters, value in zip(self._setters, values.tolist(), strict=True):
            for setter in setters:
                setter.put(value)


def read_parameter(model: Model, name: str) -> float:
    """The value that a parameter has in a model; errors as those of `Parameters`."""
    return _read_value(name, _find_setters(model, name))


def _find_setters(model: Model, name: str) -> list[Setter]:
    setters = [place.setter(model) for place in places(model, name)]
    if not setters:
        raise SettingError(
            f"the model has no number '{name}'{suggest_name(name, spellings(model))}"
        )
    return setters


def _read_value(name: str, setters: Sequence[Setter]) -> float:
    values = {setter.get() for setter in setters}
    if len(values) > 1:
        raise SettingError(f"'{name}' stands for numbers that differ; name them one by one")
    return values.pop()


def _subtract_base(found: Array, base: Array) -> Array:
    """How much numbers have changed; one without end has not."""
    same = found == base
    return np.where(same, 0.0, found - np.where(same, 0.0, base))


def _check_linear(found: Array, base: Array, columns: Array, change: Array, what: str) -> None:
    """Refuse what does not lie on the lines."""
    parts = columns * change
    size = np.abs(base) + np.abs(parts).sum(axis=1)
    if not np.all(
        np.abs(_subtract_base(found, base) - parts.sum(axis=1)) <= LINEARITY_TOLERANCE * size
    ):
        raise UnsupportedError(
            f"{what} cannot stay a symbol: what the equations are given is no linear function of it; "
            "change it in the model and make the functions anew"
        )


def insert_parameters(
    numbers: Sequence[float], slopes: Mapping[int, Sequence[tuple[int, float]]], p: Sequence[Any]
) -> list[Any]:
    """The numbers of the kernels with symbols in them."""
    result: list[Any] = list(numbers)
    for place, parts in slopes.items():
        for number, factor in parts:
            result[place] = result[place] + (p[number] if factor == 1.0 else factor * p[number])
    return result
