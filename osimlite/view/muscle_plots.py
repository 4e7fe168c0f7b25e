"""Pictures of muscles over one coordinate or two."""

from __future__ import annotations

from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.files import make_folder
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.simulation.muscle_curves import QUANTITIES, MuscleCurves
from osimlite.view.lettering import plain_lettering
from osimlite.view.plots import (
    divide_among_panels,
    figure_of,
    finish_panels,
    lines_in,
    make_sheet,
    save_figure,
)

_TITLES = {
    "length": "Muscle-tendon length",
    "tendon_force": "Tendon force, at rest",
    "active_fiber_force": "Active fiber force along the tendon, at rest",
    "passive_fiber_force": "Passive fiber force along the tendon",
}
_MOST = 60
"""Muscles of one picture."""
_ACROSS = 4


def plot_muscles(
    curves: MuscleCurves,
    mechanism: Mechanism,
    folder: str | Path,
    other: MuscleCurves | None = None,
) -> list[Path]:
    """Draw each quantity over the coordinates that were swept.

    Args:
        curves: of one coordinate or two.
        mechanism: of their model.
        folder: where the pictures go; made if it is not there.
        other: of the same muscles and poses of another model, drawn thin and dashed.

    Returns:
        The PNG files, one for each quantity: ``moment_arm_knee_angle_r.png``, ``tendon_force.png``.

    Raises:
        MissingDependency: matplotlib is not installed.
        OsimliteError: the folder cannot be written to.
    """
    base = Path(folder)
    make_folder(base)
    written = []
    with plain_lettering():
        for quantity, rows in curves.columns.items():
            title = _title(quantity)
            if len(curves.coordinates) == 2:
                figure = _draw_maps(curves, mechanism, rows, title)
            else:
                figure = _draw_lines(
                    curves,
                    mechanism,
                    rows,
                    title,
                    None if other is None else other.columns[quantity],
                )
            written.append(save_figure(figure, base / f"{quantity}.png"))
    return written


def _title(quantity: str) -> str:
    if quantity in QUANTITIES:
        unit = QUANTITIES[quantity]
        title = _TITLES.get(quantity, quantity.replace("_", " ").capitalize())
    else:
        unit, title = "m", f"Moment arm about {quantity.removeprefix('moment_arm_')}"
    return f"{title} ({unit})" if unit else title


def _axis(curves: MuscleCurves, mechanism: Mechanism, place: int) -> tuple[str, Any]:
    """Label and values of a coordinate, angles in degrees."""
    name, values = curves.coordinates[place], curves.poses[:, place]
    info = mechanism.coordinates[mechanism.coordinate_index(name)]
    is_angle = info.motion_type == "rotational"
    return f"{name} (deg)" if is_angle else f"{name} (m)", np.degrees(
        values
    ) if is_angle else values


def _names(curves: MuscleCurves) -> list[str]:
    return [path.rpartition("/")[2] for path in curves.muscles]


def _draw_lines(
    curves: MuscleCurves, mechanism: Mechanism, rows: Any, title: str, other: Any
) -> Any:
    label, across = _axis(curves, mechanism, 0)
    parts = divide_among_panels(dict(zip(_names(curves)[:_MOST], rows.T, strict=False)))
    figure, axes = make_sheet(title, [3.0] * len(parts))
    for panel, part in zip(axes, parts, strict=True):
        lines_in(panel, across, part)
        if other is not None:
            beside = dict(zip(_names(curves), other.T, strict=True))
            lines_in(panel, across, {name: beside[name] for name in part}, ls="--", lw=0.9)
    finish_panels(axes, across, _add_note(curves), label)
    return figure


def _draw_maps(curves: MuscleCurves, mechanism: Mechanism, rows: Any, title: str) -> Any:
    (label, x), (other, y) = (_axis(curves, mechanism, place) for place in (0, 1))
    xs, ys = np.unique(x), np.unique(y)
    names = _names(curves)[:_MOST]
    down = ceil(len(names) / _ACROSS)
    figure = figure_of(title, (11.0, 0.9 + 2.4 * down))
    panels = figure.subplots(down, _ACROSS, sharex=True, sharey=True, squeeze=False)
    for panel in panels.ravel()[len(names) :]:
        panel.set_visible(False)
    for place, (panel, name) in enumerate(zip(panels.ravel(), names, strict=False)):
        drawn = panel.pcolormesh(
            xs, ys, rows[:, place].reshape(len(xs), len(ys)).T, shading="nearest", cmap="viridis"
        )
        figure.colorbar(drawn, ax=panel)
        panel.set_title(name, fontsize=9)
    figure.supxlabel(label)
    figure.supylabel(other)
    return figure


def _add_note(curves: MuscleCurves) -> str:
    left = len(curves.muscles) - _MOST
    return f"the first {_MOST} muscles; {left} more are in the table" if left > 0 else ""
