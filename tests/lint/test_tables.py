"""Check findings in tables that differ from a valid one in one respect."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.lint import Config, validate
from osimlite.lint.engine import load_subject, run_rules
from osimlite.lint.many import check_files
from osimlite.lint.scan import RowScanner
from osimlite.lint.table import Table
from tests.cli.command import run as command


def numbers(draw: random.Random) -> str:
    value = draw.choice([0.0, draw.gauss(0, 500), draw.gauss(0, 1e-6), float(draw.randint(-9, 9))])
    # Hypothesis also draws the largest number, which some formats round to a larger one.
    value = max(-1e300, min(value, 1e300))
    return draw.choice(["%.6f", "%16.8f", "%g", "%.17g", "%.3e", "%+.2f"]) % value


@given(
    st.randoms(use_true_random=False),
    st.integers(1, 8),
    st.integers(1, 40),
    st.sampled_from(["\t", " ", "  \t "]),
)
def test_rows_of_numbers_in_any_form_have_no_fault(draw, columns, count, separator):
    lines = [
        separator.join([str(row / 8), *(numbers(draw) for _ in range(columns))])
        for row in range(count)
    ]
    text = draw.choice(["\n", "\r\n"]).join([*lines, ""])
    rows = RowScanner(columns + 1).scan(text.encode(), 0, 1)
    assert (rows.count, list(rows.times), rows.faults) == (
        count,
        [row / 8 for row in range(count)],
        {},
    )


# Texts that are not finite decimal numbers.
WRONG = [
    "nan",
    "NaN",
    "inf",
    "x",
    "1,5",
    "1.2.3",
    "1-2",
    "-",
    "+",
    ".",
    "e5",
    "5e",
    "1e-",
    "--1",
    "1_0",
    "0x10",
    "#N/A",
]


@given(
    st.randoms(use_true_random=False), st.integers(1, 6), st.integers(2, 30), st.sampled_from(WRONG)
)
def test_a_cell_that_is_no_number_is_found_where_it_is(draw, columns, count, wrong):
    rows = [
        [str(row / 8), *(numbers(draw).strip() for _ in range(columns))] for row in range(count)
    ]
    row, column = draw.randrange(count), draw.randint(1, columns)
    rows[row][column] = wrong
    result = RowScanner(columns + 1).scan(
        "".join("\t".join(cells) + "\n" for cells in rows).encode(), 0, 5
    )
    (fault,) = result.faults.values()
    place = sum(map(len, rows[row][:column])) + column + 1
    assert (fault.kind, fault.number, fault.line, fault.column) == ("cell", column, row + 5, place)


@given(st.randoms(use_true_random=False), st.integers(2, 6), st.integers(3, 30), st.booleans())
def test_a_row_of_another_length_is_found(draw, columns, count, longer):
    rows = [
        [str(row / 8), *(numbers(draw).strip() for _ in range(columns))] for row in range(count)
    ]
    row = draw.randrange(count)
    rows[row] = [*rows[row], "7"] if longer else rows[row][:-1]
    result = RowScanner(columns + 1).scan(
        "".join("\t".join(cells) + "\n" for cells in rows).encode(), 0, 1
    )
    (fault,) = result.faults.values()
    assert (fault.kind, fault.line, fault.number) == ("row", row + 1, len(rows[row]))


@given(st.binary(max_size=300), st.sampled_from(["a.sto", "a.mot", "a.trc"]), st.data())
def test_no_bytes_make_the_check_fail(data, name, more):
    start = more.draw(
        st.sampled_from(
            [b"", b"x\nversion=1\nnRows=1\nendheader\ntime\ta\n0\t1\n", b"PathFileType\t4\n"]
        )
    )
    run_rules(Table(start + data, name))


@pytest.mark.parametrize("name", ["walk.trc", "walk.mot"])
def test_no_cut_and_no_changed_byte_makes_the_check_fail(fixtures, name):
    good = next((fixtures / "lint" / "OSIM801").glob("pass-*" + name[-4:])).read_bytes()
    draw = random.Random(1)
    for size in range(0, len(good), 3):
        run_rules(Table(good[:size], name))
    for _ in range(300):
        damaged = bytearray(good)
        for _ in range(draw.randint(1, 4)):
            damaged[draw.randrange(len(damaged))] = draw.choice(b"\t\n\r 019.-eEnaN,=\xff#")
        run_rules(Table(bytes(damaged), name))


def test_a_table_is_taken_from_the_cache(fixtures, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    text = next((fixtures / "lint" / "OSIM807").glob("fail-02-nan*")).read_text()
    Path("walk.sto").write_text(text)
    first = check_files(["walk.sto"], Config())
    assert dict(first.codes) == {"OSIM807": 2}
    monkeypatch.setattr("osimlite.lint.many.check_job", None)
    assert check_files(["walk.sto"], Config()).findings == first.findings


def test_a_file_of_many_blocks_is_one_table(tmp_path, monkeypatch):
    monkeypatch.setattr("osimlite.lint.scan.BLOCK_BYTES", 60)
    lines = [f"{row / 100:.2f}\t{row}\t-1.5" for row in range(200)]
    lines[150] = lines[150].replace("-1.5", "nan")
    path = tmp_path / "walk.sto"
    path.write_text(
        "x\nversion=1\nnRows=200\nnColumns=3\nendheader\ntime\ta\tb\n" + "\n".join(lines)
    )
    table = load_subject(str(path))
    (finding,) = run_rules(table).findings
    assert (finding.code, finding.line, finding.column) == ("OSIM807", 157, 10)
    assert isinstance(table, Table)
    assert (table.span, round(table.step, 9), table.rows.line_of(199)) == ((0.0, 1.99), 0.01, 206)


@pytest.mark.parametrize(
    ("times", "line"),
    [("0 0.1 0.2 1e308", 11), ("0 0.1 1e25 1e26", 10), ("-1e308 0 0.1 0.2", 8), ("-1e300 0 1 1e300", 8)],
)  # fmt: skip
def test_a_time_that_no_reader_takes_is_an_error(tmp_path, times, line):
    rows = "".join(f"{time} 0.5\n" for time in times.split())
    file = tmp_path / "states.sto"
    file.write_text(
        f"states\nversion=1\nnRows=4\nnColumns=2\ninDegrees=no\nendheader\ntime knee\n{rows}"
    )
    (finding,) = run_rules(load_subject(str(file))).errors
    assert (finding.code, finding.line) == ("OSIM808", line)


@pytest.mark.parametrize(
    ("times", "severity"), [("0 0.1 0.2 0.2", "info"), ("0 0.1 0.1 0.2", "warning")]
)
def test_the_last_row_twice_is_how_opensim_ends_some_results(tmp_path, times, severity):
    rows = "".join(f"{time} 0.5\n" for time in times.split())
    file = tmp_path / "states.sto"
    file.write_text(
        f"states\nversion=1\nnRows=4\nnColumns=2\ninDegrees=no\nendheader\ntime knee\n{rows}"
    )
    (finding,) = run_rules(load_subject(str(file))).findings
    assert (finding.code, str(finding.severity)) == ("OSIM808", severity)


def test_rows_of_vectors_are_taken_many_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows of vectors and quaternions are examined in blocks; only invalid rows are examined one by one."""
    lines = [f"{0.1 * k:.1f}\t1,-2e-3,{k}\t0.5,0.25,-1\n" for k in range(50)]
    lines[20] = "2.0\t1,2\t0.5,0.25,-1\n"
    odd: list[int] = []
    one_by_one = RowScanner.examine_odd_line

    def noted(scan: RowScanner, text: bytes, line: int) -> None:
        odd.append(line)
        one_by_one(scan, text, line)

    monkeypatch.setattr(RowScanner, "examine_odd_line", noted)
    result = RowScanner(3, 3).scan("".join(lines).encode(), 0, 7)
    assert odd == [27] and result.count == 50 and list(result.times[:2]) == [0.0, 0.1]
    assert [(fault.kind, fault.line) for fault in result.faults.values()] == [("vector", 27)]
    assert result.samples[1] == [0.1, 1.0, -2e-3, 1.0, 0.5, 0.25, -1.0]


