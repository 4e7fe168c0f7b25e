"""Tests of measures of runs."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.errors import OsimliteError, SettingError
from osimlite.simulation import Simulation
from osimlite.studies.gait.steps import walk_many
from osimlite.studies.sweep.measures import get_measure_name
from osimlite.studies.sweep.plan import plan
from osimlite.studies.sweep.runner import Runner

ROWS = np.array([[0.3], [0.5], [0.7]])


def block_of(walker, *measures, **choices):
    return Runner(plan(walker, {"RHip_rz": (0.0, 1.0)}, measures=measures, **choices)).run(ROWS)


def test_against_the_summary_of_a_simulation(walker):
    block = block_of(
        walker, "distance", "energy", "largest_force", "Pelvis_ty/value", "RHip_rz/speed", to=1.5
    )
    for number, (hip,) in enumerate(ROWS.tolist()):
        with Simulation(walker, "compiled") as simulation:
            trajectory = simulation.run(1.5, initial={"RHip_rz": hip})
        column = list(trajectory.coordinates).index
        summary = trajectory.summary
        energies = summary["energy_J"]
        result = {name: values[number] for name, values in block.measures.items()}
        assert result == {
            "distance": trajectory.values[-1, column("Pelvis_tx")]
            - trajectory.values[0, column("Pelvis_tx")],
            "energy": pytest.approx(
                energies["end"]["total"] - energies["start"]["total"], abs=1e-9
            ),
            "largest_force": max(
                item["force_N"] for item in summary["largest_contact_forces"].values()
            ),
            "Pelvis_ty/value": trajectory.values[-1, column("Pelvis_ty")],
            "RHip_rz/speed": trajectory.speeds[-1, column("RHip_rz")],
        }


def test_steps_and_falls_are_those_of_the_walk(walker):
    block = block_of(walker, "steps", "scuffs", "time_to_fall", to=3.0)
    with Simulation(walker, "compiled") as simulation:
        engine = simulation.engine
        infos = engine.mechanism.coordinates
        y = engine.state.pack(
            [info.default_value for info in infos], [info.default_speed for info in infos]
        )
        starts = np.tile(y, (3, 1))
        starts[:, engine.order.index(engine.mechanism.coordinate_index("RHip_rz"))] = ROWS[:, 0]
        walks = walk_many(engine, starts, 3.0)
    assert block.measures["steps"].tolist() == [len(walk.steps) for walk in walks]
    assert block.measures["scuffs"].tolist() == [len(walk.scuffs) for walk in walks]
    assert block.measures["time_to_fall"].tolist() == [walk.end for walk in walks]
    assert block.status == ["stopped" if walk.ending == "fell" else "done" for walk in walks]
    assert [reason for reason in block.reasons if reason] == [
        f"fall: {w.fell_on}" for w in walks if w.fell_on
    ]


def test_steps_of_models_of_other_numbers(walker):
    vary = {"/contactgeometryset/*Foot*/radius": (0.04, 0.06)}
    block = Runner(plan(walker, vary, measures=("steps", "time_to_fall"), to=2.0)).run(
        np.array([[0.04], [0.06]])
    )
    for number, radius in enumerate((0.04, 0.06)):
        for side in "LR":
            walker.tree().by_path[f"/contactgeometryset/{side}FootContact"].radius = radius
        with Simulation(walker, "compiled") as simulation:
            engine = simulation.engine
            infos = engine.mechanism.coordinates
            y = engine.state.pack(
                [info.default_value for info in infos], [info.default_speed for info in infos]
            )
            (walk,) = walk_many(engine, [y], 2.0)
        assert (block.measures["steps"][number], block.measures["time_to_fall"][number]) == (
            len(walk.steps),
            walk.end,
        )


def drop(run):
    """Return the height by which the pelvis has come down (m)."""
    return run.start["Pelvis_ty"] - run.end["Pelvis_ty"]


def deepest(run):
    """Return the least height of the pelvis at the reported times (m)."""
    assert len(run.times) == len(run.history("Pelvis_ty")) == 11
    return run.history("Pelvis_ty").min()


def everything(run):
    """Check further attributes of a run."""
    assert run.values == {"RHip_rz": run.start["RHip_rz"]}
    assert run.time == 1.0 and len(run.events) > 0 and run.largest_forces["RFootForce"] > 0.0
    assert run.start["RHip_rz/speed"] == 0.0 and len(run.start) == len(list(run.start)) == 16
    assert run.end["platform_rz"] == run.mechanism.coordinates[0].default_value
    return 1.0


def picky(run):
    """Raise an error for some runs."""
    if run.values["RHip_rz"] == 0.5:
        raise ValueError("not this one")
    return 2.0


def forgetful(run):
    """Return nothing."""


def test_a_function_that_returns_nothing_fails(walker):
    block = Runner(plan(walker, {"RHip_rz": (0.3, 0.7)}, measures=(forgetful,), to=0.1)).run(ROWS)
    assert block.status == ["failed"] * len(ROWS) and "TypeError" in block.reasons[0]


def test_functions_of_ones_own(walker, tmp_path, monkeypatch):
    (tmp_path / "own.py").write_text(
        "def drop(run):\n    return run.start['Pelvis_ty'] - run.end['Pelvis_ty']\n"
    )
    monkeypatch.chdir(tmp_path)
    block = block_of(
        walker, drop, deepest, everything, "own.py:drop", "own:drop", to=1.0, report_interval=0.1
    )
    assert block.reasons == [None] * 3
    first = block.measures[get_measure_name(drop)]
    assert (
        first.tolist()
        == block.measures["own.py:drop"].tolist()
        == block.measures["own:drop"].tolist()
    )
    assert (block.measures[get_measure_name(deepest)] <= 0.835 - np.maximum(first, 0.0)).all()


def kept_times(run):
    """Return the number of recorded times of a run, which is smaller if the run ended early."""
    height = run.history("Pelvis_ty")
    assert len(height) == len(run.times) and np.isfinite(height).all() and run.times[-1] <= run.time
    return len(run.times)


def test_what_was_kept_ends_with_the_run(walker):
    block = block_of(walker, "steps", kept_times, to=1.5, report_interval=0.1)
    kept = block.measures[get_measure_name(kept_times)]
    assert "failed" not in block.status and 2 <= kept.min() < 16


def test_a_function_that_fails_spoils_its_own_run_only(walker):
    block = block_of(walker, picky, "distance", to=0.5)
    assert block.status == ["done", "failed", "done"]
    assert "ValueError: not this one" in (block.reasons[1] or "")
    assert block.measures[get_measure_name(picky)][[0, 2]].tolist() == [2.0, 2.0]
    assert np.isnan(block.measures["distance"]).tolist() == [False, True, False]


def test_what_there_is_not(walker, tmp_path):
    for name, words in [
        ("stepps", "did you mean 'steps'"),
        ("nothing:here", "cannot import"),
        ("math:nothing", "no function 'nothing'"),
    ]:
        with pytest.raises(SettingError if "import" not in words else OsimliteError, match=words):
            block_of(walker, name)
    pendulum = osimlite.Model(name="pendulum")
    rod = pendulum.add(osimlite.Body(name="rod", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    pendulum.add(osimlite.PinJoint(name="pin").between(pendulum.ground, rod))
    name = next(pendulum.components(osimlite.Coordinate)).name
    with pytest.raises(SettingError, match="no distance"):
        Runner(plan(pendulum, {name: (0.0, 1.0)}, measures=("distance",)))
    block = Runner(plan(pendulum, {name: (0.0, 1.0)}, measures=("largest_force", "energy"))).run(
        np.array([[0.5]])
    )
    assert block.measures["largest_force"].tolist() == [0.0]
    assert block.measures["energy"][0] == pytest.approx(0.0, abs=1e-2)
