"""The tour, as a newcomer takes it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import osimlite
from tests.cli.command import run

pytest.importorskip("matplotlib", reason="needs matplotlib (extra 'plot')")


def test_the_whole_tour(tmp_path: Path) -> None:
    done = run("demo", "-o", "out", folder=tmp_path)
    assert (done.code, done.err) == (0, "")
    folder = tmp_path / "out"
    assert {path.name for path in folder.iterdir()} >= {
        "DynamicWalkerModel.osim", "misspelt.osim", "urdf", "states.sto", "forces.sto", "summary.json",
        "coordinates.png", "contact_forces.png", "energy.png", "animation.gif",
    }  # fmt: skip
    assert osimlite.validate(folder / "DynamicWalkerModel.osim").ok
    assert "did you mean 'RFootContact'?" in done.out
    assert max(map(len, done.out.splitlines())) <= 80
    difference = re.search(r"at most\s+(\S+)\s+from", done.out)
    assert difference is not None and float(difference[1]) < 5e-3
    assert json.loads((folder / "summary.json").read_text())["steps"] > 100
