"""Files of motion capture (.c3d), read by ezc3d as OpenSim reads them: markers, and the forces of the force plates.

Everything is in the axes of the file, which often are not those of a model, whose y axis points
upwards.
"""

from __future__ import annotations

import io
import json
import os
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from osimlite.base.files import read_file
from osimlite.base.require import SAFE_PATH
from osimlite.errors import DocumentError, MissingDependency
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.multibody.spatial import Array

if TYPE_CHECKING:
    import subprocess

ENDING = ".c3d"

MIN_CPU_SECONDS = 2
"""Processor time for a small file and for loading numpy; large files get more by their size."""

BYTES_PER_SECOND = 2_000_000
"""Smallest accepted rate of reading a file per second; a sound file is read about 50 times faster."""

ELAPSED_TIME_FACTOR = 30
"""Factor from the limit of processor time to the limit of elapsed time."""

PROGRAM = "import sys; sys.path[:0] = sys.argv[3:]; from osimlite.io.tables.c3d_process import run_process; run_process()"


def read_c3d_markers(path: str | Path) -> tuple[tuple[str, ...], Array, Array]:
    """Read the markers of a .c3d file.

    Returns:
        Names (m,), times (t,) in s, and positions (t, m, 3) in m, NaN where a marker was not seen.

    Raises:
        MissingFileError: the file does not exist.
        DocumentError: the file is not a .c3d file.
        MissingDependency: ezc3d is not installed.
    """
    arrays = _run_reader(path, "markers")
    return tuple(arrays["names"].tolist()), arrays["times"], arrays["positions"]


def read_c3d_forces(path: str | Path) -> StoTable:
    """Read the forces of the force plates over time, with the labels of OpenSim's reader.

    Columns of the first plate are ``f1_x``, ``f1_y``, ``f1_z`` for the force (N), ``p1_x`` ... for
    the centre of the plate (m), and ``m1_x`` ... for the moment about it (N·m).

    Returns:
        Table with the times of the frames (s) and the columns of all plates.

    Raises:
        MissingFileError: the file does not exist.
        DocumentError: the file is not a .c3d file, or has no force plates.
        MissingDependency: ezc3d is not installed.
    """
    arrays = _run_reader(path, "forces")
    if not len(arrays["names"]):
        raise DocumentError("the file has no force plates", file=str(path))
    return StoTable(
        "forces", arrays["times"], tuple(arrays["names"].tolist()), arrays["rows"], file=str(path)
    )


def _run_reader(path: str | Path, content_type: str) -> dict[str, Array]:
    """Run the reader in a separate process.

    Damaged files make ezc3d 1.6 write outside its memory (the process ends by SIGSEGV) or loop
    forever. In a separate process nothing else is lost, and the time is limited.

    Args:
        path: path of the .c3d file.
        content_type: ``markers`` or ``forces``.

    Returns:
        Arrays by name, as `read_markers` or `read_forces` of `c3d_process` returns them.

    Raises:
        MissingFileError: the file does not exist.
        MissingDependency: ezc3d is not installed.
        DocumentError: the reader rejects the file, crashes, does not finish, or cannot be started.
    """
    size = len(read_file(path))
    # An entry None in sys.modules blocks the import, as a missing package does.
    if sys.modules.get("ezc3d", ...) is None or find_spec("ezc3d") is None:
        raise MissingDependency(
            "a .c3d file is read by ezc3d, which is not installed; run: pip install ezc3d, or pip install "
            "'osimlite[c3d]'",
            file=str(path),
        )
    seconds = MIN_CPU_SECONDS + size // BYTES_PER_SECOND
    # Imported here because most commands never read such a file.
    import subprocess

    # The package is found also if it is not installed but on the path.
    package = str(Path(__file__).parents[3])
    command = [
        sys.executable,
        # -P: nothing is imported from the current folder.
        "-P",
        "-c",
        PROGRAM,
        content_type,
        os.path.abspath(path),
        str(seconds),
        package,
    ]
    try:
        process = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=ELAPSED_TIME_FACTOR * seconds,
            check=False,
            cwd=Path(__file__).parent,
            # One thread of OpenBLAS: its threads count as memory in the limit.
            env={**os.environ, SAFE_PATH: "1", "OPENBLAS_NUM_THREADS": "1"},
        )
    except subprocess.TimeoutExpired:
        raise DocumentError(
            "the file cannot be read: the reader does not finish", file=str(path)
        ) from None
    except OSError as error:
        raise DocumentError(
            f"no process can be started that reads it: {error}", file=str(path)
        ) from None
    if process.returncode != 0:
        raise DocumentError(f"the file cannot be read: {_find_reason(process)}", file=str(path))
    # No pickles: the output of a crashed process may be anything.
    with np.load(io.BytesIO(process.stdout), allow_pickle=False) as arrays:
        return dict(arrays)


def _find_reason(process: subprocess.CompletedProcess[bytes]) -> str:
    """Return the reason why the process failed, from its output and exit code."""
    try:
        return str(json.loads(process.stdout)["error"])
    except (ValueError, KeyError, TypeError):
        return "it is damaged, so that reading it ends in a crash or takes too long"
