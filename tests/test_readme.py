"""Tests of the README: its examples run, and its commands and options exist."""

from __future__ import annotations

import re
import shlex
from importlib import import_module
from pathlib import Path

import pytest

import osimlite
from osimlite.cli import COMMANDS
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.models.source import make_model
from tests.cli.command import run


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def test_the_library_examples_run(
    repo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    osimlite.write(dynamic_walker(), "walker.osim")
    result = blocks((repo / "README.md").read_text(), "python")
    assert result
    for block in result:
        exec(compile(block, "README.md", "exec"), {})
    assert (tmp_path / "states.sto").exists() and (tmp_path / "copy.osim").exists()


def test_the_yaml_of_the_guide_is_a_model(repo: Path, tmp_path: Path) -> None:
    pytest.importorskip("yaml", reason="needs PyYAML (extra 'yaml')")
    (tmp_path / "model.yaml").write_text(blocks((repo / "docs" / "yaml.md").read_text(), "yaml")[0])
    model = make_model(str(tmp_path / "model.yaml"))
    assert osimlite.validate(model).ok
    assert [c.path for c in model.components(osimlite.Coordinate)] == ["/jointset/hinge/angle"]


def test_every_command_named_exists_and_every_command_is_named(repo: Path) -> None:
    text = (repo / "README.md").read_text()
    named = set(re.findall(r"^osimlite ([a-z-]+)", "\n".join(blocks(text, "sh")), re.M))
    rows = set(re.findall(r"^\|[^|]+\| `osimlite ([a-z-]+)` \|", text, re.M))
    assert rows == set(COMMANDS)
    assert named <= rows


def test_the_examples_of_the_table_have_existing_options(repo: Path) -> None:
    examples = re.findall(r"\| `(osimlite [^`]+)` \|$", (repo / "README.md").read_text(), re.M)
    assert len(examples) > 20
    for example in examples:
        command, *words = shlex.split(example)[1:]
        module = import_module(f"osimlite.cli.{command.replace('-', '_')}")
        parameters = getattr(module, command.replace("-", "_")).parameters()
        options = {spelling for each in parameters for spelling in each.spellings}
        assert {word for word in words if re.fullmatch(r"--?[a-z-]+", word)} <= options, example


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command: str) -> None:
    done = run(command, "--help")
    assert done.code == 0
    assert "Usage: osimlite" in done.out and len(done.out.splitlines()) > 5