ROWS_OF_VECTORS = [
    # OpenSim reads blanks around numbers, and an empty text at the end of a cell or of a row.
    ("0.1\t1, 2,3\t4 ,5 , 6", []),
    ("  .1 \t 1,2,3, \t4,5,6,", []),
    ("0.1\t1,2,3\t4,5,6\t", []),
    # It reads NaN, or the number at the beginning of a text.
    ("0.1\t1,,3\t4,5,6", [("OSIM807", 7, "warning", "missing (column 'a'): OpenSim reads it as NaN")]),
    ("0.1\t1,2,3\t4, x,6", [("OSIM807", 14, "warning", "'x' is not a number (column 'b'): OpenSim reads it as NaN")]),
    ("0.1\t1x,2,3\t4,5,6", [("OSIM807", 5, "warning", "'1x' is not a number (column 'a'): OpenSim reads 1")]),
    ("0.1,\t1,2,3\t4,5,6", [("OSIM807", 1, "warning", "'0.1,' is not a number (column 'time'): OpenSim reads 0.1")]),
    ("x\t1,2,3\t4,5,6", [("OSIM807", 1, "error", "a row needs a time")]),
    # It rejects all others.
    ("0.1\t1,23\t4,5,6", [("OSIM806", 5, "error", "'a' has 2 numbers and needs 3: OpenSim rejects")]),
    ("0.1\t1,2,3\t4,5,", [("OSIM806", 11, "error", "'b' has 2 numbers and needs 3")]),
    ("0.1\t1,2,3\t4,5,6,7", [("OSIM806", 11, "error", "'b' has 4 numbers and needs 3")]),
    ("0.1\t \t4,5,6", [("OSIM806", 6, "error", "'a' is empty and needs 3")]),
    ("0.1\t\t1,2,3\t4,5,6", [("OSIM806", 12, "error", "4 cells and needs 3")]),
    ("0.1\t1,2\t,3\t4,5,6", [("OSIM806", 12, "error", "4 cells and needs 3")]),
    ("\t0.1\t1,2,3\t4,5,6", [("OSIM806", 12, "error", "4 cells and needs 3")]),
    ("0.1 1,2,3 4,5,6", [("OSIM806", 16, "error", "1 cell and needs 3; its cells are separated by spaces instead of tabs")]),
    ("0.1\t1,2,3", [("OSIM806", 10, "error", "2 cells and needs 3")]),
    ("  ", [("OSIM806", 1, "error", "1 cell and needs 3")]),
    ("0.\t1,2,3\t4,5,6", [("OSIM808", 1, "error", "0 repeats that of the row before")]),
    ("0.1\t1,2,3\t4,5,6\n\n0.2\t1,2,3\t4,5,6", [("OSIM806", 1, "error", "a blank line ends the table")]),
]  # fmt: skip
"""Rows of two vectors, and the findings: code, column, severity and words of the message."""


