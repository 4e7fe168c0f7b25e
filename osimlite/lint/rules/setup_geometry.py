"""OSIM855 and OSIM856: where markers were measured, beside where the model has them."""

from __future__ import annotations

import math
from collections.abc import Sequence, Set
from itertools import islice
from typing import Any

from osimlite.base.text import format_count
from osimlite.io.tables.headers import METRES
from osimlite.lint.posture import marker_places
from osimlite.lint.registry import WARNING, FindingSink, rule
from osimlite.lint.rules.setup_markers import cells_of, marker_users, rows_between
from osimlite.lint.setup import Setup, members
from osimlite.lint.table import Table
from osimlite.lint.words import called

_LEAST, _MOST = 0.5, 2.0
"""Between these a factor that scales a body can be believed."""
_FEW_ROWS = 3
"""Sampled rows within the time range of the tool that suffice; with fewer, the table is read."""
_MOST_ROWS = 100
"""Rows that are read from a table at most."""
_SIDES = (("R", "L"), ("r", "l"), ("Right", "Left"), ("right", "left"), ("RIGHT", "LEFT"))
"""How names tell sides."""


@rule("OSIM855", "scale-factor", severity=WARNING, about="document")
def scale_factor(setup: Setup, report: FindingSink) -> None:
    """A body would be scaled by an implausible factor.

    Looks for factors given by hand, and for measurements, that make a body less than half or more
    than twice as large. A measurement is the distance of its markers in the data over that in the
    model, in its default pose.

    A label at another place, units that are not those of the header, or a pair of markers that the
    pose of the subject moves apart, make a model that is no longer that of a person; OpenSim says
    nothing.

    ```setup
      <ScaleSet name="factors">
          <objects>
    -         <Scale name="thigh"> <scales>1.1 11 1.1</scales> <segment>thigh</segment> </Scale>
    +         <Scale name="thigh"> <scales>1.1 1.1 1.1</scales> <segment>thigh</segment> </Scale>
          </objects>
      </ScaleSet>
    ```
    """
    for scale in setup.named("Scale"):
        for factor in dict.fromkeys(scale.scales) if scale.apply else ():
            if not _LEAST <= factor <= _MOST:
                report(f"{called(scale)} scales {scale.segment} by {factor:g}", scale, tag="scales")
    for scaler, table in setup.with_tables(setup.named("ModelScaler"), "marker_file"):
        if setup.tree is None or not scaler.apply or "measurements" not in scaler.scaling_order:
            continue
        said = table.entries.get("Units")
        places, unit = (
            marker_places(setup),
            METRES.get(said.value.text, math.nan) if said else math.nan,
        )
        rows, columns = list(rows_between(table, scaler.time_range)), dict(cells_of(table))
        for measurement in members(scaler.measurement_set, "Measurement") if rows else ():
            pairs = members(measurement.marker_pair_set, "MarkerPair") if measurement.apply else ()
            for pair in pairs:
                one, other = (
                    (str(name) for name in pair.markers) if len(pair.markers) == 2 else ("", "")
                )
                if {one, other} <= columns.keys() & places.keys() and one != other:
                    apart = (
                        sum(math.dist(row[columns[one]], row[columns[other]]) for row in rows)
                        * unit
                        / len(rows)
                    )
                    before = math.dist(places[one], places[other])
                    factor = apart / before if before else math.inf
                    if factor < _LEAST or factor > _MOST:
                        report(
                            f"{one} and {other} are {apart:.3g} m apart in '{scaler.marker_file}', and {before:.3g} m "
                            f"in the model: {called(measurement)} scales by {factor:.3g}",
                            pair,
                            tag="markers",
                        )


@rule("OSIM856", "swapped-sides", severity=WARNING, about="document")
def swapped_sides(setup: Setup, report: FindingSink) -> None:
    """A marker of the right side was measured on the left, and its fellow on the right.

    Compares, for each two markers whose names differ by the side alone, the way from the left one
    to the right one with that of all other such pairs, in the data and in the model. A pair that is
    the other way round in four rows of five is reported. Pairs that are more than half a metre
    apart in the model are left out: arms may be crossed. Only rows within the times of the tool
    count, and a marker at 0 0 0 is taken for one that was not seen.

    Inverse kinematics twists legs and pelvis to bring the markers as near as it can; the errors
    that it reports are spread over all markers.

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
    for user, table in marker_users(setup):
        if setup.tree is None or not table.is_markers:
            continue
        places, columns = marker_places(setup), dict(cells_of(table))
        pairs = [
            (name, fellow)
            for name in columns
            if (fellow := _fellow(name, places.keys() & columns.keys()))
            and name in places
            and 0.03 < math.dist(places[name], places[fellow]) < 0.5
        ]
        model = _agreement([_way(places[left], places[right]) for right, left in pairs])
        seen = [0] * len(pairs)
        turned = [0] * len(pairs)
        for row in _rows_of_tool(user, table):
            row = row + [math.nan] * (2 + 3 * len(columns) - len(row))
            ways = [
                _way(_seen(row[columns[left]]), _seen(row[columns[right]])) for right, left in pairs
            ]
            for number, agreement in enumerate(_agreement(ways)):
                seen[number] += agreement == agreement
                turned[number] += agreement * model[number] < -0.3
        for (right, left), rows, wrong in zip(pairs, seen, turned, strict=True):
            if rows and wrong >= 0.8 * rows:
                task = next((task for task in user.ik_task_set.objects if task.name == right), None)
                report(
                    f"in {wrong} of {format_count(rows, 'row')} of '{user.marker_file}' that were looked at, '{right}' and "
                    f"'{left}' are the other way round than other markers of both sides: are they swapped?",
                    task or user,
                    tag=None if task else "marker_file",
                    attribute="name" if task else None,
                )


def _rows_of_tool(user: Any, table: Table) -> list[list[float]]:
    """Some rows of markers within the times of a tool, from all over these times where that is known at no cost."""
    span = tuple(getattr(user, "time_range", ()))
    if len(span) != 2 or not span[0] <= span[1]:
        return list(table.rows.samples)
    within = [row for row in table.rows.samples if len(row) > 1 and span[0] <= row[1] <= span[1]]
    return (
        within if len(within) >= _FEW_ROWS else list(islice(rows_between(table, span), _MOST_ROWS))
    )


def _seen(point: Sequence[float]) -> Sequence[float]:
    """The place of a marker; NaN at 0 0 0, where programs put what they did not see."""
    return point if any(point) else (math.nan,) * 3


def _fellow(name: str, names: Set[str]) -> str:
    """The name of the same marker on the left, of one on the right; nothing if there is none."""
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


def _way(start: Sequence[float], end: Sequence[float]) -> list[float]:
    """The direction from one point to another; NaN if one is not known."""
    length = math.dist(start, end) or math.nan
    return [(b - a) / length for a, b in zip(start, end, strict=True)]


def _agreement(ways: list[list[float]]) -> list[float]:
    """The cosine of each direction with the mean of the others; NaN where there are few, or these do not agree."""
    known = [way for way in ways if way[0] == way[0]]
    whole = [sum(parts) for parts in zip(*known, strict=True)] or [0.0, 0.0, 0.0]
    result = []
    for way in ways:
        rest = [total - part for total, part in zip(whole, way, strict=True)]
        length = math.hypot(*rest)
        agree = len(known) > 3 and length > 0.5 * (len(known) - 1)
        result.append(
            sum(a * b for a, b in zip(way, rest, strict=True)) / length if agree else math.nan
        )
    return result
