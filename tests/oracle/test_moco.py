"""OpenSim's MocoTrajectory reads the solutions that are written here."""

from __future__ import annotations

import subprocess
import sys
from importlib.util import find_spec

import pytest

from tests.optimal.studies import moco_said, study_file

pytestmark = pytest.mark.skipif(find_spec("casadi") is None, reason="needs the casadi package")


@pytest.mark.parametrize("name", ["pendulum-50"])
def test_solutions_are_read(name, tmp_path, repo):
    osim = pytest.importorskip("opensim")
    file = study_file(tmp_path, name)
    # CasADi and OpenSim cannot be loaded into one process.
    command = [sys.executable, "-m", "osimlite", "run", str(file), "-o", str(tmp_path)]
    done = subprocess.run(command, cwd=repo, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "largest violation /jointset/j1/q1/speed defect at" in done.stderr
    path = str(tmp_path / "MocoStudy_solution.sto")
    trajectory = osim.MocoTrajectory(path)
    assert trajectory.getNumTimes() == 101
    assert next(iter(trajectory.getStateNames())) == "/jointset/j0/q0/value"
    assert trajectory.getFinalTime() == pytest.approx(moco_said(name)["final_time"], rel=1e-6)