@pytest.mark.parametrize(("row", "findings"), ROWS_OF_VECTORS)
@pytest.mark.parametrize("version", [1, 3])
def test_rows_of_vectors_are_judged_as_opensim_reads_them(
    tmp_path: Path, row: str, findings: list[tuple[str, int, str, str]], version: int
) -> None:
    file = tmp_path / "markers.sto"
    file.write_text(
        f"DataType=Vec3\nversion={version}\nendheader\ntime\ta\tb\n0\t1,2,3\t4,5,6\n{row}\n"
    )
    result = [
        (finding.code, finding.column, str(finding.severity), finding.message)
        for finding in validate(file).findings
    ]
    assert [entry[:3] for entry in result] == [entry[:3] for entry in findings]
    assert all(words in entry[3] for entry, (*_, words) in zip(result, findings, strict=True)), (
        result
    )


def test_blanks_between_labels_of_vectors_are_an_error(tmp_path: Path) -> None:
    file = tmp_path / "markers.sto"
    file.write_text("DataType=Vec3\nversion=3\nendheader\ntime a\n0\t1,2,3\n")
    (finding,) = validate(file).findings
    assert (finding.code, str(finding.severity)) == ("OSIM80407", "error")


def test_an_empty_line_before_rows_of_vectors_loses_all(tmp_path: Path) -> None:
    file = tmp_path / "markers.sto"
    file.write_text("DataType=Vec3\nversion=3\nendheader\ntime\ta\n\n0\t1,2,3\n")
    (finding,) = validate(file).errors
    assert (finding.code, finding.line) == ("OSIM806", 5) and "1 row" in finding.message


def test_a_last_time_far_before_the_first_is_no_traceback(tmp_path: Path) -> None:
    rows = "".join(f"{time}\t0\n" for time in ("0", "0.1", "-1e308"))
    file = tmp_path / "far.sto"
    file.write_text(
        f"far\nversion=1\nnRows=3\nnColumns=2\ninDegrees=no\nendheader\ntime\tq\n{rows}"
    )
    messages = [finding.message for finding in validate(str(file)).findings]
    assert any("-1e+308 s is too large for a motion" in message for message in messages)


@pytest.mark.parametrize(
    ("cell", "severity", "text"),
    [
        ("607,2", "error", "OpenSim reads 607"),
        ("607x", "warning", "OpenSim reads 607"),
        ("0x10", "warning", "OpenSim reads 0"),
        ("1e400", "warning", "OpenSim treats the marker as not seen"),
        ("-", "warning", "OpenSim treats the marker as not seen"),
    ],
)
def test_cells_of_marker_files(
    fixtures: Path, tmp_path: Path, cell: str, severity: str, text: str
) -> None:
    """OpenSim 4.6 reads the number at the beginning of a cell, as it does in tables of vectors."""
    lines = (fixtures / "setups" / "walk.trc").read_text().split("\n")
    cells = lines[8].split("\t")
    lines[8] = "\t".join([*cells[:2], cell, *cells[3:]])
    file = tmp_path / "walk.trc"
    file.write_text("\n".join(lines))
    (finding,) = [finding for finding in validate(file).findings if finding.code == "OSIM807"]
    assert (finding.line, finding.severity.value) == (9, severity)
    assert text in finding.message
    assert finding.suggestion == ("607.2" if cell == "607,2" else None)


