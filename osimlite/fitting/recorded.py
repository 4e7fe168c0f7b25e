"""What was recorded of a subject: numbers of some things, which have names, at the times of some frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.records import dataclass
from osimlite.base.text import join_words, suggest_name
from osimlite.errors import DocumentError, OsimliteError, SettingError
from osimlite.mechanics.multibody.spatial import Array


@dataclass(frozen=True, eq=False)
class Recording:
    """Numbers of m things at t times."""

    names: tuple[str, ...]  # of the things (m,)
    times: Array  # (t,), s
    values: Array  # of each time and thing (t, m, ...); NaN where it was not seen
    file: str | None = None  # where they were read from
    noun: ClassVar[str]  # what the things are
    shape: ClassVar[tuple[int, ...]]  # of the numbers of one thing

    def __post_init__(self) -> None:
        twice = sorted({name for name in self.names if self.names.count(name) > 1})
        if twice:
            raise DocumentError(
                f"two {self.noun}s are called {join_words(twice)}; rename one of each",
                file=self.file,
            )
        if len(self.times) == 0:
            raise DocumentError(f"there are {self.noun}s but no frames", file=self.file)
        if self.values.shape != (len(self.times), len(self.names), *self.shape):
            raise SettingError(
                f"the values of {len(self.names)} {self.noun}s at {len(self.times)} times are an array of that many "
                f"times, {self.noun}s and {' × '.join(map(str, self.shape))} numbers; got "
                f"{' × '.join(map(str, self.values.shape))}"
            )
        steps = np.diff(self.times)
        if not (steps > 0.0).all() or not np.isfinite(self.times).all():
            frame = int(np.argmin(steps > 0.0)) + 2 if len(steps) else 1
            raise DocumentError(
                f"the times of the frames must increase, and frame {frame} does not come after the one before it",
                file=self.file,
            )

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, ArrayLike], times: ArrayLike | None) -> Self:
        """What arrays (t, ...) hold by name, or single values; by default the times are 0, 1, 2 ...

        Raises:
            SettingError: the arrays do not fit together.
        """
        if not isinstance(arrays, Mapping):
            raise SettingError(
                f"{cls.noun}s are a file, or arrays by their names, not a {type(arrays).__name__}"
            )
        values = [np.asarray(value, dtype=float) for value in arrays.values()]
        values = [value[None] if value.ndim == len(cls.shape) else value for value in values]
        counts = {value.shape for value in values}
        if len(counts) != 1 or next(iter(counts))[1:] != cls.shape:
            raise SettingError(
                f"every {cls.noun} has {' × '.join(map(str, cls.shape))} numbers for each frame, as many as all others"
            )
        (count, *_), *_ = counts
        moments = (
            np.arange(count, dtype=float)
            if times is None
            else np.asarray(times, dtype=float).reshape(-1)
        )
        return cls(tuple(arrays), moments, np.stack(values, axis=1))

    @classmethod
    def nothing(cls, times: Array) -> Self:
        """Of nothing, at some times (t,), s."""
        return cls((), times, np.empty((len(times), 0, *cls.shape)))

    def rows(self, start: int, end: int) -> Self:
        """The frames from one number to before another."""
        return type(self)(self.names, self.times[start:end], self.values[start:end], self.file)

    def none_between(self, first: float, last: float) -> SettingError:
        """The error where no frame lies between two times."""
        where = f" of '{self.file}'" if self.file else ""
        return SettingError(
            f"no frame{where} lies between {first:g} and {last:g} s; the data are from {self.times[0]:g} to "
            f"{self.times[-1]:g} s"
        )

    def only(self, names: Sequence[str]) -> Array:
        """The values (t, k, ...) of some.

        Raises:
            SettingError: there is no such name.
        """
        places = {name: index for index, name in enumerate(self.names)}
        for name in names:
            if name not in places:
                raise SettingError(
                    f"there is no {self.noun} '{name}' in {self.source}{suggest_name(name, self.names)}"
                )
        return self.values[:, [places[name] for name in names]]

    def shared(self, model: Sequence[str], chosen: Mapping[str, float] | None = None) -> list[str]:
        """Names that a model has too, in the order of the data.

        Args:
            model: names in the model.
            chosen: only of these, if given.

        Raises:
            OsimliteError: there are none.
        """
        names = [
            name for name in self.names if name in model and (chosen is None or name in chosen)
        ]
        if not names:
            raise OsimliteError(
                f"no {self.noun} of {self.source} ({join_words([*self.names])}) is one of the model "
                f"({join_words([*model]) or 'none'}); give what it is in the model the name that it has in the data"
            )
        return names

    @property
    def source(self) -> str:
        """Where the values come from, in words."""
        return f"'{self.file}'" if self.file else "the data"
