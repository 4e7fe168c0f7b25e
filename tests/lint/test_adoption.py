"""Check the integration into other repositories: pre-commit hook, GitHub Action, and their guide."""

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
from osimlite.lint.settings import load_settings
from tests.cli.command import run

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
        files = [
            name
            for name in ("models/walker.osim", "ik.xml", "walk.mot", "a.osim.bak")
            if re.search(hook["files"], name)
        ]
        assert (
            files
            == ["models/walker.osim", "ik.xml", "walk.mot"][: 3 if command == "validate" else 2]
        )
    assert [hook["id"] for hook in hooks] == ["osimlite-validate", "osimlite-format"]


def test_the_guide_names_hooks_and_inputs_that_exist(repo: Path, guide: str) -> None:
    hooks = {
        hook["id"]
        for hook in yaml.safe_load((repo / ".pre-commit-hooks.yaml").read_text(encoding="utf-8"))
    }
    inputs = yaml.safe_load((repo / "action.yml").read_text(encoding="utf-8"))["inputs"].keys()
    parsed = [yaml.safe_load(block) for block in blocks(guide, "yaml")]
    assert {hook["id"] for hook in parsed[0]["repos"][0]["hooks"]} == hooks
    (step,) = [
        step for step in parsed[1]["jobs"]["validate"]["steps"] if "osimlite@" in step["uses"]
    ]
    assert step["with"].keys() <= inputs


def test_hooks_pass_over_xml_of_others(repo: Path, tmp_path: Path) -> None:
    (tmp_path / "pom.xml").write_text("<project>\n<a/></project>")
    (tmp_path / "a.sto").write_text("a\ninDegrees=true\nendheader\ntime\ta\n0\t0\n")
    (tmp_path / "id.xml").write_text(
        '<OpenSimDocument Version="40600"><InverseDynamicsTol /></OpenSimDocument>'
    )
    for hook in yaml.safe_load((repo / ".pre-commit-hooks.yaml").read_text(encoding="utf-8")):
        _, *command = hook["entry"].split()
        done = run(*command, "pom.xml", folder=tmp_path)
        assert (done.code, done.err) == (0, "")
        names = [name for name in ("pom.xml", "id.xml", "a.sto") if re.search(hook["files"], name)]
        done = run(*command, *names, folder=tmp_path)
        assert done.code and all(name in done.out + done.err for name in names if name != "pom.xml")
        assert "pom.xml" not in done.out + done.err
    assert (tmp_path / "pom.xml").read_text() == "<project>\n<a/></project>"


on_bash = pytest.mark.skipif(sys.platform == "win32", reason="the action runs bash")


def steps(repo: Path) -> list[dict[str, Any]]:
    result = yaml.safe_load((repo / "action.yml").read_text(encoding="utf-8"))["runs"]["steps"]
    return [step for step in result if "run" in step]


def act(
    repo: Path, folder: Path, paths: str, fail_on: str = ""
) -> subprocess.CompletedProcess[str]:
    """Run the last step of the action in a folder, as GitHub does."""
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    given = {"PATHS": paths, "FORMAT": "github", "FAIL_ON": fail_on, "BASELINE": "", "PATH": path}
    return subprocess.run(
        ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", steps(repo)[-1]["run"]],
        env={**os.environ, **given}, capture_output=True, text=True, cwd=folder,
    )  # fmt: skip


def checked(done: subprocess.CompletedProcess[str]) -> list[str]:
    """Return the files with findings in the output of the action."""
    return sorted(set(re.findall(r",file=([^,]+),", done.stdout)))


@on_bash
def test_the_action_validates(repo: Path, fixtures: Path, tmp_path: Path) -> None:
    assert all(step["shell"] == "bash" for step in steps(repo))
    walker = fixtures / "walker" / "DynamicWalkerModel.osim"
    for fail_on, code in (("", 0), ("error", 0), ("info", 1)):
        done = act(repo, tmp_path, str(walker), fail_on)
        assert done.returncode == code, done.stderr
        assert done.stdout.startswith("::notice title=OSIM508 limit-outside-range,file=")


@on_bash
@pytest.mark.parametrize(
    ("paths", "found"),
    [
        ("a.osim b.osim", ["a.osim", "b.osim"]),
        ("a.osim\nb.osim\n  sub/c.osim\n", ["a.osim", "b.osim", "sub/c.osim"]),
        ("*.osim", ["--fix.osim", "a.osim", "b.osim"]),
        ("**/*.osim", ["--fix.osim", "a.osim", "b.osim", "sub/c.osim", "sub/deep/d e.osim"]),
        ("sub/deep/d?e.osim\tsub", ["sub/c.osim", "sub/deep/d e.osim"]),
        ("-v", ["-v"]),
        ("--fix.osim", ["--fix.osim"]),
    ],
)
def test_the_action_checks_every_path(
    repo: Path, tmp_path: Path, paths: str, found: list[str]
) -> None:
    wrong = '<OpenSimDocument Version="40600"><Model><gravty/></Model></OpenSimDocument>'
    for name in ("a.osim", "b.osim", "-v", "--fix.osim", "sub/c.osim", "sub/deep/d e.osim"):
        place = tmp_path / name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(wrong)
    done = act(repo, tmp_path, paths)
    assert (done.returncode, checked(done)) == (1, found), done.stderr


