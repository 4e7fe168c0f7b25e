"""Check that damaged files give findings at valid positions within the time limit, and that no content is lost.

The quick suite damages 50 files, the full one 3000. ``OSIMLITE_DAMAGE=20000 OSIMLITE_SEED=7`` sets
their number and the seed, and ``OSIMLITE_DAMAGE_FOLDER=...`` adds all files of a folder.
"""

from __future__ import annotations

import gzip
import os
import random
import re
import signal
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from osimlite.errors import OsimliteError
from osimlite.io.document.printer import to_text
from osimlite.io.document.reader import read_document
from osimlite.io.document.source import Source
from osimlite.lint import validate
from osimlite.lint.engine import check_source, load_subject, run_rules
from osimlite.lint.project_files import is_table
from osimlite.lint.reporters import render
from osimlite.schema.base import Object
from osimlite.schema.difference import find_differences
from osimlite.simulation import read_sto
from tests.suite import choose

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
WANTED = int(os.environ.get("OSIMLITE_DAMAGE", choose("50", "3000")))
FIRST = int(os.environ.get("OSIMLITE_SEED", "0"))
MORE = os.environ.get("OSIMLITE_DAMAGE_FOLDER")
# Number of tests among which the damaged files are divided.
GROUPS = 20
# Limit of processor time (s) for one check.
SECONDS = 20

SCRAPS = [
    b"\0", b"\xff", b"\xef\xbb\xbf", b"\r", b"\n", b"\r\n", b"\t", b" ", b",", b"=", b"<", b">", b"&", b"<!--", b"]]>",
    b"'", b'"', b"nan", b"NaN", b"inf", b"1e999", b"-1e-999", b"9" * 5000, b"1_0", b"0x1p3", "é٣²\u2028".encode(),
    b"endheader\n", b"time", b"version=99999999999999999999", b"<objects>", b"</objects>", b"<!DOCTYPE a>",
]  # fmt: skip


def _cut(data: bytes, draw: random.Random) -> bytes:
    start = draw.randrange(len(data) + 1)
    return data[:start] + data[start + draw.choice([1, 2, 10, 300]) :]


def _insert(data: bytes, draw: random.Random) -> bytes:
    start = draw.randrange(len(data) + 1)
    return data[:start] + draw.choice(SCRAPS) * draw.choice([1, 1, 1, 3, 100]) + data[start:]


def _double(data: bytes, draw: random.Random) -> bytes:
    start = draw.randrange(len(data) + 1)
    return data[:start] + data[start : start + draw.choice([1, 5, 100, 5000])] * 2 + data[start:]


def _lines_changed(data: bytes, draw: random.Random) -> bytes:
    lines = data.split(b"\n")
    first, second = draw.randrange(len(lines)), draw.randrange(len(lines))
    lines[first], lines[second] = lines[second], lines[first]
    if draw.random() < 0.3:
        del lines[first]
    return b"\n".join(lines)


def _numbers_changed(data: bytes, draw: random.Random) -> bytes:
    result = list(re.finditer(rb"[-+]?\d[\d.]*", data[:50_000]))
    if not result:
        return data
    place = draw.choice(result)
    new = draw.choice(
        [
            b"",
            b"1e308",
            b"-1e308",
            b"1e-320",
            b"nan",
            b"7" * 400,
            b"-",
            b".",
            b"1.2.3",
            b"1,5",
            b"0",
        ]
    )
    return data[: place.start()] + new + data[place.end() :]


def _other_letters(data: bytes, draw: random.Random) -> bytes:
    text = data.decode("utf-8", "replace").replace("_", draw.choice("_éß\u0660"), 3)
    return text.encode(
        draw.choice(["utf-16", "utf-16-be", "latin-1", "utf-8-sig", "utf-32", "cp500"]), "replace"
    )


def _ends(data: bytes, draw: random.Random) -> bytes:
    return re.sub(
        rb"\r?\n",
        lambda _: draw.choice([b"\r", b"\n", b"\r\n", b"\n\r"]),
        data,
        count=draw.choice([0, 9]),
    )


def _one_line(data: bytes, draw: random.Random) -> bytes:
    return data.replace(b"\n", draw.choice([b"", b" ", b"\t", b"\r", b"\v"]), draw.choice([-1, 5]))


def _nested(data: bytes, draw: random.Random) -> bytes:
    start, tag = (
        draw.randrange(len(data) + 1),
        draw.choice([b"objects", b"a", b"Body", b"TransformAxis"]),
    )
    depth = draw.choice([5, 300, 3000])
    return (
        data[:start]
        + b"<%s>" % tag * depth
        + b"</%s>" % tag * draw.choice([depth, depth - 1])
        + data[start:]
    )


def _noise(data: bytes, draw: random.Random) -> bytes:
    start = draw.randrange(len(data) + 1)
    return draw.choice([b"", data[:start]]) + draw.randbytes(draw.choice([0, 1, 100, 5000]))


# All kinds of damage.
WAYS: list[Callable[[bytes, random.Random], bytes]] = [
    _cut, _insert, _double, _lines_changed, _numbers_changed, _other_letters, _ends, _one_line, _nested, _noise,
    lambda data, draw: data[: draw.randrange(len(data) + 1)],
]  # fmt: skip
# Relative frequency of each kind of damage.
WEIGHTS = [4, 6, 3, 4, 4, 2, 2, 1, 1, 1, 3]


