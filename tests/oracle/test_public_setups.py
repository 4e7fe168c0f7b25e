"""Compare public setups of laboratories, with measured motions and loads, with a live OpenSim."""

from __future__ import annotations

import gzip
import re
import shutil
from pathlib import Path

import pytest

import osimlite
from tests.oracle.support import compare
from tests.scripts import run_script

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

GAIT10, GAIT2354 = "gait10_subject01", "gait2354_subject01_simbody"
# Tool, setup, model and motion of each case.
CASES = {
    "walk": (
        "InverseDynamicsTool",
        "id_gait10/walk_Setup_ID.xml",
        GAIT10,
        "ik_gait10/subject01_walk_IK.mot",
    ),
    "loads on bodies": (
        "InverseDynamicsTool",
        "id_gait10/noloads_id.xml",
        GAIT10,
        "id_gait10/noloads_coords.mot",
    ),
    "gait2354": (
        "InverseDynamicsTool",
        "ik_id_gait2354/subject01_Setup_InverseDynamics.xml",
        GAIT2354,
        "ik_id_gait2354/ik_accuracy_1e-9.mot.gz",
    ),
    "six analyses": ("AnalyzeTool", "analyses_gait10/an.xml", GAIT10, "analyses_gait10/coords.mot"),
}


@pytest.mark.parametrize(("tool", "setup", "model", "motion"), CASES.values(), ids=CASES)
def test_numbers_of_opensim(
    shared: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    tool: str,
    setup: str,
    model: str,
    motion: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    place = shared / "oracle" / "tools" / "reference"
    for file in [
        *(place / setup).parent.iterdir(),
        place / "models" / f"{model}.osim.gz",
        place / motion,
    ]:
        if file.suffix == ".gz" and file.name.count(".") > 1 and ".tar" not in file.name:
            (tmp_path / file.name.removesuffix(".gz")).write_bytes(
                gzip.decompress(file.read_bytes())
            )
        else:
            shutil.copy(file, tmp_path)
    text = (place / setup).read_text()
    named = {
        "model_file": f"{model}.osim",
        "coordinates_file": Path(motion).name.removesuffix(".gz"),
    }
    for tag, name in named.items():
        text = re.sub(f"<{tag}>[^<]*<", f"<{tag}>{name}<", text)
    text = re.sub(
        r"\.\./\w+/", "", re.sub(r"<results_directory>[^<]*</results_directory>", "", text)
    )
    for results in ("ours", "theirs"):
        own = re.sub(
            f"(<{tool} .*?>)", rf"\1<results_directory>{results}</results_directory>", text, count=1
        )
        (tmp_path / f"{results}.xml").write_text(own)
    script = f"import opensim; opensim.Logger.setLevelString('Error'); assert opensim.{tool}('theirs.xml').run()"
    run_script(script)
    osimlite.run(tmp_path / "ours.xml")
    # OpenSim writes inverse dynamics with eight decimals.
    compare(tmp_path / "ours", tmp_path / "theirs", 1e-8, 1e-6 if tool == "AnalyzeTool" else 1.5e-8)
