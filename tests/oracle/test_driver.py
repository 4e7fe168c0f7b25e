"""Compare lengths and moment arms of paths, while MuJoCo moves a model, with OpenSim's in the same pose."""

from __future__ import annotations

import pytest

import osimlite

opensim = pytest.importorskip("opensim")


@pytest.mark.oracle
def test_paths_are_opensims_where_the_driver_has_brought_the_model(shared):
    file = shared / "corpus" / "models" / "m0005" / "gait10dof18musc.osim"
    model = osimlite.read(file)
    driver = osimlite.mjcf.Driver(model, timestep=5e-4, equilibrate=True)
    driver.data.ctrl[:] = 0.2
    driver.step(60)
    mechanism, paths, (q, _, _) = driver.mjcf.robot.mechanism, osimlite.paths(model), driver.state()
    lengths, arms = paths.lengths(q), paths.moment_arms(q)

    opensim.Logger.setLevelString("off")
    theirs = opensim.Model(str(file))
    state = theirs.initSystem()
    values = {
        info.path: value for info, value in zip(mechanism.coordinates, q.tolist(), strict=True)
    }
    moved = 0.0
    for path, value in values.items():
        coordinate = opensim.Coordinate.safeDownCast(theirs.getComponent(path))
        moved = max(moved, abs(coordinate.getValue(state) - value))
        coordinate.setValue(state, value, False)
    assert moved > 0.01
    theirs.realizePosition(state)
    for path in paths.names:
        muscle = opensim.Muscle.safeDownCast(theirs.getComponent(path))
        assert lengths[path] == pytest.approx(muscle.getLength(state), rel=0.0, abs=1e-9), path
        for coordinate, arm in arms[path].items():
            result = opensim.Coordinate.safeDownCast(theirs.getComponent(coordinate))
            wanted = muscle.computeMomentArm(state, result)
            assert arm == pytest.approx(wanted, rel=0.0, abs=1e-8), (path, coordinate)