@on_bash
def test_the_action_checks_setups_and_tables(repo: Path, tmp_path: Path) -> None:
    (tmp_path / "pom.xml").write_text("<project/>")
    (tmp_path / "a.sto").write_text("a\ninDegrees=true\nendheader\ntime\ta\n0\t0\n")
    (tmp_path / "id.xml").write_text(
        '<OpenSimDocument Version="40600"><InverseDynamicsTol /></OpenSimDocument>'
    )
    for paths in (".", "*.xml *.sto"):
        done = act(repo, tmp_path, paths)
        assert (done.returncode, checked(done)) == (1, ["a.sto", "id.xml"]), done.stdout


@on_bash
@pytest.mark.parametrize("paths", ["gone.osim", "a.osim\ngone.osim", "a.osim gone/*.osim"])
def test_what_the_action_does_not_find_fails_it(repo: Path, tmp_path: Path, paths: str) -> None:
    (tmp_path / "a.osim").write_text('<OpenSimDocument Version="40600"><Model /></OpenSimDocument>')
    done = act(repo, tmp_path, paths)
    assert done.returncode == 2 and "gone" in done.stderr


@on_bash
def test_the_action_executes_nothing_of_what_was_checked_out(repo: Path, tmp_path: Path) -> None:
    """The folder has modules with the names of osimlite, of its libraries, and of Python's own modules."""
    for name in ("osimlite", "lxml", "pip", "typer", "multiprocessing", "json", "sitecustomize"):
        (tmp_path / f"{name}.py").write_text("print('executed'); raise SystemExit(0)")
        (tmp_path / name).mkdir()
        for module in ("__init__", "__main__"):
            (tmp_path / name / f"{module}.py").write_text("print('executed'); raise SystemExit(0)")
    (tmp_path / "a.osim").write_text(
        '<OpenSimDocument Version="40600"><Model><gravty/></Model></OpenSimDocument>'
    )
    done = act(repo, tmp_path, "a.osim")
    assert (done.returncode, checked(done)) == (
        1,
        ["a.osim"],
    ) and "executed" not in done.stdout + done.stderr
    assert not (tmp_path / ".osimlite_cache").exists()
    pythons = [
        line
        for step in steps(repo)
        for line in step["run"].splitlines()
        if line.strip().startswith("python")
    ]
    assert len(pythons) == 2 and all(line.strip().startswith("python -I -m ") for line in pythons)


def test_the_settings_of_the_guide_are_settings(guide: str, tmp_path: Path, fixtures: Path) -> None:
    (block,) = blocks(guide, "toml")
    assert tomllib.loads(block)
    (tmp_path / "pyproject.toml").write_text(block)
    (tmp_path / "my_classes.json").write_text('{"classes": {}}')
    settings = load_settings(tmp_path)
    walker = fixtures / "walker" / "DynamicWalkerModel.osim"
    other = settings.config_for(tmp_path / "walker.osim", Config())
    result = [finding for finding in validate(walker, config=other) if finding.code == "OSIM508"]
    assert [finding.severity.value for finding in result] == ["warning", "warning"]
    left_out = settings.config_for(tmp_path / "gait10dof.osim", Config())
    assert "OSIM508" not in validate(walker, config=left_out).codes
    assert settings.config_for(tmp_path / "archive" / "x.osim", Config()).ignore == (
        "OSIM701",
        "structure",
    )
    codes = {word for word in re.findall(r"OSIM\d{3}", guide)}
    assert codes <= {rule.code for rule in all_rules()}


def test_the_test_of_the_guide_passes(guide: str, tmp_path: Path) -> None:
    (block,) = blocks(guide, "python")
    names: dict[str, Any] = {}
    exec(compile(block, "lint-in-ci.md", "exec"), names)
    names["test_the_walker_is_sound"](tmp_path)


def test_assert_valid_says_everything(tmp_path: Path) -> None:
    path = tmp_path / "m.osim"
    path.write_text(
        '<OpenSimDocument Version="40600"><Model><gravty/><foo/></Model></OpenSimDocument>'
    )
    with pytest.raises(AssertionError, match=r"(?s)gravty.*foo"):
        assert_valid(path)
    assert_valid(path, ignore=["structure"])


def test_options_of_the_guide_exist(guide: str) -> None:
    help_text = subprocess.run(
        [sys.executable, "-m", "osimlite", "validate", "--help"],
        capture_output=True, text=True, check=True, env={**os.environ, "COLUMNS": "200", "NO_COLOR": "1"},
    ).stdout  # fmt: skip
    options = set(re.findall(r"--[a-z][a-z-]*", guide))
    assert options
    for option in options:
        assert option in help_text, option
