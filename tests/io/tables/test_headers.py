"""Check headers of tables: their content, its positions, and the time of reading."""

from __future__ import annotations

import pytest

from osimlite.io.tables.headers import MarkerHeader, StorageHeader
from tests.suite import choose


def test_what_a_storage_file_says():
    header = StorageHeader(
        b"\xef\xbb\xbfwalk\nversion = 1\n nr=2\nnColumns 3\nendheader\n\n time\thip  knee\n0 1 2\n"
    )
    assert (header.name, header.form, header.value("nRows"), header.value("nColumns")) == (
        "walk",
        1,
        "2",
        "3",
    )
    assert header.entries["nRows"].key == ("nr", (3, 2, 2)) and header.end == (
        "endheader",
        (5, 1, 9),
    )
    assert [(label.text, label.at.column) for label in header.labels] == [
        ("time", 2),
        ("hip", 7),
        ("knee", 12),
    ]
    assert (header.label_line, header.row_line, header.rows) == (7, 8, 64)


@pytest.mark.parametrize(
    ("said", "file", "degrees"),
    [
        ("inDegrees=yes", "a.sto", True),
        ("inDegrees = Y", "a.sto", True),
        ("inDegrees=true", "a.sto", False),
        ("indegrees=yes", "a.sto", False),
        ("version=1", "a.mot", False),
        ("inDegrees=no", "a.mot", True),
        ("Angles are in degrees.", "a.sto", True),
        ("Angles are in radians.", "a.sto", False),
    ],
)
def test_degrees_are_said_as_opensim_reads_it(said, file, degrees):
    assert StorageHeader(f"t\n{said}\nendheader\ntime\n".encode(), file).in_degrees == degrees


def test_columns_are_counted_in_characters():
    header = StorageHeader("t\nendheader\ntime\tä\tb".encode() + b"\t\xff\xfe\tc\n")
    assert [(label.text, label.at.column) for label in header.labels[2:]] == [
        ("b", 8),
        ("��", 10),
        ("c", 13),
    ]


def test_what_a_marker_file_says():
    header = MarkerHeader(
        b"PathFileType\t4\nDataRate\tUnits\n100\t mm \nFrame#\tTime\ta b\t\t\tc\n1\t0\t1\t2\t3\n"
    )
    assert header.entries["Units"].value == ("mm", (3, 6, 2))
    assert [(label.text, label.at.column) for label in header.labels] == [("a b", 13), ("c", 19)]
    assert (header.row_line, header.rows) == (5, 59), "the line of X1 Y1 Z1 is missing"


@pytest.mark.parametrize("part", [b" ", b"\t", b"\n", b"a", b"a ", b"a\t", b"=", b"\r", b"\xff"])
def test_long_headers_are_read_in_time_that_grows_with_them(part):
    """A pattern that backtracks from every beginning would not finish."""
    long = part * choose(50_000, 300_000)
    for start in (b"", b"a=b", b"t\nendheader\n", b"t\nendheader\ntime\t"):
        StorageHeader(start + long + b"x\n")
    MarkerHeader(b"P\n" + b"\n".join([long] * 4))
