"""Tests of the energy that dampers dissipate: a state whose error counts as in OpenSim."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import osimlite
from osimlite.simulation import Simulation, read_sto
from tests.simulation.damped import STATES, damped
from tests.suite import choose

ENGINES = ["bullet", "compiled"]


@pytest.mark.parametrize("engine", ENGINES)
def test_what_is_taken_up_is_lost(engine):
    trajectory = osimlite.simulate(damped(), to=0.5, accuracy=1e-9, engine=engine)
    assert list(trajectory.auxiliary) == STATES
    slack, stop, locked, disc = trajectory.auxiliary.values()
    assert not slack.any() and not locked.any()
    # The stop that does not integrate its energy dissipates energy too.
    lost = trajectory.energy["total"][0] - trajectory.energy["total"]
    counted = stop + disc
    assert (np.diff(stop) >= -1e-15).all() and (np.diff(disc) > 0.0).all()
    assert counted[-1] > 0.1 and (lost - counted >= -1e-8).all()
    model = damped()
    model.force_set.objects[3].compute_dissipation_energy = True
    whole = osimlite.simulate(model, to=0.5, accuracy=1e-9, engine=engine)
    lost = whole.energy["total"][0] - whole.energy["total"]
    assert sum(whole.auxiliary.values()) == pytest.approx(lost, abs=1e-8)


def test_both_engines_take_the_same_steps():
    pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")
    ours, theirs = (
        osimlite.simulate(damped(), to=0.5, accuracy=1e-7, engine=engine) for engine in ENGINES
    )
    assert ours.summary["steps"] == theirs.summary["steps"]
    assert np.abs(ours.values - theirs.values).max() < 1e-11
    for path in STATES:
        assert np.abs(ours.auxiliary[path] - theirs.auxiliary[path]).max() < 1e-11


@pytest.mark.parametrize("engine", ENGINES)
def test_files_and_fixed_steps(engine, tmp_path):
    trajectory = osimlite.simulate(damped(), to=0.1, engine=engine)
    trajectory.to_sto(tmp_path / "states.sto")
    table = read_sto(tmp_path / "states.sto")
    assert list(table.columns[-4:]) == STATES
    assert table.rows[:, -1] == pytest.approx(trajectory.auxiliary[STATES[-1]], abs=0.0)
    again = pickle.loads(pickle.dumps(trajectory))
    assert np.array_equal(again.auxiliary[STATES[-1]], trajectory.auxiliary[STATES[-1]])
    step = choose(5e-5, 1e-5) if engine == "bullet" else 1e-5
    stepped = osimlite.simulate(damped(), to=0.1, engine=engine, fixed_step=step)
    for path in STATES:
        assert stepped.auxiliary[path] == pytest.approx(
            trajectory.auxiliary[path], rel=1e-2, abs=1e-4
        )


def test_many_runs_equal_single_ones():
    from osimlite.simulation.batches import run_many

    times = [0.0, 0.07, 0.2, 0.3]
    with Simulation(damped(), "compiled") as simulation:
        starts = np.array([simulation.initial_state({"q1": q}, {}) for q in (0.1, 0.5, 0.9)])
        runs = run_many(
            simulation.engine, starts, 0.3, accuracy=1e-6, report_times=times, event_states=True
        )
        assert runs.states.shape == starts.shape and runs.reports.shape == (3, 4, starts.shape[1])
        for index, q in enumerate((0.1, 0.5, 0.9)):
            alone = simulation.run(0.3, accuracy=1e-6, initial={"q1": q}, report_interval=0.1)
            values, speeds = simulation.state.extract_histories(runs.states[index][None])
            assert np.array_equal(values[0], alone.values[-1]) and np.array_equal(
                speeds[0], alone.speeds[-1]
            )
            assert runs.counts[index, 0] == alone.summary["steps"]
