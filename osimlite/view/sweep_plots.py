"""Plots of sweeps: measures of the runs over the varied quantities."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import ceil
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from osimlite.base.files import make_folder
from osimlite.base.text import format_count
from osimlite.mechanics.multibody.spatial import Array
from osimlite.view.panels import COLORS, MAX_COLUMNS, MAX_PANELS, make_figure, write_pages

MAX_VARIABLES = 12
"""Number of variables over which a measure is drawn: those with the largest correlation."""

MEASURE_UNITS = {"distance": "m", "largest_force": "N", "energy": "J"}
"""Units of the measures that have names."""


def plot_runs(
    columns: Mapping[str, Any],
    variables: Sequence[str],
    measures: Sequence[str],
    folder: str | Path,
    file_stem: str,
    units: Mapping[str, str] = MappingProxyType({}),
) -> list[Path]:
    """Draw each measure over the varied quantities: as a map over two of them, else as points.

    Args:
        columns: columns of the runs (n,) by name.
        variables: names of the varied quantities.
        measures: names of the measures.
        folder: folder to write into; it is made if it does not exist.
        file_stem: name of the first file, without its suffix.
        units: units of the varied quantities by name; measures have those of `MEASURE_UNITS`.

    Returns:
        The PNG files; none if no measure has a number.

    Raises:
        MissingDependency: matplotlib is not installed.
        OsimliteError: the folder or a file cannot be written.
    """
    # Failed runs have no measure.
    numbers = {
        name: _to_numbers(columns[name]) for name in (*variables, *measures) if name in columns
    }
    drawn_measures = [
        name for name in measures if name in numbers and np.isfinite(numbers[name]).any()
    ]
    varied = [name for name in variables if name in numbers]
    if len(varied) == 2:
        panels = [(varied[0], varied[1], name) for name in drawn_measures]
    else:
        panels = [
            (name, measure, "")
            for measure in drawn_measures
            for name in _rank_variables(numbers, varied, measure)
        ]
    return write_pages(
        _draw_pages(numbers, panels, {**MEASURE_UNITS, **units}),
        make_folder(Path(folder)),
        file_stem,
    )


def _to_numbers(column: Any) -> Array:
    """Return a column as numbers; NaN in place of None."""
    return np.array([np.nan if value is None else value for value in column], dtype=float)


def _rank_variables(numbers: Mapping[str, Array], varied: Sequence[str], measure: str) -> list[str]:
    """Return the variables of a measure, without the least correlated ones if there are too many."""
    if len(varied) <= MAX_VARIABLES:
        return list(varied)
    finite = np.isfinite(numbers[measure])

    def correlate(name: str) -> float:
        x, y = numbers[name][finite], numbers[measure][finite]
        # A constant has no correlation.
        if np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
            return 0.0
        return float(abs(np.corrcoef(x, y)[0, 1]))

    # The sign of a correlation says nothing about how interesting a variable is.
    return sorted(varied, key=correlate, reverse=True)[:MAX_VARIABLES]


def _draw_pages(
    numbers: Mapping[str, Array],
    panels: Sequence[tuple[str, str, str]],
    units: Mapping[str, str],
) -> Iterator[Any]:
    """Yield pages of panels, each with abscissa, ordinate, and the quantity of the color."""

    def label(name: str) -> str:
        return f"{name} ({units[name]})" if units.get(name) else name

    pages = ceil(len(panels) / MAX_PANELS)
    for number in range(pages):
        page = panels[number * MAX_PANELS : (number + 1) * MAX_PANELS]
        # Four panels fill a square, without a gap in a second row.
        column_count = min(MAX_COLUMNS, len(page)) if len(page) != 4 else 2
        row_count = ceil(len(page) / column_count)
        count = f" ({number + 1} of {pages})" if pages > 1 else ""
        size = (1.0 + 3.6 * column_count, 0.7 + 2.8 * row_count)
        figure = make_figure(f"{format_count(len(numbers[page[0][0]]), 'run')}{count}", size)
        panels_grid = figure.subplots(row_count, column_count, squeeze=False).ravel()
        for panel in panels_grid[len(page) :]:
            panel.remove()
        for panel, (x, y, color) in zip(panels_grid, page, strict=False):
            if color:
                _draw_map(figure, panel, numbers[x], numbers[y], numbers[color])
            else:
                panel.plot(numbers[x], numbers[y], ".", color=COLORS[0], ms=4, alpha=0.7)
            panel.set_title(label(color or y), fontsize=10, loc="left")
            panel.set_xlabel(label(x), fontsize=8)
            if color:
                panel.set_ylabel(label(y), fontsize=8)
            if not color:
                panel.grid(color="0.92", lw=0.8)
            panel.set_axisbelow(True)
            panel.tick_params(labelsize=8)
            panel.spines[["top", "right"]].set_visible(False)
        yield figure


def _draw_map(figure: Any, panel: Any, x: Array, y: Array, color: Array) -> None:
    """Draw a measure over two quantities as grid cells or points; crosses are runs without it."""
    xs, ys = np.unique(x), np.unique(y)
    # All combinations were run: draw the cells of a grid.
    if len(xs) * len(ys) == len(x) and len(xs) > 1 and len(ys) > 1:
        cells = np.full((len(ys), len(xs)), np.nan)
        # Cells are placed by values, since runs may finish in any order.
        cells[np.searchsorted(ys, y), np.searchsorted(xs, x)] = color
        mappable = panel.pcolormesh(xs, ys, cells, shading="nearest", cmap="viridis")
    else:
        finite = np.isfinite(color)
        mappable = panel.scatter(x[finite], y[finite], c=color[finite], s=14, cmap="viridis")
        panel.plot(x[~finite], y[~finite], "x", color="0.6", ms=4)
    figure.colorbar(mappable, ax=panel)
