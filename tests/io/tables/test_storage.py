"""Check reading and writing of storage files."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.errors import DocumentError, MissingFileError, OsimliteError, UnsupportedError
from osimlite.io.tables.storage import format_sto
from osimlite.simulation import read_sto, stream_table, write_sto

FINITE = st.floats(allow_nan=False, allow_infinity=False)


def test_layout():
    """The lines are those of OpenSim 4.6, except for the line of its version."""
    assert format_sto(
        "Walker", [0.0, 0.5], ["/a/value", "/a/speed"], [[1.0, -0.0], [1e-21, 2.5]]
    ).splitlines() == [
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
        ("t\nendheader\ntime\ta\n0\t1\n1\n", 5, "1 number and needs 2"),
        ("t\nendheader\ntime\ta\n0\tone\n", 4, "not a number"),
    ],
)
def test_faults_are_placed(tmp_path, text, line, words):
    path = tmp_path / "x.sto"
    path.write_text(text)
    with pytest.raises(DocumentError, match=words) as caught:
        read_sto(path)
    assert (caught.value.file, caught.value.line) == (str(path), line)


@pytest.mark.parametrize(
    ("text", "line", "column", "words"),
    [
        ("t\nendheader\ntime\ta\n0\t1\n1\n", 5, 2, "1 number and needs 2"),
        ("t\nendheader\ntime\ta\n\n0\t1 22\n", 5, 5, "3 numbers and needs 2"),
        ("t\nendheader\ntime\ta\n0\t one\n", 4, 4, "'one' is not a number"),
        ("t\nDataType=Vec3\nendheader\ntime\ta\n0\t1,2\n", 5, 3, "'a' has 2 numbers and needs 3"),
        ("t\nDataType=Vec3\nendheader\ntime\ta\n0\t\t1,2,3\n", 5, 9, "3 cells and needs 2"),
        ("t\nDataType=Vec3\nendheader\ntime\ta\n0 1,2,3\n", 5, 8, "1 cell and needs 2, with tabs"),
        ("t\nDataType=Vec3\nendheader\ntime\ta\n\t1,2,3\n", 5, 1, "the time is missing"),
        ("t\nDataType=Vec3\nendheader\ntime\ta\nx\t1,2,3\n", 5, 1, "'x' is not a number"),
        (
            "t\nDataType=Vec2\nendheader\ntime\ta\n0\t1,2\n0.\t1,2\n",
            6,
            1,
            "0 does not come after 0",
        ),
    ],
)
def test_faults_have_a_column(tmp_path, text, line, column, words):
    path = tmp_path / "x.sto"
    path.write_text(text)
    with pytest.raises(DocumentError, match=words) as caught:
        read_sto(path)
    assert (caught.value.line, caught.value.column) == (line, column)


def test_other_files_are_refused(tmp_path):
    with pytest.raises(MissingFileError):
        read_sto(tmp_path / "none.sto")
    (tmp_path / "v.sto").write_text("t\nDataType=Mat33\nendheader\ntime\ta\n0\t1,2,3\n")
    with pytest.raises(UnsupportedError, match="Mat33; tables hold double, Vec3"):
        read_sto(tmp_path / "v.sto")
    with pytest.raises(UnsupportedError, match="Mat33"):
        write_sto(tmp_path / "w.sto", "t", [], ["a"], [], kind="Mat33")
    with pytest.raises(OsimliteError, match="a row has 2 numbers"):
        write_sto(tmp_path / "w.sto", "t", [0.0], ["a"], [[1.0, 2.0]], kind="Vec3")
    assert not (tmp_path / "w.sto").exists()


@pytest.mark.parametrize(
    ("kind", "size", "last"),
    [("Vec3", 3, "b_z"), ("Quaternion", 4, "b_4"), ("SpatialVec", 6, "b_tz"), ("Vec9", 9, "b_9")],
)
def test_values_of_several_numbers(tmp_path, kind, size, last):
    path, rows = tmp_path / "v.sto", np.arange(4.0 * size).reshape(2, -1) / 3.0
    write_sto(path, "t", [0.0, 0.5], ["a", "b"], rows.tolist(), kind=kind)
    assert path.read_text().splitlines()[8].count(",") == 2 * (size - 1)
    table = read_sto(path)
    assert (table.kind, len(table.columns), table.columns[-1]) == (kind, 2 * size, last)
    assert np.array_equal(table.rows, rows)


@pytest.mark.parametrize(
    ("row", "numbers"),
    [
        ("0.5\t1, 2 ,3,\t4,5,6\t", [0.5, 1, 2, 3, 4, 5, 6]),
        ("0.5\t1,,x\tnan,inf,6", [0.5, 1, np.nan, np.nan, np.nan, np.nan, 6]),
        ("0.5,\t1x,0x10,1_0\t5e,1.#IND,6", [0.5, 1, 0, 1, np.nan, np.nan, 6]),
    ],
)
def test_vectors_are_read_as_opensim_reads_them(tmp_path, row, numbers):
    path = tmp_path / "v.sto"
    path.write_text(f"DataType=Vec3\nversion=3\nendheader\ntime\ta\tb\n0\t1,2,3\t4,5,6\n{row}\n\n")
    table = read_sto(path)
    assert np.array_equal([table.times[1], *table.rows[1]], numbers, equal_nan=True)


def test_what_older_programs_wrote(tmp_path):
    path = tmp_path / "simm.mot"
    head = "name walk\ndatacolumns 3\ndatarows 2\nrange 0 1\nendheader\n"
    path.write_text(f"{head}time hip\tknee\n0 1.#QNAN 2\n1 -1.#INF -nan\n\n")
    table = read_sto(path)
    # SIMM files are in degrees. The number of columns shows that tabs and spaces both separate
    # them.
    assert (table.name, table.columns, table.in_degrees) == ("walk", ("hip", "knee"), True)
    assert np.isnan(table.rows[0, 0]) and table.rows[1, 0] == -np.inf and np.isnan(table.rows[1, 1])
    for said, degrees in (
        ("inDegrees=no", False),
        ("Angles are in degrees.", True),
        ("Angles are in radians.", False),
    ):
        (tmp_path / "old.sto").write_text(f"t\n{said}\nendheader\na\ttime\ta\n1\t0\t2\n")
        table = read_sto(tmp_path / "old.sto")
        assert (table.in_degrees, table.columns, table.times.tolist()) == (
            degrees,
            ("a", "a"),
            [0.0],
        )
        assert table.rows.tolist() == [[1.0, 2.0]]


def test_labels_with_spaces(tmp_path):
    path = tmp_path / "x.sto"
    path.write_text("t\nversion=3\nnColumns=3\nendheader\ntime\ta b\tc \n0\t1\t2\n")
    assert read_sto(path).columns == ("a b", "c")


def test_rows_one_by_one(tmp_path):
    """Rows are written and read one by one, without the complete file in memory."""
    path, asked = tmp_path / "long.sto", []

    def rows():
        for number in range(1000):
            asked.append(number)
            yield [float(number)]

    write_sto(path, "t", (0.1 * number for number in range(1000)), ["a"], rows())
    assert len(asked) == 1000 and "nRows=1000" in path.read_text()
    with path.open("a") as file:
        file.write("damaged\n")
    with stream_table(path) as table:
        assert (table.name, table.columns) == ("t", ("a",))
        rows_ = iter(table)
        assert next(rows_) == (0.0, [0.0])
        assert next(rows_) == (0.1, [1.0])
    with (
        pytest.raises(DocumentError, match="'damaged' is not a number") as caught,
        stream_table(path) as table,
    ):
        assert sum(1 for _ in table) == 1000
    assert caught.value.line == 1009
