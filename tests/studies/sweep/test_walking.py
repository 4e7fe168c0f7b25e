"""Tests of measures of walking, and of walkers that are placed on their feet."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
import pytest

import osimlite
from osimlite.errors import OsimliteError, SettingError
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.simulation import Simulation
from osimlite.studies.gait.foot_contacts import find_footing
from osimlite.studies.gait.measures import PLANTED_DEPTH_M
from osimlite.studies.gait.starts import plant_feet
from osimlite.studies.gait.steps import measure_along_slope, walk_many
from osimlite.studies.sweep.measures import make_measure
from osimlite.studies.sweep.optimize import Objective, optimize
from osimlite.studies.sweep.plan import plan
from osimlite.studies.sweep.runner import Runner

# Do not import it here: that takes seconds, in each process that collects this module.
if find_spec("cma") is None:
    pytest.skip("needs cma (extra 'optimize')", allow_module_level=True)
VARY = {"RHip_rz": (-0.5, 0.5), "LHip_rz/speed": (-4.0, 4.0), "LKnee_rz": (-1.0, 0.0)}
MODELS = {**VARY, "/contactgeometryset/*Foot*/radius": (0.04, 0.06)}


def points(vary, count=60):
    low, high = np.array(list(vary.values())).T
    return low + np.random.default_rng(4).random((count, len(low))) * (high - low)


def walks_of(made, rows):
    """Place samples on their feet and simulate their walks without the code of sweeps.

    Args:
        made: plan of the sweep.
        rows: samples.

    Returns:
        Initial states, and walks.
    """
    runner, starts, walks = Runner(made), [], []
    for row in rows:
        engine = runner.variants.make_variant(row.tolist()).engine
        start = runner.variants.make_start(runner.variants.make_variant(row.tolist()), row.tolist())
        starts.append(plant_feet(engine, find_footing(engine), start[None])[0])
        starts[-1][engine.order.index(engine.mechanism.coordinate_index("Pelvis_ty"))] -= (
            PLANTED_DEPTH_M
        )
        walks += walk_many(engine, starts[-1][None], made.to, accuracy=made.accuracy)
    return np.array(starts), walks


@pytest.mark.parametrize("vary", [VARY, MODELS], ids=["one model", "many models"])
@pytest.mark.full
def test_progress_counts_steps_before_the_first_scuff(walker, vary):
    rows = points(vary)
    made = plan(
        walker, vary, measures=("progress", "steps"), to=2.0, is_planted=True, accuracy=1e-5
    )
    result = Runner(made).run(rows).measures["progress"]
    _, walks = walks_of(made, rows)
    assert result.astype(int).tolist() == [walk.clean_steps for walk in walks]
    assert len(set(np.round(result, 6))) == len(rows)
    parts = result - result.astype(int)
    assert (parts > 0.0).all() and max(walk.clean_steps for walk in walks) > 0


def test_progress_tells_how_near_the_next_step_was(walker):
    rows = points(VARY, 200)
    made = plan(walker, VARY, measures=("progress",), to=2.0, is_planted=True)
    result = Runner(made).run(rows).measures["progress"]
    _, walks = walks_of(made, rows)
    scuffed = [
        (value, walk) for value, walk in zip(result.tolist(), walks, strict=True) if walk.scuffs
    ]
    assert len(scuffed) > 20
    for value, walk in scuffed:
        first = walk.scuffs[0]
        near = 0.05 / (0.05 + max(0.05 - first.length, 0.0))
        wanted = walk.clean_steps + 0.5 * near + 0.5 * first.time / (first.time + 1.0)
        assert value == pytest.approx(wanted, abs=1e-3)


def test_a_planted_walker_stands_at_rest(walker):
    made = plan(walker, VARY, measures=("steps",), is_planted=True)
    runner, rows = Runner(made), points(VARY)
    given = runner.variants.base_variant
    engine = given.engine
    bare = np.array([runner.variants.make_start(given, row) for row in rows.tolist()])
    starts = runner.variants.make_initial_states(engine, [given] * len(rows), bare)
    feet = [engine.contacts.index(name) for foot in find_footing(engine).feet for name in foot]
    n, which = len(engine.order), np.arange(len(rows))

    def of_feet(states):
        along, depths = measure_along_slope(engine, states)
        return along[:, feet], depths[:, feet]

    along, depths = of_feet(starts)
    stands = depths.argmax(axis=1)
    assert depths.max(axis=1) == pytest.approx(np.full(len(rows), PLANTED_DEPTH_M), abs=1e-12)
    later = starts.copy()
    later[:, :n] += 1e-6 * later[:, n:]
    then, deeper = of_feet(later)
    assert (then - along)[which, stands] / 1e-6 == pytest.approx(np.zeros(len(rows)), abs=1e-4)
    assert (deeper - depths)[which, stands] / 1e-6 == pytest.approx(np.zeros(len(rows)), abs=1e-4)


def test_the_best_model_starts_on_its_feet(walker, tmp_path):
    made = plan(walker, VARY, measures=("steps",), to=1.0, is_planted=True, accuracy=1e-6)
    best = optimize(made, Objective("progress"), tmp_path, budget=60, popsize=20, seed=3)
    with Simulation(osimlite.read(best.model), "compiled") as simulation:
        start = np.array(simulation.initial_state({}, {}))
    (wanted,), (walk,) = walks_of(made, np.array([list(best.values.values())]))
    assert start == pytest.approx(wanted, abs=1e-9)
    assert int(best.value) == walk.clean_steps


def test_feet_may_be_given(walker):
    """If the knee belongs to the foot, a knee on the ground does not end the walk."""
    rows = points(VARY, 8)
    result = {}
    for feet in (
        None,
        ("RFootForce", "LFootForce"),
        ("RFootForce + RKneeForce", "LFootForce + LKneeForce"),
    ):
        made = plan(
            walker, VARY, measures=("time_to_fall", "scuffs"), to=1.5, is_planted=True, feet=feet
        )
        block = Runner(made).run(rows)
        result[feet] = [column.tolist() for column in block.measures.values()]
        assert made.settings()["feet"] == (None if feet is None else list(feet))
    by_structure, named, knees = result.values()
    assert named == by_structure
    assert (
        all(later >= fell for later, fell in zip(knees[0], named[0], strict=True))
        and knees[0] != named[0]
    )


def test_who_cannot_be_planted_is_told_before_any_run(walker):
    pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")
    with pytest.raises(SettingError, match="a planted start needs the compiled engine"):
        Runner(plan(walker, VARY, engine="bullet", is_planted=True))
    walker.tree().by_path["/forceset/LFootForce"].appliesForce = False
    walker.tree().by_path["/forceset/LKneeForce"].appliesForce = False
    walker.tree().by_path["/forceset/LHipForce"].appliesForce = False
    with pytest.raises(OsimliteError, match="the ends of 1 leg"):
        Runner(plan(walker, VARY, is_planted=True))


def test_walking_needs_the_compiled_engine():
    pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")
    with Simulation(dynamic_walker(), "bullet") as simulation:
        for name in ("steps", "scuffs", "progress", "time_to_fall"):
            with pytest.raises(SettingError, match=f"'{name}' needs the compiled engine"):
                make_measure(name, simulation.engine)
