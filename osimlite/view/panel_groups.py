"""Grouping of table columns into panels: left and right of a quantity together, in one unit."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later
from osimlite.mechanics.multibody.spatial import Array
from osimlite.view.bands import Band

MAX_CONSTANTS = 12
"""Number of constant curves that the note of a page names."""
RELATIVE_CHANGE = 1e-9
"""A curve whose range is below this part of its largest value is constant."""
FRACTION = "0–1"
"""Unit of activations of muscles."""
MULTIPLE = "× optimal force"
"""Unit of controls of actuators that are no muscles."""
FORCE_UNITS = frozenset({"N", "N·m", "W"})
"""Units of sums of large terms. A sum that should be zero has a rounding error instead."""
ZERO_FRACTION = 1e-9
"""Force, moment or power that counts as zero, relative to the largest one of a table."""

_SIDE_TOKENS = (
    (compile_later(r"(?:^|(?<=[._/ ]))[rl](?=[._/ ]|$)"), {"r": "l", "l": "r"}),
    (compile_later(r"(?:^|(?<=[._/ ]))[RL](?=[._/ ]|[A-Z]|$)"), {"R": "L", "L": "R"}),
    (compile_later(r"right|left"), {"right": "left", "left": "right"}),
    (compile_later(r"Right|Left"), {"Right": "Left", "Left": "Right"}),
)
"""Patterns of the letters and words for a side in names of models, each with their opposites."""


class StepTimes(Protocol):
    """Steps of one foot."""

    @property
    def strikes(self) -> Sequence[float]:
        """Times at which the foot touches the ground, s."""

    @property
    def offs(self) -> Sequence[float]:
        """Times at which the foot leaves the ground, s."""

    @property
    def cycles(self) -> Sequence[tuple[float, float]]:
        """Gait cycles: from each strike to the next, s."""


class Column(NamedTuple):
    """Quantity over time or over another abscissa of a page."""

    name: str  # name with its side, such as "hip_flexion_r"
    unit: str  # unit, "" for numbers without one
    values: Array  # values (n,)
    group: str = ""  # body region, joint or coordinate to which it belongs
    section: str = ""  # title of the pages on which it is drawn, "" for none
    limits: tuple[float, ...] = ()  # bounds of the values in their unit, drawn as lines
    y_range: tuple[float, float] | None = None  # ends of the ordinate; None to fit the values


class PanelCurve(NamedTuple):
    """One curve of a panel."""

    times: Array  # abscissa (n,), s
    values: Array  # ordinate (n,), NaN where unknown
    side: str = ""  # "r", "l" or "" for neither
    style: Any = "-"  # line style of matplotlib; it distinguishes trials
    label: str = ""  # name of the trial or model
    steps: Mapping[str, StepTimes] = {}  # steps by side, if they are known


class Panel(NamedTuple):
    """Curves of one quantity in one unit."""

    title: str
    unit: str
    curves: list[PanelCurve]
    group: str = ""
    section: str = ""
    limits: tuple[float, ...] = ()
    band: Band | None = None  # reference, drawn where the abscissa is the gait cycle
    y_range: tuple[float, float] | None = None  # ends of the ordinate; None to fit the values


def split_sides(names: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Find the side that each name says, from its letters and from the other names.

    A name has a side if the name of the opposite side is there as well, as for ``RHip_rz`` and
    ``LHip_rz``, or if it ends in ``_r`` or ``_l``.

    Args:
        names: names of columns.

    Returns:
        Name without its side, and side ("r", "l" or ""), by name.
    """
    unique_names = dict.fromkeys(names)
    return {name: _split_side(name, unique_names) for name in unique_names}


def _split_side(name: str, names: Collection[str]) -> tuple[str, str]:
    """Return a name without its side, and the side."""
    # Letters such as "r" are in many words; a name has a side only if its opposite exists.
    matches = [
        (match, opposite) for token, opposite in _SIDE_TOKENS for match in token.finditer(name)
    ]
    for match, opposite in matches:
        opposite_name = name[: match.start()] + opposite[match[0]] + name[match.end() :]
        # "_r" and "_l" at the end are taken for sides in any case.
        if opposite_name in names or name[max(0, match.start() - 1) :] in ("_r", "_l"):
            base_name = _trim(name[: match.start()] + name[match.end() :])
            return base_name or name, match[0][0].lower()
    if matches and _mirror(name) in names:
        base_name = name
        # Several letters for sides, as in "calcn_r_right".
        for token, _ in _SIDE_TOKENS:
            base_name = token.sub("", base_name)
        return _trim(base_name) or name, matches[0][0][0][0].lower()
    return name, ""


