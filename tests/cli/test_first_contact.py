"""Tests of the commands that a newcomer types first, and of the next steps that their messages suggest."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import osimlite
from tests.cli.command import run
from tests.cli.support import loaded
from tests.simple_models import make_pendulum


@pytest.fixture
def box(tmp_path: Path) -> Path:
    osimlite.write(make_pendulum("b"), tmp_path / "box.osim")
    return tmp_path


@pytest.mark.parametrize("command", ["rule", "lsp", "doctor"])
def test_a_command_alone_is_read(command: str) -> None:
    assert loaded(command).complete([]) == [] and loaded(command).read([]) is not None


def test_without_words_the_help_is_printed(tmp_path: Path) -> None:
    done = run(folder=tmp_path)
    assert (done.code, done.err) == (0, "") and done.out == run("--help", folder=tmp_path).out
    assert "simulate" in done.out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("scone", "human-walk"), "did you mean 'human-walks', the built-in scenario?"),
        (("scone", "humanwalks"), "did you mean 'human-walks', the built-in scenario?"),
        (("simulate", "dynamic-walkr"), "did you mean the built-in model 'dynamic-walker'?"),
        (("view", "jumpr.osim"), "'osimlite build jumper -o jumper.osim' writes it"),
        (
            ("scale", "box.osim"),
            "there is nothing to scale; add --distance, --factor, --mass or --place",
        ),
        (("scale", "box.osim", "--preserve-masses"), "there is nothing to scale"),
        (
            ("scale", "box.osim", "--mass", "-72"),
            "--mass: expected a positive mass in kg, found -72",
        ),
        (("modify", "box.osim"), "there is nothing to replace; add --replace NAME=WORD"),
        (("simulate", "box.osim", "--to"), "'osimlite simulate --help' shows the usage"),
        (("simulate", "box.osim", "--to", "1 s"), "--to: expected a number, found '1 s'"),
        (
            ("simulate", "box.osim", "--to", "1", "--to=1,5"),
            "--to: expected a number, found '1,5'",
        ),
        (
            ("run", "box.osim", "--workers", "1.5"),
            "--workers: expected a whole number, found '1.5'",
        ),
        (("validate", "--format"), "'osimlite validate --help' shows the usage"),
        (("translate", "box.osim", "-o"), "'osimlite translate --help' shows the usage"),
        (("run-tool", "setup.xml", "--workers"), "'osimlite run --help' shows the usage"),
        (("--nothing",), "'osimlite --help' shows the usage"),
        (("explain", "OSIM301"), "No such command 'explain', use 'rule'"),
    ],
)
def test_errors_lead_on(box: Path, words: tuple[str, ...], said: str) -> None:
    done = run(*words, folder=box)
    assert done.code == 2 and done.out == ""
    assert said in done.err and done.err.count("\n") == 1
    assert [path.name for path in box.iterdir()] == ["box.osim"]


def test_a_name_that_is_near_by_chance_suggests_nothing(tmp_path: Path) -> None:
    assert "did you mean" not in run("info", "arm26.osim", folder=tmp_path).err


def test_check_without_a_file_compares_what_is_written(tmp_path: Path) -> None:
    pytest.importorskip("mujoco", reason="needs mujoco (extra 'mujoco')")
    assert run("build", "arm", "-o", "arm.osim", folder=tmp_path).code == 0
    for words in (("--check", "-o", "out"), ("-o", "out", "--check")):
        done = run("translate", "arm.osim", *words, folder=tmp_path)
        assert (done.code, done.err) == (0, ""), done.err
        assert "arm.xml: root mean square errors" in done.out
        assert json.loads((tmp_path / "out" / "check.json").read_text())["muscles"]
        assert (tmp_path / "out" / "fidelity.json").exists()
