"""Tests of the files of a release: version, dependencies and metadata agree with the package."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement

import osimlite

yaml = pytest.importorskip("yaml", reason="needs PyYAML (extra 'yaml')")
LINUX = {"sys_platform": "linux", "platform_machine": "x86_64", "python_version": "3.12"}


def read(path: Path) -> Any:
    """Read a YAML or JSON file of the repository; skip the test if a source distribution lacks the file."""
    if not path.exists():
        pytest.skip(f"{path.name} is in the repository only")
    return yaml.safe_load(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("file", "version"),
    [
        ("CITATION.cff", lambda found: found["version"]),
        ("packaging/conda/recipe.yaml", lambda found: found["context"]["version"]),
        ("editors/vscode/package.json", lambda found: found["version"]),
        ("editors/vscode/package-lock.json", lambda found: found["packages"][""]["version"]),
    ],
)
def test_every_file_has_the_version_of_the_package(
    repo: Path, file: str, version: Callable[[Any], str]
) -> None:
    assert version(read(repo / file)) == osimlite.__version__ == metadata.version("osimlite")


def test_the_changelog_begins_with_this_version(repo: Path) -> None:
    text = (repo / "CHANGELOG.md").read_text(encoding="utf-8")
    assert text.split("\n## ", 2)[1].startswith(f"[{osimlite.__version__}] - ")


def test_conda_installs_what_pip_does(repo: Path) -> None:
    wanted = {
        f"{item.name} {item.specifier}"
        for item in map(Requirement, metadata.requires("osimlite") or [])
        for extra in ("", "sim", "view")
        if item.name != "osimlite"
        and (item.marker is None or item.marker.evaluate({**LINUX, "extra": extra}))
    }
    recipe = read(repo / "packaging" / "conda" / "recipe.yaml")
    python = metadata.metadata("osimlite")["Requires-Python"]
    assert {*recipe["requirements"]["run"]} == wanted | {f"python {python}"}


def test_workflows_can_be_read_and_run_nothing_of_a_stranger_with_rights(repo: Path) -> None:
    files = sorted((repo / ".github" / "workflows").glob("*.yml"))
    assert {"tests", "full", "release", "docs"} <= {file.stem for file in files}
    for file in files:
        workflow = read(file)
        assert workflow["jobs"] and workflow["permissions"]["contents"] == "read"
        # YAML 1.1 reads the key `on` as true.
        assert "pull_request_target" not in workflow[True]


@pytest.mark.parametrize("command", [["actionlint"], ["cffconvert", "--validate"]])
def test_programs_that_check_these_files_are_content(repo: Path, command: list[str]) -> None:
    program = shutil.which(command[0])
    if program is None or not (repo / ".github").exists():
        pytest.skip(f"needs the program '{command[0]}', and the repository")
    done = subprocess.run(
        [program, *command[1:]], cwd=repo, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
