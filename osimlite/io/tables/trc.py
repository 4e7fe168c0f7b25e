"""Marker files (.trc), as motion capture programs and OpenSim's tools exchange them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from osimlite.base.files import open_atomically
from osimlite.io.tables.headers import MARKER_KEYS
from osimlite.io.tables.storage import number_text


def write_trc(
    path: str | Path,
    times: Sequence[float],
    markers: Sequence[str],
    rows: Iterable[Sequence[float]],
    *,
    units: str = "m",
) -> None:
    """Write marker positions to a file, whole or not at all; the rows are taken one by one.

    A position that is not a number is left empty: the marker was not seen.

    Args:
        path: of the file.
        times: n moments, s.
        markers: their m names.
        rows: 3 m numbers each, X, Y and Z of one marker after the other.
        units: of the positions.

    Raises:
        OsimliteError: the file cannot be written.
    """
    with open_atomically(path) as stream:
        for line in _lines(Path(path).name, times, markers, rows, units):
            stream.write(f"{line}\n".encode())


def _lines(
    name: str,
    times: Sequence[float],
    markers: Sequence[str],
    rows: Iterable[Sequence[float]],
    units: str,
) -> Iterator[str]:
    count = len(times)
    span = times[-1] - times[0] if count > 1 else 0.0
    rate = number_text((count - 1) / span) if span > 0.0 else "1"
    values = (rate, rate, count, len(markers), units, rate, 1, count)
    yield f"PathFileType\t4\t(X/Y/Z)\t{name}"
    yield "\t".join(MARKER_KEYS)
    yield "\t".join(map(str, values))
    yield "Frame#\tTime\t" + "".join(f"{marker}\t\t\t" for marker in markers)
    yield "\t\t" + "".join(
        f"{axis}{number + 1}\t" for number in range(len(markers)) for axis in "XYZ"
    )
    yield ""
    for frame, (time, row) in enumerate(zip(times, rows, strict=True), start=1):
        words = ("" if number != number else number_text(number) for number in row)
        yield "\t".join((str(frame), number_text(time), *words, ""))
