"""Tests of output with hostile names of models and files, and of output in encodings other than UTF-8."""

from __future__ import annotations

import io
import json
import os
import re
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from osimlite.cli import main
from osimlite.cli._console import EscapingStream, FactTable, escape_output

HOSTILE = "::error::##[add-mask]v1\x7f\x85\x9b31m\u202e\u2066\u2028\u00e9\u4e16"
"""Characters that XML allows in an attribute and that terminals or CI logs interpret."""

FILE = "::error::\x1b[2J\x07\n::error::caf\udce9\u202e.osim"
OBEYED = re.compile(r"[\0-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]")


@pytest.fixture(scope="module")
def folder(fixtures: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a walker whose names, and whose file's name, contain hostile characters."""
    place = tmp_path_factory.mktemp("hostile")
    text = (fixtures / "walker" / "DynamicWalkerModel.osim").read_text(encoding="utf-8")
    written = "".join(f"&#{ord(character)};" for character in HOSTILE)
    for name in ("RHip_rz", "Pelvis", "RFootContact", "DynamicWalkerModel", "RightThighToPelvis"):
        text = re.sub(rf"\b{name}\b", name + written, text)
    (place / FILE).write_text(text, encoding="utf-8")
    (place / "other.osim").write_text(text.replace("Pelvis&", "Qelvis&"), encoding="utf-8")
    (place / "wrong.osim").write_text(
        text.replace("<gravity>", "<gravty>&#27; :::error::\u202e", 1), encoding="utf-8"
    )
    return place


def call(folder: Path, *words: str, encoding: str = "utf-8") -> tuple[int, bytes, bytes]:
    streams = [
        io.TextIOWrapper(io.BytesIO(), encoding=encoding, write_through=True) for _ in range(2)
    ]
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setenv("COLUMNS", "60")
        patch.setattr(sys, "stdout", streams[0])
        patch.setattr(sys, "stderr", streams[1])
        with pytest.raises(SystemExit) as ended:
            main(list(words))
    out, err = (stream.buffer.getvalue() for stream in streams)
    return int(ended.value.code or 0), out, err


def check(text: str) -> None:
    assert not OBEYED.search(text), OBEYED.findall(text)
    assert not any(line.lstrip().startswith("::") for line in text.split("\n")), text
    assert not re.search(r"##\w*\[", text)


@pytest.mark.parametrize(
    "words",
    [
        ["validate", "--no-cache", "./" + FILE],
        ["validate", "--no-cache", "--format", "concise", FILE],
        ["validate", "wrong.osim", "--unsafe-fixes", "--diff"],
        ["validate", "no\n::error::\x1b[2J\udce9.osim"],
        ["validate", "--\x1b[31m\n::error::"],
        ["validate", FILE, "--select", "\n::error::\x1b"],
        ["\n::error::\x1b[2J"],
        ["info", FILE],
        ["diff", FILE, "other.osim"],
        ["diff", "--git", "\n::error::\x1b", FILE, "0" * 40, "100644", "other.osim", "1" * 40, "100644"],
        ["format", "--diff", FILE],
        ["upgrade", FILE, "-o", "new\n::error::\x1b\udce9.osim"],
        ["translate", FILE, "-o", "out\n::error::\x1b\udce9"],
        ["simulate", FILE, "--to", "0.01", "-o", "moved\n::error::\x1b\udce9"],
        ["simulate", FILE, "--to", "0.01", "--set", "RHip\n::error::\x1b=1"],
        ["kinematics", FILE, "moved\n::error::\x1b\udce9/states.sto", "-o", "followed\n::error::"],
        ["doctor", "no\n::error::\x1b"],
    ],
    ids=lambda words: " ".join(word for word in words if word.isalnum())[:30],
)  # fmt: skip
def test_nothing_that_people_read_is_obeyed(folder: Path, words: list[str]) -> None:
    _, out, err = call(folder, *words)
    check(out.decode())
    check(err.decode())
    assert out or err


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252", "ascii", "utf-16"])
def test_formats_for_programs_are_whole_wherever_they_go(folder: Path, encoding: str) -> None:
    texts = {}
    for form in ("json", "sarif", "junit", "github"):
        code, out, err = call(
            folder, "validate", "--no-cache", FILE, "--format", form, encoding=encoding
        )
        assert (code, err) == (1, b"")
        texts[form] = out.decode("utf-8")
    findings = json.loads(texts["json"])
    assert {finding["file"] for finding in findings} == {FILE.replace("\udce9", r"\xe9")}
    assert any(HOSTILE in finding["message"] for finding in findings)
    results = json.loads(texts["sarif"])["runs"][0]["results"]
    uris = {
        result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] for result in results
    }
    assert uris == {"%3A%3Aerror%3A%3A%1B%5B2J%07%0A%3A%3Aerror%3A%3Acaf%E9%E2%80%AE.osim"}
    assert ElementTree.fromstring(texts["junit"]).get("failures") == "1"
    check(texts["junit"])
    assert len(texts["github"].splitlines()) == len(findings)
    for line in texts["github"].splitlines():
        assert re.match(r"::(error|warning|notice) title=", line) and "é世" in texts["github"]
        assert not OBEYED.search(line)