def test_decimal_commas_in_the_times_of_a_marker_file(fixtures: Path, tmp_path: Path) -> None:
    """No finding mentions the substitutes of unreadable times."""
    head, rows = (fixtures / "setups" / "walk.trc").read_text().split("\n\n")
    file = tmp_path / "walk.trc"
    file.write_text(f"{head}\n\n{rows.replace('.', ',')}")
    report = validate(file)
    assert {finding.code for finding in report.findings} == {"OSIM807"}
    assert "'0,500000' is not a number (column 'Time')" in report.findings[0].message


@pytest.mark.parametrize("cell", ["1e400", "-1E+400"])
@pytest.mark.parametrize(("version", "severity"), [(1, "error"), (2, "warning"), (3, "warning")])
def test_numbers_beyond_the_largest_one(
    tmp_path: Path, cell: str, version: int, severity: str
) -> None:
    """OpenSim 4.6 reads NaN from newer tables; older ones end there, at 1.8e308."""
    file = tmp_path / "a.sto"
    head = f"a\nversion={version}\nnRows=3\nnColumns=2\ninDegrees=no\nendheader\ntime\ta\n"
    file.write_text(f"{head}0\t1e308\n0.1\t{cell}\n0.2\t1e-400\n")
    (finding,) = validate(file).findings
    assert (finding.code, finding.severity.value) == ("OSIM807", severity)
    assert "largest number" in finding.message and (finding.line, finding.column) == (9, 5)
    assert finding.message.endswith("without a message") == (version == 1)


MARKERS = """PathFileType	4	(X/Y/Z)	w.trc
DataRate	CameraRate	NumFrames	NumMarkers	Units	OrigDataRate	OrigDataStartFrame	OrigNumFrames
{rate}	{rate}	{count}	1	mm	{rate}	1	{count}
Frame#	Time	RASI
		X1	Y1	Z1

{rows}"""


def make_markers(rate: float, times: list[str]) -> Table:
    """Return a marker file with a frame for each of the times."""
    rows = "".join(f"{frame}\t{time}\t1\t2\t3\n" for frame, time in enumerate(times, 1))
    return Table(MARKERS.format(rate=rate, count=len(times), rows=rows).encode(), "w.trc")


@pytest.mark.parametrize(
    ("rate", "indices", "digits"),
    [
        # The usual step of 60 Hz is 0.017 s if times are rounded to milliseconds.
        (60.0, range(61), 3),
        (100.0, range(61), 2),
        # Steps of 0.01 and 0.02 s.
        (75.0, range(301), 2),
        # Several rows have equal times.
        (1000.0, range(1001), 2),
        # 20 frames are missing.
        (120.0, [*range(40), *range(60, 121)], 4),
    ],
)
def test_the_rate_of_rounded_times(rate: float, indices: list[int], digits: int) -> None:
    table = make_markers(rate, [f"{index / rate:.{digits}f}" for index in indices])
    assert table.rate == pytest.approx(rate, rel=2e-3)
    assert "OSIM803" not in {finding.code for finding in run_rules(table).findings}


def test_the_rate_of_few_times() -> None:
    assert make_markers(60.0, []).rate == make_markers(60.0, ["0.5"]).rate == 0.0
    assert make_markers(60.0, ["0.5", "0.5"]).rate == make_markers(60.0, ["0", "x"]).rate == 0.0


def test_a_rule_and_info_print_the_same_rate(tmp_path: Path) -> None:
    table = make_markers(100.0, [f"{index / 60:.3f}" for index in range(61)])
    (message,) = [
        finding.message for finding in run_rules(table).findings if finding.code == "OSIM803"
    ]
    assert message.endswith("the times of the frames give 60")
    file = tmp_path / "w.trc"
    file.write_bytes(table.data)
    assert "0 to 1 s, 60 Hz" in command("info", str(file)).out


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("# half of it", "OpenSim does not allow comments among the rows"),
        ("end of data", "expected a row of numbers, found 'end of data'"),
        ("x" * 50, f"expected a row of numbers, found '{'x' * 40}...'"),
    ],
)
def test_a_line_that_is_no_row_is_named_for_what_it_is(line: str, message: str) -> None:
    text = f"m\nversion=1\nnRows=2\nnColumns=2\nendheader\ntime\tknee\n0\t1\n{line}\n1\t2\n{line}\n"
    (finding,) = run_rules(Table(text.encode(), "m.mot")).findings
    assert finding.code == "OSIM806"
    assert finding.message == f"{message}; the same in 1 more line"
