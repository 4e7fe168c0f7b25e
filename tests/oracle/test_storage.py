"""Compare reading and writing of storage files with a live OpenSim 4.6."""

from __future__ import annotations

import numpy as np
import pytest

from osimlite.io.tables.writers import write_trc
from osimlite.simulation import read_sto, write_sto

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

# Suffix of OpenSim's table class and numbers per column, by type of data.
KINDS = {
    "double": ("", 1),
    "Vec3": ("Vec3", 3),
    "Quaternion": ("Quaternion", 4),
    "SpatialVec": ("SpatialVec", 6),
}


@pytest.mark.parametrize("kind", list(KINDS))
def test_opensim_reads_what_we_write_and_back(kind, tmp_path):
    ending, size = KINDS[kind]
    rng = np.random.default_rng(4)
    rows = rng.normal(size=(5, 2 * size))
    if kind == "Quaternion":
        # OpenSim normalises quaternions when it reads them.
        halves = rows.reshape(5, 2, 4)
        rows = (halves / np.linalg.norm(halves, axis=2, keepdims=True)).reshape(5, 8)
    times = [0.1 * k for k in range(5)]
    write_sto(tmp_path / "ours.sto", "t", times, ["a b", "c"], rows.tolist(), kind=kind)
    theirs = getattr(opensim, f"TimeSeriesTable{ending}")(str(tmp_path / "ours.sto"))
    assert tuple(theirs.getColumnLabels()) == ("a b", "c")
    flat = theirs if size == 1 else theirs.flatten()
    result = [flat.getRowAtIndex(row).to_numpy() for row in range(flat.getNumRows())]
    assert np.abs(np.array(result) - rows).max() < 1e-15
    adapter = getattr(opensim, f"STOFileAdapter{ending}")
    adapter.write(theirs, str(tmp_path / "theirs.sto"))
    table = read_sto(tmp_path / "theirs.sto")
    assert (table.kind, len(table.columns)) == (kind, 2 * size)
    assert table.times.tolist() == pytest.approx(times)
    assert np.abs(table.rows - rows).max() < 1e-9


OLD = "header\n{}\nnRows=2\nnColumns=3\n{}\nendheader\ntime\ta\tb\n0\t1\t2\n1\t3\t4\n"


@pytest.mark.parametrize("suffix", [".sto", ".mot"])
@pytest.mark.parametrize("version", ["version=1", "version=0", ""])
@pytest.mark.parametrize("said", ["inDegrees=no", "inDegrees=yes", "Angles are in degrees.", ""])
def test_degrees_of_older_files(suffix, version, said, tmp_path):
    path = tmp_path / f"old{suffix}"
    path.write_text(OLD.format(version, said))
    opensim.Logger.setLevelString("off")
    theirs = opensim.Storage(str(path))
    ours = read_sto(path)
    assert ours.in_degrees is theirs.isInDegrees()
    assert ours.name == theirs.getName()
    labels = theirs.getColumnLabels()
    assert ours.columns == tuple(labels.get(k) for k in range(1, labels.getSize()))


def test_opensim_reads_our_markers(tmp_path):
    times, rows = [0.0, 0.01, 0.02], np.random.default_rng(1).normal(size=(3, 6))
    rows[1, 3:] = np.nan
    write_trc(tmp_path / "markers.trc", times, ["knee.med", "heel"], rows.tolist())
    table = opensim.TimeSeriesTableVec3(str(tmp_path / "markers.trc"))
    assert tuple(table.getColumnLabels()) == ("knee.med", "heel")
    assert list(table.getIndependentColumn()) == times
    result = [
        [table.getRowAtIndex(row)[k][axis] for k in range(2) for axis in range(3)]
        for row in range(3)
    ]
    assert np.array_equal(result, rows, equal_nan=True)
    assert (
        table.getTableMetaDataAsString("DataRate") == "100"
        and table.getTableMetaDataAsString("Units") == "m"
    )
