"""Simulate a predicted walk in OpenSim with the excitations of the optimal control solution only."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest

import osimlite
from benchmarks.predicted_walk import simulate_in_opensim
from osimlite.io.tables.storage import read_sto

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = [
    pytest.mark.oracle,
    pytest.mark.skipif(find_spec("casadi") is None, reason="needs the casadi package"),
]


# Script that evaluates the objective terms with OpenSim's Moco.
MOCO = """
import json
import opensim as osim
osim.Logger.setLevelString("Off")
solution = osim.MocoStudy("human-walks.omoco").solve()
solution.unseal()
solution.write("theirs.sto")
print(json.dumps({name: solution.getObjectiveTerm(name) for name in solution.getObjectiveTermNames()}))
"""
# Script that evaluates the objective terms with osimlite.
OURS = """
import json
from osimlite import moco
from osimlite.optimal.program import Program
program = Program(moco.build_problem("human-walks.omoco"))
print(json.dumps(moco.evaluate(program, moco.MocoTrajectory.read("theirs.sto"))[0]))
"""


@pytest.fixture
def build(tmp_path, repo):
    """Return a function that builds the model and its study with given solver settings.

    The function returns the file of the model.
    """

    def built(**settings):
        model = tmp_path / "human-walks.osim"
        command = [sys.executable, "-m", "osimlite", "build", "human-walks", "-o", str(model)]
        subprocess.run(command, cwd=repo, check=True, capture_output=True)
        study = osimlite.read_document(model.with_suffix(".omoco"))
        for name, value in settings.items():
            setattr(study.solver, name, value)
        osimlite.write(study, model.with_suffix(".omoco"))
        return model

    return built


@pytest.mark.full
def test_moco_has_the_same_costs(build, repo):
    """Objective terms agree at the guess, as Ipopt moves it away from the bounds."""
    model = build(num_mesh_intervals=4, optim_max_iterations=0)
    theirs, ours = (
        json.loads(
            subprocess.run(
                [sys.executable, "-c", code],
                cwd=model.parent,
                env=os.environ | {"PYTHONPATH": str(repo)},
                check=True,
                capture_output=True,
                text=True,
            ).stdout.splitlines()[-1]
        )
        for code in (MOCO, OURS)
    )
    assert ours == pytest.approx(theirs, rel=1e-10)
    assert {*ours} == {"effort", "roughness"}


def test_opensim_walks_as_we_do(build):
    """Simulate the excitations of the guess in both programs, until the walker has fallen a little.

    The guess is the same on all processors.
    """
    model = build(num_mesh_intervals=16)
    stride, step = read_sto(model.with_name("human-walks_guess.sto")), 0.25
    opensim.Logger.setLevelString("Error")
    times, theirs = simulate_in_opensim(opensim, model, stride, step)
    controls = {name: stride[name] for name in stride.columns if name.count("/") == 2}
    ours = osimlite.simulate(
        osimlite.read(model),
        step,
        accuracy=1e-8,
        report_interval=step / 2000,
        initial={name: float(stride[name][0]) for name in stride.columns if name.count("/") > 2},
        controls={
            name: (stride.times[np.isfinite(column)], column[np.isfinite(column)])
            for name, column in controls.items()
        },
    )
    for k, info in enumerate(ours.mechanism.coordinates):
        name = f"{info.path}/value"
        off = np.abs(np.interp(times, ours.times, ours.values[:, k]) - theirs[name])
        assert off.max() < 1e-6, name
        # The error of the coarse mesh has not grown much after half a step.
    half = len(times) // 2
    assert np.min(theirs["/jointset/ground_pelvis/pelvis_ty/value"][:half]) > 0.85
    way = theirs["/jointset/ground_pelvis/pelvis_tx/value"][half]
    assert way == pytest.approx(stride["/jointset/ground_pelvis/pelvis_tx/value"][half], abs=0.05)
