"""Tests of walkers whose forces have states: exchange of the states of both legs, and neutral states."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from osimlite.models.walkers import steady_walker
from osimlite.schema.forces import CoordinateLimitForce
from osimlite.simulation import Simulation
from osimlite.studies.gait.cycle import find_cycle
from osimlite.studies.gait.stepmap import StepMap
from osimlite.studies.gait.symmetry import match_auxiliary_states


def test_a_walker_that_counts_energy_walks_as_before():
    """Counters of energy are neutral, are exchanged between the legs, and grow from step to step."""
    maps, cycles = [], []
    for counts in (False, True):
        model = steady_walker()
        for force in model.components(CoordinateLimitForce):
            force.compute_dissipation_energy = counts
        with Simulation(model, "compiled") as simulation:
            maps.append(StepMap(simulation.engine, simulation.initial_state({}, {})))
            cycles.append(find_cycle(maps[-1]))
    plain, counting = cycles
    engine = maps[1].engine
    count, first = len(engine.state.paths), 2 * len(engine.order)
    assert count >= 2 and counting.neutral == plain.neutral + count
    assert counting.state[:first] == pytest.approx(plain.state, abs=1e-6)
    assert (counting.length, counting.period) == pytest.approx(
        (plain.length, plain.period), rel=1e-6
    )
    assert np.abs(counting.multipliers) == pytest.approx(np.abs(plain.multipliers), abs=2e-3)
    assert maps[1].exchange is not None and maps[0].exchange is not None
    assert maps[1].exchange[:first].tolist() == maps[0].exchange.tolist()
    # The stops of the hips are never reached.
    partners = [engine.state.paths[place - first] for place in maps[1].exchange[first:]]
    names = dict(zip(engine.state.paths, partners, strict=True))
    for leg, other in ("RL", "LR"):
        assert names[f"/forceset/{leg}KneeLimitTorque/dissipatedEnergy"].startswith(
            f"/forceset/{other}Knee"
        )
        assert names[f"/forceset/{leg}HipLimitTorque/dissipatedEnergy"].startswith(
            f"/forceset/{leg}Hip"
        )
    image = maps[1](counting.state[None]).states[0]
    again = maps[1](image[None]).states[0]
    assert (image[first:] >= counting.state[first:][maps[1].exchange[first:] - first] - 1e-12).all()
    assert (again[first:] >= counting.state[first:] - 1e-12).all() and image[
        first:
    ].sum() > counting.state[first:].sum()


def test_states_that_push_are_exchanged_by_what_they_do():
    """Two of four similar states act on one leg each, and are exchanged; a fifth state acts on both legs."""
    drive = np.array([0.3, 0.3, 0.3, 0.3, 0.7])

    def derivative(t, y):
        q, u, z = np.split(np.array(y), (2, 4))
        pushes = np.array([z[1] - q[0] + 0.1 * z[4], z[2] - q[1] + 0.1 * z[4]])
        return [*u, *pushes, *(drive - z[:5]), u[1] ** 2, u[0] ** 2]

    def started(states):
        return np.hstack(
            (states[:, :4], np.tile((0.05, 0.05, 0.05, 0.05, 0.1, 0.0, 0.0), (len(states), 1)))
        )

    state = SimpleNamespace(size=11, restart_auxiliary=started)
    engine = SimpleNamespace(order=(0, 1), state=state, compute_derivative=derivative)
    source = np.arange(11)
    source[:4] = 1, 0, 3, 2
    match_auxiliary_states(engine, source, np.random.default_rng(1).normal(size=(3, 11)))
    assert source.tolist() == [1, 0, 3, 2, 4, 6, 5, 7, 8, 10, 9]
