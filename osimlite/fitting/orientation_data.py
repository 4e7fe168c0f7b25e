"""Measured orientations of sensors, from tables of quaternions and from arrays."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.records import dataclass, replace
from osimlite.errors import DocumentError, SettingError
from osimlite.fitting.measurements import Measurements
from osimlite.io.tables.storage import read_sto
from osimlite.io.tables.table_stream import TableStream
from osimlite.mechanics.multibody.spatial import Array, rotation_about_space, rotation_of

QUATERNION = "Quaternion"
"""Type of the values in a table of orientations."""
TIME_TOLERANCE_S = 1e-14
"""Largest difference of times that count as equal in OpenSim, s."""


@dataclass(frozen=True, eq=False)
class OrientationData(Measurements):
    """Rotation matrices of k sensors in ground (t, k, 3, 3); NaN where one was not measured."""

    noun = "sensor"
    shape = (3, 3)

    @classmethod
    def from_source(
        cls, source: OrientationSource, times: ArrayLike | None = None
    ) -> OrientationData:
        """Return orientations from a file, or from arrays by the names of the sensors.

        Args:
            source: a .sto file of quaternions; OrientationData; or arrays by name: quaternions
                (t, 4), scalar first, or rotation matrices (t, 3, 3) from a sensor to ground.
            times: times of the frames of arrays, s; by default 0, 1, 2 ...

        Raises:
            MissingFileError: the file does not exist.
            DocumentError: the file is damaged, or has no quaternions.
            SettingError: the arrays do not fit together.
        """
        if isinstance(source, OrientationData):
            return source
        if isinstance(source, str | Path):
            return read_orientations(source)
        return cls.from_arrays(
            {name: to_rotations(value, f"sensor '{name}'") for name, value in source.items()}, times
        )

    def select_times(self, start_time: float, end_time: float) -> OrientationData:
        """Return the frames between two times, both included.

        Args:
            start_time: first time, s.
            end_time: last time, s.

        Raises:
            SettingError: there is no frame between these times.
        """
        # Unlike markers, orientations are not taken from the nearest frames outside the range.
        frames_in_range = np.flatnonzero(
            (self.times >= start_time - TIME_TOLERANCE_S)
            & (self.times <= end_time + TIME_TOLERANCE_S)
        )
        if not len(frames_in_range):
            raise self.create_range_error(start_time, end_time)
        return self.slice_frames(int(frames_in_range[0]), int(frames_in_range[-1]) + 1)

    def rotate_ground(self, angles: ArrayLike) -> OrientationData:
        """Return the orientations in a rotated ground.

        Args:
            angles: rotation of the ground about X, Y and Z of space (3,), rad.
        """
        return replace(self, values=rotation_about_space(angles) @ self.values)


def to_rotations(values: ArrayLike, owner: str) -> Array:
    """Return rotation matrices (..., 3, 3) from quaternions (..., 4) or from rotation matrices.

    Args:
        values: quaternions, scalar first, or rotation matrices.
        owner: description of the sensor or table, for the message.

    Raises:
        SettingError: the array has neither shape.
    """
    array = np.asarray(values, dtype=float)
    if array.ndim >= 1 and array.shape[-1] == 4:
        return rotation_of(array)
    if array.ndim < 2 or array.shape[-2:] != (3, 3):
        raise SettingError(
            f"expected quaternions of 4 numbers or matrices of 3 × 3 for orientations; {owner} has "
            "an array of "
            f"{' × '.join(map(str, array.shape)) or 'one number'}"
        )
    return array


def holds_orientations(path: str | Path) -> bool:
    """Return whether a file is a table of quaternions.

    Raises:
        OsimliteError: the file cannot be read, see :class:`TableStream`.
    """
    if Path(path).suffix.lower() != ".sto":
        return False
    with TableStream(path) as stream:
        return stream.kind == QUATERNION


def read_orientations(path: str | Path) -> OrientationData:
    """Return the orientations in a .sto file of quaternions.

    A quaternion of zeros, or with NaN, is a sensor that was not measured.

    Raises:
        MissingFileError: the file does not exist.
        DocumentError: the file is damaged, or has no quaternions.
    """
    table = read_sto(path)
    if table.kind != QUATERNION:
        raise DocumentError(
            f"the table holds {table.kind}, not quaternions; its header must have "
            f"DataType={QUATERNION}",
            file=str(path),
        )
    # The reader of tables splits a quaternion into four columns, with the suffixes _1 to _4.
    names = tuple(label.removesuffix("_1") for label in table.columns[::4])
    return OrientationData(
        names, table.times, rotation_of(table.rows.reshape(-1, len(names), 4)), str(path)
    )


OrientationSource = OrientationData | str | Path | Mapping[str, ArrayLike]
"""Sources of orientations: data, a file, or arrays by name."""