def _mirror(name: str) -> str:
    """Return a name with every side replaced by the opposite one, as in ``calcn_r_right``."""

    def replace(match: re.Match[str]) -> str:
        return next(opposites[match[0]] for _, opposites in _SIDE_TOKENS if match[0] in opposites)

    for token, _ in _SIDE_TOKENS:
        name = token.sub(replace, name)
    return name


def _trim(name: str) -> str:
    """Return a name without the separators that remain when a side is cut out of it."""
    return re.sub(r"(?<=[._/ ])[._ ]+|^[._/ ]|[._/ ]$", "", name)


def is_constant(values: Array) -> bool:
    """Return whether known values do not change, or none is known."""
    # Rounding errors of a constant are no curve.
    finite_values = values[np.isfinite(values)]
    return not finite_values.size or bool(
        np.ptp(finite_values) <= RELATIVE_CHANGE * max(1e-3, float(np.abs(finite_values).max()))
    )


def group_columns(
    columns: Iterable[Column],
    times: Array,
    *,
    steps: Mapping[str, StepTimes] | None = None,
    style: str = "-",
    label: str = "",
) -> tuple[list[Panel], dict[str, str]]:
    """Group columns into panels: one for the left and right column of a quantity.

    Columns without any change have no panel, but the note of their section names them.

    Args:
        columns: columns to draw, each with n values.
        times: abscissa (n,), in seconds if `steps` are given.
        steps: steps by side, which divide the curves into gait cycles.
        style: line style of the curves.
        label: name of the curves in the legend, "" for none.

    Returns:
        The panels, those of one group one after the other, and the notes by section.
    """
    all_columns = list(columns)
    sides = split_sides(column.name for column in all_columns)
    panels: dict[tuple[str, str, str], Panel] = {}
    constant: dict[str, list[str]] = {}
    largest = _find_largest(all_columns)
    for column in all_columns:
        base_name, side = sides[column.name]
        values = np.asarray(column.values, dtype=float)
        if column.unit in FORCE_UNITS:
            values = np.where(np.abs(values) <= ZERO_FRACTION * largest[column.unit], 0.0, values)
        if is_constant(values):
            descriptions = constant.setdefault(column.section, [])
            descriptions.append(_describe_constant(column, values))
            continue
        # A quantity without a curve on the other side keeps its name.
        panel = panels.setdefault(
            (base_name, column.unit, column.section),
            Panel(
                base_name,
                column.unit,
                [],
                column.group,
                column.section,
                column.limits,
                y_range=column.y_range,
            ),
        )
        panel.curves.append(PanelCurve(times, values, side, style, label, steps or {}))
    # Panels of a group stay together.
    groups: dict[tuple[str, str], list[Panel]] = {}
    for panel in panels.values():
        groups.setdefault((panel.section, panel.group), []).append(panel)
    notes = {section: _describe_constants(names) for section, names in constant.items()}
    return [panel for group in groups.values() for panel in group], notes


def _find_largest(columns: Iterable[Column]) -> dict[str, float]:
    """Return the largest absolute value of each unit."""
    largest: dict[str, float] = {}
    for column in columns:
        values = np.abs(np.asarray(column.values, dtype=float))
        value = float(np.max(values, initial=0.0, where=np.isfinite(values)))
        largest[column.unit] = max(largest.get(column.unit, 0.0), value)
    return largest


def _describe_constant(column: Column, values: Array) -> str:
    """Return name and value of a column that does not change, for the note below the panels.

    Args:
        column: column that does not change.
        values: values of the column (n,); numbers that are not finite count as unknown.
    """
    finite_values = values[np.isfinite(values)]
    if not finite_values.size:
        return f"{column.name} (no values)"
    unit = f" {column.unit}" if column.unit not in ("", FRACTION, MULTIPLE) else ""
    # Rounding to 9 places turns rounding errors, such as 1e-17, into 0; adding 0.0 turns -0.0 into
    # 0.0.
    return f"{column.name} {0.0 + round(float(finite_values[0]), 9):.4g}{unit}"


def _describe_constants(descriptions: Sequence[str]) -> str:
    """Return the note about columns that do not change."""
    hidden_note = (
        f", and {len(descriptions) - MAX_CONSTANTS} more"
        if len(descriptions) > MAX_CONSTANTS
        else ""
    )
    return f"Constant: {', '.join(descriptions[:MAX_CONSTANTS])}{hidden_note}"


def merge_panels(panels: Iterable[Panel]) -> list[Panel]:
    """Return panels in which those with the same title and unit are one panel."""
    result: dict[tuple[str, str], Panel] = {}
    for panel in panels:
        merged = result.setdefault((panel.title, panel.unit), panel._replace(curves=[]))
        merged.curves.extend(panel.curves)
    return list(result.values())
