"""Tests of searches: the result is reproducible by the model, and interrupted searches continue exactly."""

from __future__ import annotations

import json
from importlib.util import find_spec

import numpy as np
import pytest

import osimlite
from osimlite.errors import OsimliteError, SettingError, SimulationError
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.simulation import Simulation
from osimlite.studies.sweep.optimize import (
    BEST_FILE,
    HISTORY_FILE,
    SUMMARY_FILE,
    Objective,
    optimize,
    read_best_values,
)
from osimlite.studies.sweep.plan import plan
from osimlite.studies.sweep.run import SweepInterruption
from osimlite.studies.sweep.search import METHODS, OutOfBudget, Search

# Do not import it here: that takes seconds, in each process that collects this module.
if find_spec("cma") is None:
    pytest.skip("needs cma (extra 'optimize')", allow_module_level=True)
pq = pytest.importorskip("pyarrow.parquet", reason="needs pyarrow (extra 'sweep')")
VARY = {"RHip_rz": (0.2, 0.9), "Pelvis_tx/speed": (0.0, 2.0), "/bodyset/Pelvis/mass": (1.0, 3.0)}
DISTANCE = Objective("distance")


@pytest.fixture
def made(walker):
    return plan(walker, VARY, measures=("largest_force",), to=0.5)


@pytest.mark.parametrize("method", sorted(METHODS))
def test_methods_find_the_bottom_of_a_bowl(method):
    bottom, asked = np.array([0.3, 0.8, 0.55]), []

    def ask(points):
        if len(asked) + len(points) > 2000:
            raise OutOfBudget
        asked.extend(points.tolist())
        return np.sum((points - bottom) ** 2 * (1.0, 10.0, 3.0), axis=1)

    tolerance = 1e-6 if method == "differential-evolution" else 1e-9
    search = Search(
        np.array([0.5, 0.5, 0.5]), 0.25, None, 1, True, 2000, tolerance,
        gradient=lambda point: 2.0 * (point - bottom) * (1.0, 10.0, 3.0),
    )  # fmt: skip
    assert METHODS[method](ask, search).startswith("converged")
    rows = np.array(asked)
    assert (rows >= 0.0).all() and (rows <= 1.0).all()
    assert rows[np.argmin(np.sum((rows - bottom) ** 2, axis=1))] == pytest.approx(bottom, abs=1e-3)
    again, first = [], asked.copy()
    asked.clear()
    METHODS[method](ask, search)
    again += asked
    assert again == first


