"""Compare lengths, moment arms and forces of muscles over a coordinate with a live OpenSim 4.6."""

from __future__ import annotations

import gzip

import numpy as np
import pytest

import osimlite
from osimlite.simulation.muscle_curves import muscle_curves

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

# OpenSim's method for each quantity.
ASKED = {
    "length": "getLength",
    "fiber_length": "getFiberLength",
    "normalized_fiber_length": "getNormalizedFiberLength",
    "tendon_length": "getTendonLength",
    "tendon_force": "getTendonForce",
    "active_fiber_force": "getActiveFiberForceAlongTendon",
    "passive_fiber_force": "getPassiveFiberForceAlongTendon",
}


@pytest.mark.parametrize(
    ("number", "coordinate", "values"),
    [("m0001", "r_elbow_flex", (0.1, 0.9, 2.0)), ("m0005", "knee_angle_r", (-1.9, -1.0, 0.0))],
)
def test_muscles_are_told_as_by_opensim(corpus, tmp_path, number, coordinate, values):
    (known,) = (model for model in corpus if model.id == number)
    file = tmp_path / "model.osim"
    file.write_bytes(gzip.decompress(known.converted.read_bytes()))
    curves = muscle_curves(osimlite.read(file), {coordinate: values}, activation=0.7)
    opensim.Logger.setLevelString("off")
    model = opensim.Model(str(file))
    state = model.initSystem()
    moved = model.getCoordinateSet().get(coordinate)
    for row, value in enumerate(values):
        moved.setValue(state, value, True)
        for index, path in enumerate(curves.muscles):
            muscle = opensim.Muscle.safeDownCast(model.getComponent(path))
            muscle.setActivation(state, 0.7)
            model.realizeVelocity(state)
            muscle.computeEquilibrium(state)
            model.realizeDynamics(state)
            strength = muscle.getMaxIsometricForce()
            for quantity, ask in ASKED.items():
                scale = strength if quantity.endswith("force") else 1.0
                expected = getattr(muscle, ask)(state)
                assert curves.columns[quantity][row, index] == pytest.approx(
                    expected, abs=1e-8 * scale
                ), (
                    path,
                    quantity,
                )
            arm = muscle.getGeometryPath().computeMomentArm(state, moved)
            assert curves.columns[f"moment_arm_{coordinate}"][row, index] == pytest.approx(
                arm, abs=1e-10
            )
    assert np.isfinite(list(curves.columns.values())).all()
