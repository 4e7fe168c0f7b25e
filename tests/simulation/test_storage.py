"""Reading and writing storage files."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.errors import DocumentError, MissingFileError, UnsupportedError
from osimlite.simulation import read_sto, write_sto
from osimlite.simulation.storage import sto_text

FINITE = st.floats(allow_nan=False, allow_infinity=False)


def test_layout():
    """Line for line what OpenSim 4.6 writes, but for its own version."""
    assert sto_text("Walker", [0.0, 0.5], ["/a/value", "/a/speed"], [[1.0, -0.0], [1e-21, 2.5]]).splitlines() == [
        "Walker",
        "inDegrees=no",
        "nColumns=3",
        "nRows=2",
        "DataType=double",
        "version=3",
        "endheader",
        "time\t/a/value\t/a/speed",
        "0\t1\t-0",
        "0.5\t1e-21\t2.5",
    ]


@given(st.lists(st.tuples(FINITE, FINITE, FINITE), max_size=5))
def test_every_number_comes_back(tmp_path_factory, rows):
    path = tmp_path_factory.mktemp("sto") / "table.sto"
    write_sto(path, "t", [row[0] for row in rows], ["a", "b"], [row[1:] for row in rows])
    table = read_sto(path)
    assert (table.name, table.columns, table.in_degrees) == ("t", ("a", "b"), False)
    assert np.column_stack([table.times, table.rows]).tolist() == [list(row) for row in rows]


def test_older_layout(tmp_path):
    path = tmp_path / "old.mot"
    path.write_text(
        "Coordinates\nversion=1\nnRows=2\nnColumns=3\ninDegrees=yes\n\nUnits are S.I. units (a=b)\n\nendheader\n\n"
        "time  hip flex\n 0.0   1.5 2\n\n 0.1   NaN 3\n"
    )
    table = read_sto(path)
    assert (table.name, table.in_degrees, table.columns) == ("Coordinates", True, ("hip", "flex"))
    assert table.times.tolist() == [0.0, 0.1]
    assert np.isnan(table["hip"][1]) and table["flex"].tolist() == [2.0, 3.0]
    with pytest.raises(KeyError):
        table["knee"]


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("nothing\n", None, "endheader"),
        ("t\nendheader\n", 2, "before its column labels"),
        ("t\nendheader\nx\ty\n", 3, "must be 'time'"),
        ("t\nendheader\ntime\ta\n0\t1\n1\n", 5, "1 numbers and needs 2"),
        ("t\nendheader\ntime\ta\n0\tone\n", 4, "no number"),
    ],
)
def test_faults_are_placed(tmp_path, text, line, words):
    path = tmp_path / "x.sto"
    path.write_text(text)
    with pytest.raises(DocumentError, match=words) as caught:
        read_sto(path)
    assert (caught.value.file, caught.value.line) == (str(path), line)


def test_other_files_are_refused(tmp_path):
    with pytest.raises(MissingFileError):
        read_sto(tmp_path / "none.sto")
    (tmp_path / "v.sto").write_text("t\nDataType=Vec3\nendheader\ntime\ta\n0\t1,2,3\n")
    with pytest.raises(UnsupportedError, match="Vec3"):
        read_sto(tmp_path / "v.sto")