def test_the_best_model_does_what_was_found(made, tmp_path):
    result = optimize(made, DISTANCE, tmp_path / "new" / "folder", budget=40, popsize=8, seed=2)
    table = pq.read_table(result.history).to_pydict()
    assert table["evaluation"] == list(range(40)) and table["batch"] == [k // 8 for k in range(40)]
    assert result.value == max(table["distance"]) and result.evaluation == table["distance"].index(
        result.value
    )
    for name, (low, high) in VARY.items():
        assert all(low <= x <= high for x in table[name])
        assert table[name][result.evaluation] == result.values[name]
    assert all(force >= 0.0 for force in table["largest_force"])
    best = osimlite.read(result.model)
    assert best.tree().by_path["/bodyset/Pelvis"].mass == result.values["/bodyset/Pelvis/mass"]
    with Simulation(best, "compiled") as simulation:
        trajectory = simulation.run(0.5)
    values = trajectory.values[:, list(trajectory.coordinates).index("Pelvis_tx")]
    assert values[-1] - values[0] == result.value
    summary = json.loads((tmp_path / "new" / "folder" / SUMMARY_FILE).read_text())
    assert summary["value"] == result.value and summary["settings"]["seed"] == 2
    assert sorted(path.name for path in (tmp_path / "new" / "folder").iterdir()) == sorted(
        (HISTORY_FILE, BEST_FILE, SUMMARY_FILE)
    )


def test_it_begins_where_the_model_is(made, tmp_path):
    result = optimize(made, DISTANCE, tmp_path, method="cma", budget=20, popsize=20, sigma=1e-9)
    start = {"RHip_rz": np.radians(30.0), "Pelvis_tx/speed": 0.0, "/bodyset/Pelvis/mass": 1.0}
    assert result.values == pytest.approx(start, abs=1e-6)


def test_it_begins_where_another_search_has_ended(made, walker, tmp_path):
    first = optimize(made, DISTANCE, tmp_path / "first", budget=16, popsize=8)
    other = plan(walker, {**VARY, "LHip_rz": (-0.4, 0.0)}, to=0.5)
    choices = {
        "start": read_best_values(tmp_path / "first"),
        "method": "cma",
        "budget": 4,
        "popsize": 4,
        "sigma": 1e-9,
    }
    again = optimize(other, DISTANCE, tmp_path / "again", **choices)
    assert again.values == pytest.approx({**first.values, "LHip_rz": np.radians(-10.0)}, abs=1e-6)
    with pytest.raises(OsimliteError, match=r"'none.summary.json' is not the summary of a search"):
        read_best_values("none")


def test_it_looks_around_from_where_the_model_is(made, tmp_path):
    """The model itself comes first, then points of the complete ranges; the search continues from the best of them."""
    result = optimize(
        made, DISTANCE, tmp_path, method="sobol-cma", budget=40, popsize=8, sigma=1e-6, seed=3
    )
    table = pq.read_table(result.history).to_pydict()
    rows = np.array([table[name] for name in VARY]).T
    assert rows[0] == pytest.approx([np.radians(30.0), 0.0, 1.0])
    low, high = np.array(list(VARY.values())).T
    places = (rows - low) / (high - low)
    assert (places[:16].min(axis=0) < 0.2).all() and (places[:16].max(axis=0) > 0.8).all()
    best = int(np.argmax(table["distance"][:16]))
    assert best > 0
    assert places[16:] == pytest.approx(np.tile(places[best], (24, 1)), abs=1e-4)
    assert rows[16] == pytest.approx(rows[best], rel=1e-12)


@pytest.mark.parametrize("method", sorted(METHODS))
def test_an_interrupted_search_goes_on(made, tmp_path, method):
    last = 3 if method == "gradient" else 17

    def stop(done, of):
        if done >= last:
            raise KeyboardInterrupt

    choices = {"method": method, "budget": 45, "popsize": 6, "seed": 4}
    whole = optimize(made, DISTANCE, tmp_path / "whole", **choices)
    with pytest.raises(SweepInterruption, match="--resume"):
        optimize(made, DISTANCE, tmp_path / "cut", progress=stop, **choices)
    with pytest.raises(SettingError, match="continue with --resume"):
        optimize(made, DISTANCE, tmp_path / "cut", **choices)
    with pytest.raises(SettingError, match="seed"):
        optimize(made, DISTANCE, tmp_path / "cut", resume=True, **{**choices, "seed": 5})
    again = optimize(made, DISTANCE, tmp_path / "cut", resume=True, workers=1, **choices)
    for name in (HISTORY_FILE, BEST_FILE, SUMMARY_FILE):
        assert (tmp_path / "cut" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes(), (
            name
        )
    assert again.value == whole.value


def test_a_finished_search_goes_on_with_a_larger_budget(made, tmp_path):
    whole = optimize(made, DISTANCE, tmp_path / "whole", budget=40, popsize=8)
    optimize(made, DISTANCE, tmp_path / "two", budget=16, popsize=8)
    more = optimize(made, DISTANCE, tmp_path / "two", budget=40, popsize=8, resume=True)
    assert more.value == whole.value
    assert (tmp_path / "two" / HISTORY_FILE).read_bytes() == (
        tmp_path / "whole" / HISTORY_FILE
    ).read_bytes()


def test_another_search_is_spared_unless_forced(made, tmp_path):
    choices = {"popsize": 8, "seed": 1}
    optimize(made, DISTANCE, tmp_path, budget=16, **choices)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    for resume in (False, True):
        with pytest.raises(SettingError, match=r"seed \(1 before, 2 now\); .*--force"):
            optimize(made, DISTANCE, tmp_path, budget=16, popsize=8, seed=2, resume=resume)
    with pytest.raises(SettingError, match="has 16 runs of this search, more than"):
        optimize(made, DISTANCE, tmp_path, budget=8, **choices)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    kept = optimize(made, DISTANCE, tmp_path, budget=8, resume=True, **choices)
    assert kept.evaluations == 16
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    other = optimize(made, DISTANCE, tmp_path, budget=8, popsize=8, seed=2, force=True)
    assert pq.read_table(other.history).num_rows == 8


@pytest.mark.parametrize("method", ["sobol-cma", "cma", "differential-evolution"])
def test_every_run_that_is_allowed_is_made(made, tmp_path, method):
    whole = optimize(made, DISTANCE, tmp_path / "whole", method=method, budget=20, popsize=8)
    assert whole.evaluations == 20
    few = optimize(made, DISTANCE, tmp_path / "two", method=method, budget=3, popsize=8)
    table = pq.read_table(few.history).to_pydict()
    assert (
        few.evaluations == 3 and few.value == max(table["distance"]) and table["batch"] == [0, 0, 0]
    )
    optimize(made, DISTANCE, tmp_path / "two", method=method, budget=11, popsize=8, resume=True)
    optimize(made, DISTANCE, tmp_path / "two", method=method, budget=20, popsize=8, resume=True)
    assert (tmp_path / "two" / HISTORY_FILE).read_bytes() == (
        tmp_path / "whole" / HISTORY_FILE
    ).read_bytes()


def least_drop(run):
    """Return how far the pelvis comes down (m), plus a penalty for a high initial speed."""
    return run.start["Pelvis_ty"] - run.end["Pelvis_ty"] + run.values["Pelvis_tx/speed"]


def test_functions_are_made_small_and_names_large_or_small(made, tmp_path):
    down = optimize(made, Objective(least_drop), tmp_path / "a", budget=24, popsize=8)
    table = pq.read_table(down.history).to_pydict()
    assert down.value == min(table[next(name for name in table if "least_drop" in name)])
    force = optimize(made, Objective("largest_force"), tmp_path / "b", budget=8, popsize=8)
    assert force.value == min(pq.read_table(force.history).to_pydict()["largest_force"])
    most = optimize(made, Objective("largest_force", True), tmp_path / "c", budget=8, popsize=8)
    assert most.value == max(pq.read_table(most.history).to_pydict()["largest_force"])


def endless(run):
    """Return NaN except for samples near the middle of the range."""
    return (
        float("nan")
        if abs(run.values["Pelvis_tx/speed"] - 1.0) > 0.5
        else run.values["Pelvis_tx/speed"]
    )


def never(run):
    """Return infinity for every run."""
    return float("inf")


def test_only_a_finite_number_is_the_best(made, walker, tmp_path):
    best = optimize(
        made, Objective(endless), tmp_path / "a", budget=40, popsize=8, method="sobol-cma"
    )
    assert 0.5 <= best.value <= 1.5 and best.values["Pelvis_tx/speed"] == best.value
    with pytest.raises(SimulationError, match="never' is not a finite number in any run"):
        optimize(made, Objective(never), tmp_path / "b", budget=8, popsize=8)
    stopped = plan(walker, VARY, to=0.5, below={"Pelvis_ty": 0.7})
    with pytest.raises(SimulationError, match="never' is not a finite number in any run"):
        optimize(stopped, Objective(never), tmp_path / "c", budget=8, popsize=8)


def test_ranges_may_be_left_if_asked(walker, tmp_path):
    made = plan(walker, {"Pelvis_tx/speed": (0.0, 0.1), "RHip_rz": (0.4, 0.6)}, to=0.3)
    result = optimize(made, DISTANCE, tmp_path, budget=40, popsize=8, is_bounded=False, sigma=1.0)
    assert result.values["Pelvis_tx/speed"] > 0.2


def test_parameters_begin_at_their_defaults(tmp_path):
    def make(parameters):
        return dynamic_walker(**parameters)

    vary = {"slope": (5.0, 15.0), "thigh_length": (0.3, 0.6)}
    made = plan(make, vary, parameters={"slope": 10.0, "thigh_length": 0.4}, to=0.3)
    result = optimize(made, DISTANCE, tmp_path, method="cma", budget=6, popsize=6, sigma=1e-6)
    assert result.values == pytest.approx({"slope": 10.0, "thigh_length": 0.4}, abs=1e-3)
    assert osimlite.to_text(dynamic_walker(**result.values)) == result.model.read_text()


def test_failed_runs_are_worse_than_all_others(walker, tmp_path):
    path = "/forceset/RFootForce/contact_parameters/stiffness"
    made = plan(walker, {path: (-1e6, 1e6), "RHip_rz": (0.4, 0.6)}, to=0.2)
    result = optimize(
        made, DISTANCE, tmp_path / "a", budget=24, popsize=8, start=[0.0, 0.5], seed=1
    )
    table = pq.read_table(result.history).to_pydict()
    assert "failed" in table["status"] and table["status"][result.evaluation] == "done"
    with pytest.raises(SimulationError, match=r"no run came to its end: .*RFootForce"):
        optimize(
            plan(walker, {path: (-2.0, -1.0), "RHip_rz": (0.4, 0.6)}, to=0.2),
            DISTANCE,
            tmp_path / "b",
            budget=8,
            popsize=8,
        )


def test_what_cannot_be_is_said(made, walker, tmp_path):
    for words, choices in [
        ("did you mean 'cma'", {"method": "cmaes"}),
        ("budget of at least 1", {"budget": 0}),
        ("population of at least 2", {"popsize": 1}),
        ("must be positive", {"sigma": 0.0}),
        ("seed must be a whole number", {"seed": -1}),
        ("tolerance must be", {"tolerance": -1.0}),
        ("tolerance must be", {"tolerance": float("nan")}),
        ("outside 0.2 to 0.9", {"start": [5.0, 0.0, 1.0]}),
        (r"one number for each variable \(3\)", {"start": [5.0]}),
        ("stays within", {"method": "differential-evolution", "is_bounded": False}),
    ]:
        with pytest.raises(SettingError, match=words):
            optimize(made, DISTANCE, tmp_path, **choices)
    with pytest.raises(SettingError, match="use the method 'nelder-mead'"):
        optimize(plan(walker, {"RHip_rz": (0.3, 0.5)}), DISTANCE, tmp_path)
    with pytest.raises(
        SettingError, match=r"'RHip_rz' has 3 grid points, .*; leave out the number of points"
    ):
        optimize(plan(walker, {"RHip_rz": "0.3:0.5:3"}), DISTANCE, tmp_path)
    assert not list(tmp_path.iterdir())
    with pytest.raises(SettingError, match="nothing to search"):
        optimize(plan(walker, {"RHip_rz": 0.3}), DISTANCE, tmp_path)
    with pytest.raises(SettingError, match="did you mean 'distance'"):
        optimize(made, Objective("distanc"), tmp_path)
    # The method and the measure do not fit: the command is wrong, not the model.
    with pytest.raises(SettingError, match="depends on events") as refusal:
        optimize(
            plan(walker, {"RHip_rz": (0.3, 0.5)}, to=0.01),
            Objective("steps"),
            tmp_path / "steps",
            method="gradient",
        )
    assert refusal.value.exit_code == 2


@pytest.mark.parametrize("name", [BEST_FILE, SUMMARY_FILE])
def test_files_of_others_are_spared_unless_forced(made, tmp_path, name):
    (tmp_path / name).write_text("mine")
    with pytest.raises(SettingError, match=rf"{name}' was not written by such a search; .*--force"):
        optimize(made, DISTANCE, tmp_path, budget=4, popsize=4)
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [(name, "mine")]
    assert optimize(made, DISTANCE, tmp_path, budget=4, popsize=4, force=True).evaluations == 4


def test_a_search_that_cannot_begin_leaves_no_folder(made, walker, tmp_path):
    with pytest.raises(SettingError, match="did you mean 'distance'"):
        optimize(made, Objective("distanc"), tmp_path / "new")
    with pytest.raises(SettingError, match="use the method 'nelder-mead'"):
        optimize(plan(walker, {"RHip_rz": (0.3, 0.5)}), DISTANCE, tmp_path / "new")
    assert not list(tmp_path.iterdir())
