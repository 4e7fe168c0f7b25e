"""Pictures of a simulation: coordinates, states of muscles, forces, probes and energy over time."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.files import make_folder, write_atomically
from osimlite.base.require import require
from osimlite.errors import OsimliteError
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.view.lettering import plain_lettering
from osimlite.view.motion import ContactForce, Motion, contact_forces, in_mechanism_order

COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Colours that colour-blind people tell apart (Okabe and Ito, 2008), without the yellow, too pale for lines."""

STYLES = ("-", "--", ":")
"""Once all colours are used they come again in another style."""

LINES_IN_PANEL = 7

MOST_ENERGIES = 400
"""Moments at which energy is worked out; more would not show."""

STORED = "stored in contacts, springs, muscles"

_UNITS = {
    "fiber_length": " (m)",
    "fiber_velocity": " (m/s)",
    "stretch": " (m)",
    "dissipatedEnergy": " (J)",
}
"""Of the states of forces that have one."""

_NEVER_MIND = 1e-9
"""A force below this part of the largest counts as none."""


def plot_simulation(
    trajectory: Motion, folder: str | Path, *, mechanism: Mechanism | None = None
) -> list[Path]:
    """Draw the coordinates, states of muscles, forces, probes and energy of a motion over time.

    Args:
        trajectory: the motion.
        folder: where the pictures go; made if it is not there.
        mechanism: what moves; the trajectory's own if left out. Without any, coordinates cannot be
            told into angles and lengths, and there is no picture of the energy.

    Returns:
        The PNG files: ``coordinates.png``, and as far as there is something to show ``states.png``,
        ``contact_forces.png``, ``other_forces.png``, ``probes.png`` and ``energy.png``.

    Raises:
        MissingDependency: matplotlib is not installed.
        OsimliteError: the motion has no moments, or the folder cannot be written to.
    """
    if len(trajectory.times) == 0:
        raise OsimliteError("the motion has no moments; nothing can be drawn")
    known = mechanism if mechanism is not None else getattr(trajectory, "mechanism", None)
    base = Path(folder)
    make_folder(base)
    written = []
    with plain_lettering():
        for name, figure in draw_figures(trajectory, known):
            written.append(save_figure(figure, base / name))
    return written


def save_figure(figure: Any, path: Path, dpi: float = 150) -> Path:
    """Write a figure of matplotlib as PNG, whole or not at all."""
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=dpi)
    write_atomically(path, out.getvalue())
    return path


def compute_energies(motion: Motion, mechanism: Mechanism) -> tuple[Array, dict[str, Array]]:
    """Moments (m,) and, at them, kinetic energy and potential energy of gravity (J), zero at the origin of the ground.

    A trajectory knows what contacts and springs store besides; of another motion that cannot be
    told.
    """
    times = np.asarray(motion.times, dtype=float)
    known = getattr(motion, "energy", None)
    if known is not None:
        kinetic, height = np.asarray(known["kinetic"]), np.asarray(known["gravity"])
        parts = {"kinetic": kinetic, "potential of gravity": height}
        return times, {**parts, STORED: np.asarray(known["stored"])}
    places = np.unique(np.linspace(0, len(times) - 1, min(len(times), MOST_ENERGIES)).astype(int))
    q = in_mechanism_order(motion, mechanism, np.asarray(motion.values)[places])
    u = in_mechanism_order(motion, mechanism, np.asarray(motion.speeds)[places])
    kinetic = np.array([mechanism.kinetic_energy(*state) for state in zip(q, u, strict=True)])
    height = np.array([mechanism.potential_energy(row) for row in q])
    return times[places], {"kinetic": kinetic, "potential of gravity": height}


