"""Check that OpenSim reads the intended table after fixes of tables."""

from __future__ import annotations

import re

import pytest

from tests.lint.support import BROKEN, MARKERS, MOTION, mend

pytestmark = pytest.mark.oracle

opensim = pytest.importorskip("opensim")


def read(path):
    """Return what OpenSim reads from a table: labels, times, rows, and its units.

    The units are those of a .trc file, or whether a storage file is in degrees.
    """
    opensim.Logger.setLevelString("Off")
    if path.suffix == ".trc":
        markers = opensim.TimeSeriesTableVec3(str(path))
        table = markers.flatten()
        matrix = table.getMatrix()
        numbers = matrix.to_numpy().copy().tolist()
        labels, times = list(table.getColumnLabels()), list(table.getIndependentColumn())
        return labels, times, numbers, markers.getTableMetaDataString("Units")
    storage = opensim.Storage(str(path))
    labels = [
        storage.getColumnLabels().get(index) for index in range(storage.getColumnLabels().getSize())
    ]
    rows = [storage.getStateVector(row) for row in range(storage.getSize())]
    numbers = [[row.getData().get(index) for index in range(row.getSize())] for row in rows]
    return labels, [row.getTime() for row in rows], numbers, storage.isInDegrees()


def strictly(path):
    """Return the numbers that OpenSim's newer reader, TimeSeriesTable, reads."""
    # Keep a reference to the table: otherwise Python frees its memory before the matrix is copied.
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
@pytest.mark.parametrize(
    "line", [b"osimlite: ignore OSIM809", b"# osimlite: ignore OSIM809, OSIM804"]
)
def test_opensim_passes_over_a_line_that_ignores_a_finding(line, version, tmp_path):
    path = tmp_path / "a.sto"
    data = MOTION.replace(b"version=1", b"version=" + version)
    path.write_bytes(data)
    meant = read(path), strictly(path)
    path.write_bytes(data.replace(b"nRows", line + b"\nnRows", 1))
    assert (read(path), strictly(path)) == meant


SETUP = """<OpenSimDocument Version="40600">
\t<InverseKinematicsTool name="ik">
\t\t<accuracy>0.001</accuracy>
\t\t<constraint_weight>20</constraint_weight>
\t\t<marker_file>leg.trc</marker_file>
\t\t<output_motion_file>ik.mot</output_motion_file>
\t\t<IKTaskSet> <objects> <IKMarkerTask name="asis"> <weight>3</weight> </IKMarkerTask> </objects> </IKTaskSet>
\t</InverseKinematicsTool>
</OpenSimDocument>
"""


def tool_in(path):
    """Return the settings of an InverseKinematicsTool after OpenSim has read its setup."""
    tool = opensim.InverseKinematicsTool(str(path), False)
    tasks = tool.getIKTaskSet()
    weights = [
        (tasks.get(index).getName(), tasks.get(index).getWeight())
        for index in range(tasks.getSize())
    ]
    values = [
        tool.getPropertyByName(name).toString()
        for name in ("accuracy", "constraint_weight", "marker_file")
    ]
    return *values, tool.getOutputMotionFileName(), weights


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("accuracy>", "Accuracy>"),
        ("constraint_weight>", "constrain_weight>"),
        ("IKMarkerTask", "IKMarkerTaks"),
        ("\t\t<marker_file>", "\t\t<accuracy>1</accuracy>\n\t\t<marker_file>"),
        ("leg.trc", "Leg.trc"),
        ("IKTaskSet>", "IKTaskset>"),
    ],
)
def test_opensim_reads_the_setup_that_was_meant(old, new, fixtures, tmp_path):
    opensim.Logger.setLevelString("Off")
    (tmp_path / "leg.trc").write_bytes(MARKERS)
    path = tmp_path / "ik.xml"
    path.write_text(SETUP)
    meant = tool_in(path)
    assert meant[-1] == [("asis", 3.0)]
    path.write_bytes(mend(str(path), SETUP.replace(old, new).encode(), unsafe=True))
    assert tool_in(path) == meant and path.read_text() == SETUP