@contextmanager
def _limited() -> Iterator[None]:
    """Raise an error if the code uses too much processor time, independent of other processes."""

    def stop(*_: object) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[tuple[str, bytes]]]:
    """Write a project in which the tests damage one file at a time.

    Returns:
        The folder, and names and contents of the files to be damaged.
    """
    folder = tmp_path_factory.mktemp("project")
    for file in (FIXTURES / "setups").iterdir():
        data = file.read_bytes()
        (folder / file.name.removesuffix(".gz")).write_bytes(
            gzip.decompress(data) if file.suffix == ".gz" else data
        )
    files = [
        *folder.iterdir(),
        *(FIXTURES / "documents").iterdir(),
        FIXTURES / "lint/skeleton.osim",
    ]
    files += (FIXTURES / "lint").glob("OSIM8*/pass-*.*t[or]*")
    if MORE:
        suffixes = (".osim", ".xml", ".omoco", ".sto", ".mot", ".trc")
        files += [
            file
            for file in Path(MORE).rglob("*")
            if file.suffix in suffixes and file.stat().st_size < 300_000
        ]
    return folder, [(file.name, file.read_bytes()) for file in sorted(files)]


def check(folder: Path, name: str, data: bytes) -> None:
    path = folder / f"damaged{Path(name).suffix}"
    path.write_bytes(data)
    subject = load_subject(str(path))
    report = run_rules(subject)
    lines = re.split("\n" if is_table(name) else r"\r\n|\r|\n", subject.text)
    for finding in report:
        assert finding.line is None or 1 <= finding.line <= len(lines) + 1, finding
        if finding.line is not None and finding.line <= len(lines):
            assert 1 <= (finding.column or 1) <= len(lines[finding.line - 1]) + 1, finding
    for form in ("full", "json"):
        assert render(report, form)
    if is_table(name):
        try:
            read_sto(path)
        except OsimliteError as error:
            assert str(error)
        return
    try:
        top = read_document(Source(data, name), expected_class=Object).top
    except OsimliteError as error:
        assert str(error)
        return
    text = to_text(top)
    again = read_document(Source(text.encode(), name), expected_class=Object).top
    assert to_text(again) == text and not find_differences(top, again)
    assert _unknown(again) == _unknown(top)


def _unknown(top: Object) -> list[str]:
    """Return all unknown elements of a document, with empty elements in one spelling."""
    texts = (
        re.sub(r"></[^>]*>|\s*/>", "/>", text)
        for item in top.walk()
        if item.layout
        for text in item.layout.unknown
    )
    return sorted(texts)


@pytest.mark.skipif(
    not hasattr(signal, "SIGPROF"), reason="the time of a check cannot be limited here"
)
@pytest.mark.parametrize("group", range(GROUPS))
def test_a_damaged_file_has_findings_in_places_that_exist(project, group):
    folder, victims = project
    for seed in range(FIRST + group, FIRST + WANTED, GROUPS):
        draw = random.Random(seed)
        suffix = draw.choice([".osim", ".xml", ".xml", ".omoco", ".sto", ".mot", ".trc"])
        name, data = draw.choice([victim for victim in victims if victim[0].endswith(suffix)])
        for way in draw.choices(WAYS, WEIGHTS, k=draw.choice([1, 1, 2, 3])):
            data = way(data, draw)
        try:
            with _limited():
                check(folder, name, data)
        except Exception as error:
            error.add_note(f"OSIMLITE_SEED={seed}: {name}")
            raise


HEAD = b"t\nversion=1\nnRows=3\nnColumns=2\nendheader\n"
MARKERS = b"PathFileType\t4\nDataRate\tUnits\n100\tmm\nFrame#\tTime\t"


@pytest.mark.parametrize(
    "data",
    [
        pytest.param(
            HEAD
            + b"time\t"
            + b"\t".join(b"c%d" % k for k in range(100_000))
            + b"\n"
            + b"1\t" * 100_000
            + b"1\n",
            marks=pytest.mark.full,
        ),
        pytest.param(
            HEAD + b"time\t" + b"a\t" * 100_000 + b"\n" + b"nan\t" * 100_001 + b"\n",
            marks=pytest.mark.full,
        ),
        HEAD + b"time\t" + b"a\t" * 10_000 + b"\n" + b"nan\t" * 10_001 + b"\n",
        HEAD + b"time a\n" + b"1 " * 700_000 + b"\n",
        HEAD + b"time a\n" + b"1" * 3_000_000 + b" 2\n",
        HEAD + b"time a\n0 1\n" + b"\n" * 300_000 + b"1 1\n",
        HEAD + b" " * 900_000 + b"time a\n" + b" " * 1_000_000 + b"0 1\n",
        HEAD + b"\0" * 3_000_000,
        b"\n" * 3_000_000,
        b"a = b" + b" " * 900_000 + b"c\nendheader\ntime a\n0 1\n",
        pytest.param(b"time " * 200_000, marks=pytest.mark.full),
        b"1\r" * 1_000_000,
    ],
    ids=lambda data: f"{len(data)} bytes",
)
def test_a_table_of_unusual_size_takes_no_more_than_a_small_multiple_of_it(data):
    for name in ("t.sto", "t.trc"):
        with _limited():
            tracemalloc.start()
            try:
                report = check_source(Source(MARKERS + data if name == "t.trc" else data, name))
                peak = tracemalloc.get_traced_memory()[1]
            finally:
                tracemalloc.stop()
        assert report.findings
        assert peak < 150 * len(data) + 50_000_000


def test_a_binary_file_is_called_one(fixtures: Path) -> None:
    """The message names the commands that read a .c3d file; there is no finding about its encoding."""
    (finding,) = validate(fixtures / "trials" / "force_plate.c3d").findings
    assert finding.code == "OSIM001"
    assert "this is a binary file; the commands 'ik', 'scale' and 'fit' read" in finding.message
