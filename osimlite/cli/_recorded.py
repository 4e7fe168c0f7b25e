"""What the commands on recorded motions share: writing tables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from osimlite.base.files import make_folder
from osimlite.base.text import join_words
from osimlite.cli._console import say
from osimlite.io.tables.storage import StoTable, write_sto
from osimlite.simulation.recorded_motion import RecordedMotion


def written(
    recorded: RecordedMotion, tables: Mapping[str, StoTable], folder: Path, *, trc: bool = False
) -> None:
    """Write tables into a folder, that of markers as markers.trc too, and say what they are made from."""
    make_folder(folder)
    for name, table in tables.items():
        write_sto(
            folder / name,
            table.name,
            table.times,
            table.columns,
            table.rows.tolist(),
            in_degrees=table.in_degrees,
        )
    names = list(tables)
    if trc:
        from osimlite.io.tables.writers import write_trc

        markers = tables["markers.sto"]
        labels = [label.removesuffix("_X") for label in markers.columns[::3]]
        write_trc(folder / "markers.trc", markers.times.tolist(), labels, markers.rows.tolist())
        names.append("markers.trc")
    say_motion(recorded, [folder / name for name in names])


def say_motion(recorded: RecordedMotion, files: Iterable[Path]) -> None:
    """Say what was made from a motion, and what of it counted."""
    if recorded.missing:
        say(f"not in the motion, default value used: {join_words(recorded.missing)}")
    if recorded.ignored:
        say(f"ignored columns, which are not coordinates: {join_words(recorded.ignored)}")
    times = recorded.times
    paths = join_words([str(file) for file in files])
    say(f"{len(times)} times from {times[0]:g} s to {times[-1]:g} s; wrote {paths}")
