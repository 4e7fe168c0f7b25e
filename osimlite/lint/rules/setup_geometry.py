"""OSIM855 and OSIM856: measured positions of markers compared with those in the model."""

from __future__ import annotations

import math
from collections.abc import Sequence, Set
from itertools import islice
from typing import Any

from osimlite.base.text import format_count
from osimlite.io.tables.headers import METRES_PER_UNIT
from osimlite.lint.posture import locate_markers
from osimlite.lint.registry import WARNING, FindingCollector, rule
from osimlite.lint.rules.setup_markers import (
    find_marker_users,
    iterate_rows_between,
    list_marker_cells,
)
from osimlite.lint.setup import Setup, select_members
from osimlite.lint.table import Table
from osimlite.lint.words import describe_object

_MIN_FACTOR = 0.5
"""Smallest plausible scale factor of a body."""
_MAX_FACTOR = 2.0
"""Largest plausible scale factor of a body."""
_MIN_ROWS = 3
"""Number of sampled rows in the time range that suffice; with fewer, the table is read."""
_MAX_ROWS = 100
"""Largest number of rows that are read from a table."""
_SIDES = (("R", "L"), ("r", "l"), ("Right", "Left"), ("right", "left"), ("RIGHT", "LEFT"))
"""Patterns of the sides in names."""


@rule("OSIM855", "scale-factor", severity=WARNING, about="document")
def report_scale_factor(setup: Setup, report: FindingCollector) -> None:
    """A body would be scaled by an implausible factor.

    Reports manual scale factors, and measurements, that make a body less than half or more than
    twice as large. The factor of a measurement is the distance of its markers in the data, divided
    by their distance in the default pose of the model.

    The scaled model does not fit the person, and OpenSim gives no message. Typical causes are a
    marker with the wrong label, wrong units in the header, and a pair of markers whose distance
    depends on the pose.

    ```setup
      <ScaleSet name="factors">
          <objects>
    -         <Scale name="thigh"> <scales>1.1 11 1.1</scales> <segment>thigh</segment> </Scale>
    +         <Scale name="thigh"> <scales>1.1 1.1 1.1</scales> <segment>thigh</segment> </Scale>
          </objects>
      </ScaleSet>
    ```
    """
    for scale in setup.find_by_class("Scale"):
        for factor in dict.fromkeys(scale.scales) if scale.apply else ():
            if not _MIN_FACTOR <= factor <= _MAX_FACTOR:
                report(
                    f"{describe_object(scale)} scales {scale.segment} by a factor of {factor:g}",
                    scale,
                    tag="scales",
                )
    for scaler, table in setup.iterate_with_tables(
        setup.find_by_class("ModelScaler"), "marker_file"
    ):
        if setup.tree is None or not scaler.apply or "measurements" not in scaler.scaling_order:
            continue
        units_entry = table.entries.get("Units")
        positions = locate_markers(setup)
        # With an unknown unit nothing is reported, since all comparisons with NaN are false.
        unit = METRES_PER_UNIT.get(units_entry.value.text, math.nan) if units_entry else math.nan
        rows = list(iterate_rows_between(table, scaler.time_range))
        columns = dict(list_marker_cells(table))
        for measurement in select_members(scaler.measurement_set, "Measurement") if rows else ():
            pairs = (
                select_members(measurement.marker_pair_set, "MarkerPair")
                if measurement.apply
                else ()
            )
            for pair in pairs:
                first_marker, second_marker = (
                    (str(name) for name in pair.markers) if len(pair.markers) == 2 else ("", "")
                )
                if {
                    first_marker,
                    second_marker,
                } <= columns.keys() & positions.keys() and first_marker != second_marker:
                    measured_distance = (
                        sum(
                            math.dist(row[columns[first_marker]], row[columns[second_marker]])
                            for row in rows
                        )
                        * unit
                        / len(rows)
                    )
                    model_distance = math.dist(positions[first_marker], positions[second_marker])
                    factor = measured_distance / model_distance if model_distance else math.inf
                    if factor < _MIN_FACTOR or factor > _MAX_FACTOR:
                        report(
                            f"{first_marker} and {second_marker} are {measured_distance:.3g} m apart in "
                            f"'{scaler.marker_file}', but {model_distance:.3g} m in the model: "
                            f"{describe_object(measurement)} scales by a factor of {factor:.3g}",
                            pair,
                            tag="markers",
                        )


