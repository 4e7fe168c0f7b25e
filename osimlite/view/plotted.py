"""Pages of plots, which notebooks show and which can be written as PNG files."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from osimlite.base.files import make_folder
from osimlite.base.writing import write_into
from osimlite.errors import OsimliteError
from osimlite.view.lettering import plain_lettering
from osimlite.view.panel_groups import group_columns
from osimlite.view.panels import draw_pages, name_pages, render_png
from osimlite.view.plots import draw_figures
from osimlite.view.table_plots import ColumnNames, describe_columns, make_title

if TYPE_CHECKING:
    from osimlite.io.tables.storage import StoTable
    from osimlite.simulation.trajectory import Movement, Trajectory


class Pages(list[tuple[str, Any]]):
    """File names and matplotlib figures of pages; notebooks show the figures."""

    def __repr__(self) -> str:
        return f"Pages: {', '.join(name for name, _ in self) or 'none, nothing changes over time'}"

    def _repr_html_(self) -> str:
        with plain_lettering():
            pictures = [
                (name, base64.b64encode(render_png(figure)).decode()) for name, figure in self
            ]
        return "".join(
            f"<img alt='{escape(name, quote=True)}' style='max-width:100%' "
            f"src='data:image/png;base64,{data}'>"
            for name, data in pictures
        ) or escape(repr(self))

    @property
    def figures(self) -> list[Any]:
        """Matplotlib figures of all pages, in order."""
        return [figure for _, figure in self]

    def write(self, folder: str | Path) -> list[Path]:
        """Write the pages as PNG files.

        Args:
            folder: folder to write into; it is made if it does not exist.

        Returns:
            Paths of the written files.

        Raises:
            OsimliteError: the folder or a file cannot be written.
        """
        base = make_folder(Path(folder))
        with plain_lettering():
            return [write_into(base, name, render_png(figure)) for name, figure in self]


def plot_trajectory(trajectory: Trajectory) -> Pages:
    """Return the pages of a simulation: coordinates, states, forces, probes and energies."""
    _require_times(len(trajectory.times))
    with plain_lettering():
        return Pages(draw_figures(trajectory, trajectory.mechanism))


def plot_movement(movement: Movement) -> Pages:
    """Return the pages of the coordinates of a motion."""
    from osimlite.io.tables.storage import StoTable

    table = StoTable(
        "Coordinates", movement.times, movement.coordinates, movement.in_degrees, in_degrees=True
    )
    names = ColumnNames.from_model(getattr(movement, "model", None), movement.mechanism)
    return _plot_columns(table, names)


def plot_table(table: StoTable) -> Pages:
    """Return the pages of a table over time."""
    motion = getattr(table, "motion", None)
    return _plot_columns(table, ColumnNames.from_model(None, getattr(motion, "mechanism", None)))


def _plot_columns(table: StoTable, names: ColumnNames) -> Pages:
    _require_times(len(table.times))
    panels, notes = group_columns(describe_columns(table, names), table.times)
    file_stem = (
        Path(table.file).stem if table.file else table.name.lower().replace(" ", "_") or "table"
    )

    def draw() -> Iterator[tuple[str, Any]]:
        yield from name_pages(file_stem, draw_pages(make_title(file_stem), panels, notes=notes))

    with plain_lettering():
        return Pages(draw())


def _require_times(count: int) -> None:
    """Raise an error if a motion or table has no rows.

    Raises:
        OsimliteError: there are no rows.
    """
    if not count:
        raise OsimliteError("the motion has no rows; nothing can be drawn")
