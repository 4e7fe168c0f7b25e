"""Tests of reflexes and noise that control the actuators of simulations."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.errors import OsimliteError
from osimlite.mechanics.kernels.reflexes import draw_normal, philox
from osimlite.models.walking import write_scenario
from osimlite.simulation.control_steps import ControllerRuns
from osimlite.simulation.trajectory import Interrupted
from osimlite.studies.gym.tasks import arm as task
from osimlite.studies.reflexes.scenario import Scenario
from tests.suite import choose

REFLEXES = {
    "dual_sided": 0,
    "DofReflex": [
        {
            "target": "flexor",
            "source": "elbow",
            "P0": 1.2,
            "KP": "~2<0,20>",
            "KV": 0.3,
            "delay": 0.013,
            "C0": 0.1,
        },
        {"target": "extensor", "source": "elbow", "P0": 1.2, "KP": -1, "allow_neg_P": 0},
    ],
    "MuscleReflex": {
        "target": "extensor",
        "source": "flexor",
        "KF": 0.2,
        "KV": 0.01,
        "delay": 0.005,
    },
}
SOUGHT: dict[str, Any] = {
    "dual_sided": 0,
    "DofReflex": {"target": "motor", "source": "elbow", "P0": 1.2, "KP": "~1<0,9>", "KV": "~0.2<0,1>",
                  "delay": "~0.005<0,0.05>"},
}  # fmt: skip
STEP = 0.005
simulate: Any = osimlite.simulate
"""Without a static type: its trajectories have the attribute `controller` only with a controller."""


@pytest.fixture(scope="module")
def model():
    made = task().model()
    motor = osimlite.CoordinateActuator(
        name="motor", coordinate="elbow", optimal_force=2.0, min_control=-0.2, max_control=0.5
    )
    made.add(motor)
    return made


def same(one, other) -> bool:
    return np.array_equal(one.times, other.times) and np.array_equal(
        one.states.rows, other.states.rows
    )


def test_controls_are_sums_of_what_was_felt(model) -> None:
    feedback = osimlite.Feedback({"ReflexController": REFLEXES}, {"flexor-elbow.KP": 3.0})
    moved = simulate(model, 0.3, controller=feedback, report_interval=STEP)
    told, count = moved.controller, 61
    assert told.times == pytest.approx(STEP * np.arange(count), abs=0.0)
    # The recorded sensors equal the values of the motion.
    assert told["elbow.value"] == pytest.approx(moved.values[:, -1], abs=1e-15)
    strength = model.tree().by_path["/forceset/flexor"].max_isometric_force
    assert told["forceset/flexor.force"] == pytest.approx(
        moved.forces["flexor"] / strength, abs=1e-12
    )

    def before(column: str, delay: float):
        return np.interp(told.times - delay, told.times, told[column])

    angle, speed = (before(f"elbow.{what}", 0.013) for what in ("value", "speed"))
    flexor = 3.0 * (1.2 - angle) - 0.3 * speed + 0.1
    extensor = np.maximum(told["elbow.value"] - 1.2, 0.0)
    extensor += 0.2 * before("forceset/flexor.force", 0.005)
    extensor += 0.01 * np.maximum(before("forceset/flexor.velocity", 0.005), 0.0)
    assert told["/forceset/flexor"] == pytest.approx(np.clip(flexor, 0.0, 1.0), abs=1e-12)
    assert told["/forceset/extensor"] == pytest.approx(np.clip(extensor, 0.0, 1.0), abs=1e-12)
    assert np.ptp(told["/forceset/flexor"]) > 0.1 and (told["/forceset/motor"] == 0.0).all()


def test_what_was_interrupted_goes_on(model) -> None:
    feedback = osimlite.Feedback({"ReflexController": REFLEXES})

    def stop(time: float, _: Any = None) -> None:
        if time > 0.0:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted) as stopped:
        simulate(model, 1000.0, controller=feedback, report_interval=0.3, progress=stop)
    first: Any = stopped.value.trajectory
    end = first.times[-1]
    assert 0.0 <= end - first.controller.times[-1] < STEP
    assert simulate(model, end + 0.01, controller=feedback, resume=first).times[0] == end


def test_a_record_ends_with_the_motion(model, monkeypatch) -> None:
    """An interruption may come after control steps were recorded but before their states."""
    seen, table = [], ControllerRuns.table

    def noted(self: ControllerRuns, *end: float) -> Any:
        seen.append(self)
        return table(self, *end)

    monkeypatch.setattr(ControllerRuns, "table", noted)
    simulate(model, 0.1, controller=osimlite.Feedback({"ReflexController": REFLEXES}))
    for end, last in ((0.0525, 0.05), (0.055, 0.055), (1.0, 0.1)):
        cut = seen[0].table(end)
        assert cut.times[-1] == pytest.approx(last, abs=1e-12) and len(cut.rows) == len(cut.times)


@pytest.mark.parametrize("integrator", ["merson", "euler2", "rosenbrock", "bdf", "adams"])
def test_runs_go_on_bit_for_bit(model, integrator, tmp_path) -> None:
    feedback = osimlite.Feedback({"ReflexController": REFLEXES})
    whole = simulate(model, 0.4, controller=feedback, integrator=integrator)
    first = simulate(model, 0.1, controller=feedback, integrator=integrator)
    first.write(tmp_path / "first")
    second = simulate(
        model, 0.3, controller=feedback, integrator=integrator, resume=tmp_path / "first"
    )
    third = simulate(model, 0.4, controller=feedback, integrator=integrator, resume=second)
    assert third.times[0] == 0.3 and third.times[-1] == 0.4
    rows = slice(30, None)
    assert np.array_equal(third.times, whole.times[rows])
    assert np.array_equal(third.states.rows, whole.states.rows[rows])
    told = third.controller
    assert np.array_equal(told.rows, whole.controller.rows[-len(told.times) :])
    assert {name: column[-1] for name, column in third.forces.items()} == {
        name: column[-1] for name, column in whole.forces.items()
    }


def test_a_human_goes_on_in_the_midst_of_a_walk(tmp_path) -> None:
    """Continue with states of the legs, contact, and delays of several control steps."""
    file = write_scenario(tmp_path)
    scenario = Scenario(file)
    start = scenario.walk(scenario.best(), duration=0.005).states
    initial = {path: float(start[path][0]) for path in start.columns}
    choices = {
        "controller": osimlite.Feedback(file),
        "integrator": "euler2",
        "report_interval": 0.05,
    }
    whole = simulate(scenario.model, 2.0, initial=initial, **choices)
    assert np.ptp(whole.states["/jointset/ground_pelvis/pelvis_tx/value"]) > 1.5
    assert {0.0, 1.0, 2.0, 3.0} <= {*whole.controller["leg_l.state"]}
    first = simulate(scenario.model, 0.75, initial=initial, **choices)
    second = simulate(scenario.model, 2.0, resume=first, **choices)
    assert np.array_equal(second.states.rows, whole.states.rows[15:])
    # The contact events are those of the complete run.
    events = [each for each in whole.summary["contact_events"] if each["time_s"] > 0.75]
    begun = [each for each in second.summary["contact_events"] if each["time_s"] > 0.75]
    assert [each["contact"] for each in begun] == [each["contact"] for each in events]
    assert [each["time_s"] for each in begun] == pytest.approx(
        [each["time_s"] for each in events], abs=1e-8
    )


def test_an_interrupted_run_goes_on(model) -> None:
    feedback = osimlite.Feedback({"ReflexController": REFLEXES})

    def stop(time: float, _: float) -> None:
        if time > 0.1:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted) as stopped:
        simulate(model, 0.5, controller=feedback, progress=stop)
    first: Any = stopped.value.trajectory
    second = simulate(model, 0.5, controller=feedback, resume=first)
    whole = simulate(model, 0.5, controller=feedback)
    assert 0.1 < second.times[0] < 0.5 and second.values[-1] == pytest.approx(
        whole.values[-1], abs=1e-6
    )


def test_motors_are_driven_beside_what_else_drives(model) -> None:
    reflex = {"target": "motor", "source": "elbow", "P0": 1.2, "KP": 5, "KV": 1, "delay": 0.005}
    given = {
        "ReflexController": {"dual_sided": 0, "DofReflex": reflex},
        "fixed_control_step_size": 0.002,
    }
    moved = simulate(
        model, 0.5, controller=osimlite.Feedback(given), controls={"flexor": 0.1, "motor": 0.3}
    )
    told = moved.controller["/forceset/motor"]
    assert told[0] == 0.5 and told.min() < 0.49 and len(told) == 251
    # The motor's force follows its control, also between control steps.
    expected = 2.0 * (0.3 + told[::5])
    assert moved.forces["motor"] == pytest.approx(expected, abs=1e-12)
    # Prescribing the recorded controls gives the same motion.
    held = osimlite.PiecewiseConstantFunction(x=tuple(moved.controller.times), y=tuple(0.3 + told))
    again = simulate(model, 0.5, controls={"flexor": 0.1, "motor": held}, accuracy=1e-7)
    assert again.values == pytest.approx(moved.values, abs=2e-5)


def test_any_run_goes_on(model, tmp_path) -> None:
    first = simulate(model, 0.2, controls={"flexor": 0.3})
    first.write(tmp_path)
    whole = simulate(model, 0.4, controls={"flexor": 0.3}, accuracy=1e-8)
    second = simulate(model, 0.4, controls={"flexor": 0.3}, resume=tmp_path, accuracy=1e-8)
    assert second.times[0] == 0.2 and second.values[-1] == pytest.approx(whole.values[-1], abs=1e-3)


def test_what_has_no_meaning_is_refused(model, tmp_path) -> None:
    feedback, other = (osimlite.Feedback({"ReflexController": {"dual_sided": 0, "DofReflex": {
        "target": name, "source": "elbow", "KP": 1}}}) for name in ("motor", "flexor"))  # fmt: skip
    first = simulate(model, 0.1, controller=feedback)
    plain, finer = simulate(model, 0.1), task().model()
    first.write(tmp_path / "first")
    (tmp_path / "first" / "controller.sto").unlink()
    for words, choices in (
        (
            r"later than its start, 0\.1 s, found 0\.05 s",
            {"to": 0.05, "resume": first, "controller": feedback},
        ),
        ("the earlier run had a controller; pass", {"resume": first}),
        ("so it had no controller", {"resume": plain, "controller": feedback}),
        (r"has no controller\.sto", {"resume": tmp_path / "first", "controller": feedback}),
        (
            "leave out initial values, speeds and equilibrate",
            {"resume": first, "controller": feedback, "initial": {"elbow": 1.0}},
        ),
        (
            r"controller is an osimlite\.Feedback, such as osimlite\.Feedback\('a.yaml'\)",
            {"controller": "a.yaml"},
        ),
        ("leave out the fixed step", {"controller": feedback, "fixed_step": 0.001}),
        (
            "combined with controls that are Python functions",
            {"controller": feedback, "controls": {"motor": lambda t: t}},
        ),
    ):
        with pytest.raises(OsimliteError, match=words):
            simulate(model, **{"to": 0.2, **choices})
    with pytest.raises(OsimliteError, match="other sensors or actuators"):
        simulate(finer, 0.2, controller=other, resume=first)
    with pytest.raises(OsimliteError, match="no 'motor'; expected flexor or extensor"):
        simulate(finer, 0.2, controller=feedback)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"KP": 3.0}, r"'motor-elbow\.KP' 1, this one has 3"),
        ({"P0": 1.0}, r"'motor-elbow\.P0' 1\.2, this one has 1"),
        ({"delay": "0.006"}, r"'motor-elbow\.delay' 0\.005, this one has 0\.006"),
        ({"allow_neg_P": 0}, "other reflexes, states of legs or noise"),
    ],
)
@pytest.mark.parametrize("is_file", [True, False])
def test_a_run_goes_on_by_the_gains_that_it_began_with(
    model, changed, words, is_file, tmp_path
) -> None:
    first = simulate(model, 0.1, controller=osimlite.Feedback({"ReflexController": SOUGHT}))
    first.write(tmp_path)
    before = tmp_path if is_file else first
    other = {**SOUGHT, "DofReflex": {**SOUGHT["DofReflex"], **changed}}
    with pytest.raises(OsimliteError, match=words):
        simulate(
            model, 0.2, controller=osimlite.Feedback({"ReflexController": other}), resume=before
        )


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"DofReflex": {}}, "a controller is required"),
        ({"ReflexControler": {}}, "'ReflexControler'; did you mean 'ReflexController'"),
        (
            {"ReflexController": [REFLEXES] * 2},
            "'ReflexController' follows 'ReflexController', but only one is allowed",
        ),
        (
            {"ReflexController": REFLEXES, "CompositeController": {}},
            "'CompositeController' follows 'Reflex",
        ),
        (
            {"ReflexController": REFLEXES, "fixed_control_step_size": 0},
            "'fixed_control_step_size' is 0.0001 s or",
        ),
        (
            {"ReflexController": REFLEXES, "fixed_control_step_size": 1e-9},
            "0.0001 s or more, not 1e-09 s",
        ),
        (
            {
                "ReflexController": {
                    "DofReflex": {"target": "motor", "source": "elbow", "delay": 11}
                }
            },
            "the maximum is 10 s",
        ),
        (
            {"ReflexController": REFLEXES, "measure": 1},
            "does not support 'measure' of a file of a controller",
        ),
        (
            {"CompositeController": {"NoiseControler": {}}},
            "'NoiseControler'.*did you mean 'NoiseController'",
        ),
        ({"CompositeController": {"NoiseController": [{}, {}]}}, "a second NoiseController"),
        (
            {"CompositeController": {"NoiseController": {"base_noice": 1}}},
            "'base_noice' of a NoiseController",
        ),
        (
            {"CompositeController": {"NoiseController": {"base_noise": -1}}},
            "'base_noise' must not be negative",
        ),
        (
            {"CompositeController": {"NoiseController": {"random_seed": 1.5}}},
            "'random_seed'.*whole.*not 1.5",
        ),
        (
            {"CompositeController": {"NoiseController": {"random_seed": 1e20}}},
            "'random_seed'.*whole.*not 1e.20",
        ),
    ],
)
def test_what_is_not_done_is_refused(model, given, words) -> None:
    with pytest.raises(OsimliteError, match=words):
        simulate(model, 0.01, controller=osimlite.Feedback(given))


def test_values_of_nothing_are_refused(model) -> None:
    feedback = osimlite.Feedback({"ReflexController": REFLEXES}, {"flexor.KP": 1.0})
    with pytest.raises(
        OsimliteError, match=r"no parameter 'flexor\.KP'.*did you mean 'flexor-elbow\.KP'"
    ):
        simulate(model, 0.01, controller=feedback)


# ------------------------------------------------------------------------------------------------------------- noise
@pytest.mark.parametrize(
    ("counter", "key", "words"),
    [
        ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D)),
        ((0xFFFFFFFF,) * 4, (0xFFFFFFFF,) * 2, (0x408F276D, 0x41C83B0E)),
        (
            (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
            (0xA4093822, 0x299F31D0),
            (0xD16CFE09, 0x94FDCCEB),
        ),
    ],
)
def test_philox_is_that_of_its_authors(counter, key, words) -> None:
    """The expected words are published with Random123 (kat_vectors)."""
    assert philox(*counter, *key) == words


def test_noise_is_normal() -> None:
    drawn = np.array(
        [draw_normal(7, 0, step, number) for step in range(500) for number in range(8)]
    )
    assert abs(drawn.mean()) < 0.05 and drawn.std() == pytest.approx(1.0, abs=0.05)
    assert np.mean(np.abs(drawn) < 1.0) == pytest.approx(0.6827, abs=0.03)
    assert len(np.unique(drawn)) == len(drawn)


def noisy(**noise):
    given = {"CompositeController": {"ReflexController": REFLEXES, "NoiseController": noise}}
    return osimlite.Feedback(given, {"flexor-elbow.KP": 0.3})


def test_noise_is_as_large_as_it_is_asked_for(model) -> None:
    calm, rough = (
        simulate(model, 0.2, controller=noisy(base_noise=base, proportional_noise=part)).controller
        for base, part in ((0.0, 0.0), (0.004, 0.02))
    )
    value, drawn = calm["/forceset/flexor"][0], draw_normal(123, 0, 0, 0)
    assert 0.1 < value < 0.9
    assert rough["/forceset/flexor"][0] == pytest.approx(
        value + (0.004 + 0.02 * value) * drawn, abs=1e-12
    )
    felt = simulate(
        model, 0.05, controller=noisy(sensor_noise=0.01, proportional_sensor_noise=0.1)
    ).controller
    first, place = calm.rows[0], calm.columns.index("elbow.value")
    width = 0.01 + 0.1 * abs(first[place])
    assert felt.rows[0, place] == pytest.approx(
        first[place] + width * draw_normal(123, 1, 0, place), abs=1e-12
    )


def test_what_no_reflex_drives_has_noise_too(model) -> None:
    """This is as in SCONE; noise in proportion to a control of zero is zero."""
    one = {"dual_sided": 0, "DofReflex": {"target": "flexor", "source": "elbow", "KP": 1}}
    for noise, drives in (({"base_noise": 5.0}, True), ({"proportional_noise": 5.0}, False)):
        both = {"CompositeController": {"ReflexController": one, "NoiseController": noise}}
        extensor = simulate(model, 0.2, controller=osimlite.Feedback(both)).controller[
            "/forceset/extensor"
        ]
        assert extensor.max() == float(drives)


def test_seeds_are_exact(model) -> None:
    """This also holds for a run that continues another one."""
    runs = [
        simulate(model, 0.2, controller=noisy(base_noise=0.05, random_seed=seed))
        for seed in (1, 1, 2)
    ]
    assert same(runs[0], runs[1]) and not same(runs[0], runs[2])
    first = simulate(model, 0.1, controller=noisy(base_noise=0.05, random_seed=1))
    second = simulate(model, 0.2, controller=noisy(base_noise=0.05, random_seed=1), resume=first)
    assert np.array_equal(second.states.rows, runs[0].states.rows[10:])


def test_noisy_walks_alone_are_those_among_many(tmp_path) -> None:
    file = write_scenario(tmp_path)
    text, end = file.read_text(), "CompositeMeasure"
    inner, measures = (
        text[text.index("GaitStateController") : text.index(end)],
        text[text.index(end) :],
    )
    noise = "NoiseController { base_noise = 0.005 proportional_noise = 0.05 random_seed = 5 }"
    head = text[: text.index("GaitStateController")]
    file.write_text(f"{head} CompositeController {{ {inner} {noise} }} {measures}")
    scenario = Scenario(file)
    best, name = scenario.best(), "S00011.vasti.KF"
    with pytest.warns(UserWarning, match="those of SCONE depend on its compiler"):
        together = scenario.walk(best | {name: best[name] * np.array([1.0, 1.01])}, 2, duration=1.0)
        alone = [
            scenario.walk(best | {name: best[name] * factor}, duration=1.0)
            for factor in (1.0, 1.01)
        ]
    assert together.results.tolist() == [walked.results[0] for walked in alone]
    calm = Scenario(write_scenario(tmp_path / "calm"))
    assert calm.walk(best, duration=1.0).results[0] != together.results[0]


# ------------------------------------------------------------------------------------------------------------- sweeps
def test_many_runs_are_single_ones_bit_for_bit(model) -> None:
    """This also holds with different muscles, which scale the sensors of force, in any block and on any thread."""
    from osimlite.studies.sweep.plan import plan
    from osimlite.studies.sweep.runner import Runner

    feedback = osimlite.Feedback({"ReflexController": REFLEXES})
    names = ["flexor/max_isometric_force", "extensor/optimal_fiber_length@scale", "elbow"]
    made = plan(
        model, dict.fromkeys(names[:1], "400:900") | {names[1]: "0.9:1.1", names[2]: "0.3:1.5"}, to=0.3,
        measures=("elbow/value", "max(elbow/speed)"), controller=feedback, controls={"motor": 0.1},
    )  # fmt: skip
    rows = np.array([[500.0, 1.0, 0.8], [850.0, 1.05, 0.4], [410.0, 0.93, 1.3]])
    together = Runner(made).run(rows)
    assert together.status == ["done"] * 3
    again = Runner(made).run(rows[[2, 0, 1]])
    for name in together.measures:
        assert np.array_equal(together.measures[name][[2, 0, 1]], again.measures[name])
    for k, (strength, scale, start) in enumerate(rows.tolist()):
        own = model.copy_deep()
        own.tree().by_path["/forceset/flexor"].max_isometric_force = strength
        own.tree().by_path["/forceset/extensor"].optimal_fiber_length *= scale
        given = {"controls": {"motor": 0.1}, "initial": {"elbow": start}, "engine": "compiled"}
        alone = simulate(own, 0.3, controller=feedback, **given)
        assert together.measures["elbow/value"][k] == alone.values[-1, -1]
    with pytest.raises(OsimliteError, match="needs 'motor', which depends on the controller"):
        Runner(plan(model, {"elbow": "0.3:1.5"}, measures=("max(motor)",), controller=feedback))


@pytest.mark.full
def test_sweeps_go_by_a_file(model, tmp_path) -> None:
    pytest.importorskip("yaml", reason="needs PyYAML (extra 'yaml')")
    pytest.importorskip("pyarrow", reason="needs pyarrow (extra 'sweep')")
    from tests.cli.command import run as command

    osimlite.write(model, tmp_path / "arm.osim")
    (tmp_path / "hold.yaml").write_text(
        'ReflexController:\n  dual_sided: 0\n  DofReflex: {target: motor, source: elbow, P0: 1.2, KP: "~1<0,9>"}\n'
    )
    words = [
        "sweep",
        tmp_path / "arm.osim",
        "--vary",
        "elbow=0.4:1.4:3",
        "--to",
        "0.1",
        "--measure",
        "elbow/value",
    ]
    words += ["--controller", tmp_path / "hold.yaml", "-o", tmp_path / "r.parquet"]
    assert command(*words).code == 0
    (tmp_path / "stiff.par").write_text("motor-elbow.KP 5 5 1\n")
    result = command(*words, "--par", tmp_path / "stiff.par")
    assert result.code != 0 and "settings" in result.err


def test_kernels_as_python_go_likewise(model, monkeypatch) -> None:
    """Vectors with bounds raise an error for indices outside."""
    from tests.simulation.checked import Checked

    feedback = noisy(base_noise=0.01, sensor_noise=0.01)
    expected = osimlite.simulation.Simulation(model, "compiled").run(0.02, controller=feedback)
    with monkeypatch.context() as patched:
        patched.setattr("osimlite.simulation.evaluation.select_code", lambda: Checked("Python"))
        plain = osimlite.simulation.Simulation(model, "compiled").run(0.02, controller=feedback)
    assert plain.states.rows == pytest.approx(expected.states.rows, rel=1e-12, abs=1e-12)
    assert expected.controller is not None and plain.controller is not None
    assert plain.controller.rows == pytest.approx(expected.controller.rows, rel=1e-9, abs=1e-12)


def test_gains_of_many_runs_are_those_of_single_ones_bit_for_bit(model) -> None:
    """This also holds with different delays, and next to other variables of the model."""
    from osimlite.studies.sweep.plan import plan
    from osimlite.studies.sweep.runner import Runner

    feedback = osimlite.Feedback({"ReflexController": SOUGHT})
    choices: Any = {"to": 0.3, "measures": ("elbow/value",), "controller": feedback}
    made = plan(model, {}, **choices)
    assert {item.name: (item.low, item.high) for item in made.variables} == {
        "motor-elbow.delay": (0.0, 0.05), "motor-elbow.KP": (0.0, 9.0), "motor-elbow.KV": (0.0, 1.0),
    }  # fmt: skip
    some = plan(model, {"elbow": "0.7", "motor-elbow.KP": "2"}, **choices)
    assert [item.name for item in some.variables] == [
        "elbow",
        "motor-elbow.KP",
        "motor-elbow.delay",
        "motor-elbow.KV",
    ]
    rows = np.array([[0.0, 5.0, 0.1], [0.05, 0.0, 0.0], [0.013, 2.0, 0.9]])
    together = Runner(made).run(rows)
    names = [item.name for item in made.variables]
    for k, row in enumerate(rows.tolist()):
        controller = feedback.replace_values(dict(zip(names, row, strict=True)))
        alone = simulate(model, 0.3, controller=controller, engine="compiled")
        assert together.measures["elbow/value"][k] == alone.values[-1, -1]
    both = plan(model, {"*.K?": "0:1", "motor/optimal_force": "1:3", "elbow": "0.4:0.9"}, **choices)
    found = Runner(both).run(np.array([[0.7, 1.5, 0.5]])).measures["elbow/value"][0]
    own = model.copy_deep()
    own.tree().by_path["/forceset/motor"].optimal_force = 1.5
    controller = feedback.replace_values({"motor-elbow.KP": 0.7, "motor-elbow.KV": 0.7})
    alone = simulate(own, 0.3, controller=controller, initial={"elbow": 0.5}, engine="compiled")
    assert found == alone.values[-1, -1]


def test_a_search_for_gains(model, tmp_path) -> None:
    """The result is a file of parameters, with which a simulation has the same cost."""
    pytest.importorskip("yaml", reason="needs PyYAML (extra 'yaml')")
    pytest.importorskip("pyarrow", reason="needs pyarrow (extra 'sweep')")
    import json

    from tests.cli.command import run as command

    osimlite.write(model, tmp_path / "arm.osim")
    text = (
        json.dumps({"ReflexController": SOUGHT})
        .replace('"~0.005<0,0.05>"', "0.005")
        .replace("1.2", "0.5")
    )
    (tmp_path / "hold.yaml").write_text(text)
    given = ["--controller", tmp_path / "hold.yaml", "--to", "0.3"]
    words = ["optimize", tmp_path / "arm.osim", *given, "--objective", "max(elbow)-min(elbow)"]
    out = tmp_path / "out"
    result = command(*words, "--budget", choose("25", "40"), "--method", "nelder-mead", "-o", out)
    assert result.code == 0 and "best.par" in result.out
    summary = json.loads((out / "summary.json").read_text())
    begun = simulate(
        model, 0.3, controller=osimlite.Feedback(tmp_path / "hold.yaml"), engine="compiled"
    )
    best = osimlite.Feedback(tmp_path / "hold.yaml", out / "best.par")
    found = simulate(osimlite.read(out / "best.osim"), 0.3, controller=best, engine="compiled")
    assert np.ptp(found.values[:, -1]) == pytest.approx(summary["value"], abs=1e-12)
    assert summary["value"] < 0.9 * np.ptp(begun.values[:, -1])
    assert "PrescribedController" not in (out / "best.osim").read_text()
    for more, told in (
        (["--method", "gradient"], "have no derivatives"),
        (
            ["--vary", "motor-elbow.KQ=0:1"],
            "numeric property 'motor-elbow.KQ' to vary; did you mean 'motor-elbow.KP'",
        ),
        (["--vary", "motor-elbow.KP=0:1deg"], "whose unit osimlite does not know"),
    ):
        refused = command(*words, *more, "-o", tmp_path / "other")
        assert refused.code != 0 and told in refused.err.replace("\n", " ")
    (tmp_path / "hold.yaml").write_text(text.replace("~1<0,9>", "~1"))
    refused = command(*words, "-o", tmp_path / "other")
    assert refused.code != 0 and "'motor-elbow.KP' has no bounds" in refused.err.replace("\n", " ")
    (tmp_path / "hold.yaml").write_text(
        text.replace("~", "").replace("<0,9>", "").replace("<0,1>", "")
    )
    refused = command(*words, "-o", tmp_path / "other")
    assert refused.code != 0 and "there is nothing to vary" in refused.err
