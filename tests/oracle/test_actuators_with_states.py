"""Actuators with states of their own against a live OpenSim 4.6: derivatives, records, energies; steps and tables."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.multibody import build_mechanism
from osimlite.schema.actuators import ActivationCoordinateActuator
from osimlite.schema.path_actuators import ClutchedPathSpring
from osimlite.simulation import read_sto
from osimlite.simulation.elements import force_elements
from osimlite.simulation.engines.compiled import CompiledEngine
from tests.oracle.opensim_runs import simulated
from tests.simulation.hanging import hanging

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytest.importorskip("numba", reason="needs numba (extra 'sim')")
pytestmark = pytest.mark.oracle

STATES = 6
BOUNDS = {"activation": (0.05, 1.1), "stretch": (0.0, 0.05)}
"""Of the states that are tried, by their names."""


def coordinate_actuator(rng):
    return ActivationCoordinateActuator(
        name="mu",
        coordinate="x",
        optimal_force=rng.uniform(20, 300),
        activation_time_constant=rng.uniform(0.005, 0.05),
        default_activation=rng.uniform(-1, 1),
    )


def clutched_spring(rng):
    return ClutchedPathSpring(
        name="mu",
        stiffness=rng.uniform(100, 9000),
        dissipation=rng.uniform(0, 0.5),
        relaxation_time_constant=rng.uniform(0.001, 0.1),
        initial_stretch=rng.uniform(0, 0.05),
    )


MADE = {make.__name__: make for make in (coordinate_actuator, clutched_spring)}
CONTROLS = (0.0, 0.4, 1.3)


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("kind", MADE)
def test_derivatives_and_records(kind, control, tmp_path):
    rng = np.random.default_rng(len(kind))
    model = hanging(MADE[kind](rng), control)
    osimlite.write(model, tmp_path / "model.osim")
    opensim.Logger.setLevelString("off")
    theirs = opensim.Model(str(tmp_path / "model.osim"))
    state = theirs.initSystem()
    mechanism = build_mechanism(model)
    engine = CompiledEngine(mechanism, force_elements(model, mechanism))
    named = [theirs.getStateVariableNames().get(k) for k in range(theirs.getNumStateVariables())]
    own = [path for path in named if path.startswith("/forceset/")]
    assert engine.state.paths == own
    assert engine.state.default()[2:] == [theirs.getStateVariableValue(state, path) for path in own]
    force, coordinate = theirs.getForceSet().get(0), theirs.getCoordinateSet().get(0)
    for _ in range(STATES):
        y = [rng.uniform(0.3, 0.37), rng.uniform(-0.4, 0.4)]
        y += [rng.uniform(*BOUNDS[path.rpartition("/")[2]]) for path in own]
        coordinate.setValue(state, y[0], False)
        coordinate.setSpeedValue(state, y[1])
        for path, value in zip(own, y[2:], strict=True):
            theirs.setStateVariableValue(state, path, value)
        theirs.realizeAcceleration(state)
        expected = [theirs.getStateVariableDerivativeValue(state, path) for path in own]
        expected = [y[1], coordinate.getAccelerationValue(state), *expected]
        assert engine.derivative(0.0, y) == pytest.approx(expected, rel=1e-9)
        labels, values = force.getRecordLabels(), force.getRecordValues(state)
        assert list(engine.columns) == [labels.get(k) for k in range(labels.getSize())]
        assert engine.force_records(0.0, y) == pytest.approx([values.get(0)], rel=1e-9, abs=1e-12)
        stored = theirs.calcPotentialEnergy(state) - 20.0 * -9.80665 * y[0]
        assert engine.energies(0.0, y)[2] == pytest.approx(stored, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("kind", MADE)
def test_states_and_steps(kind, tmp_path):
    model = hanging(MADE[kind](np.random.default_rng(2)))
    osimlite.write(model, tmp_path / "model.osim")
    theirs = simulated(tmp_path / "model.osim", 0.2, 1e-5)
    trajectory = osimlite.simulate(model, 0.2, accuracy=1e-5, engine="compiled")
    trajectory.to_sto(tmp_path / "states.sto")
    ours = read_sto(tmp_path / "states.sto")
    assert ours.columns == theirs.columns
    assert trajectory.summary["steps"] == len(theirs.rows) - 1
    assert ours.rows[-1] == pytest.approx(theirs.rows[-1], rel=1e-9, abs=1e-9 * np.abs(theirs.rows[-1]).max())
