"""Tables as OpenSim's tools write them: the older form of its storage files, with eight decimals."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

NOTES = """
Units are S.I. units (second, meters, Newtons, ...)
If the header above contains a line with 'inDegrees', this indicates whether rotational values are in degrees (yes) or \
radians (no).

"""
"""What OpenSim's analyses write into the headers of coordinates."""


def old_storage_text(
    name: str,
    times: Sequence[float],
    columns: Sequence[str],
    rows: Iterable[Sequence[float]],
    *,
    in_degrees: bool = False,
    notes: str = "",
) -> str:
    """The text of a table over time, as OpenSim's Storage prints it."""
    lines = [
        name,
        "version=1",
        f"nRows={len(times)}",
        f"nColumns={len(columns) + 1}",
        f"inDegrees={'yes' if in_degrees else 'no'}",
    ]
    head = "\n".join(lines) + "\n" + notes + "endheader\n" + "\t".join(("time", *columns)) + "\n"
    return head + "".join(
        "\t".join(f"{number:16.8f}" for number in (time, *row)) + "\n" for time, row in zip(times, rows, strict=True)
    )
