"""Measured orientations of sensors: from tables of quaternions, and from arrays."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.records import dataclass, replace
from osimlite.errors import DocumentError, SettingError
from osimlite.fitting.recorded import Recording
from osimlite.io.tables.storage import read_sto
from osimlite.io.tables.table_stream import TableStream
from osimlite.mechanics.multibody.spatial import Array, rotation_about_space, rotation_of

KIND = "Quaternion"
"""What a table of orientations holds."""
SAME_TIME = 1e-14
"""What times may be off that are taken for the same, as OpenSim has it (s)."""


@dataclass(frozen=True, eq=False)
class OrientationData(Recording):
    """Rotation matrices of k sensors in ground at t times (t, k, 3, 3); NaN where one was not measured."""

    noun, shape = "sensor", (3, 3)

    @classmethod
    def of(cls, source: Orientations, times: ArrayLike | None = None) -> OrientationData:
        """Orientations from a file, or from arrays by the names of the sensors.

        Args: source: a .sto file of quaternions; or by name quaternions (t, 4), scalar first, or
            rotation matrices (t, 3, 3), which turn what is given along the axes of a sensor into
            ground; or what is these already. times: of the frames of arrays, s; by default 0, 1, 2
            ...

        Raises:
            MissingFileError: there is no such file.
            DocumentError: it is damaged, or it holds no quaternions.
            SettingError: the arrays do not fit together.
        """
        if isinstance(source, OrientationData):
            return source
        if isinstance(source, str | Path):
            return read_orientations(source)
        return cls.of_arrays(
            {name: rotations(value, f"sensor '{name}'") for name, value in source.items()}, times
        )

    def between(self, first: float, last: float) -> OrientationData:
        """The frames from a time up to another, these included.

        Raises:
            SettingError: no frame lies between.
        """
        inside = np.flatnonzero(
            (self.times >= first - SAME_TIME) & (self.times <= last + SAME_TIME)
        )
        if not len(inside):
            raise self.none_between(first, last)
        return self.rows(int(inside[0]), int(inside[-1]) + 1)

    def turned(self, angles: ArrayLike) -> OrientationData:
        """The same in a ground whose axes are turned by angles (3,) about X, Y and Z of space (rad)."""
        return replace(self, values=rotation_about_space(angles) @ self.values)


def rotations(values: ArrayLike, what: str) -> Array:
    """Rotation matrices (..., 3, 3) of quaternions (..., 4), or of what is rotation matrices.

    Raises:
        SettingError: it is neither.
    """
    given = np.asarray(values, dtype=float)
    if given.ndim >= 1 and given.shape[-1] == 4:
        return rotation_of(given)
    if given.ndim < 2 or given.shape[-2:] != (3, 3):
        raise SettingError(
            f"orientations are quaternions of 4 numbers or matrices of 3 × 3; {what} has an array of "
            f"{' × '.join(map(str, given.shape)) or 'one number'}"
        )
    return given


def holds_orientations(path: str | Path) -> bool:
    """Whether a file is a table of quaternions; errors as those of :class:`TableStream`."""
    if Path(path).suffix.lower() != ".sto":
        return False
    with TableStream(path) as stream:
        return stream.kind == KIND


def read_orientations(path: str | Path) -> OrientationData:
    """The orientations of a .sto file; a quaternion of zeros, or with NaN, is a sensor that was not heard.

    Raises:
        MissingFileError: there is no such file.
        DocumentError: it is damaged, or it holds no quaternions.
    """
    table = read_sto(path)
    if table.kind != KIND:
        raise DocumentError(
            f"the table holds {table.kind}, not quaternions; its header must say DataType={KIND}",
            file=str(path),
        )
    names = tuple(label.removesuffix("_1") for label in table.columns[::4])
    return OrientationData(
        names, table.times, rotation_of(table.rows.reshape(-1, len(names), 4)), str(path)
    )


Orientations = OrientationData | str | Path | Mapping[str, ArrayLike]
"""Orientations in any form."""
