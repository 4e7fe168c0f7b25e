"""Compare the height that the jumper model reaches in OpenSim 4.6 with osimlite."""

from __future__ import annotations

import pytest

import osimlite
from osimlite.models.jumper import jumper
from osimlite.simulation import Simulation

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
from tests.oracle.opensim_runs import simulated

pytestmark = pytest.mark.oracle


def test_opensim_rises_alike(tmp_path):
    """Up to the highest point of the mass center, with all muscles and contacts active.

    The tolerance of 1e-5 m is less than the error of one step.
    """
    osimlite.write(jumper(), tmp_path / "jumper.osim")
    theirs = simulated(tmp_path / "jumper.osim", 0.48, 1e-5)
    with Simulation(jumper(), "compiled") as simulation:
        motion = simulation.run(0.48, accuracy=1e-8)
    last = dict(zip(theirs.columns, theirs.rows[-1], strict=True))
    ours = dict(zip(motion.coordinates, motion.values[-1], strict=True))
    result = {path.split("/")[-2]: value for path, value in last.items() if path.endswith("/value")}
    assert result == pytest.approx(ours, abs=1e-5)
