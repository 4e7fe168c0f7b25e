"""Tests of packaging/regenerate.py: generated files are current, and the script finds outdated ones."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

pytest.importorskip("grimp", reason="needs import-linter (extra 'dev')")


@pytest.fixture(scope="module")
def regenerate() -> ModuleType:
    """Import packaging/regenerate.py as a module."""
    path = Path(__file__).resolve().parents[2] / "packaging" / "regenerate.py"
    spec = importlib.util.spec_from_file_location("regenerate", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_all_generated_files_are_current(regenerate: ModuleType) -> None:
    assert [*regenerate.find_stale()] == []


def test_a_stale_file_is_found_and_written(
    regenerate: ModuleType,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(regenerate, "GENERATED", {"page.md": lambda: "new"})
    path = tmp_path / "page.md"
    assert regenerate.main(["--check"], tmp_path) == 1
    assert not path.exists()
    path.write_text("old", encoding="utf-8")
    capsys.readouterr()
    assert regenerate.main([], tmp_path) == 0
    assert capsys.readouterr().out == "wrote page.md\n"
    assert path.read_text(encoding="utf-8") == "new"
    assert regenerate.main(["--check"], tmp_path) == 0


def test_what_other_commands_make_is_listed(
    regenerate: ModuleType, capsys: pytest.CaptureFixture[str]
) -> None:
    assert regenerate.main(["--list"]) == 0
    listed = capsys.readouterr().out
    assert (
        "docs/rules.md: this script\n" in listed
        and "benchmarks/cost.json: python benchmarks/cost.py" in listed
    )
