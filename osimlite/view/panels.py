"""Drawing of panels with curves on pages of at most twelve panels."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import ceil
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.require import require
from osimlite.base.writing import write_into
from osimlite.view.lettering import plain_lettering
from osimlite.view.panel_groups import Panel, PanelCurve

COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Colors that color-blind people tell apart (Okabe and Ito 2008), without yellow, which is too pale for lines."""

STYLES = ("-", "--", ":")
"""Line styles; when all colors are used, they are used again with the next style."""

MAX_PANELS = 12
"""Number of panels on a page: more cannot be read on one screen."""
MAX_COLUMNS = 3
"""Number of panels side by side, each at least 3.5 inches wide."""
PERCENT = np.linspace(0.0, 100.0, 101)
"""Points of the gait cycle at which curves are drawn, %."""
MAX_LIMIT_DISTANCE = 0.5
"""Largest distance of a limit from the curves that is drawn, relative to their range with zero."""
STEP_NOTE = "Vertical lines: foot strikes (solid), toe-offs (dotted)"
"""Note of pictures over time in which the steps of the feet are known."""
SIDES = {"r": (COLORS[0], "right"), "l": (COLORS[1], "left"), "": ("#444444", "")}
"""Color and name of the curves of each side."""
LIMIT_COLOR = "#b00020"
"""Color of the lines of limits."""
DASHES = (0.0, (4.0, 4.0))
"""Line style of a curve that lies on another."""
EXPONENTS = (-4, 6)
"""Powers of ten of ordinates beyond which a common power is written above the axis."""
DPI = 110
"""Resolution of the pages, dots per inch: a page of twelve panels has 1,210 by 1,050 pixels."""

# The panels have fixed places. Matplotlib's constrained layout measures all labels to find places,
# which takes longer than drawing the page, and the labels have the same sizes on all pages.
TITLE_HEIGHT_IN = 0.5
"""Height of the title of a page, inches."""
PANEL_HEIGHT_IN = 2.15
"""Height of a panel with its margins, inches."""
GAP_ROWS = 2
"""Number of last rows whose gaps a small group fills."""
PANEL_WIDTH_IN = 3.6
"""Width of a panel with its margins, inches."""
PANEL_MARGINS_IN = {"left": 0.62, "right": 0.16, "bottom": 0.26, "top": 0.34}
"""Margins around the axes of a panel for ticks, label and title, inches.

Half of the last number of the abscissa extends into the right margin."""
LABEL_HEIGHT_IN = 0.16
"""Height of the label of the abscissa, which only the lowest panel of a column has, inches."""
NOTE_LINE_IN = 0.15
"""Height of a line of the note, inches."""
LETTERS_PER_INCH = 12.0
"""Number of letters of a title of 10 points in an inch."""


class Page(NamedTuple):
    """Panels of one picture, in rows."""

    title: str  # "" for none
    rows: list[list[Panel]]
    abscissa: str  # label of the abscissa
    note: str = ""  # sentences below the panels
    cyclic: bool = False  # whether curves are drawn over the gait cycle


def draw_pages(
    title: str,
    panels: Sequence[Panel],
    *,
    abscissa: str = "time (s)",
    notes: Mapping[str, str] = MappingProxyType({}),
) -> Iterator[Any]:
    """Yield the figures of panels, at most `MAX_PANELS` on each.

    Curves are drawn over the gait cycle if there is a complete cycle for each of them, otherwise
    over time, with lines at foot strikes and toe-offs, which the note of each page explains.

    Args:
        title: title of the figures; "" for none.
        panels: panels to draw; without any there is no figure.
        abscissa: label of the abscissa, where it is not the gait cycle.
        notes: sentences by section, below the panels on its last page. Those of sections without
            panels are on the last page of all.

    Yields:
        The figures of each section, one section after the other.
    """
    cyclic = has_cycles(panels)
    sections: dict[str, list[Panel]] = {}
    for panel in panels:
        sections.setdefault(panel.section, []).append(panel)
    has_steps = not cyclic and any(curve.steps for panel in panels for curve in panel.curves)
    step_note = STEP_NOTE if has_steps else ""
    pages = []
    for section, section_panels in sections.items():
        section_pages = list(_divide_into_pages(section_panels))
        for number, rows in enumerate(section_pages, 1):
            page_title = f"{title}: {section}" if title and section else title
            if page_title and len(section_pages) > 1:
                page_title += f" ({number} of {len(section_pages)})"
            label = "gait cycle (%)" if cyclic else abscissa
            section_note = notes.get(section, "") if number == len(section_pages) else ""
            note = ". ".join(filter(None, (section_note, step_note)))
            band_note = _describe_bands(rows) if cyclic else ""
            note = "\n".join(filter(None, (note, band_note)))
            pages.append(Page(page_title, rows, label, note, cyclic))
    if pages:
        others = [note for section, note in notes.items() if section not in sections]
        last_note = "\n".join(filter(None, (pages[-1].note, *others)))
        pages[-1] = pages[-1]._replace(note=last_note)
    yield from map(_draw_page, pages)


