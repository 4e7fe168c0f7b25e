"""Run the notebooks of the manual from beginning to end, each in a new folder."""

from __future__ import annotations

import re
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "notebooks"
SHOWN = {
    "walker": {"<iframe", "Pelvis_ty", "xarray"},
    "lint": {"OSIM512", "LeftShank", "Applied"},
    "gait2392": {"<iframe", "soleus_r"},
    "moment_arms": {"<iframe", "moment arms (m)"},
    "sweep": {"<iframe", "400 runs", "best:"},
    "mujoco": {"<iframe", "MuJoCo cannot say"},
    "whole_subject": {"<iframe", "worst_marker", "afterwards"},
}
"""Texts that the outputs of each notebook must contain."""

# Only check that packages exist: every process of pytest collects this module, and importing them
# is slow.
for package in ("ipykernel", "nbclient", "matplotlib", "xarray", "cma", "mujoco", "mkdocs"):
    if find_spec(package) is None:
        pytest.skip(f"needs {package} (extra 'dev')", allow_module_level=True)


def test_all_are_listed() -> None:
    assert {path.stem for path in FOLDER.glob("*.ipynb")} == {*SHOWN}


@pytest.mark.parametrize(
    "name",
    ["lint", *(pytest.param(name, marks=pytest.mark.full) for name in SHOWN if name != "lint")],
)
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::RuntimeWarning")
def test_it_runs(name: str) -> None:
    nbformat, notebooks = import_module("nbformat"), import_module("docs._notebooks")
    path = FOLDER / f"{name}.ipynb"
    kept = nbformat.read(path, as_version=4)
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in kept.cells), (
        "strip its outputs"
    )
    notebook = notebooks.execute_notebook(path)
    if not any(cell.get("outputs") for cell in notebook.cells):
        pytest.skip(
            f"needs {notebook.metadata['needs']}, beside the notebook or in the shared folder"
        )
    text = "\n\n".join(notebooks.convert_cells(path, notebook))
    shown = notebooks.on_page_content(re.sub(r"^output .*$", r"<p>\g<0></p>", text, flags=re.M))
    assert all(words in shown for words in SHOWN[name]) and "<p>output" not in shown


def test_an_executed_notebook_is_cached_until_something_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    nbformat, notebooks = import_module("nbformat"), import_module("docs._notebooks")
    runs: list[Path] = []

    def execute(path: Path) -> Any:
        runs.append(path)
        notebook = notebooks.read(path)
        notebook.cells[0].outputs = [nbformat.v4.new_output("stream", text=f"run {len(runs)}")]
        return notebook

    def write(source: str) -> None:
        cells = [nbformat.v4.new_code_cell(source, id="first")]
        nbformat.write(nbformat.v4.new_notebook(cells=cells), path)

    def read_output() -> str:
        return str(notebooks.execute_with_cache(path).cells[0].outputs[0].text)

    path = tmp_path / "a.ipynb"
    monkeypatch.setattr(notebooks, "execute_notebook", execute)
    monkeypatch.setattr(notebooks, "user_cache_folder", lambda: tmp_path / "cache")
    write("1")
    assert [read_output(), read_output()] == ["run 1", "run 1"]
    write("2")
    assert read_output() == "run 2"
    monkeypatch.setattr(notebooks, "list_sources", lambda: "another version of osimlite")
    assert [read_output(), read_output()] == ["run 3", "run 3"]
    monkeypatch.setattr(notebooks, "user_cache_folder", lambda: None)
    assert [read_output(), read_output()] == ["run 4", "run 5"]
