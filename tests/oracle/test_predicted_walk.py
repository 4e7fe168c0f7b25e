"""The walk that optimal control finds, driven in OpenSim with nothing but the excitations that were found."""

from __future__ import annotations

import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest

import osimlite
from benchmarks.predicted_walk import forward
from osimlite.simulation.files.storage import read_sto

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytest.importorskip("numba", reason="needs numba (extra 'sim')")
pytestmark = [pytest.mark.oracle, pytest.mark.skipif(find_spec("casadi") is None, reason="needs the casadi package")]


def test_opensim_walks_as_we_do(tmp_path, repo):
    """For a step; then the motion, which nothing holds, has made some thousands of what it was off."""
    model = tmp_path / "human-walks.osim"
    study = model.with_suffix(".omoco")
    # CasADi and OpenSim cannot be loaded into one process.
    run = [sys.executable, "-m", "osimlite"]
    subprocess.run([*run, "build", "human-walks", "-o", str(model)], cwd=repo, check=True, capture_output=True)
    given = osimlite.read_document(study)
    given.solver.num_mesh_intervals, given.solver.optim_convergence_tolerance = 16, 1e-2
    osimlite.write(given, study)
    subprocess.run([*run, "run", str(study), "-o", str(tmp_path)], cwd=repo, check=True, capture_output=True)
    stride = read_sto(tmp_path / "human-walks_stride.sto")
    step = float(stride.times[len(stride.times) // 2])
    opensim.Logger.setLevelString("Error")
    times, theirs = forward(opensim, model, stride, step)
    controls = {name: stride[name] for name in stride.columns if name.count("/") == 2}
    ours = osimlite.simulate(
        osimlite.read(model),
        step,
        accuracy=1e-8,
        report_interval=step / 2000,
        initial={name: float(stride[name][0]) for name in stride.columns if name.count("/") > 2},
        controls={
            name: (stride.times[np.isfinite(column)], column[np.isfinite(column)]) for name, column in controls.items()
        },
    )
    for k, info in enumerate(ours.mechanism.coordinates):
        name = f"{info.path}/value"
        off = np.abs(np.interp(times, ours.times, ours.values[:, k]) - theirs[name])
        assert off.max() < 1e-5, name
        # What the coarse mesh was off has not grown much after half a step.
        assert np.abs(theirs[name] - stride[name][: len(times)])[: len(times) // 2].max() < 0.05, name
    assert np.min(theirs["/jointset/ground_pelvis/pelvis_ty/value"]) > 0.85
    assert theirs["/jointset/ground_pelvis/pelvis_tx/value"][-1] == pytest.approx(1.2 * step, abs=0.05)