@pytest.mark.parametrize("encoding", ["cp1252", "ascii", "utf-16"])
def test_output_of_any_encoding(folder: Path, encoding: str) -> None:
    for words, code in (
        (["info", FILE], 0),
        (["validate", "--no-cache", FILE], 1),
        (["info", "世.osim"], 2),
    ):
        done, out, err = call(folder, *words, encoding=encoding)
        assert done == code, err.decode(encoding)
        check(out.decode(encoding) + err.decode(encoding))
        assert "世" in out.decode(encoding) + err.decode(encoding) or r"\u4e16" in (
            out + err
        ).decode(encoding)
    # XML on standard output is UTF-8, whatever the encoding of the terminal.
    code, out, _ = call(folder, "build", "dynamic-walker", "-o", "-", encoding=encoding)
    assert (
        code == 0
        and out.decode("utf-8").startswith("<?xml")
        and out.endswith(b"</OpenSimDocument>\n")
    )


def test_no_path_of_a_file_is_broken_into_lines(
    capsys: pytest.CaptureFixture[str], monkeypatch
) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    path = "/tmp/" + "pytest-of-somebody/" * 4 + "best.par"
    FactTable("search", [("runs", "40"), ("files", f"results/best.osim, {path}")]).show()
    assert path in capsys.readouterr().out.splitlines()[-1]


