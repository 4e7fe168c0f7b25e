"""Tests of humans that walk by reflexes: the built-in one, and SCONE's if its sources are next to this repository."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.errors import OsimliteError
from osimlite.mechanics.kernels.walks import ORDER
from osimlite.models.walking import write_scenario
from osimlite.studies.reflexes.parameters import Parameters
from osimlite.studies.reflexes.scenario import Candidates, Scenario
from tests.conftest import ROOT

ARM = """
CmaOptimizer {
    SimulationObjective {
        max_duration = 1
        ModelOpenSim4 { model_file = arm.osim initial_load = 0 }
        ReflexController {
            dual_sided = 0
            DofReflex { target = flexor source = elbow P0 = 1.2 KP = ~2<0,20> KV = 0.3 delay = 0.01 C0 = ~0.1<0,1> }
            DofReflex { target = extensor source = elbow P0 = 1.2 KP = -1 allow_neg_P = 0 }
        }
        DofMeasure { dof = elbow start_time = 0.2 position { min = 65 max = 72 abs_penalty = 1 } }
    }
}
"""


@pytest.fixture(scope="module")
def ours(tmp_path_factory):
    return Scenario(write_scenario(tmp_path_factory.mktemp("walk")))


@pytest.fixture
def arm(tmp_path):
    from osimlite.io.document.printer import write
    from osimlite.studies.gym.tasks import arm as task

    pytest.importorskip("gymnasium", reason="needs gymnasium (extra 'gym')")
    write(task().model(), tmp_path / "arm.osim")
    (tmp_path / "arm.scone").write_text(ARM)
    return tmp_path / "arm.scone"


def test_our_human_walks(ours) -> None:
    walked = ours.walk(ours.best(), duration=4.0)
    assert walked.times.tolist() == [4.0]
    far = walked.states["/jointset/ground_pelvis/pelvis_tx/value"]
    assert 1.0 < np.ptp(far) / 4.0 < 1.5
    loads = walked.loads.rows[200:]
    # Each foot alone carries the body in turn, and both do for some time.
    assert (loads.max(axis=0) > 0.9).all() and (loads.min(axis=0) == 0.0).all()
    assert 0.02 < np.mean((loads > 0.05).all(axis=1)) < 0.4
    assert walked.results[0] == pytest.approx(
        sum(terms[0] for terms in walked.terms.values()), abs=0.5
    )


def test_candidates_are_single_walks_bit_for_bit(ours) -> None:
    """This also holds when another candidate falls."""
    best = ours.best()
    name = "S00011.vasti.KF"
    gains = np.array([best[name], 0.0, 1.1 * best[name]])
    together = ours.walk(best | {name: gains}, 3, duration=1.5)
    assert together.times[1] < 1.5
    for k in (0, 1, 2):
        alone = ours.walk(best | {name: gains[k]}, duration=1.5)
        assert (alone.times[0], alone.results[0]) == (together.times[k], together.results[k])


def test_walks_begin_with_the_weight_that_is_asked_for(ours) -> None:
    candidates = Candidates(ours, Parameters(ours.best()), 1.0)
    assert candidates.walkers.get_leg_loads().sum() == pytest.approx(0.5, rel=0.1)


def test_a_scenario_that_somebody_changed_is_kept(tmp_path) -> None:
    file = write_scenario(tmp_path)
    assert write_scenario(tmp_path) == file
    for name in ("human-walks.scone", "human.osim"):
        path = tmp_path / name
        before = path.read_bytes()
        path.write_bytes(before + b" ")
        with pytest.raises(OsimliteError, match=f"{name}' exists already and has changes"):
            write_scenario(tmp_path)
        assert path.read_bytes() == before + b" "
        path.write_bytes(before)


def test_a_file_of_states_is_a_start(tmp_path) -> None:
    from osimlite.io.tables.storage import write_sto

    file = write_scenario(tmp_path)
    first = Scenario(file)
    states = first.walk(first.best(), duration=0.05).states
    write_sto(tmp_path / "start.sto", "states", states.times, states.columns, states.rows)
    text = (
        file.read_text()
        .replace("human-walks.zml", "start.sto")
        .replace("initial_load = 0.5", "initial_load = 0")
    )
    file.write_text(text.replace("initial_state_offset = 0~0.05<-1,1>", ""))
    again = Scenario(file)
    start = again.walk(again.best(), duration=0.01).states
    values = [label for label in states.columns if label.endswith("/value")]
    assert [start[label][0] for label in values] == pytest.approx(
        [states[label][0] for label in values], abs=1e-9
    )


def test_an_arm_holds_a_weight(arm, tmp_path) -> None:
    pytest.importorskip("cma", reason="needs cma (extra 'optimize')")
    from osimlite.studies.reflexes.parameters import read_par
    from osimlite.studies.reflexes.search import search_parameters

    scenario = Scenario(arm)
    assert [each.name for each in scenario.parameters()] == ["flexor-elbow.KP", "flexor-elbow.C0"]
    before = scenario.walk({}).results[0]
    seen: list[Any] = []
    found = search_parameters(
        scenario, tmp_path / "out", generations=8, population=8, report=seen.append
    )
    assert len(seen) == 8 and seen[-1].best < 0.5 * before
    assert scenario.walk(found).results[0] == pytest.approx(seen[-1].best, rel=1e-6)
    assert set(read_par(tmp_path / "out" / "best.par")) == set(found)
    assert {
        name: best for name, (best, _, _) in read_par(tmp_path / "out" / "best.par").items()
    } == found
    with pytest.raises(OsimliteError, match=r"best\.par' exists already: continue it"):
        search_parameters(Scenario(arm), tmp_path / "out", generations=1, population=8)
    text = (tmp_path / "out" / "best.par").read_text()
    (tmp_path / "out" / "best.par").write_text(text.replace("elbow.KP", "elbow.KQ"))
    with pytest.raises(
        OsimliteError,
        match=r"has no parameter 'flexor-elbow\.K[PQ]', so it belongs to another search",
    ):
        search_parameters(Scenario(arm), tmp_path / "out", generations=1, population=8, resume=True)
    (tmp_path / "out" / "best.par").write_text(text)
    # The previous best is a candidate of the next generation; a mean beyond the bounds is moved
    # into them.
    text = (tmp_path / "out" / "best.par").read_text().split("\n", 1)
    name, best, _, std = text[0].split()
    (tmp_path / "out" / "best.par").write_text(f"{name} {best} -5 {std}\n{text[1]}")
    again = search_parameters(
        Scenario(arm), tmp_path / "out", generations=1, population=8, resume=True
    )
    assert scenario.walk(again).results[0] <= scenario.walk(found).results[0]


def test_values_of_nothing_are_refused(arm) -> None:
    scenario = Scenario(arm)
    with pytest.raises(
        OsimliteError, match=r"no parameter 'flexor-elbow\.KQ'.*did you mean 'flexor-elbow\.KP'"
    ):
        scenario.walk({"flexor-elbow.KQ": 1.0}, duration=0.01)
    with pytest.raises(OsimliteError, match=r"'flexor-elbow\.KP' has 3 values for 2 candidates"):
        scenario.walk({"flexor-elbow.KP": np.ones(3)}, 2, duration=0.01)


HOLDS = {
    "CmaOptimizer": {
        "SimulationObjective": {
            "max_duration": 1,
            "ModelOpenSim4": {"initial_load": 0},
            "ReflexController": {
                "dual_sided": 0,
                "DofReflex": [
                    {"target": "flexor", "source": "elbow", "P0": 1.2, "KP": "~2<0,20>", "KV": 0.3, "delay": 0.01,
                     "C0": "~0.1<0,1>"},
                    {"target": "extensor", "source": "elbow", "P0": 1.2, "KP": -1, "allow_neg_P": 0},
                ],
            },
            "DofMeasure": {"dof": "elbow", "start_time": 0.2, "position": {"min": 65, "max": 72, "abs_penalty": 1}},
        }
    }
}  # fmt: skip


def test_yaml_and_data_of_python_say_the_same_as_a_scenario(arm, tmp_path) -> None:
    yaml = pytest.importorskip("yaml", reason="needs PyYAML (extra 'yaml')")
    wanted = Scenario(arm).walk({}, duration=0.2)
    model = osimlite.read(tmp_path / "arm.osim")
    text = yaml.safe_dump(HOLDS).replace(
        "initial_load: 0", "{initial_load: 0, model_file: arm.osim}"
    )
    (tmp_path / "arm.yaml").write_text(text)
    for scenario in (Scenario(HOLDS, model), Scenario(tmp_path / "arm.yaml")):
        assert [each.name for each in scenario.parameters()] == [
            "flexor-elbow.KP",
            "flexor-elbow.C0",
        ]
        walked = scenario.walk({}, duration=0.2)
        assert np.array_equal(walked.states.rows, wanted.states.rows)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("target = flexor", "target = flexer", "no 'flexer'.*did you mean 'flexor'"),
        ("KV = 0.3", "KX = 0.3", "does not support 'KX' of a DofReflex"),
        ("ModelOpenSim4", "ModelHyfydy", "only ModelOpenSim4"),
        ("ReflexController", "MirrorController", "does not support MirrorController"),
        (
            "dual_sided = 0",
            "dual_sided = 0 NoiseController { base_noise = 0.1 }",
            "'NoiseController' of a Reflex",
        ),
        ("dof = elbow", "dof = knee", "no coordinate 'knee'"),
        ("DofMeasure", "BodyMeasure", "osimlite does not support BodyMeasure; osimlite supports"),
        ("DofMeasure", "DoffMeasure", "unknown measure 'DoffMeasure'; did you mean 'DofMeasure'"),
        ("ReflexController", "ReflexControler", "unknown controller 'ReflexControler'; did you"),
        ("max_duration = 1", "max_duration = long", "must be a number, not 'long'"),
        ("~2<0,20>", "~x", "must be a number or a parameter"),
        (
            "SimulationObjective",
            "lamda = 4 SimulationObjective",
            "support 'lamda' of a CmaOptimizer.*mean 'lambda'",
        ),
        ("P0 = 1.2", "P0 = 1.2 P0 = 2", "'P0' is set twice"),
        ("dual_sided = 0", "dual_sided = perhaps", "'dual_sided' must be 0 or 1, not 'perhaps'"),
        ("delay = 0.01", "delay = -0.01", "a delay of -0.01 s"),
        ("min = 65 max = 72", "min = 72 max = 65", "a minimum of 72 above its maximum of 65"),
        ("max_duration = 1", "max_duration = 0", "max_duration is 0 s; set a positive duration"),
        (
            "max_duration = 1",
            "max_duration = 0.001",
            "0.001 s is shorter than a control step of 0.005 s",
        ),
        ("initial_load = 0", "fixed_control_step_size = 1e-9", "is 0.0001 s or more, not 1e-09 s"),
        (
            "~2<0,20>",
            "~30<0,20>",
            "'flexor-elbow.KP' has the initial value 30, outside its range of 0 to 20",
        ),
        ("~2<0,20>", "~2<20,0>", "has the initial value 2, outside its range of 20 to 0"),
        ("source = elbow P0 = 1.2 KP = ~2", "P0 = 1.2 KP = ~2", "'source' is missing"),
        (
            "dual_sided = 0",
            "dual_sided = 0 symetric = 1",
            "does not support 'symetric' of a ReflexController",
        ),
    ],
)
def test_what_is_not_done_is_refused_by_name(arm, old, new, words) -> None:
    text = arm.read_text()
    assert old in text
    arm.write_text(text.replace(old, new))
    with pytest.raises(OsimliteError, match=words):
        Scenario(arm).walk({})


def test_settings_without_sense(ours, tmp_path) -> None:
    pytest.importorskip("cma", reason="needs cma (extra 'optimize')")
    from osimlite.studies.reflexes.search import search_parameters

    with pytest.raises(OsimliteError, match="shorter than a control step"):
        ours.walk({}, duration=0.0)
    with pytest.raises(OsimliteError, match="4 candidates in each generation"):
        search_parameters(ours, tmp_path, population=1)


def test_the_scenario_says_how_to_search_and_step(arm) -> None:
    text = arm.read_text().replace(
        "SimulationObjective", "lambda = 6 random_seed = 3 min_progress = 1 SimulationObjective"
    )
    arm.write_text(
        text.replace("initial_load = 0", "initial_load = 0 max_integration_step_size = 0.0001")
    )
    scenario = Scenario(arm)
    assert (scenario.population, scenario.seed) == (6, 3)
    scenario.walk({}, duration=0.005)
    (counts,) = scenario.get_walkers(1).copies.batch.counts[:, :1]
    assert counts[0] == 50


def test_implicit_steps_do_not_shrink_where_feet_touch(ours) -> None:
    text = (ours.folder / "human-walks.scone").read_text()
    method = "ModelOpenSim4 {\n integration_method = Rosenbrock integration_accuracy = 0.01"
    (ours.folder / "implicit.scone").write_text(text.replace("ModelOpenSim4 {", method))
    walked, wanted = (
        Scenario(ours.folder / f"{name}.scone") for name in ("implicit", "human-walks")
    )
    steps = []
    for scenario in (walked, wanted):
        result = scenario.walk(scenario.best(), duration=0.5)
        steps.append(scenario.get_walkers(1).copies.batch.counts[0, 0])
        assert result.times[0] == pytest.approx(0.5)
    assert 0 < steps[0] < 4 <= steps[1]


def bumpy(model, height, seed):
    """Return the model with bumps on its floor, about three per metre and up to `height` (m) high."""
    model, rng = model.copy_deep(), np.random.default_rng(seed)
    tops = [
        (0.5 + 0.3 * k + rng.uniform(-0.1, 0.1), height * rng.uniform(0.3, 1.0)) for k in range(45)
    ]
    bumps = [
        osimlite.ContactSphere(
            name=f"bump{k}", socket_frame="/ground", radius=0.5, location=(x, y - 0.5, 0.0)
        )
        for k, (x, y) in enumerate(tops)
    ]
    model.add(*bumps)
    for force in model.components(osimlite.HuntCrossleyForce):
        for parameters in force.contact_parameters.objects:
            parameters.geometry = (*parameters.geometry, *(bump.name for bump in bumps))
    return model


@pytest.mark.parametrize("seed", [0, 1])
def test_our_human_walks_over_uneven_ground(ours, seed) -> None:
    scenario = Scenario(ours.folder / "human-walks.scone", bumpy(ours.model, 0.005, seed))
    walked = scenario.walk(scenario.best())
    assert walked.times[0] == pytest.approx(10.0) and walked.report["speed"][0] > 1.1


def test_gaits_need_legs(arm) -> None:
    arm.write_text(
        arm.read_text()
        .replace("DofMeasure { dof = elbow", "GaitMeasure { name = gait #")
        .replace("#", "#\n}#")
    )
    with pytest.raises(
        OsimliteError, match="the model has no legs; it needs bodies 'femur_l' and 'femur_r'"
    ):
        Scenario(arm).walk({})


def test_scone_s_human_walks_twenty_seconds() -> None:
    """The parameters are published with SCONE."""
    name = "scenarios/Examples3/Gait2D - H0918 - OpenSim4.scone"
    for parent in ROOT.parents:
        if (file := parent / "pub-scone" / name).is_file():
            break
    else:
        pytest.skip("needs the sources of scone-core, which are not beside this repository")
    scenario, count, rng = Scenario(file), 16, np.random.default_rng(0)
    # Contact amplifies rounding errors to different walks: some of these fall, on any processor.
    values = {
        name: best * (1.0 + 1e-7 * rng.normal(size=count)) for name, best in scenario.best().items()
    }
    walked = scenario.walk(values, count)
    whole = walked.times == 20.0
    assert whole.sum() >= count // 3 and (walked.terms["Gait"][whole] == 0.0).all()
    speeds, steps = (walked.report[name][whole] for name in ("speed", "steps"))
    assert speeds.min() > 1.0 and speeds.max() < 1.06 and steps.min() >= 34 and steps.max() <= 38


def test_kernels_as_python_walk_likewise(ours, arm, monkeypatch) -> None:
    """Vectors with bounds raise an error for indices outside."""
    from tests.simulation.checked import Checked

    for file, seconds in ((ours.folder / "human-walks.scone", ours.step), (arm, 0.02)):
        compiled = Scenario(file)
        expected = compiled.walk(compiled.best(), duration=seconds)
        with monkeypatch.context() as patched:
            patched.setattr("osimlite.simulation.evaluation.select_code", lambda: Checked("Python"))
            plain = Scenario(file)
            walked = plain.walk(plain.best(), duration=seconds)
        for name in ("states", "excitations", "loads"):
            rows = getattr(walked, name).rows
            assert np.allclose(rows, getattr(expected, name).rows, rtol=1e-12, atol=1e-12)
        assert np.allclose(walked.results, expected.results, rtol=1e-11)


def test_a_start_that_cannot_be_computed_is_told(ours) -> None:
    candidates = Candidates(ours, Parameters(ours.best(), 2), 1.0)
    walkers = candidates.walkers
    walkers.copies.states[1, walkers.offsets["/forceset/vasti_l/fiber_length"]] = np.nan
    with pytest.raises(OsimliteError, match="state of the motion has become infinite"):
        walkers.advance(ORDER.FEEL)