@rule("OSIM856", "swapped-sides", severity=WARNING, about="document")
def report_swapped_sides(setup: Setup, report: FindingCollector) -> None:
    """A right and a left marker are swapped in the data.

    Checks each pair of markers whose names differ only in the side, such as R.ASIS and L.ASIS.
    Compares the direction from the left to the right marker with that of all other pairs, in the
    data and in the model. Reports a pair whose direction is reversed in at least four of five rows.
    Pairs more than half a metre apart in the model are ignored, because arms may be crossed. Only
    rows within the time range of the tool count, and a marker at 0 0 0 counts as missing.

    Inverse kinematics twists legs and pelvis to fit the markers. The errors that it reports are
    spread over all markers.

    ```setup
      <InverseKinematicsTool name="ik">
          <model_file>sides.osim</model_file>
    -     <marker_file>sides_swapped.trc</marker_file>
    +     <marker_file>sides.trc</marker_file>
          <time_range>0 0.02</time_range>
          <output_motion_file>ik.mot</output_motion_file>
      </InverseKinematicsTool>
    ```
    """
    for user, table in find_marker_users(setup):
        if setup.tree is None or not table.is_markers:
            continue
        positions = locate_markers(setup)
        columns = dict(list_marker_cells(table))
        pairs = [
            (name, fellow)
            for name in columns
            if (fellow := _find_left_marker(name, positions.keys() & columns.keys()))
            and name in positions
            # Markers that are closer have no reliable direction; arms with farther ones may be
            # crossed.
            and 0.03 < math.dist(positions[name], positions[fellow]) < 0.5
        ]
        model = _compute_agreement(
            [_compute_direction(positions[left], positions[right]) for right, left in pairs]
        )
        row_counts = [0] * len(pairs)
        swapped_counts = [0] * len(pairs)
        for row in _select_rows(user, table):
            # Rows may lack their last cells.
            row = row + [math.nan] * (2 + 3 * len(columns) - len(row))
            directions = [
                _compute_direction(
                    _hide_origin(row[columns[left]]), _hide_origin(row[columns[right]])
                )
                for right, left in pairs
            ]
            for number, agreement in enumerate(_compute_agreement(directions)):
                # NaN, of a pair that is not seen, differs from itself.
                row_counts[number] += agreement == agreement
                swapped_counts[number] += agreement * model[number] < -0.3
        for (right, left), rows, wrong in zip(pairs, row_counts, swapped_counts, strict=True):
            if rows and wrong >= 0.8 * rows:
                # A finding at the task points to the name that the user has to compare.
                task = next((task for task in user.ik_task_set.objects if task.name == right), None)
                report(
                    f"'{right}' and '{left}' are on the wrong sides, compared with the other markers of "
                    f"both sides, in {wrong} of {format_count(rows, 'checked row')} of "
                    f"'{user.marker_file}': are they swapped?",
                    task or user,
                    tag=None if task else "marker_file",
                    attribute="name" if task else None,
                )


def _select_rows(user: Any, table: Table) -> list[list[float]]:
    """Return some rows of markers within the time range of a tool, spread over it if that is cheap."""
    span = tuple(getattr(user, "time_range", ()))
    if len(span) != 2 or not span[0] <= span[1]:
        return list(table.rows.samples)
    rows_in_range = [
        row for row in table.rows.samples if len(row) > 1 and span[0] <= row[1] <= span[1]
    ]
    return (
        rows_in_range
        if len(rows_in_range) >= _MIN_ROWS
        else list(islice(iterate_rows_between(table, span), _MAX_ROWS))
    )


def _hide_origin(point: Sequence[float]) -> Sequence[float]:
    """Return the position of a marker; NaN at 0 0 0, where some programs put missing markers."""
    return point if any(point) else (math.nan,) * 3


def _find_left_marker(name: str, names: Set[str]) -> str:
    """Return the name of the left counterpart of a right marker; empty without one."""
    for right, left in _SIDES:
        for fellow in (
            left + name.removeprefix(right),
            name.removesuffix(right) + left,
            name.replace(f"_{right}_", f"_{left}_"),
        ):
            if (
                len(fellow) == len(name) - len(right) + len(left)
                and fellow != name
                and fellow in names
            ):
                return fellow
    return ""


def _compute_direction(start: Sequence[float], end: Sequence[float]) -> list[float]:
    """Return the unit vector from one point to another; NaN if one is unknown."""
    length = math.dist(start, end) or math.nan
    return [(b - a) / length for a, b in zip(start, end, strict=True)]


def _compute_agreement(directions: list[list[float]]) -> list[float]:
    """Return the cosine of each direction with the mean of the others; NaN if few are known or they disagree."""
    finite_directions = [direction for direction in directions if direction[0] == direction[0]]
    sums = [sum(components) for components in zip(*finite_directions, strict=True)] or [
        0.0,
        0.0,
        0.0,
    ]
    result = []
    for direction in directions:
        others_sum = [total - component for total, component in zip(sums, direction, strict=True)]
        length = math.hypot(*others_sum)
        # With fewer pairs, or pairs that point everywhere, a reversed one cannot be told from the
        # others.
        agree = len(finite_directions) > 3 and length > 0.5 * (len(finite_directions) - 1)
        result.append(
            sum(a * b for a, b in zip(direction, others_sum, strict=True)) / length
            if agree
            else math.nan
        )
    return result
