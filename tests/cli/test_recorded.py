"""``kinematics`` and ``inverse-dynamics`` from the command line."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from osimlite.simulation.storage import read_sto, write_sto

pytest.importorskip("numpy", reason="needs numpy (extra 'sim')")


def _run(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "osimlite", *words], capture_output=True, text=True, cwd=folder, check=False
    )


def test_the_walker_in_a_recorded_motion(fixtures: Path, tmp_path: Path) -> None:
    walker = str(fixtures / "walker" / "DynamicWalkerModel.osim")
    times = [0.01 * k for k in range(20)]
    rows = [[0.1 * t, 30.0 * t * t, 2.0] for t in times]
    write_sto(tmp_path / "walk.mot", "walk", times, ("Pelvis_tx", "RKnee_rz", "emg"), rows, in_degrees=True)
    done = _run(tmp_path, "kinematics", walker, "walk.mot", "-o", "out")
    assert (done.returncode, done.stderr) == (0, "")
    assert "columns that name no coordinate, ignored: emg" in done.stdout
    bodies = read_sto(tmp_path / "out" / "bodies.sto")
    assert bodies.in_degrees
    assert bodies["RightShank_Oz"] - bodies["RightThigh_Oz"] == pytest.approx([row[1] for row in rows], abs=1e-9)
    done = _run(tmp_path, "inverse-dynamics", walker, "walk.mot", "-o", "out")
    assert (done.returncode, done.stderr) == (0, "")
    forces = read_sto(tmp_path / "out" / "inverse_dynamics.sto")
    assert forces["Pelvis_ty_force"][0] == pytest.approx(5.0 * 9.80665, rel=0.2)
    done = _run(tmp_path, "kinematics", walker, "nothing.mot")
    assert done.returncode == 2
    assert "nothing.mot: cannot read the file" in done.stderr
