"""Compare verdicts and numbers of random rows of vectors with a live OpenSim 4.6."""

from __future__ import annotations

import math
import random
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from osimlite.errors import DocumentError
from osimlite.io.tables.headers import SUFFIXES
from osimlite.lint import validate
from osimlite.simulation import read_sto

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

KINDS = [kind for kind in SUFFIXES if kind != "double"]
ROWS = 40
EDITS = [" ", "\t", ",", ".", "-", "x", "  ", " ,", ", ", "1", "e", "\r"]
UNITS = ("Quaternion", "UnitVec3")
"""Types that OpenSim divides by their length."""


def edit_row(draw: random.Random, row: str) -> str:
    """Insert or remove characters at random places."""
    characters = list(row)
    for _ in range(draw.choice((1, 1, 2, 3))):
        index = draw.randrange(len(characters) + 1)
        if draw.random() < 0.7:
            characters.insert(index, draw.choice(EDITS))
        else:
            del characters[index : index + 1]
    return "".join(characters)


def read_with_opensim(path: Path, kind: str) -> list[list[float]] | None:
    """Return times and numbers of the rows, or None if OpenSim rejects the table."""
    # Storage reads all types. Where Python has a class of tables for a type, the two must agree.
    try:
        storage = opensim.Storage(str(path))
    except RuntimeError:
        storage = None
    table = getattr(opensim, f"TimeSeriesTable{kind}", None)
    if table is not None:
        try:
            count = table(str(path)).getNumRows()
        except RuntimeError:
            count = None
        assert count == (storage and storage.getSize())
    if storage is None:
        return None
    rows = [storage.getStateVector(row) for row in range(storage.getSize())]
    return [
        [row.getTime(), *(row.getData().get(index) for index in range(row.getSize()))]
        for row in rows
    ]


def read_with_osimlite(path: Path, kind: str) -> list[list[float]] | None:
    """Return times and numbers of the rows as OpenSim would, or None if the table is refused."""
    try:
        table = read_sto(path)
    except DocumentError:
        return None
    rows = table.rows.reshape(len(table.times), -1, len(SUFFIXES[kind]))
    if kind in UNITS:
        rows = rows / np.linalg.norm(rows, axis=2, keepdims=True)
    return np.column_stack([table.times, rows.reshape(len(rows), -1)]).tolist()


@pytest.mark.parametrize("columns", [1, 2])
@pytest.mark.parametrize("kind", KINDS)
def test_random_rows_of_vectors(kind: str, columns: int, tmp_path: Path) -> None:
    """Refused rows are errors, NaN is a warning, and other findings are warnings about odd numbers."""
    opensim.Logger.setLevelString("off")
    draw = random.Random(f"{kind} {columns}")
    path = tmp_path / "table.sto"
    labels = "\t".join(["time", *"ab"[:columns]])
    vector = ",".join(draw.choice(["1", "2", "-3", "0.5", "4e-1"]) for _ in SUFFIXES[kind])
    cells = "\t".join([vector] * columns)
    verdicts = Counter[str]()
    for _ in range(ROWS):
        row, end = edit_row(draw, f"0.1\t{cells}"), draw.choice(["\n", "\r\n"])
        path.write_text(
            f"DataType={kind}\nversion=3\nendheader\n{labels}\n0\t{cells}{end}{row}{end}",
            newline="",
        )
        theirs = read_with_opensim(path, kind)
        ours = read_with_osimlite(path, kind)
        result = validate(path)
        verdict = "error" if result.errors else "warning" if result.warnings else "none"
        verdicts[verdict] += 1
        if theirs is None:
            assert (verdict, ours) == ("error", None), row
        elif math.isnan(theirs[-1][0]):
            # OpenSim reads the table, but nothing can use it.
            assert (verdict, ours) == ("error", None), row
        else:
            assert verdict == "warning" if np.isnan(theirs).any() else verdict != "error", row
            assert ours is not None, row
            assert np.allclose(ours, theirs, rtol=1e-12, atol=0.0, equal_nan=True), row
            # What C++ and Python read alike has no finding.
            time, *cells_of_row = row.rstrip("\r").removesuffix("\t").split("\t")
            parts = [cell.rstrip(" \r").removesuffix(",").split(",") for cell in cells_of_row]
            numbers = [time, *(part for cell in parts for part in cell)]
            assert (verdict == "none") == all(map(is_number, numbers)), row
    assert len(verdicts) == 3, verdicts


def is_number(text: str) -> bool:
    """Return whether a text is a finite number for Python."""
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False