def _describe_bands(rows: Iterable[Iterable[Panel]]) -> str:
    """Return the note about the references behind the curves of a page, "" without any."""
    bands = [panel.band for row in rows for panel in row if panel.band is not None]
    sources = sorted({band.source for band in bands})
    return f"Grey: mean and one standard deviation, {', '.join(sources)}" if sources else ""


def has_cycles(panels: Iterable[Panel]) -> bool:
    """Return whether every curve has a complete gait cycle of its side."""
    curves = [curve for panel in panels for curve in panel.curves]
    return bool(curves) and all(_select_cycles(curve) for curve in curves)


def _select_cycles(curve: PanelCurve) -> list[tuple[float, float]]:
    """Return the gait cycles that a curve covers; a curve without a side follows the right foot."""
    steps = curve.steps.get(curve.side or "r")
    if steps is None:
        return []
    return [
        (first, last)
        for first, last in steps.cycles
        if curve.times[0] <= first and last <= curve.times[-1]
    ]


def _divide_into_pages(panels: Sequence[Panel]) -> Iterator[list[list[Panel]]]:
    """Yield the rows of each page.

    A group stays in one row where it fits in one and that costs no further row.
    """
    count = len(panels)
    # Four panels are two rows of two.
    width = count if count < MAX_COLUMNS else 2 if count == 4 else MAX_COLUMNS
    groups: dict[str, list[Panel]] = {}
    for panel in panels:
        groups.setdefault(panel.group, []).append(panel)
    rows = _fill_rows(groups.values(), width)
    if len(rows) > ceil(count / width):
        # Pairs in rows of three would leave the last column empty; each panel names its group.
        rows = [list(panels[first : first + width]) for first in range(0, count, width)]
    height = MAX_PANELS // MAX_COLUMNS
    pages = ceil(len(rows) / height)
    for first in range(0, len(rows), size := ceil(len(rows) / max(1, pages)) or 1):
        yield rows[first : first + size]


def _fill_rows(groups: Iterable[Sequence[Panel]], width: int) -> list[list[Panel]]:
    """Return rows in which no group is divided that fits in one.

    A small group fills the gap of one of the last rows, so that panels stay near their place in the
    order of the columns.
    """
    rows: list[list[Panel]] = []
    for group in groups:
        if len(group) <= width:
            row = next((row for row in rows[-GAP_ROWS:] if len(row) + len(group) <= width), None)
            if row is None:
                rows.append(row := [])
            row.extend(group)
            continue
        for panel in group:
            if not rows or len(rows[-1]) == width:
                rows.append([])
            rows[-1].append(panel)
    return rows


def _draw_page(page: Page) -> Any:
    """Return a figure with the rows of one page."""
    columns = max(len(row) for row in page.rows)
    # A page of one panel has room for its title.
    panel_width = PANEL_WIDTH_IN if columns > 1 else 1.5 * PANEL_WIDTH_IN
    width = columns * panel_width
    note = "\n".join(
        textwrap.fill(line, round(13 * width), break_on_hyphens=False)
        for line in page.note.split("\n")
    )
    top = TITLE_HEIGHT_IN
    curves = [curve for row in page.rows for panel in row for curve in panel.curves]
    # Panels with one abscissa have its numbers once, below each column.
    is_shared = page.cyclic or len({_get_ends(curve) for curve in curves}) == 1
    bottom = LABEL_HEIGHT_IN + (NOTE_LINE_IN * (note.count("\n") + 1.5) if note else 0.0)
    height = top + PANEL_HEIGHT_IN * len(page.rows) + bottom
    figure = make_figure(page.title, (width, height), layout=None)
    margins = PANEL_MARGINS_IN
    for row_index, row in enumerate(page.rows):
        for column_index, panel in enumerate(row):
            lower_end = height - top - (row_index + 1) * PANEL_HEIGHT_IN
            panel_axes = figure.add_axes(
                (
                    (column_index * panel_width + margins["left"]) / width,
                    (lower_end + margins["bottom"]) / height,
                    (panel_width - margins["left"] - margins["right"]) / width,
                    (PANEL_HEIGHT_IN - margins["bottom"] - margins["top"]) / height,
                )
            )
            is_lowest = all(len(lower) <= column_index for lower in page.rows[row_index + 1 :])
            draw_panel(panel_axes, panel, page.abscissa if is_lowest else "", cyclic=page.cyclic)
            if is_shared and not is_lowest:
                panel_axes.tick_params(axis="x", labelbottom=False)
    add_legend(figure, curves)
    if note:
        figure.supxlabel(
            note, fontsize=8, color="0.35", x=0.12 / width, y=0.06 / height, ha="left", va="bottom"
        )
    return figure