def draw_figures(motion: Motion, mechanism: Mechanism | None) -> Iterator[tuple[str, Any]]:
    """Yield file name and figure of each plot of a motion."""
    times = np.asarray(motion.times, dtype=float)
    yield "coordinates.png", _plot_coordinates(times, motion, mechanism)
    states = getattr(motion, "auxiliary", {})
    if states:
        yield "states.png", _plot_states(times, states)
    contacts = list(_one_of_each_pair(contact_forces(motion)))
    if contacts:
        yield "contact_forces.png", _plot_contacts(times, contacts)
    others = {
        label: np.asarray(column)
        for label, column in motion.forces.items()
        if ".force." not in label and ".torque." not in label and "PotentialEnergy" not in label
    }
    acting = {label: column for label, column in others.items() if np.any(column)}
    if acting:
        idle = [label for label in others if label not in acting]
        note = f"never acting: {', '.join(idle)}" if idle else ""
        kinds = {"force (N) or torque (N·m)": acting}
        yield (
            "other_forces.png",
            _make_panels(times, "Forces of muscles, springs and others", kinds, note),
        )
    probes = getattr(motion, "probes", {})
    if probes:
        yield "probes.png", _make_panels(times, "Probes", {"what a probe reports": probes})
    if mechanism is not None:
        yield "energy.png", _plot_energy(*compute_energies(motion, mechanism))


def _plot_coordinates(times: Array, motion: Motion, mechanism: Mechanism | None) -> Any:
    kinds: dict[str, dict[str, Array]] = {}
    held = []
    for k, name in enumerate(motion.coordinates):
        column = np.asarray(motion.values)[:, k]
        if mechanism is None:
            kinds.setdefault("value (rad, m)", {})[name] = column
            continue
        info = mechanism.coordinates[mechanism.coordinate_index(name)]
        if info.motion_type == "rotational":
            label, column, unit = "angle (deg)", np.degrees(column), "deg"
        elif info.motion_type == "translational":
            label, unit = "displacement (m)", "m"
        else:
            label, unit = "coupled (rad, m)", ""
        if info.locked:
            held.append(f"{name} is locked at {column[0]:.4g} {unit}".rstrip())
        else:
            kinds.setdefault(label, {})[name] = column
    return _make_panels(times, "Coordinates", kinds, "; ".join(held))


def _plot_states(times: Array, states: Mapping[str, Array]) -> Any:
    kinds: dict[str, dict[str, Array]] = {}
    for path, column in states.items():
        owner, _, kind = path.rpartition("/")
        label = kind.replace("_", " ") + _UNITS.get(kind, "")
        kinds.setdefault(label, {})[owner.rpartition("/")[2]] = column
    return _make_panels(times, "States of muscles and other forces", kinds)


def _one_of_each_pair(forces: Sequence[ContactForce]) -> Iterator[ContactForce]:
    """Of an element that pushes two frames with opposite forces, the first; of any other, all."""
    by_element: dict[str, list[ContactForce]] = {}
    for force in forces:
        by_element.setdefault(force.element, []).append(force)
    for group in by_element.values():
        opposite = len(group) == 2 and np.allclose(group[0].vectors, -group[1].vectors)
        yield from group[:1] if opposite else group


def _plot_contacts(times: Array, forces: Sequence[ContactForce]) -> Any:
    sizes = {
        f"{force.element} on {force.frame}": np.linalg.norm(force.vectors, axis=1)
        for force in forces
    }
    threshold = _NEVER_MIND * max(float(size.max()) for size in sizes.values())
    acting = {label: size for label, size in sizes.items() if size.max() > threshold}
    figure, (above, below) = make_sheet("Contact forces", [3.4, 0.5 + 0.25 * max(1, len(acting))])
    lines_in(above, times, acting)
    above.set_ylabel("force (N)")
    above.set_ylim(bottom=0.0)
    for row, size in enumerate(acting.values()):
        spans = [
            (times[first], max(times[last] - times[first], 1e-3))
            for first, last in _find_spans(size > threshold)
        ]
        below.broken_barh(spans, (row - 0.35, 0.7), facecolors=_choose_style(row)["color"])
    below.set_yticks(range(len(acting)), [label.split(" on ")[0] for label in acting])
    below.set_ylim(len(acting) - 0.5, -0.5)
    below.set_ylabel("in contact")
    idle = [label.split(" on ")[0] for label in sizes if label not in acting]
    finish_panels((above, below), times, f"never in contact: {', '.join(idle)}" if idle else "")
    return figure


