"""Compare motions of random models with a live OpenSim 4.6: same steps and states with either engine."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.simulation import Simulation, read_sto
from tests.oracle.opensim_runs import simulated
from tests.oracle.random_models import RandomModel

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")
pytestmark = pytest.mark.oracle


# The GimbalJoint of seed 20 reaches gimbal lock, where the steps shrink without end, in OpenSim
# too.
@pytest.mark.parametrize("seed", [*range(20), *range(21, 25)])
def test_states_and_steps(seed, tmp_path):
    path = tmp_path / "model.osim"
    osimlite.write(RandomModel(seed).model, path)
    theirs = simulated(path, 0.3, 1e-6)
    model = osimlite.read(path)
    for engine in ("compiled", "bullet"):
        # OpenSim's derivatives are wrong where one coordinate drives several rotations.
        with Simulation(model, engine, opensim_derivatives=True) as simulation:
            trajectory = simulation.run(0.3, accuracy=1e-6, report_interval=0.3)
        trajectory.to_sto(tmp_path / "states.sto")
        ours = read_sto(tmp_path / "states.sto")
        assert ours.columns == theirs.columns
        assert trajectory.summary["steps"] == len(theirs.rows) - 1
        scale = 1.0 + np.abs(theirs.rows[-1]).max()
        assert np.abs(ours.rows[-1] - theirs.rows[-1]).max() < 1e-9 * scale
