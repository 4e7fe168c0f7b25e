"""The tour, as a newcomer takes it."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

import osimlite

pytest.importorskip("pybullet", reason="needs pybullet (extra 'sim')")
pytest.importorskip("matplotlib", reason="needs matplotlib (extra 'plot')")


def test_the_whole_tour(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "osimlite", "demo", "-o", "out"],
        capture_output=True, text=True, cwd=tmp_path, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    folder = tmp_path / "out"
    assert {path.name for path in folder.iterdir()} >= {
        "DynamicWalkerModel.osim", "misspelt.osim", "urdf", "states.sto", "forces.sto", "summary.json",
        "coordinates.png", "contact_forces.png", "energy.png", "animation.gif",
    }  # fmt: skip
    assert osimlite.validate(folder / "DynamicWalkerModel.osim").ok
    assert "did you mean 'RFootContact'?" in done.stdout
    assert max(map(len, done.stdout.splitlines())) <= 80
    difference = re.search(r"at most\s+(\S+)\s+from", done.stdout)
    assert difference is not None and float(difference[1]) < 5e-3
    assert json.loads((folder / "summary.json").read_text())["steps"] > 100