def _get_ends(curve: PanelCurve) -> tuple[float, float]:
    """Return the ends of the abscissa of a curve."""
    return float(curve.times[0]), float(curve.times[-1])


def draw_panel(panel_axes: Any, panel: Panel, abscissa: str, *, cyclic: bool = False) -> None:
    """Draw a panel into axes of matplotlib."""
    for index, curve in enumerate(panel.curves):
        if any(_coincide(curve, other) for other in panel.curves[:index]):
            # The curve below shows through, as in a symmetric motion.
            curve = curve._replace(style=DASHES)
        _draw_curve(panel_axes, curve, cyclic=cyclic)
    _draw_limits(panel_axes, panel)
    if cyclic and panel.band is not None:
        percent, mean, deviation, _ = panel.band
        panel_axes.fill_between(percent, mean - deviation, mean + deviation, color="0.85", lw=0.0)
        panel_axes.plot(percent, mean, color="0.6", lw=1.0, zorder=1.0)
    style_axes(panel_axes, abscissa)
    if panel.y_range is not None:
        first, last = panel.y_range
        margin = 0.05 * (last - first)
        lowest, highest = panel_axes.get_ylim()
        # Values outside of the range, such as those of a wrong table, are not cut off.
        panel_axes.set_ylim(min(first - margin, lowest), max(last + margin, highest))
    title = panel.title.replace("_", " ")
    unit = f" ({panel.unit})" if panel.unit else ""
    height = find_title_height(panel_axes)
    letters = LETTERS_PER_INCH * (PANEL_WIDTH_IN - PANEL_MARGINS_IN["left"])
    size = 10.0 * max(0.6, min(1.0, letters / len(title + unit)))
    panel_axes.set_title(f"{title}{unit}", fontsize=size, loc="left", y=height)
    group = panel.group.replace("_", " ")
    if group and group not in title and len(title + unit + group) < letters:
        panel_axes.set_title(group, fontsize=8, loc="right", color="0.5", y=height)


def _draw_limits(panel_axes: Any, panel: Panel) -> None:
    """Draw limits near the curves as lines; a distant limit would flatten the curves."""
    values = np.concatenate([[0.0], *(curve.values for curve in panel.curves)])
    lowest, highest = float(np.nanmin(values)), float(np.nanmax(values))
    max_distance = MAX_LIMIT_DISTANCE * (highest - lowest)
    for limit in panel.limits:
        if lowest - max_distance <= limit <= highest + max_distance:
            panel_axes.axhline(limit, color=LIMIT_COLOR, ls=DASHES, lw=1.0)


def _coincide(curve: PanelCurve, other: PanelCurve) -> bool:
    """Return whether two curves cannot be distinguished in a picture."""
    # Curves of different trials may have other times.
    if len(curve.values) != len(other.values):
        return False
    tolerance = 1e-3 * np.nanmax(np.abs(curve.values), initial=0.0)
    return bool(np.allclose(curve.values, other.values, rtol=0.0, atol=tolerance, equal_nan=True))


def _draw_curve(panel_axes: Any, curve: PanelCurve, *, cyclic: bool) -> None:
    """Draw a curve over time, or each gait cycle and their mean."""
    color, _ = SIDES[curve.side]
    if not cyclic:
        panel_axes.plot(curve.times, curve.values, color=color, ls=curve.style, lw=1.5)
        for side, steps in curve.steps.items():
            if side == (curve.side or side):
                for style, moments in (("-", steps.strikes), (":", steps.offs)):
                    for moment in moments:
                        if curve.times[0] <= moment <= curve.times[-1]:
                            panel_axes.axvline(
                                moment, color=SIDES[side][0], ls=style, lw=0.6, alpha=0.6
                            )
        return
    cycles = [
        np.interp(first + (last - first) * PERCENT / 100.0, curve.times, curve.values)
        # Each cycle is resampled at the same per cents, so that a mean can be taken.
        for first, last in _select_cycles(curve)
    ]
    if len(cycles) > 1:
        for cycle in cycles:
            panel_axes.plot(PERCENT, cycle, color=color, ls=curve.style, lw=0.7, alpha=0.5)
    panel_axes.plot(PERCENT, np.mean(cycles, axis=0), color=color, ls=curve.style, lw=1.8)


