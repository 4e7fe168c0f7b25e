"""Plots of muscles over one coordinate or two."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.files import make_folder
from osimlite.base.progress import watch_items
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.muscle_curves import QUANTITIES, MuscleCurves
from osimlite.view.panel_groups import split_sides
from osimlite.view.panels import COLORS, make_figure, style_axes, write_pages
from osimlite.view.plots import divide_among_panels

_TITLES = {
    "length": "Muscle-tendon length",
    "tendon_force": "Tendon force, at rest",
    "active_fiber_force": "Active fiber force along the tendon, at rest",
    "passive_fiber_force": "Passive fiber force along the tendon",
}
MAX_LINE_PANELS = 6
"""Number of panels on a page of curves, each with up to seven muscles."""
MAX_MAPS = 12
"""Number of maps on a page."""
MAPS_ACROSS = 4
"""Number of maps side by side."""


def plot_muscles(
    curves: MuscleCurves,
    mechanism: Mechanism,
    folder: str | Path,
    other: MuscleCurves | None = None,
    *,
    regions: Mapping[str, str] | None = None,
) -> list[Path]:
    """Draw each quantity over the swept coordinates, on pages that fit a screen.

    The muscles of a region share panels; the left muscle of a pair is dashed.

    Args:
        curves: curves over one coordinate or two.
        mechanism: mechanism of the model.
        folder: folder to write into; it is made if it does not exist.
        other: curves of the same muscles in the same poses of another model, drawn thin.
        regions: bodies between which each muscle runs, by name of the muscle.

    Returns:
        The PNG files: ``moment_arm_knee_angle_r.png``, ``tendon_force.png``, and further pages as
        ``tendon_force-2.png``. A quantity that is unknown for all muscles has none.

    Raises:
        MissingDependency: matplotlib is not installed.
        OsimliteError: the folder cannot be written to.
    """
    base = make_folder(Path(folder))
    paths = []
    for quantity, rows in watch_items("drawing", curves.columns.items(), " quantities"):
        # A quantity that no muscle has, such as forces without equilibrium, gets no page.
        if not np.isfinite(rows).any():
            continue
        title = _make_title(quantity)
        if len(curves.coordinates) == 2:
            pages = _draw_maps(curves, mechanism, rows, title)
        else:
            other_rows = None if other is None else other.columns[quantity]
            pages = _draw_lines(curves, mechanism, rows, title, other_rows, regions or {})
        paths += write_pages(pages, base, quantity)
    return paths


def _make_title(quantity: str) -> str:
    """Return the title of a quantity with its unit."""
    if quantity in QUANTITIES:
        unit = QUANTITIES[quantity]
        title = _TITLES.get(quantity, quantity.replace("_", " ").capitalize())
    else:
        unit = "m"
        title = f"Moment arm about {quantity.removeprefix('moment_arm_')}"
    return f"{title} ({unit})" if unit else title


def _get_abscissa(curves: MuscleCurves, mechanism: Mechanism, index: int) -> tuple[str, Array]:
    """Return label and values of a coordinate, angles in degrees."""
    name = curves.coordinates[index]
    values = curves.poses[:, index]
    coordinate = mechanism.coordinates[mechanism.coordinate_index(name)]
    is_angle = coordinate.motion_type == "rotational"
    label = f"{name.rpartition('/')[2]} ({'deg' if is_angle else 'm'})"
    return label, np.degrees(values) if is_angle else values


def _get_names(curves: MuscleCurves) -> list[str]:
    """Return the names of the muscles."""
    return [path.rpartition("/")[2] for path in curves.muscles]


def _draw_lines(
    curves: MuscleCurves,
    mechanism: Mechanism,
    rows: Array,
    title: str,
    other: Array | None,
    regions: Mapping[str, str],
) -> Iterator[Any]:
    """Yield the pages of one quantity over a coordinate."""
    label, abscissa = _get_abscissa(curves, mechanism, 0)
    names = _get_names(curves)
    sides = split_sides(names)
    columns = dict(zip(names, rows.T, strict=True))
    other_columns = {} if other is None else dict(zip(names, other.T, strict=True))
    # A pair is one entry of a panel, whatever the number of its sides.
    groups: dict[str, dict[str, list[str]]] = {}
    for name in names:
        if np.isfinite(columns[name]).any():
            group = groups.setdefault(regions.get(name, ""), {})
            group.setdefault(sides[name][0], []).append(name)
    panels = [
        (region, panel_pairs)
        for region, pairs in groups.items()
        for panel_pairs in divide_among_panels(pairs)
    ]
    pages = ceil(len(panels) / MAX_LINE_PANELS)
    # Pages of equal size, not a full one and a rest.
    size = ceil(len(panels) / pages)
    for number, first in enumerate(range(0, len(panels), size), 1):
        page = panels[first : first + size]
        count = f" ({number} of {pages})" if pages > 1 else ""
        column_count = min(2, len(page))
        row_count = ceil(len(page) / column_count)
        figure = make_figure(f"{title}{count}", (6.5 * column_count, 0.6 + 2.9 * row_count))
        axes = figure.subplots(row_count, column_count, squeeze=False).ravel()
        # Unused panels are removed from the page.
        for panel in axes[len(page) :]:
            panel.remove()
        for panel, (region, pairs) in zip(axes, page, strict=False):
            _draw_pairs(panel, abscissa, pairs, columns, other_columns, sides)
            panel.set_title(region, fontsize=10, loc="left")
            style_axes(panel, label)
            widen_constant_range(panel)
        yield figure


def widen_constant_range(panel: Any) -> None:
    """Widen the range of a panel whose curves are constant, so that rounding errors do not show."""
    lowest, highest = panel.dataLim.intervaly
    size = max(abs(lowest), abs(highest))
    # Matplotlib would show the noise of a constant in full height.
    if highest - lowest <= 1e-6 * size:
        panel.set_ylim(lowest - 0.1 * size, highest + 0.1 * size)


def _draw_pairs(
    panel: Any,
    abscissa: Array,
    pairs: Mapping[str, Sequence[str]],
    columns: Mapping[str, Array],
    other_columns: Mapping[str, Array],
    sides: Mapping[str, tuple[str, str]],
) -> None:
    """Draw muscles in the colors of their pairs, and a legend beside the panel."""
    for number, names in enumerate(pairs.values()):
        for name in names:
            style = {
                "color": COLORS[number % len(COLORS)],
                "ls": "--" if sides[name][1] == "l" else "-",
            }
            # Matplotlib leaves a label that begins with an underscore out of the legend.
            legend_label = f" {name}" if name.startswith("_") else name
            panel.plot(abscissa, columns[name], lw=1.6, label=legend_label, **style)
            if name in other_columns:
                panel.plot(abscissa, other_columns[name], lw=0.8, alpha=0.8, **style)
    panel.legend(
        loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, frameon=False, fontsize=8
    )


def _draw_maps(
    curves: MuscleCurves, mechanism: Mechanism, rows: Array, title: str
) -> Iterator[Any]:
    """Yield the pages of one quantity over two coordinates, a map for each muscle."""
    (label, x), (other_label, y) = (_get_abscissa(curves, mechanism, index) for index in (0, 1))
    xs, ys = np.unique(x), np.unique(y)
    names = _get_names(curves)
    pages = ceil(len(names) / MAX_MAPS)
    for number in range(pages):
        indices = range(number * MAX_MAPS, min(len(names), (number + 1) * MAX_MAPS))
        column_count = min(MAPS_ACROSS, len(indices))
        row_count = ceil(len(indices) / column_count)
        count = f" ({number + 1} of {pages})" if pages > 1 else ""
        figure = make_figure(f"{title}{count}", (1.0 + 2.9 * column_count, 0.9 + 2.4 * row_count))
        panels_grid = figure.subplots(
            row_count, column_count, sharex=True, sharey=True, squeeze=False
        ).ravel()
        for panel in panels_grid[len(indices) :]:
            panel.remove()
        for index, panel in zip(indices, panels_grid, strict=False):
            color_mesh = panel.pcolormesh(
                xs,
                ys,
                # pcolormesh wants rows by y.
                rows[:, index].reshape(len(xs), len(ys)).T,
                shading="nearest",
                cmap="viridis",
            )
            figure.colorbar(color_mesh, ax=panel)
            panel.set_title(names[index], fontsize=9)
        figure.supxlabel(label)
        figure.supylabel(other_label)
        yield figure
