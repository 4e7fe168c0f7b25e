"""Compare dampers that integrate dissipated energy with a live OpenSim 4.6: steps and state tables."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.simulation import read_sto
from tests.oracle.opensim_runs import simulated
from tests.simulation.damped import damped

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")
pytestmark = pytest.mark.oracle


@pytest.mark.parametrize("accuracy", [1e-4, 1e-8])
@pytest.mark.parametrize("engine", ["bullet", "compiled"])
def test_states_and_steps(engine, accuracy, tmp_path):
    osimlite.write(damped(), tmp_path / "model.osim")
    theirs = simulated(tmp_path / "model.osim", 0.5, accuracy)
    trajectory = osimlite.simulate(damped(), 0.5, accuracy=accuracy, engine=engine)
    trajectory.to_sto(tmp_path / "states.sto")
    ours = read_sto(tmp_path / "states.sto")
    assert ours.columns == theirs.columns
    assert trajectory.summary["steps"] == len(theirs.rows) - 1
    assert np.abs(ours.rows[-1] - theirs.rows[-1]).max() < 1e-12


@pytest.mark.parametrize("engine", ["bullet", "compiled"])
def test_components_anywhere_have_their_places_in_the_table(engine, tmp_path):
    """Dampers outside the ForceSet keep OpenSim's order of states.

    States of components that the model or a body holds precede those of all coordinates.
    """
    model = damped()
    force_set = model.force_set.objects
    slack, stop = force_set.pop(0), force_set.pop(0)
    model.subcomponents.append(slack)
    model.body_set.objects[1].subcomponents.append(stop)
    osimlite.write(model, tmp_path / "model.osim")
    model = osimlite.read(tmp_path / "model.osim")
    theirs = simulated(tmp_path / "model.osim", 0.2, 1e-6)
    assert theirs.columns[:2] == ("/slack/dissipated_energy", "/bodyset/b1/stop/dissipatedEnergy")
    trajectory = osimlite.simulate(model, 0.2, accuracy=1e-6, engine=engine)
    trajectory.to_sto(tmp_path / "states.sto")
    ours = read_sto(tmp_path / "states.sto")
    assert ours.columns == theirs.columns
    assert trajectory.summary["steps"] == len(theirs.rows) - 1
    assert np.abs(ours.rows[-1] - theirs.rows[-1]).max() < 1e-12
