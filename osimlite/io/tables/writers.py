"""Writers of marker files (.trc) and of documents of ControlSets."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from osimlite.base.files import open_atomically
from osimlite.io.tables.headers import MARKER_KEYS
from osimlite.io.tables.storage import StoTable, format_number


def write_trc(
    path: str | Path,
    times: Sequence[float],
    markers: Sequence[str],
    rows: Iterable[Sequence[float]],
    *,
    units: str = "m",
) -> None:
    """Write marker positions to a file atomically, one row at a time.

    A position that is NaN is left empty, because the marker was not seen.

    Args:
        path: file to write.
        times: n times (s).
        markers: names of the m markers.
        rows: n rows of 3 m numbers, X, Y and Z of each marker.
        units: unit of the positions.

    Raises:
        OsimliteError: the file cannot be written.
    """
    with open_atomically(path) as stream:
        for line in _format_trc(Path(path).name, times, markers, rows, units):
            stream.write(f"{line}\n".encode())


def _format_trc(
    name: str,
    times: Sequence[float],
    markers: Sequence[str],
    rows: Iterable[Sequence[float]],
    units: str,
) -> Iterator[str]:
    """Yield the lines of a marker file; a missing coordinate (NaN) is an empty cell."""
    count = len(times)
    span = times[-1] - times[0] if count > 1 else 0.0
    rate = format_number((count - 1) / span) if span > 0.0 else "1"
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
        words = ("" if number != number else format_number(number) for number in row)
        yield "\t".join((str(frame), format_number(time), *words, ""))


_START = """<?xml version="1.0" encoding="UTF-8" ?>
<OpenSimDocument Version="40600">
	<ControlSet name="Control Set">
		<objects>
"""
_BEFORE = """			<ControlLinear name={name}>
				<is_model_control>true</is_model_control>
				<extrapolate>true</extrapolate>
				<default_min>0.02</default_min>
				<default_max>1</default_max>
				<filter_on>false</filter_on>
				<use_steps>false</use_steps>
				<x_nodes>
"""
_NODE = """					<ControlLinearNode>
						<t>%.17g</t>
						<value>%.17g</value>
					</ControlLinearNode>
"""
_AFTER = """				</x_nodes>
				<min_nodes />
				<max_nodes />
				<kp>100</kp>
				<kv>20</kv>
			</ControlLinear>
"""
_END = """		</objects>
		<groups />
	</ControlSet>
</OpenSimDocument>
"""


def format_control_set(table: StoTable) -> Iterator[str]:
    """Yield the text of a ControlSet in parts, with a ControlLinear for each column and no node for NaN."""
    # Imported here, because it imports the network code of the standard library.
    from xml.sax.saxutils import quoteattr

    yield _START
    for name, values in zip(table.columns, table.rows.T, strict=True):
        has_value = ~np.isnan(values)
        nodes = np.column_stack([table.times[has_value], values[has_value]])
        yield _BEFORE.format(name=quoteattr(name))
        yield _NODE * len(nodes) % tuple(nodes.ravel().tolist())
        yield _AFTER
    yield _END
