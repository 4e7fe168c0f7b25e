"""Compare the compiled engine with OpenSim's Manager from random initial states."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.simulation import Simulation
from tests.suite import choose

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

# Final time (s), accuracy, and number of random starts.
UNTIL, ACCURACY, STARTS = 1.0, 1e-9, choose(2, 20)


@pytest.fixture(scope="module")
def path(fixtures):
    return str(fixtures / "walker" / "DynamicWalkerModel.osim")


def opensim_end(path, values, speeds):
    """Return the values of all coordinates at the end of an integration by OpenSim's Manager."""
    opensim.Logger.setLevelString("error")
    model = opensim.Model(path)
    state = model.initSystem()
    coordinates = model.getCoordinateSet()
    for name, value in values.items():
        coordinates.get(name).setValue(state, value, False)
    for name, speed in speeds.items():
        coordinates.get(name).setSpeedValue(state, speed)
    manager = opensim.Manager(model)
    manager.setIntegratorAccuracy(ACCURACY)
    manager.initialize(state)
    end = manager.integrate(UNTIL)
    return [coordinates.get(index).getValue(end) for index in range(coordinates.getSize())]


def test_random_starts(path):
    rng, errors = np.random.default_rng(4), []
    with Simulation(osimlite.read(path), "compiled") as simulation:
        free = [info for info in simulation.mechanism.coordinates if not info.locked]
        for _ in range(STARTS):
            values = {info.name: info.default_value + rng.uniform(-0.2, 0.2) for info in free}
            # The pelvis starts above the platform, so that no contact geometry starts deep inside
            # of it.
            values["Pelvis_ty"] = 1.0 + rng.uniform(0.0, 0.2)
            speeds = {info.name: rng.uniform(-0.5, 0.5) for info in free}
            ours = simulation.run(UNTIL, accuracy=ACCURACY, initial=values, initial_speeds=speeds)
            assert ours.summary["contact_events"]
            errors.append(np.abs(ours.values[-1] - opensim_end(path, values, speeds)).max())
    assert max(errors) < 1e-7, errors
