"""Measurements of named markers or sensors over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.records import dataclass
from osimlite.base.text import format_time_span, join_words, suggest_name
from osimlite.errors import DocumentError, OsimliteError, SettingError
from osimlite.io.tables.storage import expect_increasing_times
from osimlite.mechanics.multibody.spatial import Array


@dataclass(frozen=True, eq=False)
class Measurements:
    """Measurements of m markers or sensors at t times."""

    names: tuple[str, ...]  # names of the markers or sensors (m,)
    times: Array  # times (t,), s
    values: Array  # values (t, m, ...); NaN where one was not seen
    file: str | None = None  # file of the measurements
    noun: ClassVar[str]  # noun for messages
    shape: ClassVar[tuple[int, ...]]  # shape of one value

    def __post_init__(self) -> None:
        repeated = sorted({name for name in self.names if self.names.count(name) > 1})
        if repeated:
            raise DocumentError(
                f"two {self.noun}s have the name {join_words(repeated)}; rename one of each",
                file=self.file,
            )
        if len(self.times) == 0:
            raise DocumentError(f"the data have {self.noun}s but no frames", file=self.file)
        if self.values.shape != (len(self.times), len(self.names), *self.shape):
            raise SettingError(
                f"expected an array of shape "
                f"{' × '.join(map(str, (len(self.times), len(self.names), *self.shape)))} "
                f"(times × {self.noun}s × numbers of each); got "
                f"{' × '.join(map(str, self.values.shape))}"
            )
        expect_increasing_times(self.times, self.file)

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, ArrayLike], times: ArrayLike | None) -> Self:
        """Return measurements from arrays (t, ...), or single values, by name.

        Args:
            arrays: arrays by the names of the markers or sensors.
            times: times (t,), s; by default 0, 1, 2 ...

        Raises:
            SettingError: the arrays do not fit together.
        """
        if not isinstance(arrays, Mapping):
            raise SettingError(
                f"expected a file or a mapping of names to arrays for {cls.noun}s, found a "
                f"{type(arrays).__name__}"
            )
        values = [np.asarray(value, dtype=float) for value in arrays.values()]
        # A single value counts as one frame.
        values = [value[None] if value.ndim == len(cls.shape) else value for value in values]
        counts = {value.shape for value in values}
        if len(counts) != 1 or next(iter(counts))[1:] != cls.shape:
            raise SettingError(
                f"expected {' × '.join(map(str, cls.shape))} numbers per frame for every {cls.noun}, "
                "and the same number of frames for all"
            )
        (count, *_), *_ = counts
        moments = (
            np.arange(count, dtype=float)
            if times is None
            else np.asarray(times, dtype=float).reshape(-1)
        )
        return cls(tuple(arrays), moments, np.stack(values, axis=1))

    @classmethod
    def create_empty(cls, times: Array) -> Self:
        """Return measurements of nothing at some times (t,), s."""
        return cls((), times, np.empty((len(times), 0, *cls.shape)))

    def slice_frames(self, start: int, end: int) -> Self:
        """Return the frames from one number up to, but not including, another."""
        return type(self)(self.names, self.times[start:end], self.values[start:end], self.file)

    def create_range_error(self, start: float, end: float) -> SettingError:
        """Return the error for a range of times without frames."""
        file_note = f" of '{self.file}'" if self.file else ""
        return SettingError(
            f"no frame{file_note} lies {format_time_span(start, end)}; the data are from "
            f"{self.times[0]:g} to {self.times[-1]:g} s"
        )

    def select_values(self, names: Sequence[str]) -> Array:
        """Return the values (t, k, ...) of k markers or sensors.

        Args:
            names: names of k markers or sensors.

        Raises:
            SettingError: a name is unknown.
        """
        indices = {name: index for index, name in enumerate(self.names)}
        for name in names:
            if name not in indices:
                raise SettingError(
                    f"unknown {self.noun} '{name}' in {self.source}{suggest_name(name, self.names)}"
                )
        return self.values[:, [indices[name] for name in names]]

    def find_shared_names(
        self, model: Sequence[str], selected: Mapping[str, float] | None = None
    ) -> list[str]:
        """Return the names that a model has as well, in the order of the data.

        Args:
            model: names in the model.
            selected: names to which the result is restricted; None for no restriction.

        Raises:
            OsimliteError: the data and the model share no name.
        """
        # The data determine the order, as the positions of a frame are in it.
        names = [
            name for name in self.names if name in model and (selected is None or name in selected)
        ]
        if not names:
            raise OsimliteError(
                f"no {self.noun} of {self.source} ({join_words([*self.names])}) is one of the "
                "model "
                f"({join_words([*model]) or 'none'}); use the same names in the model and in the "
                "data"
            )
        return names

    @property
    def source(self) -> str:
        """Origin of the values, in words."""
        return f"'{self.file}'" if self.file else "the data"
