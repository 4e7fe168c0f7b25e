"""The process that reads a .c3d file: what it finds goes to its standard output as arrays of numpy."""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from osimlite.io.tables.headers import METRES_PER_UNIT
from osimlite.mechanics.multibody.spatial import Array

MOMENTS = {"nm": 1.0, "n.m": 1.0, "nmm": 0.001, "n.mm": 0.001}
"""Units of moments in N·m."""

MAX_BYTES = 4_000_000_000
"""Memory of the process; a file of the largest size that is read takes about a third of it."""


def run_process() -> None:
    """Read the file that the command names, and write its markers or forces to standard output.

    Of a file that cannot be read the reason is written as JSON, and the exit code is 1.

    Raises:
        SystemExit: the file cannot be read; with exit code 1.
    """  # noqa: DOC501 - the error is caught here
    content_type, path, seconds = sys.argv[1:4]
    _limit_resources(int(seconds))
    try:
        arrays = READERS[content_type](path)
        if not all(np.isfinite(arrays["times"])):
            raise ValueError("its frames have no times")
        buffer = io.BytesIO()
        np.savez(buffer, allow_pickle=False, **arrays)
    # ezc3d raises whatever its standard library does, and a damaged header leads to any key or
    # index.
    except Exception as error:
        sys.stdout.buffer.write(json.dumps({"error": describe_failure(error)}).encode())
        raise SystemExit(1) from None
    sys.stdout.buffer.write(buffer.getvalue())


def describe_failure(error: Exception) -> str:
    """Return the reason why a file cannot be read, without words of Python and of ezc3d's programmers."""
    if isinstance(error, MemoryError):
        return "reading it takes too much memory; it may be damaged"
    # C++ adds this to the reason of every error of a stream.
    reason = str(error).removesuffix(": iostream error")
    if not isinstance(error, OSError | RuntimeError | ValueError) or not reason:
        return "it is damaged: a part that its header or its parameters describe is missing"
    if "ignoreBadFormatting" in reason:
        return "it is damaged: its sections are not where the standard puts them"
    return reason


def read_markers(path: str) -> dict[str, Array]:
    """Read the markers of a .c3d file.

    Returns:
        "names" (m,), "times" (t,) in s and "positions" (t, m, 3) in m, NaN where a marker was not
        seen.

    Raises:
        ValueError: the file has fewer labels than markers.
    """
    result = import_module("ezc3d").c3d(path)
    points = result["parameters"]["POINT"]
    # Millimetres are what most systems write.
    unit = METRES_PER_UNIT.get(points["UNITS"]["value"][0].strip().lower(), 0.001)
    # More than 255 labels continue in LABELS2 and so on.
    names = [
        name for key, entry in points.items() if key.startswith("LABELS") for name in entry["value"]
    ]
    # ezc3d has (coordinate, marker, frame).
    positions = np.moveaxis(result["data"]["points"][:3], (2, 1, 0), (0, 1, 2))
    times = (
        _compute_start(result)
        + np.arange(len(positions)) / result["header"]["points"]["frame_rate"]
    )
    names = names[: positions.shape[1]]
    if len(names) != positions.shape[1]:
        raise ValueError(f"it names {len(names)} of {positions.shape[1]} markers")
    return {"names": np.array(names, dtype=np.str_), "times": times, "positions": unit * positions}


def read_forces(path: str) -> dict[str, Array]:
    """Read the forces of the force plates.

    Returns:
        "names" of the columns (k,), "times" (t,) in s and "rows" (t, k) in N, m and N·m; without plates
        all are empty.
    """
    result = import_module("ezc3d").c3d(path, extract_forceplat_data=True)
    columns, rows = list[str](), list[Array]()
    for number, plate in enumerate(result["data"]["platform"], start=1):
        # Positions and moments may have units of their own.
        length = METRES_PER_UNIT.get(plate["unit_position"].strip().lower(), 0.001)
        # Forces act at the middle of the plate; the moment is about it, as OpenSim reads it.
        middle = np.repeat(
            length * plate["corners"].mean(axis=1)[:, None], plate["force"].shape[1], axis=1
        )
        moment = MOMENTS.get(plate["unit_moment"].strip().lower(), 0.001) * plate["moment"]
        for letter, values in (("f", plate["force"]), ("p", middle), ("m", moment)):
            columns += [f"{letter}{number}_{axis}" for axis in "xyz"]
            rows += list(values)
    if not rows:
        return {
            "names": np.array([], dtype=np.str_),
            "times": np.zeros(0),
            "rows": np.zeros((0, 0)),
        }
    times = (
        _compute_start(result) + np.arange(len(rows[0])) / result["header"]["analogs"]["frame_rate"]
    )
    return {
        "names": np.array(columns, dtype=np.str_),
        "times": times,
        "rows": np.stack(rows, axis=1),
    }


READERS: dict[str, Callable[[str], dict[str, Array]]] = {
    "markers": read_markers,
    "forces": read_forces,
}


def _compute_start(result: Any) -> float:
    """Return the time of the first frame, s."""
    points = result["header"]["points"]
    return float(points["first_frame"] / points["frame_rate"])


def _limit_resources(seconds: int) -> None:
    """Let the system end this process when it takes too much time or memory; Windows cannot."""
    try:
        import resource
    except ImportError:
        return
    for kind, limit in (
        (resource.RLIMIT_CPU, seconds),
        (resource.RLIMIT_AS, MAX_BYTES),
        (resource.RLIMIT_CORE, 0),
    ):
        _, hard = resource.getrlimit(kind)
        # The limit cannot be raised beyond what the system has set.
        soft_limit = limit if hard == resource.RLIM_INFINITY else min(limit, hard)
        resource.setrlimit(kind, (soft_limit, hard))
