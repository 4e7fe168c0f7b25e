"""Tests of simulations that are cached between calls: changes of the model are noticed."""

from __future__ import annotations

import gc
import weakref
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import osimlite
from osimlite.simulation import cached_simulation, run
from osimlite.simulation.engines.batch import BatchWorkspace
from osimlite.simulation.engines.machine_code import has_machine_code
from tests.suite import choose

WALKER = "fixtures/walker/DynamicWalkerModel.osim"


def heavier(model, x):
    model.body_set.objects[1].mass *= 1.0 + x


def moved(model, x):
    frame = next(joint.frames[0] for joint in model.joint_set.objects if joint.frames)
    frame.translation = (0.1 * x, 0.0, 0.01)


def started(model, x):
    next(model.components(osimlite.Coordinate)).default_value = 0.3 * x


def renamed(model, x):
    coordinate = next(model.components(osimlite.Coordinate))
    model.rename(coordinate, f"{coordinate.name}_{round(100 * x)}")


def stiffer(model, x):
    force = next(force for force in model.components(osimlite.HuntCrossleyForce))
    force.contact_parameters.objects[0].stiffness *= 1.0 + x


def added(model, x):
    body = model.body_set.objects[0]
    name = f"pull{len(model.force_set.objects)}"
    spring = osimlite.PointToPointSpring(name=name, stiffness=100.0 * (1.0 + x), rest_length=0.5)
    spring.socket_body1, spring.socket_body2 = model.ground, body
    model.force_set.objects.append(spring)


def switched_off(model, x):
    model.force_set.objects[round(x * (len(model.force_set.objects) - 1))].appliesForce = False


def taken_out(model, x):
    if len(model.force_set.objects) > 1:
        del model.force_set.objects[-1]


def lighter_gravity(model, x):
    model.gravity = (0.0, -9.0 - x, 0.0)


EDITS = [heavier, moved, started, renamed, stiffer, added, switched_off, taken_out, lighter_gravity]


def motion(model):
    trajectory = osimlite.simulate(model, to=0.05, engine="compiled")
    return trajectory.paths, trajectory.values, trajectory.speeds


@settings(max_examples=choose(5, 25), deadline=None)
@given(st.lists(st.tuples(st.sampled_from(EDITS), st.floats(0.0, 1.0)), min_size=1, max_size=5))
def test_after_any_edit_a_motion_is_that_of_a_model_just_read(repo, edits):
    model = osimlite.read(repo / WALKER)
    motion(model)
    for edit, x in edits:
        edit(model, x)
        fresh = osimlite.read_text(osimlite.to_text(model))
        for mine, theirs in zip(motion(model), motion(fresh), strict=True):
            assert np.array_equal(mine, theirs)


def test_what_is_ready_is_used_again_and_goes_with_the_model(repo, monkeypatch):
    made = []
    start = run.Simulation.__init__
    monkeypatch.setattr(
        run.Simulation, "__init__", lambda self, *a, **k: (made.append(1), start(self, *a, **k))[1]
    )
    model = osimlite.read(repo / WALKER)
    name = next(each.name for each in model.components(osimlite.Coordinate) if not each.locked)
    one = osimlite.simulate(model, to=0.1, engine="compiled")
    two = osimlite.simulate(model, to=0.1, engine="compiled", initial={name: 0.2}, accuracy=1e-5)
    three = osimlite.simulate(model, to=0.1, engine="compiled")
    assert len(made) == 1
    assert np.array_equal(one.values, three.values) and not np.array_equal(one.values, two.values)
    assert one.summary["settings"] == three.summary["settings"] != two.summary["settings"]
    osimlite.simulate(model, to=0.1, engine="compiled", simbody_early_return=True)
    assert len(made) == 2
    kept = [weakref.ref(simulation) for simulation in model.tree().cached.values()]
    assert len(kept) == 2
    del one, two, three, model
    gc.collect()
    assert [simulation() for simulation in kept] == [None, None]


def test_few_models_stay_ready(repo):
    models = [osimlite.read(repo / WALKER) for _ in range(cached_simulation.CACHED_SIMULATIONS + 2)]
    for model in models:
        osimlite.simulate(model, to=0.01, engine="compiled")
    assert [len(model.tree().cached) for model in models] == [
        0,
        0,
        *[1] * cached_simulation.CACHED_SIMULATIONS,
    ]


def test_a_trajectory_has_the_model_as_it_was(repo):
    model = osimlite.read(repo / WALKER)
    text = osimlite.to_text(model)
    before = osimlite.simulate(model, to=0.01, engine="compiled")
    forces = osimlite.simulate(model, to=0.01, engine="compiled").forces
    model.body_set.objects[0].mass *= 2.0
    after = osimlite.simulate(model, to=0.01, engine="compiled")
    assert osimlite.to_text(before.model) == text
    assert osimlite.to_text(after.model) == osimlite.to_text(model) != text
    assert after.model is after.model is not model
    for label, values in before.forces.items():
        assert np.array_equal(values, forces[label])


def test_files_are_read_every_time(repo, tmp_path):
    """A table of controls may change although the model does not."""
    model = osimlite.read(repo / WALKER)
    coordinate = list(model.components(osimlite.Coordinate))[-1]
    model.add(
        osimlite.CoordinateActuator(name="motor", coordinate=coordinate.name, optimal_force=1.0)
    )
    table = "controls\nversion=1\nnRows=2\nnColumns=2\ninDegrees=no\nendheader\ntime\tmotor\n0\t{0}\n1\t{0}\n"
    model.add(osimlite.PrescribedController(name="drive", controls_file="controls.sto"))
    result = []
    for level in (0.0, 5.0):
        (tmp_path / "controls.sto").write_text(table.format(level))
        result.append(osimlite.simulate(model, to=0.05, engine="compiled", folder=tmp_path).values)
    assert not np.array_equal(*result)


def test_threads_do_not_meet_in_one_model(repo):
    model = osimlite.read(repo / WALKER)
    name = next(each.name for each in model.components(osimlite.Coordinate) if not each.locked)
    starts = [0.01 * k for k in range(12)]

    def motion(start):
        trajectory = osimlite.simulate(model, to=0.2, engine="compiled", initial={name: start})
        return trajectory.values, trajectory.energy["total"]

    alone = [motion(start) for start in starts]
    with ThreadPoolExecutor(4) as pool:
        for (values, energy), (mine, own) in zip(pool.map(motion, starts), alone, strict=True):
            assert np.array_equal(values, mine) and np.array_equal(energy, own)


@pytest.mark.skipif(
    not has_machine_code(), reason="as Python the kernels take the time of many calls"
)
def test_a_model_that_has_moved_moves_in_one_call(repo, monkeypatch):
    calls = []
    whole = BatchWorkspace.run
    monkeypatch.setattr(
        BatchWorkspace, "run", lambda self, *rest: (calls.append(1), whole(self, *rest))[1]
    )
    model = osimlite.read(repo / WALKER)
    first = osimlite.simulate(model, to=1.0, engine="compiled")
    at_first = len(calls)
    osimlite.simulate(model, to=1.0, engine="compiled")
    calls.clear()
    last = osimlite.simulate(model, to=1.0, engine="compiled")
    # Earlier runs decide how many steps a call takes: one call for all, or a few if the machine
    # paused meanwhile.
    assert len(calls) < at_first
    assert np.array_equal(first.values, last.values)
    assert first.summary["contact_events"] == last.summary["contact_events"]
