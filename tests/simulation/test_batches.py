"""Tests of batches of runs: results equal single runs on any number of threads; conditions that end a run, reports, failures."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import osimlite
from osimlite.errors import ModelError, OsimliteError, SettingError
from osimlite.simulation import Simulation
from osimlite.simulation.batches import ENDINGS, Watch, run_many


@pytest.fixture(scope="module")
def engine(walker):
    with Simulation(walker, "compiled") as simulation:
        yield simulation.engine


@pytest.fixture(scope="module")
def starts(engine):
    infos = engine.mechanism.coordinates
    row = engine.state.pack(
        [info.default_value for info in infos], [info.default_speed for info in infos]
    )
    rows = np.tile(row, (20, 1))
    rows[1:] += np.random.default_rng(1).uniform(-0.1, 0.1, (19, len(row)))
    return rows


def test_default_start_is_the_simulation(engine, starts, walker):
    times = np.linspace(0.0, 2.0, 21)
    runs = run_many(engine, starts[:1], report_times=times, most_events=20)
    with Simulation(walker, "compiled") as simulation:
        trajectory = simulation.run(2.0, report_interval=0.1)
    order = list(engine.order)
    assert np.array_equal(runs.reports[0][:, : len(order)], trajectory.values[:, order])
    assert runs.counts[0].tolist() == [135, 173, 828]
    assert ENDINGS[int(runs.endings[0])] == "done"
    result = [event for event in trajectory.summary["contact_events"] if event["time_s"] > 0.0]
    assert [name for _, name, _ in runs.events[0]] == [event["contact"] for event in result]
    assert [t for t, _, _ in runs.events[0]] == pytest.approx(
        [event["time_s"] for event in result], abs=1e-9
    )
    for name, (force, t) in zip(engine.contacts, runs.peaks[0].tolist(), strict=True):
        largest = trajectory.summary["largest_contact_forces"].get(
            name, {"force_N": 0.0, "time_s": 0.0}
        )
        assert (force, t) == pytest.approx((largest["force_N"], largest["time_s"]))


def test_threads_do_not_matter(engine, starts):
    one, two = (
        run_many(engine, starts, 1.0, most_events=30, threads=threads) for threads in (1, 2)
    )
    assert np.array_equal(one.states, two.states)
    assert np.array_equal(one.counts, two.counts)
    assert one.events == two.events
    alone = [run_many(engine, start[None], 1.0).states[0] for start in starts]
    assert np.array_equal(one.states, alone)


def test_an_engine_goes_to_another_process(engine, starts):
    other = pickle.loads(pickle.dumps(engine))
    assert np.array_equal(
        run_many(other, starts[:2], 1.0).states, run_many(engine, starts[:2], 1.0).states
    )


def test_other_numbers_need_no_other_code(engine, starts, walker, fixtures):
    heavy = osimlite.read(fixtures / "walker" / "DynamicWalkerModel.osim")
    next(body for body in heavy.components(osimlite.Body) if body.name == "Pelvis").mass = 3.0
    with Simulation(heavy, "compiled") as simulation:
        other = simulation.engine
        numbers = np.stack([engine.numbers, other.numbers])
        runs = run_many(engine, starts[[0, 0]], 1.0, numbers=numbers)
        assert np.array_equal(runs.states[0], run_many(engine, starts[:1], 1.0).states[0])
        assert np.array_equal(runs.states[1], run_many(other, starts[:1], 1.0).states[0])
    assert not np.allclose(runs.states[0], runs.states[1])


def test_a_fall_ends_a_run(engine, starts):
    pelvis = engine.mechanism.coordinate_index("Pelvis_ty")
    place = engine.order.index(pelvis)
    level = starts[0, place] - 0.1
    by_value = Watch("low", coordinate="Pelvis_ty", level=level, stops=-1)
    runs = run_many(
        engine, starts, 3.0, watches=[by_value], most_events=40, report_times=[0.0, 3.0]
    )
    ends = [ENDINGS[int(ending)] for ending in runs.endings]
    assert "stopped" in ends
    for ending, t, state, events in zip(ends, runs.times, runs.states, runs.events, strict=True):
        if ending == "stopped":
            assert events[-1] == (t, "low", False)
            assert state[place] == pytest.approx(level, abs=1e-7)
        assert [event[0] for event in events] == sorted(event[0] for event in events)
    stopped = ends.index("stopped")
    assert np.isnan(runs.reports[stopped, 1]).all() and not np.isnan(runs.reports[stopped, 0]).any()


def test_height_of_a_point(engine, starts):
    watch = Watch("down", body="Pelvis", station=(0.0, 0.1, 0.0), level=0.6, stops=-1)
    runs = run_many(engine, starts[:1], 5.0, watches=[watch], most_events=40)
    assert ENDINGS[int(runs.endings[0])] == "stopped"
    q = engine.state.values(runs.states[0].tolist())
    assert engine.mechanism.station_position("Pelvis", (0.0, 0.1, 0.0), q)[1] == pytest.approx(
        0.6, abs=1e-7
    )


def test_a_run_that_fails_does_not_harm_the_others(engine, starts):
    rows = starts.copy()
    rows[3, 0] = np.nan
    runs = run_many(engine, rows, 0.5)
    assert ENDINGS[int(runs.endings[3])] == "failed"
    expected = run_many(engine, starts, 0.5)
    others = [k for k in range(20) if k != 3]
    assert np.array_equal(runs.states[others], expected.states[others])
    runs = run_many(engine, starts, 2.0, most_tries=10)
    assert {ENDINGS[int(ending)] for ending in runs.endings} == {"too many steps"}


def test_wrong_words_are_refused(engine, starts):
    with pytest.raises(OsimliteError, match="14 numbers"):
        run_many(engine, starts[:, 1:])
    with pytest.raises(
        OsimliteError, match=r"expected an array of the shape .20, [0-9]+., one row for each run"
    ):
        run_many(engine, starts, numbers=np.zeros((3, 5)))
    with pytest.raises(OsimliteError, match="'x' must name exactly one of"):
        run_many(engine, starts, watches=[Watch("x")])
    with pytest.raises(OsimliteError, match="locked"):
        run_many(engine, starts, watches=[Watch("x", coordinate="platform_rz")])
    with pytest.raises(OsimliteError, match="no contact 'RHipForc'; did you mean 'RHipForce'"):
        run_many(engine, starts, watches=[Watch("x", contact="RHipForc")])
    with pytest.raises(ModelError, match="no coordinate"):
        run_many(engine, starts, watches=[Watch("x", coordinate="nothing")])


def test_states_at_events_are_those_of_the_motion(engine, starts):
    runs = run_many(engine, starts, 2.0, accuracy=1e-6, most_events=60, event_states=True)
    for start, events, states in zip(starts, runs.events, runs.event_states, strict=True):
        assert states.shape == (len(events), 14)
        times = sorted({t for t, _, _ in events})
        known = run_many(engine, start[None], 2.0, accuracy=1e-6, report_times=times).reports[0]
        for (t, _, _), state in zip(events, states, strict=True):
            assert state == pytest.approx(known[times.index(t)], abs=1e-12)


def test_a_touch_ends_a_run(engine, starts):
    watch = Watch("down", contact="RHipForce", stops=1)
    runs = run_many(engine, starts, 5.0, watches=[watch], most_events=90)
    ends = [ENDINGS[int(ending)] for ending in runs.endings]
    assert ends.count("stopped") > 10
    for end, t, events in zip(ends, runs.times, runs.events, strict=True):
        begins = [moment for moment, name, _ in events if name == "RHipForce"]
        assert begins == (pytest.approx([t], abs=2e-9) if end == "stopped" else [])
        assert [event for event in events if event[1] == "down"] == (
            [(t, "down", True)] if begins else []
        )


@pytest.mark.parametrize(
    ("settings", "why"),
    [
        ({"accuracy": float("nan")}, "between 0 and 1; nan"),
        ({"accuracy": 0.0}, "between 0 and 1; 0.0"),
        ({"accuracy": 2.0}, "between 0 and 1; 2.0"),
        ({"to": float("nan")}, "at 0 s or later, not at nan s"),
        ({"to": -1.0}, "at 0 s or later, not at -1.0 s"),
        ({"report_times": [0.5, 0.1]}, "must not decrease"),
        ({"report_times": [-0.1]}, "must not decrease"),
        ({"report_times": [float("nan")]}, "must not decrease"),
        ({"threads": -1}, "threads must be at least 1, not -1"),
        ({"most_events": -1}, "most_events must be at least 0"),
        ({"most_tries": -1}, "most_tries must be at least 0"),
    ],
)
def test_settings_without_meaning_are_refused(engine, starts, settings, why):
    """With some of these settings, machine code would never end."""
    with pytest.raises(SettingError, match=why):
        run_many(engine, starts[:1], **{"to": 0.1, **settings})


def test_endings_are_those_of_the_machine_code():
    from osimlite.mechanics.kernels import record

    words = {
        record.ENDING.DONE: "done",
        record.ENDING.FAILED: "failed",
        record.ENDING.STOPPED: "stopped",
        record.ENDING.TOO_MANY: "too many steps",
    }
    assert words == ENDINGS
