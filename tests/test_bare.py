"""Commands in a real environment that has the base dependencies alone, without numpy."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.bare import BareEnvironment


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> BareEnvironment:
    return BareEnvironment(tmp_path_factory.mktemp("bare") / "environment")


def test_optional_packages_are_absent(bare: BareEnvironment, tmp_path: Path) -> None:
    done = bare.call(folder=tmp_path, code="import osimlite, numpy")
    assert done.stderr.splitlines()[-1] == "ModuleNotFoundError: No module named 'numpy'"


def test_a_custom_joint_is_validated(bare: BareEnvironment, fixtures: Path, tmp_path: Path) -> None:
    """The linter evaluates functions of joints without numpy."""
    models = sorted(str(path) for path in fixtures.glob("lint/*/*.osim") if b"<CustomJoint" in path.read_bytes())
    assert len(models) > 20
    done = bare.call("validate", "--no-cache", "--format", "json", *models, folder=tmp_path)
    assert done.returncode == 1 and done.stderr == ""
    assert "OSIM413" in {finding["code"] for finding in json.loads(done.stdout)}
