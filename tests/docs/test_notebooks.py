"""The notebooks of the manual run from beginning to end, each in a folder of its own."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "notebooks"
SHOWN = {
    "walker": {"<iframe", "Pelvis_ty", "xarray"},
    "lint": {"OSIM512", "LeftShank", "Mended"},
    "gait2392": {"<iframe", "soleus_r"},
    "moment_arms": {"<iframe", "moment arms (m)"},
    "sweep": {"<iframe", "400 runs", "best:"},
    "mujoco": {"<iframe", "MuJoCo cannot say"},
}
"""What the outputs of each must have among them."""

nbformat = pytest.importorskip("nbformat", reason="needs nbformat (extra 'dev')")
nbclient = pytest.importorskip("nbclient", reason="needs nbclient (extra 'dev')")


def test_all_are_listed() -> None:
    assert {path.stem for path in FOLDER.glob("*.ipynb")} == {*SHOWN}


@pytest.mark.parametrize("name", SHOWN)
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::RuntimeWarning")
def test_it_runs(name: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    for package in ("ipykernel", "numba", "matplotlib", "xarray", "cma", "mujoco"):
        pytest.importorskip(package, reason=f"needs {package} (extra 'dev')")
    if name == "gait2392":
        models = request.getfixturevalue("shared") / "corpus" / "models"
        shutil.copyfile(
            models / "m0014" / "gait2392_thelen2003muscle.osim", tmp_path / "gait2392_thelen2003muscle.osim"
        )
    notebook = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in notebook.cells), "strip its outputs"
    nbclient.NotebookClient(
        notebook, timeout=120, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}
    ).execute()
    outputs = "".join(
        output.get("text", "") + output.get("data", {}).get("text/html", "")
        for cell in notebook.cells
        for output in cell.get("outputs", [])
    )
    assert all(words in outputs for words in SHOWN[name])