def _make_panels(
    times: Array, title: str, kinds: Mapping[str, Mapping[str, Array]], note: str = ""
) -> Any:
    """A figure with as many panels as the lines of each kind, which has one unit, take."""
    panels = [
        (label, part) for label, lines in kinds.items() for part in divide_among_panels(lines)
    ]
    figure, axes = make_sheet(title, [3.0] * max(1, len(panels)))
    for panel, (label, lines) in zip(axes, panels, strict=False):
        lines_in(panel, times, lines)
        panel.set_ylabel(label)
    finish_panels(axes, times, note)
    return figure


def _plot_energy(times: Array, parts: Mapping[str, Array]) -> Any:
    figure, (panel,) = make_sheet("Energy", [3.6])
    lines_in(panel, times, {**parts, "sum": np.sum(list(parts.values()), axis=0)})
    panel.set_ylabel("energy (J)")
    note = "gravity: zero at the origin of the ground"
    if STORED not in parts:
        note += "; energy stored in contacts and limit springs is not in the sum"
    finish_panels((panel,), times, note)
    return figure


def figure_of(title: str, size: tuple[float, float]) -> Any:
    """An empty figure (width and height in inches)."""
    figures = require("matplotlib.figure", extra="plot", purpose="a picture")
    require("matplotlib.backends.backend_agg", extra="plot", purpose="a picture")
    figure = figures.Figure(figsize=size, layout="constrained")
    figure.suptitle(title, fontsize=13, x=0.02, ha="left", fontweight="bold")
    return figure


def make_sheet(title: str, heights: Sequence[float]) -> tuple[Any, Any]:
    """A figure with panels of these heights (inches) above each other, and its panels."""
    figure = figure_of(title, (9.0, 0.7 + sum(heights)))
    grid = {"height_ratios": list(heights)}
    panels = figure.subplots(len(heights), 1, sharex=True, squeeze=False, gridspec_kw=grid)[:, 0]
    return figure, panels


def divide_among_panels(lines: Mapping[str, Array]) -> list[dict[str, Array]]:
    """The lines of each panel: as many in one as in another, and no more than a reader can follow."""
    items = list(lines.items())
    size = ceil(len(items) / ceil(len(items) / LINES_IN_PANEL))
    return [dict(items[first : first + size]) for first in range(0, len(items), size)]


def _choose_style(number: int) -> dict[str, Any]:
    style = STYLES[number // len(COLORS) % len(STYLES)]
    return {"color": COLORS[number % len(COLORS)], "ls": style, "lw": 1.6}


def lines_in(panel: Any, across: Array, lines: Mapping[str, Array], **style: Any) -> None:
    """Draw lines over times, or whatever is across; with a style of their own they are not in the legend."""
    drawn: list[Array] = []
    for number, (label, column) in enumerate(lines.items()):
        looks = _choose_style(number)
        near = 1e-3 * np.nanmax(np.abs(column), initial=0.0)
        if below := sum(
            np.allclose(column, other, rtol=0.0, atol=near, equal_nan=True) for other in drawn
        ):
            # What lies below shows through.
            looks["ls"] = (0.0, (6.0 / (below + 1), 6.0 * below / (below + 1)))
        drawn.append(column)
        # Matplotlib leaves a label that begins with an underscore out of the legend.
        shown = f" {label}" if label.startswith("_") else label
        panel.plot(across, column, label=None if style else shown, **(looks | style))
    # Beside the panel, where it covers no data.
    panel.legend(
        loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, frameon=False, fontsize=9
    )


def finish_panels(panels: Sequence[Any], across: Array, note: str, label: str = "time (s)") -> None:
    """Give panels their grids, the lowest its label, and a note below."""
    for panel in panels:
        panel.grid(True, color="0.9", lw=0.8)
        panel.set_axisbelow(True)
        panel.spines[["top", "right"]].set_visible(False)
        panel.margins(x=0.0)
    if across[-1] > across[0]:
        panels[-1].set_xlim(across[0], across[-1])
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
    """First and last place of every run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(int), [0]))))
    return [(int(first), int(end) - 1) for first, end in edges.reshape(-1, 2)]
