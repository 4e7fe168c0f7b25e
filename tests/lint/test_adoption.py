"""The ways into other repositories: the pre-commit hook, the GitHub Action, and the guide to them."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

from osimlite.cli import COMMANDS
from osimlite.lint import Config, all_rules, assert_valid, validate
from osimlite.lint.settings import settings_for

yaml = pytest.importorskip("yaml", reason="needs pyyaml (extra 'yaml')")


@pytest.fixture
def guide(repo: Path) -> str:
    return (repo / "docs" / "lint-in-ci.md").read_text(encoding="utf-8")


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def test_hooks_call_commands_that_exist(repo: Path) -> None:
    hooks = yaml.safe_load((repo / ".pre-commit-hooks.yaml").read_text(encoding="utf-8"))
    for hook in hooks:
        program, command, *_ = hook["entry"].split()
        assert program == "osimlite" and command in COMMANDS
        assert re.search(hook["files"], "models/walker.osim") and not re.search(hook["files"], "walker.osim.bak")
    assert [hook["id"] for hook in hooks] == ["osimlite-validate", "osimlite-format"]


def test_the_guide_names_hooks_and_inputs_that_exist(repo: Path, guide: str) -> None:
    hooks = {hook["id"] for hook in yaml.safe_load((repo / ".pre-commit-hooks.yaml").read_text(encoding="utf-8"))}
    inputs = yaml.safe_load((repo / "action.yml").read_text(encoding="utf-8"))["inputs"].keys()
    parsed = [yaml.safe_load(block) for block in blocks(guide, "yaml")]
    assert {hook["id"] for hook in parsed[0]["repos"][0]["hooks"]} == hooks
    (step,) = [step for step in parsed[1]["jobs"]["validate"]["steps"] if "osimlite@" in step["uses"]]
    assert step["with"].keys() <= inputs


@pytest.mark.skipif(sys.platform == "win32", reason="the action runs bash")
def test_the_action_validates(repo: Path, fixtures: Path, tmp_path: Path) -> None:
    steps: list[dict[str, Any]] = yaml.safe_load((repo / "action.yml").read_text(encoding="utf-8"))["runs"]["steps"]
    assert all(step["shell"] == "bash" for step in steps if "run" in step)
    script = steps[-1]["run"].replace("python -m", f"'{sys.executable}' -m")
    walker = fixtures / "walker" / "DynamicWalkerModel.osim"
    given = {"FORMAT": "github", "BASELINE": "", "XDG_CACHE_HOME": str(tmp_path), "PYTHONPATH": str(repo)}
    for fail_on, code in (("", 0), ("error", 0), ("info", 1)):
        done = subprocess.run(
            ["bash", "-e", "-c", script],
            env={**os.environ, **given, "PATHS": str(walker), "FAIL_ON": fail_on},
            capture_output=True, text=True, cwd=tmp_path,
        )  # fmt: skip
        assert done.returncode == code, done.stderr
        assert done.stdout.startswith("::notice title=OSIM508 limit-outside-range,file=")


def test_the_settings_of_the_guide_are_settings(guide: str, tmp_path: Path, fixtures: Path) -> None:
    (block,) = blocks(guide, "toml")
    assert tomllib.loads(block)
    (tmp_path / "pyproject.toml").write_text(block)
    settings = settings_for(tmp_path)
    walker = fixtures / "walker" / "DynamicWalkerModel.osim"
    other = settings.config_for(tmp_path / "walker.osim", Config())
    found = [finding for finding in validate(walker, config=other) if finding.code == "OSIM508"]
    assert [finding.severity.value for finding in found] == ["warning", "warning"]
    left_out = settings.config_for(tmp_path / "gait10dof.osim", Config())
    assert "OSIM508" not in validate(walker, config=left_out).codes
    assert settings.config_for(tmp_path / "archive" / "x.osim", Config()).ignore == ("OSIM701", "structure")
    codes = {word for word in re.findall(r"OSIM\d{3}", guide)}
    assert codes <= {rule.code for rule in all_rules()}


def test_the_test_of_the_guide_passes(guide: str, tmp_path: Path) -> None:
    (block,) = blocks(guide, "python")
    names: dict[str, Any] = {}
    exec(compile(block, "lint-in-ci.md", "exec"), names)
    names["test_the_walker_is_sound"](tmp_path)


def test_assert_valid_says_everything(tmp_path: Path) -> None:
    path = tmp_path / "m.osim"
    path.write_text('<OpenSimDocument Version="40600"><Model><gravty/><foo/></Model></OpenSimDocument>')
    with pytest.raises(AssertionError, match=r"(?s)gravty.*foo"):
        assert_valid(path)
    assert_valid(path, ignore=["structure"])


def test_options_of_the_guide_exist(guide: str) -> None:
    help_text = subprocess.run(
        [sys.executable, "-m", "osimlite", "validate", "--help"],
        capture_output=True, text=True, check=True, env={**os.environ, "COLUMNS": "200", "NO_COLOR": "1"},
    ).stdout  # fmt: skip
    options = set(re.findall(r"--[a-z-]+", guide))
    assert options
    for option in options:
        assert option in help_text, option