def add_legend(figure: Any, curves: Sequence[PanelCurve]) -> None:
    """Add a legend of sides and trials at the top right of a figure."""
    from matplotlib.lines import Line2D

    sides = [
        Line2D([], [], color=color, label=name)
        for side, (color, name) in SIDES.items()
        if name and any(curve.side == side for curve in curves)
    ]
    trials = dict.fromkeys((curve.label, curve.style) for curve in curves if curve.label)
    styles = (
        [Line2D([], [], color="#444444", ls=style, label=label) for label, style in trials]
        if len(trials) > 1
        else []
    )
    if sides or styles:
        figure.legend(
            handles=[*sides, *styles], loc="upper right", ncols=6, frameon=False, fontsize=9
        )


def style_axes(panel_axes: Any, label: str) -> None:
    """Set grid, ticks and abscissa of a panel."""
    panel_axes.grid(True, color="0.92", lw=0.8)
    panel_axes.set_axisbelow(True)
    panel_axes.spines[["top", "right"]].set_visible(False)
    panel_axes.tick_params(labelsize=8)
    # No common offset at the axis: it is easily overlooked.
    panel_axes.ticklabel_format(axis="y", useOffset=False, scilimits=EXPONENTS)
    panel_axes.margins(x=0.0)
    panel_axes.set_xlabel(label, fontsize=8)


def find_title_height(panel_axes: Any) -> float | None:
    """Return the height of the title of axes that `style_axes` has styled, in axes coordinates.

    Matplotlib measures all labels of the axes several times to find a height, which takes a third of the time
    of a page. Only a power of ten above the axis of ordinates can be in the way of the title.

    Returns:
        Height 1, or None where matplotlib must find it.
    """
    largest_limit = max(map(abs, panel_axes.get_ylim()))
    # Ticks may be smaller than the limits by a digit.
    smallest_exponent, largest_exponent = EXPONENTS
    return (
        1.0 if 10.0 ** (smallest_exponent + 2) <= largest_limit < 10.0**largest_exponent else None
    )


def make_figure(
    title: str, size: tuple[float, float], *, layout: str | None = "constrained"
) -> Any:
    """Return an empty figure of matplotlib.

    Args:
        title: bold title at the top left.
        size: width and height, inches.
        layout: layout engine of matplotlib that places the axes; None if the caller places them.

    Raises:
        MissingDependency: matplotlib is not installed.
    """
    # Figures without pyplot: no global state, and no window.
    figures = require("matplotlib.figure", extra="plot", purpose="a picture")
    require("matplotlib.backends.backend_agg", extra="plot", purpose="a picture")
    figure = figures.Figure(figsize=size, layout=layout)
    if layout is None:
        width, height = size
        figure.suptitle(
            title, fontsize=13, x=0.12 / width, y=1.0 - 0.1 / height, ha="left", fontweight="bold"
        )
    else:
        figure.suptitle(title, fontsize=13, x=0.02, ha="left", fontweight="bold")
    return figure


def name_pages(file_stem: str, figures: Iterable[Any]) -> Iterator[tuple[str, Any]]:
    """Yield figures with their file names: ``stem.png``, ``stem-2.png`` and so on."""
    for number, figure in enumerate(figures, 1):
        yield f"{file_stem}.png" if number == 1 else f"{file_stem}-{number}.png", figure


def write_pages(figures: Iterable[Any], folder: Path, file_stem: str) -> list[Path]:
    """Write figures into a folder as ``stem.png``, ``stem-2.png`` and so on.

    Args:
        figures: figures of matplotlib; they may be drawn while they are written.
        folder: existing folder to write into.
        file_stem: name of the first file, without its suffix.

    Returns:
        Paths of the written files.

    Raises:
        OsimliteError: a file cannot be written.
    """
    with plain_lettering():
        return [
            write_into(folder, name, render_png(figure))
            for name, figure in name_pages(file_stem, figures)
        ]


def render_png(figure: Any, dpi: float = DPI) -> bytes:
    """Return a figure of matplotlib as a PNG file."""
    agg = require("matplotlib.backends.backend_agg", extra="plot", purpose="a picture")
    buffer = io.BytesIO()
    # `savefig` would draw everything once more, only for the layout.
    figure.set_dpi(dpi)
    agg.FigureCanvasAgg(figure).print_png(buffer)
    return buffer.getvalue()
