"""Reference bands: mean and standard deviation of quantities over the gait cycle, from a user's file."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from osimlite.base.files import read_file
from osimlite.base.named_tuples import NamedTuple
from osimlite.base.text import format_count, join_words
from osimlite.errors import DocumentError, SettingError
from osimlite.mechanics.multibody.spatial import Array

MEAN = "_mean"
"""End of the labels of means."""
DEVIATION = "_sd"
"""End of the labels of standard deviations."""


class Band(NamedTuple):
    """Mean and standard deviation of one quantity over the gait cycle, in the unit of its panel."""

    percent: Array  # points of the gait cycle (n,), %
    mean: Array  # mean (n,)
    deviation: Array  # standard deviation (n,)
    source: str = ""  # source of the numbers, shown below the panels


def read_bands(path: str | Path) -> dict[str, Band]:
    """Read bands from a CSV file.

    The first column is the per cent of the gait cycle. The others are named after the titles of
    panels, with ``_mean`` and ``_sd`` at the end. Lines before them that begin with ``#`` name the
    source of the numbers, which is otherwise the name of the file.

    Args:
        path: path of the CSV file.

    Returns:
        Bands by the title of their panel.

    Raises:
        DocumentError: the file has no such columns, or a cell is not a number.
    """
    file = str(path)
    # Spreadsheet programs write a byte order mark, which would become part of the first label.
    lines = io.StringIO(read_file(path).decode("utf-8-sig", "replace")).readlines()
    comments = [line.lstrip("# \t").strip() for line in lines if line.startswith("#")]
    source = " ".join(comments).removeprefix("source:").strip() or Path(path).name
    rows = [row for row in csv.reader(line for line in lines if not line.startswith("#")) if row]
    labels = [label.strip() for label in rows[0]] if rows else []
    names = [label.removesuffix(MEAN) for label in labels[1:] if label.endswith(MEAN)]
    missing_labels = [f"{name}{DEVIATION}" for name in names if f"{name}{DEVIATION}" not in labels]
    # One line of labels, and two points between which a band can be drawn.
    if not names or missing_labels or len(rows) < 3:
        problem = (
            f"column '{missing_labels[0]}' is missing"
            if missing_labels
            else "the file has no pair of a mean and a standard deviation"
        )
        raise DocumentError(
            f"{problem}; write per cent, NAME{MEAN} and NAME{DEVIATION} in the first line, and one row "
            "for each point of the gait cycle",
            file=file,
        )
    for row in rows[1:]:
        if len(row) != len(labels):
            raise DocumentError(
                f"a row has {format_count(len(row), 'cell')}, expected one for each of the "
                f"{len(labels)} columns",
                file=file,
            )
    numbers = np.array([[_to_number(cell, file) for cell in row] for row in rows[1:]])
    if not (np.isfinite(numbers).all() and (np.diff(numbers[:, 0]) > 0.0).all()):
        raise DocumentError("expected finite numbers, and per cents that increase", file=file)
    columns = dict(zip(labels, numbers.T, strict=True))
    return {
        name: Band(numbers[:, 0], columns[f"{name}{MEAN}"], columns[f"{name}{DEVIATION}"], source)
        for name in names
    }


def _to_number(cell: str, file: str) -> float:
    """Return the number in a cell.

    Raises:
        DocumentError: the cell does not contain a number.
    """
    try:
        return float(cell)
    except ValueError:
        raise DocumentError(f"expected a number in each cell, found '{cell}'", file=file) from None


def check_bands(bands: Mapping[str, Band], titles: Sequence[str], *, cyclic: bool) -> None:
    """Raise an error if no band can be drawn.

    Args:
        bands: bands by title.
        titles: titles of all panels.
        cyclic: whether any panel is over the gait cycle.

    Raises:
        SettingError: no panel has the name of a band, or no panel is over the gait cycle.
    """
    if not bands.keys() & {*titles}:
        raise SettingError(
            f"the bands are named {join_words([*bands], max_count=3)}, but no panel has such a name; the panels are "
            f"{join_words(list(dict.fromkeys(titles)), max_count=12)}"
        )
    if not cyclic:
        raise SettingError(
            "a band needs a complete gait cycle of each side; name the measured loads of the feet"
        )
