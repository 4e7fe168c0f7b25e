"""Mends of tables: after them OpenSim reads the table that was meant."""

from __future__ import annotations

import re

import pytest

from tests.lint.test_table_fixes import BROKEN, MARKERS, MOTION, mend

pytestmark = pytest.mark.oracle

opensim = pytest.importorskip("opensim")


def read(path):
    """What OpenSim reads: labels, times, all numbers, and whether they are degrees."""
    opensim.Logger.setLevelString("Off")
    if path.suffix == ".trc":
        markers = opensim.TimeSeriesTableVec3(str(path))
        table = markers.flatten()
        matrix = table.getMatrix()
        numbers = matrix.to_numpy().copy().tolist()
        labels, times = list(table.getColumnLabels()), list(table.getIndependentColumn())
        return labels, times, numbers, markers.getTableMetaDataString("Units")
    storage = opensim.Storage(str(path))
    labels = [storage.getColumnLabels().get(place) for place in range(storage.getColumnLabels().getSize())]
    rows = [storage.getStateVector(row) for row in range(storage.getSize())]
    numbers = [[row.getData().get(place) for place in range(row.getSize())] for row in rows]
    return labels, [row.getTime() for row in rows], numbers, storage.isInDegrees()


def strictly(path):
    """The numbers that OpenSim's newer reader reads."""
    # What Python does not hold is gone while its numbers are still looked at.
    table = opensim.TimeSeriesTable(str(path))
    matrix = table.getMatrix()
    return matrix.to_numpy().copy().tolist()


@pytest.mark.parametrize(("what", "data", "old", "new"), BROKEN, ids=[each[0] for each in BROKEN])
def test_opensim_reads_what_was_meant(what, data, old, new, tmp_path):
    name = "a.trc" if data is MARKERS else "a.sto"
    (tmp_path / name).write_bytes(data)
    meant = read(tmp_path / name)
    (tmp_path / name).write_bytes(mend(name, re.sub(old, new, data)))
    assert read(tmp_path / name) == meant


@pytest.mark.parametrize("version", [b"1", b"3\nDataType=double"])
@pytest.mark.parametrize("line", [b"osimlite: ignore OSIM809", b"# osimlite: ignore OSIM809, OSIM804"])
def test_opensim_passes_over_a_line_that_ignores_a_finding(line, version, tmp_path):
    path = tmp_path / "a.sto"
    data = MOTION.replace(b"version=1", b"version=" + version)
    path.write_bytes(data)
    meant = read(path), strictly(path)
    path.write_bytes(data.replace(b"nRows", line + b"\nnRows", 1))
    assert (read(path), strictly(path)) == meant