@pytest.mark.parametrize("columns", [80, 120])
def test_many_files_of_one_folder_are_listed_below_it(
    columns: int, capsys: pytest.CaptureFixture[str], monkeypatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.chdir(tmp_path)
    names = [f"so_MuscleAnalysis_Moment Arm_{index}_{'angle' * 4}.sto" for index in range(12)]
    folder = tmp_path / "a_rather_long_folder_name_for_results" / "so"
    facts = FactTable("so.xml", [("rows", "31")])
    facts.add_files(folder / name for name in names)
    facts.show()
    lines = capsys.readouterr().out.splitlines()
    assert lines[2] == "files  " + os.path.join("a_rather_long_folder_name_for_results", "so", "")
    assert all(len(line) <= columns for line in lines)
    assert all(any(name in line for line in lines) for name in names)
    # A short list of files shows complete paths, which can be copied.
    facts = FactTable()
    facts.add_files(["results/states.sto", "results/forces.sto"])
    facts.show()
    assert capsys.readouterr().out == "files  results/states.sto, results/forces.sto\n"


def test_a_path_that_does_not_fit_beside_its_label_is_below_it(
    capsys: pytest.CaptureFixture[str], monkeypatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    path = "/home/müller/" + "0123456789" * 6 + ".sto"
    facts = FactTable("", [("a rather long label", path), ("rows", "31")])
    facts.add_files([path * 2])
    facts.show()
    assert capsys.readouterr().out.splitlines() == [
        "a rather long label",
        f"  {path}",
        "rows                 31",
        "files",
        f"  {path * 2}",
    ]


def test_what_others_print_is_guarded_too(capsys: pytest.CaptureFixture[str]) -> None:
    with escape_output():
        assert isinstance(sys.stdout, EscapingStream)
        print("::error::x")
        print("Body", end="")
        print("::error::\x1b[2J\x1b[1mbold\x1b[0m")
        print("\x07", file=sys.stderr)
    print("::as it was")
    assert tuple(capsys.readouterr()) == (
        "\\x3a:error::x\nBody::error::\\x1b[2J\x1b[1mbold\x1b[0m\n::as it was\n",
        "\\x07\n",
    )


def test_tables_and_sentences_are_never_broken_inside_a_word(monkeypatch, capsys):
    import sys

    from osimlite.cli._console import say, show_rows

    monkeypatch.setenv("COLUMNS", "60")
    path = "results/subject01/a_very_long_name_of_a_setup_of_inverse_dynamics.xml"
    rows = [(path, "done", "0.10", "largest moment 12 N·m at 0.3 s"), ("b.xml", "failed", "", path)]
    show_rows(("setup", "", "s", ""), rows, right_aligned=(2,))
    out = capsys.readouterr().out
    assert out.count(path) == 2
    assert all(len(line) <= 60 or path in line for line in out.splitlines())
    show_rows(("setup", ""), [("a.xml", "one two three four five six seven eight nine ten eleven")])
    assert capsys.readouterr().out == (
        "setup\na.xml  one two three four five six seven eight nine ten\n       eleven\n"
    )
    # A message is one line in a pipe; a terminal wraps it.
    message = f"75 times from 0 to 1 s; wrote {path} and other files"
    say(message)
    assert capsys.readouterr().out == f"{message}\n"
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    say(message)
    assert path in capsys.readouterr().out.splitlines()


@pytest.mark.parametrize("columns", [40, 80, 120])
def test_tables_of_several_texts_are_never_broken_inside_a_word(monkeypatch, capsys, columns):
    from osimlite.cli._console import add_row, create_table, print_table

    monkeypatch.setenv("COLUMNS", str(columns))
    path = "/bodyset/pelvis/a_geometry_of_the_pelvis"
    table = create_table("Lost: a model")
    for heading in ("what", "translation", "components"):
        table.add_column(heading)
    add_row(table, f"{path}: the mesh file is missing", "left out; its path is drawn", "glut_max_r")
    add_row(table, "a force", "", "the model")
    print_table(table)
    out = capsys.readouterr().out
    assert path in out
    assert out.startswith("Lost: a model\n")
    for words in ("missing", "translation", "glut_max_r", "drawn"):
        assert words in out
    assert all(len(line) <= max(columns, len(path) + 1) for line in out.splitlines())
    # Rows that are too wide for the terminal are printed as blocks.
    assert ("    components: glut_max_r" in out) is (columns == 40)


@pytest.mark.parametrize(
    ("variables", "is_coloured"),
    [({}, False), ({"FORCE_COLOR": "1"}, True), ({"FORCE_COLOR": "1", "NO_COLOR": "1"}, False)],
)
def test_tables_have_colours_by_meaning_only(monkeypatch, capsys, variables, is_coloured):
    from osimlite.cli._console import add_row, create_table, print_table

    for name in ("NO_COLOR", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    table = create_table()
    for _ in range(2):
        table.add_column("")
    add_row(table, "bad", "12 N")
    print_table(table)
    red = "\033[31mbad\033[0m  12 N\n"
    assert capsys.readouterr().out == (red if is_coloured else "bad  12 N\n")
