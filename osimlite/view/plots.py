"""Plots of a simulation: coordinates, states of muscles, forces, probes and energy over time."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from math import ceil
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from osimlite.base.files import make_folder
from osimlite.base.progress import watch_items
from osimlite.base.writing import write_into
from osimlite.errors import OsimliteError
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.view.lettering import plain_lettering
from osimlite.view.motion import ContactForce, DrawableMotion, contact_forces, order_columns
from osimlite.view.panel_groups import group_columns
from osimlite.view.panels import COLORS, STYLES, draw_pages, make_figure, name_pages, render_png
from osimlite.view.table_plots import ColumnNames, describe_columns

Line = TypeVar("Line")
"""Type of the data of one line."""

LINES_IN_PANEL = 7
"""Number of lines in a panel: more cannot be told apart."""

MAX_ENERGY_TIMES = 400
"""Largest number of times at which energies are computed; more would not be visible."""

STORED = "stored in contacts, springs, muscles"

_CONTACT_THRESHOLD = 1e-9
"""Force, relative to the largest one, below which there is no contact."""


def plot_simulation(
    trajectory: DrawableMotion, folder: str | Path, *, mechanism: Mechanism | None = None
) -> list[Path]:
    """Draw the coordinates, states of muscles, forces, probes and energy of a motion over time.

    Args:
        trajectory: motion to plot.
        folder: output folder for the pictures; it is made if it does not exist.
        mechanism: mechanism that moves; by default that of `trajectory`. Without any, coordinates
            have no units, and there is no picture of the energy.

    Returns:
        The PNG files of the quantities that the motion has: ``coordinates.png``, ``states.png``,
        ``contact_forces.png``, ``other_forces.png``, ``probes.png`` and ``energy.png``; further
        pages are ``states-2.png`` and so on.

    Raises:
        MissingDependency: matplotlib is not installed.
        OsimliteError: the motion has no moments, or the folder cannot be written to.
    """
    if len(trajectory.times) == 0:
        raise OsimliteError("the motion has no rows; nothing can be drawn")
    plotted_mechanism = (
        mechanism if mechanism is not None else getattr(trajectory, "mechanism", None)
    )
    base = Path(folder)
    make_folder(base)
    with plain_lettering():
        return [
            write_into(base, name, render_png(figure))
            for name, figure in draw_figures(trajectory, plotted_mechanism)
        ]


def compute_energies(
    motion: DrawableMotion, mechanism: Mechanism
) -> tuple[Array, dict[str, Array]]:
    """Compute the energies of a motion; potential energy is zero at the origin of ground.

    Only a simulated trajectory has the energy that contacts and springs store. Other motions are
    evaluated at `MAX_ENERGY_TIMES` times at most.

    Returns:
        Times (m,), s, and the energies (m,), J, by name.
    """
    times = np.asarray(motion.times, dtype=float)
    recorded = getattr(motion, "energy", None)
    # A simulated trajectory has its energies; other motions need them computed at fewer moments.
    if recorded is not None:
        kinetic, height = np.asarray(recorded["kinetic"]), np.asarray(recorded["gravity"])
        energies = {"kinetic": kinetic, "potential of gravity": height}
        return times, {**energies, STORED: np.asarray(recorded["stored"])}
    indices = np.unique(
        np.linspace(0, len(times) - 1, min(len(times), MAX_ENERGY_TIMES)).astype(int)
    )
    q = order_columns(motion, mechanism, np.asarray(motion.values)[indices])
    u = order_columns(motion, mechanism, np.asarray(motion.speeds)[indices])
    kinetic = np.array([mechanism.kinetic_energy(*state) for state in zip(q, u, strict=True)])
    height = np.array([mechanism.potential_energy(row) for row in q])
    return times[indices], {"kinetic": kinetic, "potential of gravity": height}


def draw_figures(motion: DrawableMotion, mechanism: Mechanism | None) -> Iterator[tuple[str, Any]]:
    """Yield file name and figure of each page of the plots of a motion."""
    times = np.asarray(motion.times, dtype=float)
    names = ColumnNames.from_model(getattr(motion, "model", None), mechanism)
    values = np.asarray(motion.values, dtype=float)
    coordinates = dict(zip(motion.coordinates, values.T, strict=True))
    other_forces = {
        label: column
        for label, column in motion.forces.items()
        if ".force." not in label and ".torque." not in label and "PotentialEnergy" not in label
    }
    plots = [
        _draw_table("Coordinates", times, coordinates, names),
        _draw_table("States", times, getattr(motion, "auxiliary", {}), names),
        _draw_contacts(times, motion),
        _draw_table("Other forces", times, other_forces, names, "ModelForces"),
        _draw_table("Probes", times, getattr(motion, "probes", {}), names, "ModelProbes"),
        _draw_energies(motion, mechanism),
    ]
    for pages in watch_items("drawing", plots, " plots"):
        yield from pages


def _draw_contacts(times: Array, motion: DrawableMotion) -> Iterator[tuple[str, Any]]:
    """Yield file name and figure of the contact forces, if there are any."""
    contacts = list(_one_of_each_pair(contact_forces(motion)))
    if contacts:
        yield "contact_forces.png", _plot_contacts(times, contacts)


def _draw_energies(
    motion: DrawableMotion, mechanism: Mechanism | None
) -> Iterator[tuple[str, Any]]:
    """Yield file name and figure of the energies, if the mechanism is known."""
    if mechanism is not None:
        yield "energy.png", _plot_energy(*compute_energies(motion, mechanism))


def _draw_table(
    title: str, times: Array, columns: Mapping[str, Array], names: ColumnNames, name: str = ""
) -> Iterator[tuple[str, Any]]:
    """Yield file name and figure of each page of columns."""
    if not columns:
        return
    rows = np.column_stack([np.asarray(column, dtype=float) for column in columns.values()])
    table = StoTable(name or title, times, tuple(columns), rows)
    panels, notes = group_columns(describe_columns(table, names), times)
    file_stem = title.lower().replace(" ", "_")
    yield from name_pages(file_stem, draw_pages(title, panels, notes=notes))


def _one_of_each_pair(forces: Sequence[ContactForce]) -> Iterator[ContactForce]:
    """Yield the forces; of two opposite forces of one element only the first."""
    by_element: dict[str, list[ContactForce]] = {}
    for force in forces:
        by_element.setdefault(force.element, []).append(force)
    for group in by_element.values():
        # Force and reaction would be two curves, one over the other.
        opposite = len(group) == 2 and np.allclose(group[0].vectors, -group[1].vectors)
        yield from group[:1] if opposite else group


def _plot_contacts(times: Array, forces: Sequence[ContactForce]) -> Any:
    sizes = {
        f"{force.element} on {force.frame}": np.linalg.norm(force.vectors, axis=1)
        for force in forces
    }
    # Sizes below the threshold are noise of contacts that do not touch.
    threshold = _CONTACT_THRESHOLD * max(float(size.max()) for size in sizes.values())
    active_sizes = {label: size for label, size in sizes.items() if size.max() > threshold}
    figure, (force_panel, contact_panel) = make_sheet(
        "Contact forces", [3.4, 0.5 + 0.25 * max(1, len(active_sizes))]
    )
    draw_lines(force_panel, times, active_sizes)
    force_panel.set_ylabel("force (N)")
    force_panel.set_ylim(bottom=0.0)
    for row, size in enumerate(active_sizes.values()):
        intervals = [
            # A contact at a single time still gets a visible bar.
            (times[first], max(times[last] - times[first], 1e-3))
            for first, last in _find_spans(size > threshold)
        ]
        contact_panel.broken_barh(
            intervals, (row - 0.35, 0.7), facecolors=_choose_style(row)["color"]
        )
    contact_panel.set_yticks(
        range(len(active_sizes)), [label.split(" on ")[0] for label in active_sizes]
    )
    contact_panel.set_ylim(len(active_sizes) - 0.5, -0.5)
    contact_panel.set_ylabel("in contact")
    idle_labels = [label.split(" on ")[0] for label in sizes if label not in active_sizes]
    finish_panels(
        (force_panel, contact_panel),
        times,
        f"never in contact: {', '.join(idle_labels)}" if idle_labels else "",
    )
    return figure


def _plot_energy(times: Array, energies: Mapping[str, Array]) -> Any:
    figure, (panel,) = make_sheet("Energy", [3.6])
    draw_lines(panel, times, {**energies, "sum": np.sum(list(energies.values()), axis=0)})
    panel.set_ylabel("energy (J)")
    note = "gravity: zero at the origin of the ground"
    if STORED not in energies:
        note += "; energy stored in contacts and limit springs is not in the sum"
    finish_panels((panel,), times, note)
    return figure


def make_sheet(title: str, heights: Sequence[float]) -> tuple[Any, Any]:
    """Make a figure with panels one above the other.

    Args:
        title: title of the figure.
        heights: heights of the panels, inches.

    Returns:
        The figure and the array of its panels.
    """
    figure = make_figure(title, (9.0, 0.7 + sum(heights)))
    grid = {"height_ratios": list(heights)}
    panels = figure.subplots(len(heights), 1, sharex=True, squeeze=False, gridspec_kw=grid)[:, 0]
    return figure, panels


def divide_among_panels(lines: Mapping[str, Line]) -> list[dict[str, Line]]:
    """Return the lines of each panel: equal numbers, at most `LINES_IN_PANEL` in one."""
    named_lines = list(lines.items())
    # All panels get about equal numbers of lines.
    size = ceil(len(named_lines) / ceil(len(named_lines) / LINES_IN_PANEL))
    return [dict(named_lines[first : first + size]) for first in range(0, len(named_lines), size)]


def _choose_style(number: int) -> dict[str, Any]:
    style = STYLES[number // len(COLORS) % len(STYLES)]
    return {"color": COLORS[number % len(COLORS)], "ls": style, "lw": 1.6}


def draw_lines(panel: Any, abscissa: Array, lines: Mapping[str, Array], **style: Any) -> None:
    """Draw lines over an abscissa. Lines with an explicit style are left out of the legend."""
    drawn_columns: list[Array] = []
    for number, (label, column) in enumerate(lines.items()):
        line_style = _choose_style(number)
        tolerance = 1e-3 * np.nanmax(np.abs(column), initial=0.0)
        if hidden_count := sum(
            np.allclose(column, other_column, rtol=0.0, atol=tolerance, equal_nan=True)
            for other_column in drawn_columns
        ):
            # A line that lies over others is dashed, the more of them, the shorter its dashes.
            line_style["ls"] = (
                0.0,
                (6.0 / (hidden_count + 1), 6.0 * hidden_count / (hidden_count + 1)),
            )
        drawn_columns.append(column)
        # Matplotlib leaves a label that begins with an underscore out of the legend.
        legend_label = f" {label}" if label.startswith("_") else label
        panel.plot(abscissa, column, label=None if style else legend_label, **(line_style | style))
    # Beside the panel, where it covers no data.
    panel.legend(
        loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, frameon=False, fontsize=9
    )


def finish_panels(
    panels: Sequence[Any], abscissa: Array, note: str, label: str = "time (s)"
) -> None:
    """Draw the grids of panels, the abscissa's label at the lowest one, and a note below."""
    for panel in panels:
        panel.grid(True, color="0.9", lw=0.8)
        panel.set_axisbelow(True)
        panel.spines[["top", "right"]].set_visible(False)
        panel.margins(x=0.0)
    if abscissa[-1] > abscissa[0]:
        panels[-1].set_xlim(abscissa[0], abscissa[-1])
    panels[-1].set_xlabel(label)
    if note:
        style = {"fontsize": 8, "color": "0.35", "va": "top"}
        note = textwrap.fill(note, 110, break_on_hyphens=False)
        panels[-1].annotate(
            note,
            (0.0, 0.0),
            (0, -32),
            xycoords="axes fraction",
            textcoords="offset points",
            **style,
        )


def _find_spans(mask: Array) -> list[tuple[int, int]]:
    """Return the first and last index of every run of true values."""
    # Edges are where the mask changes; a zero on both sides closes runs at the ends.
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(int), [0]))))
    return [(int(first), int(end) - 1) for first, end in edges.reshape(-1, 2)]
