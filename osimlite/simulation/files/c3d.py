"""Files of motion capture (.c3d), read by ezc3d as OpenSim reads them: markers, and the forces of the force plates.

Everything is in the axes of the file, which often are not those of a model, whose y axis points upwards.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.errors import DocumentError, MissingDependency
from osimlite.files import read_file
from osimlite.multibody.spatial import Array
from osimlite.simulation.files.storage import StoTable
from osimlite.tables import METRES

ENDING = ".c3d"
MOMENTS = {"nm": 1.0, "n.m": 1.0, "nmm": 0.001, "n.mm": 0.001}
"""Units of moments in N·m."""


def read_c3d_markers(path: str | Path) -> tuple[tuple[str, ...], Array, Array]:
    """Names of the markers (m,), times (t,), s, and places (t, m, 3), m; NaN where a marker was not seen.

    Raises:
        MissingFileError: there is no such file.
        DocumentError: it is no .c3d file.
        MissingDependency: ezc3d is not installed.
    """
    result = _opened(path)
    points = result["parameters"]["POINT"]
    unit = METRES.get(points["UNITS"]["value"][0].strip().lower(), 0.001)
    names = tuple(name for key, more in points.items() if key.startswith("LABELS") for name in more["value"])
    positions = np.moveaxis(result["data"]["points"][:3], (2, 1, 0), (0, 1, 2))
    times = _start(result) + np.arange(len(positions)) / result["header"]["points"]["frame_rate"]
    return names[: positions.shape[1]], times, unit * positions


def read_c3d_forces(path: str | Path) -> StoTable:
    """The forces of the plates over time, as OpenSim's reader names them.

    Of the first plate ``f1_x``, ``f1_y``, ``f1_z`` is the force (N), ``p1_x`` ... the middle of the plate (m), and
    ``m1_x`` ... the moment about it (N·m).

    Raises:
        MissingFileError: there is no such file.
        DocumentError: it is no .c3d file, or it has no force plates.
        MissingDependency: ezc3d is not installed.
    """
    result = _opened(path, extract_forceplat_data=True)
    plates = result["data"]["platform"]
    if not plates:
        raise DocumentError("the file has no force plates", file=str(path))
    columns, rows = list[str](), list[Array]()
    for number, plate in enumerate(plates, start=1):
        length = METRES.get(plate["unit_position"].strip().lower(), 0.001)
        middle = np.repeat(length * plate["corners"].mean(axis=1)[:, None], plate["force"].shape[1], axis=1)
        moment = MOMENTS.get(plate["unit_moment"].strip().lower(), 0.001) * plate["moment"]
        for letter, values in (("f", plate["force"]), ("p", middle), ("m", moment)):
            columns += [f"{letter}{number}_{axis}" for axis in "xyz"]
            rows += list(values)
    times = _start(result) + np.arange(len(rows[0])) / result["header"]["analogs"]["frame_rate"]
    return StoTable("forces", times, tuple(columns), np.stack(rows, axis=1), file=str(path))


def _opened(path: str | Path, **options: bool) -> Any:
    read_file(path)
    try:
        return import_module("ezc3d").c3d(str(path), **options)
    except ImportError:
        raise MissingDependency(
            "a .c3d file is read by ezc3d, which is not installed; run: pip install ezc3d, or pip install "
            "'osimlite[c3d]'",
            file=str(path),
        ) from None
    except (OSError, RuntimeError, ValueError) as error:
        raise DocumentError(f"the file cannot be read: {error}", file=str(path)) from None


def _start(found: Any) -> float:
    """The time of the first frame, s."""
    points = found["header"]["points"]
    return float(points["first_frame"] / points["frame_rate"])
