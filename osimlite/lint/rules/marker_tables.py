"""OSIM81x: faults that only marker files (.trc) have."""

from __future__ import annotations

from math import hypot

from osimlite.io.document.source import Position
from osimlite.io.tables.headers import METRES_PER_UNIT
from osimlite.lint.registry import INFO, WARNING, FindingCollector, rule
from osimlite.lint.table import Table

_MAX_SPREAD_M = 8.0
"""Largest plausible spread of the markers of a moving subject, m."""
_MIN_SPREAD_M = 0.02
"""Smallest plausible spread of the markers of a moving subject, m."""


@rule("OSIM811", "marker-units", severity=WARNING, fixes="unsafe", about="table")
def report_marker_units(table: Table, report: FindingCollector) -> None:
    """The units of a marker file do not fit its numbers.

    Reports a marker file in which the markers of a frame are usually spread over more than 8 m or
    less than 2 cm. No moving body is so large or so small.

    OpenSim reads millimetres as metres without a message. Inverse kinematics then ends with errors
    of kilometres, and a scaled model is a thousand times too large.

    ```trc
      PathFileType→4→(X/Y/Z)→walk.trc
      DataRate→CameraRate→NumFrames→NumMarkers→Units→OrigDataRate→OrigDataStartFrame→OrigNumFrames
    - 100→100→1→2→m→100→1→1
    + 100→100→1→2→mm→100→1→1
      Frame#→Time→knee→→→hip→→→
      →→X1→Y1→Z1→X2→Y2→Z2

      1→0.01→617.2→1055.2→170.7→639.6→1400.1→158.1
    ```
    """
    units = table.entries.get("Units")
    unit = METRES_PER_UNIT.get(units.value.text) if units is not None else None
    if units is None or unit is None or len(table.labels) < 2:
        return
    spreads = sorted(
        spread for sample in table.rows.samples if (spread := _measure_spread(sample)) is not None
    )
    if not spreads:
        return
    # The median is not moved by single wrong markers.
    usual = spreads[len(spreads) // 2]
    if not _MIN_SPREAD_M <= usual * unit <= _MAX_SPREAD_M:
        # The markers of a person or an animal are spread over 0.2 to 3 m.
        likely_unit = next(
            (name for name in ("m", "mm", "cm") if 0.2 <= usual * METRES_PER_UNIT[name] <= 3.0),
            None,
        )
        report(
            f"the markers of a frame are spread over {float(f'{usual * unit:.3g}'):g} m if they are in "
            f"the units of the file, '{units.value.text}'",
            at=units.value.at,
            suggestion=likely_unit,
        )


def _measure_spread(sample: list[float]) -> float | None:
    """Return the diagonal of the box around the markers of a row; None with fewer than two markers."""
    axes = [[number for number in sample[2 + axis :: 3] if number == number] for axis in range(3)]
    if any(len(numbers) < 2 for numbers in axes):
        return None
    return hypot(*(max(numbers) - min(numbers) for numbers in axes))


@rule("OSIM812", "marker-gap", severity=WARNING, about="table")
def report_marker_gap(table: Table, report: FindingCollector) -> None:
    """A marker is at the origin, or has only some of its coordinates.

    Reports markers at 0 0 0, where some programs put missing markers, and markers with one or two
    empty cells. As an info it reports markers that are missing in all frames.

    OpenSim takes 0 0 0 as the position of the marker and bends the model towards it. If a cell of a
    marker is empty, the marker is missing in that frame.

    ```trc
      PathFileType→4→(X/Y/Z)→walk.trc
      DataRate→CameraRate→NumFrames→NumMarkers→Units→OrigDataRate→OrigDataStartFrame→OrigNumFrames
    - 100→100→1→2→m→100→1→1
    + 100→100→2→2→m→100→1→2
      Frame#→Time→knee→→→hip→→→
      →→X1→Y1→Z1→X2→Y2→Z2

    - 1→0.01→0.6→0.5→0.1→0→0→0
    + 1→0.01→0.6→0.5→0.1→→→
    + 2→0.02→0.6→0.5→0.1→0.6→0.9→0.1
    ```
    """
    for fault in table.rows.select("zero", "part"):
        name = table.label_of(fault.number)
        problem = (
            "is at 0 0 0, which OpenSim takes for a measured position"
            if fault.kind == "zero"
            else "lacks some of its coordinates"
        )
        report(
            f"the marker '{name}' {problem}{fault.describe_repeats()}",
            at=Position(fault.line, fault.column, fault.length),
        )
    for label in [
        label for number, label in enumerate(table.labels) if number in table.rows.unseen
    ]:
        report(f"the marker '{label.text}' is missing in all frames", at=label.at, severity=INFO)


@rule("OSIM813", "frame-number", severity=INFO, about="table")
def report_frame_number(table: Table, report: FindingCollector) -> None:
    """The frames of a marker file are not numbered consecutively.

    Compares the number of each frame with the number of the previous frame.

    OpenSim ignores the numbers. But a wrong number can mean that frames were removed or inserted.

    ```trc
      PathFileType→4→(X/Y/Z)→walk.trc
      DataRate→CameraRate→NumFrames→NumMarkers→Units→OrigDataRate→OrigDataStartFrame→OrigNumFrames
      100→100→2→2→m→100→1→2
      Frame#→Time→knee→→→hip→→→
      →→X1→Y1→Z1→X2→Y2→Z2

      1→0.01→0.6→0.5→0.1→0.6→0.9→0.1
    - 4→0.02→0.6→0.5→0.1→0.6→0.9→0.1
    + 2→0.02→0.6→0.5→0.1→0.6→0.9→0.1
    ```
    """
    for fault in table.rows.select("frame"):
        problem = (
            f"'{fault.text}' does not follow the number of the previous frame"
            if fault.text
            else "the frame number is missing"
        )
        report(
            f"{problem}{fault.describe_repeats()}",
            at=Position(fault.line, fault.column, max(1, fault.length)),
        )
