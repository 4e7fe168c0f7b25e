"""Tests of jumps that functions of time control instead of reflexes."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest

import osimlite
from osimlite.errors import OsimliteError
from osimlite.models.walking import write_scenario
from osimlite.simulation.link_motion import locate_mass_centers
from osimlite.studies.gym.tasks import arm
from osimlite.studies.reflexes.scenario import Scenario

STEP = 0.01
SCENARIO = """
CmaOptimizer {
    SimulationObjective {
        max_duration = 1.2
        ModelOpenSim4 { model_file = human.osim state_init_file = crouch.zml fixed_control_step_size = 0.01 }
        FeedForwardController {
            symmetric = 1
            PieceWiseConstant {
                control_points = 2
                control_point_y = 0.3~0.1<0,1>
                control_point_dt = 0.2~0.05<0.001,1>
            }
        }
        JumpMeasure { termination_height = 0.75 prepare_time = 0.2 }
    }
}
"""
CROUCHED = """values {
    pelvis_ty = 0.75 pelvis_tilt = -0.6 hip_flexion_l = 1.4 hip_flexion_r = 1.4
    knee_angle_l = -1.2 knee_angle_r = -1.2 ankle_angle_l = 0.43 ankle_angle_r = 0.43
}"""
PUSHES = {
    f"{muscle}.{name}": value
    for muscle, values in {
        "glut_max": (0.0, 0.93, 0.17), "hamstrings": (0.2, 0.98, 0.16), "iliopsoas": (0.77, 0.03, 0.23),
        "rect_fem": (0.53, 0.84, 0.23), "vasti": (0.0, 0.99, 0.12), "gastroc": (0.08, 0.99, 0.25),
        "soleus": (0.02, 1.0, 0.24), "tib_ant": (0.48, 0.0, 0.12),
    }.items()
    for name, value in zip(("Y0", "Y1", "DT0"), values, strict=True)
}  # fmt: skip
"""Parameters of a jump that a search has found."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("jump")
    write_scenario(made)
    (made / "crouch.zml").write_text(CROUCHED)
    return made


def scenario(folder, *changes: tuple[str, str]) -> Scenario:
    text = SCENARIO
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "jump.scone").write_text(text)
    return Scenario(folder / "jump.scone")


def judged(
    walked, given: Scenario, prepare: float, least: float, at_peak: bool
) -> tuple[float, int]:
    """Compute SCONE's measure of a jump from its motion.

    Args:
        walked: result of the simulation.
        given: scenario.
        prepare: time of preparation (s).
        least: fraction of the initial height below which the jump ends.
        at_peak: whether the jump ends at the highest position.

    Returns:
        The measure, and the control step after which the jump ends.
    """
    walkers, table = given.get_walkers(1), walked.states
    states = np.empty_like(table.rows)
    states[:, [walkers.offsets[path] for path in table.columns]] = table.rows
    centre = locate_mass_centers(
        walkers.engine, list(zip(table.times.tolist(), states.tolist(), strict=True))
    )
    height, rise = centre[:, 1], centre[:, 4]
    load, last = walked.loads.rows.sum(axis=1), len(height) - 1
    sunk = np.flatnonzero(height < least * height[0])
    end = int(sunk[0]) if len(sunk) else last
    steps = np.arange(len(height))
    took_off = np.flatnonzero(
        (steps * STEP >= prepare - 1e-9) & ((rise > 0.0) | (load <= 0.0)) & (steps > 0)
    )
    if not len(took_off) or took_off[0] >= end:
        return 100.0 * (height[0] + (height[end] - height[0]) / (STEP * end)), end
    first = took_off[0]
    off = [k for k in steps[first + 1 :] if load[k] <= 0.0]
    sinks = [k for k in steps[first + 1 :] if rise[k] < 0.0 and load[k] > 0.0]
    down = sinks[0] if sinks and (not off or sinks[0] < off[0]) else next(
        (k for k in steps[first + 1 :] if off and k > off[0] and (rise[k] < 0.0 or load[k] > 0.0)), last
    )  # fmt: skip
    end = min(end, int(down)) if at_peak else end
    return 100.0 * (height[: end + 1].max() - max(0.0, height[first] - height[0])), end


@pytest.mark.parametrize(
    ("changes", "values", "at_peak"),
    [
        ((), PUSHES, True),
        ((("prepare_time = 0.2", "prepare_time = 0.4"),), PUSHES, True),
        ((("prepare_time = 0.2", "prepare_time = 0.2 terminate_on_peak = 0"),), PUSHES, False),
        # The first case sinks during the preparation, the second comes down without a flight.
        ((), {name: 0.01 for name in PUSHES if "Y" in name}, True),
        ((), {}, True),
    ],
)
def test_a_jump_is_as_high_as_the_mass_centre_comes(folder, changes, values, at_peak) -> None:
    given = scenario(folder, *changes)
    walked = given.walk(values)
    prepare = 0.4 if changes and "0.4" in changes[0][1] else 0.2
    expected, end = judged(walked, given, prepare, 0.75, at_peak)
    assert walked.terms["JumpMeasure"][0] == pytest.approx(expected, rel=1e-9)
    # The height is maximized, and the search minimizes.
    assert walked.results[0] == -walked.terms["JumpMeasure"][0]
    assert walked.times[0] == pytest.approx(end * STEP, abs=1e-12)
    if values is PUSHES and not changes:
        assert walked.report["jump height"][0] > 125.0 and walked.report["early rise"][0] == 0.0
        assert walked.loads.rows[-1].max() == 0.0 and walked.times[0] < 0.8
    if values is PUSHES and prepare == 0.4:
        assert walked.report["early rise"][0] > 1.0


@pytest.mark.parametrize(
    ("first", "second"),
    [("soft_threshold = 1", "KEY = 2"), ("KEY = 2", "soft_threshold = 1")],
    ids=["soft first", "soft last"],
)
@pytest.mark.parametrize("key", ["result_offset", "threshold"])
def test_a_soft_threshold_excludes_what_it_would_replace(folder, key, first, second) -> None:
    new = f"JumpMeasure {{ {first} {second}".replace("KEY", key)
    with pytest.raises(OsimliteError, match=f"'{key}' and 'soft_threshold' exclude each other"):
        scenario(folder, ("JumpMeasure {", new)).walk(PUSHES)


def test_signs_weights_and_sums(folder) -> None:
    high = scenario(folder).walk(PUSHES).terms["JumpMeasure"][0]
    for new, wanted, result in (
        ("JumpMeasure { weight = 2 result_offset = 5 threshold = 1e6", 2.0 * (high + 5.0), -1.0),
        ("JumpMeasure { negate_result = 1 minimize = 1", -high, 1.0),
    ):
        walked = scenario(folder, ("JumpMeasure {", new)).walk(PUSHES)
        assert walked.terms["JumpMeasure"][0] == pytest.approx(wanted, rel=1e-12)
        assert walked.results[0] == result * walked.terms["JumpMeasure"][0]
    both = "EffortMeasure { weight = -0.1 measure_type = SquaredMuscleActivation } }"
    for first, sign in (("", -1.0), ("minimize = 1", 1.0)):
        measure = f"CompositeMeasure {{ {first} JumpMeasure {{"
        summed = scenario(
            folder,
            ("JumpMeasure {", measure),
            ("prepare_time = 0.2 }", f"prepare_time = 0.2 }} {both}"),
        )
        found = summed.walk(PUSHES)
        assert (
            found.terms["JumpMeasure"][0] == high
            and found.terms["SquaredMuscleActivation"][0] < 0.0
        )
        assert found.results[0] == pytest.approx(
            sign * sum(term[0] for term in found.terms.values()), rel=1e-12
        )


def test_candidates_jump_as_they_do_alone(folder) -> None:
    given = scenario(folder)
    starts = np.array([0.05, 0.12, 0.4])
    together = given.walk(PUSHES | {"vasti.DT0": starts}, 3)
    assert len({*together.results}) == 3
    for k, start in enumerate(starts):
        alone = given.walk(PUSHES | {"vasti.DT0": start})
        assert (alone.times[0], alone.results[0]) == (together.times[k], together.results[k])


def test_a_search_finds_higher_jumps(folder, tmp_path) -> None:
    pytest.importorskip("cma", reason="needs cma (extra 'optimize')")
    from osimlite.studies.reflexes.search import search_parameters

    given = scenario(folder)
    assert {each.name for each in given.parameters()} == {*PUSHES}
    before = given.walk({}).report["jump height"][0]
    found = search_parameters(given, tmp_path, generations=6)
    assert given.walk(found).report["jump height"][0] > before + 3.0


@pytest.mark.full
def test_kernels_as_python_jump_likewise(folder, monkeypatch) -> None:
    """Vectors with bounds raise an error for indices outside."""
    from tests.simulation.checked import Checked

    compiled, plain = (
        scenario(folder, ("prepare_time = 0.2", "prepare_time = 0")) for _ in range(2)
    )
    with monkeypatch.context() as patched:
        patched.setattr("osimlite.simulation.evaluation.select_code", lambda: Checked("Python"))
        walked = plain.walk(PUSHES, duration=2 * STEP)
    assert walked.results == pytest.approx(
        compiled.walk(PUSHES, duration=2 * STEP).results, rel=1e-12
    )


# --------------------------------------------------------------------------------------------------- functions of time
def points(extra: str = "") -> dict[str, Any]:
    made = {
        "control_points": 3,
        "control_point_y": "~0.3<0,1>",
        "control_point_dt": "~0.07<0.001,1>",
    }
    return made | ({extra: 1} if extra else {})


VALUES = {"Y0": 0.2, "Y1": 0.9, "Y2": 0.4, "DT0": 0.083, "DT1": 0.05}
KNOTS = np.cumsum([0.0, VALUES["DT0"], VALUES["DT1"]])
HEIGHTS = np.array([VALUES[f"Y{k}"] for k in range(3)])
FORMS: dict[str, tuple[dict[str, Any], dict[str, float], Any]] = {
    "constant": (
        {"PieceWiseConstant": points()}, VALUES, lambda t: HEIGHTS[np.searchsorted(KNOTS, t, side="right") - 1],
    ),
    "one": ({"PieceWiseConstant": {"control_points": 1, "control_point_y": 0.3}}, {}, lambda t: 0.3 + 0.0 * t),
    "flat": ({"PieceWiseLinear": points("flat_extrapolation")}, VALUES, lambda t: np.interp(t, KNOTS, HEIGHTS)),
    "linear": (
        {"PieceWiseLinear": points()}, VALUES,
        lambda t: np.where(t < KNOTS[2], np.interp(t, KNOTS, HEIGHTS), 0.4 - 10.0 * (t - KNOTS[2])),
    ),
    "polynomial": (
        {"Polynomial": {"degree": 2, "coefficient0": "~0.1", "coefficient1": "~1", "coefficient2": -3}},
        {"C0": 0.2, "C1": 2.5}, lambda t: np.polynomial.Polynomial([0.2, 2.5, -3.0])(t),
    ),
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_actuators_are_driven_by_functions_of_time(form) -> None:
    function, values, expected = FORMS[form]
    given = {"FeedForwardController": {"include": "*or", "exclude": "ext*", **function}}
    feedback = osimlite.Feedback(given, {f"flexor.{name}": value for name, value in values.items()})
    model, simulate = arm().model(), cast("Any", osimlite.simulate)
    told = simulate(model, 0.3, controller=feedback).controller
    assert told["/forceset/flexor"] == pytest.approx(
        np.clip(expected(told.times), 0.0, 1.0), abs=1e-12
    )
    assert (told["/forceset/extensor"] == 0.0).all() and len(told.times) == 61
    # A run that continues another one keeps its time.
    again = simulate(
        model, 0.3, controller=feedback, resume=simulate(model, 0.1, controller=feedback)
    )
    assert np.array_equal(
        again.controller["/forceset/flexor"][-41:], told["/forceset/flexor"][-41:]
    )


@pytest.mark.filterwarnings("ignore:the noise is as large")
def test_functions_go_with_reflexes_and_noise(folder) -> None:
    """Contributions are added, and each side can have its own function."""
    constant = (
        "PieceWiseConstant { control_points = 2 control_point_y = 0.3 control_point_dt = 0.03 }"
    )
    plain = f"CompositeController {{ FeedForwardController {{ symmetric = 0 {constant} }}"
    reflex = "ReflexController { MuscleReflex { target = vasti C0 = 0.2 } }"
    noise = "NoiseController { base_noise = 0.01 random_seed = 3 }"
    old = SCENARIO[SCENARIO.index("FeedForwardController") : SCENARIO.index("JumpMeasure")]
    tables = [
        scenario(folder, (old, f"{plain} {more} }}\n")).walk({}, duration=0.1).excitations
        for more in ("", reflex, noise)
    ]
    assert (tables[0].rows == pytest.approx(0.3, abs=1e-15)) and (tables[1]["vasti_l"] == 0.5).all()
    assert (tables[1]["soleus_r"] == 0.3).all()
    assert 0.005 < np.std(tables[2].rows[:-1]) < 0.02
    sided = scenario(folder, ("symmetric = 1", "symmetric = 0"))
    walked = sided.walk({"vasti_l.Y0": 0.1, "vasti_r.Y0": 0.6}, duration=0.05).excitations
    assert (walked["vasti_l"] == pytest.approx(0.1)) and (walked["vasti_r"] == pytest.approx(0.6))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("PieceWiseConstant", "SineWave", "does not support 'SineWave' of a FeedForwardController"),
        (
            "PieceWiseConstant {",
            "Polynomial { degree = 1 coefficient0 = 0 } PieceWiseConstant {",
            "needs one function",
        ),
        (
            "PieceWiseConstant {",
            "Polynomial { degree = 1 coefficient0 = 0 } #",
            "'coefficient1' is missing",
        ),
        (
            "control_points = 2",
            "control_points = 0",
            "'control_points' must be a whole number from 1 to 99, not 0",
        ),
        ("control_points = 2", "control_points = 2.5", "a whole number from 1 to 99, not 2.5"),
        (
            "PieceWiseConstant {",
            "Polynomial { degree = -1 } #",
            "'degree' must be a whole number from 0 to 99, not -1",
        ),
        ("control_points = 2", "", "'control_points' is missing"),
        ("control_point_y = 0.3~0.1<0,1>", "", "'control_point_y' is missing"),
        (
            "control_point_dt = 0.2~0.05<0.001,1>",
            "",
            "several control points need 'control_point_dt'",
        ),
        ("0.2~0.05<0.001,1>", "0", "'control_point_dt' must be positive"),
        (
            "control_points = 2",
            "control_points = 2 flat = 1",
            "does not support 'flat' of a PieceWiseConstant",
        ),
        ("symmetric = 1", "include = psoas", "no actuator matches include = 'psoas'"),
        (
            "symmetric = 1",
            "start_time = 1",
            "does not support 'start_time' of a FeedForwardController",
        ),
        (
            "prepare_time",
            "recover_time = 1 prepare_time",
            "does not support 'recover_time' of a JumpMeasure",
        ),
        (
            "prepare_time",
            "target_body = torso prepare_time",
            "does not support 'target_body' of a JumpMeasure",
        ),
        (
            "prepare_time",
            "prepare",
            "does not support 'prepare' of a JumpMeasure.*did you mean 'prepare_time'",
        ),
    ],
)
def test_what_is_not_done_is_refused_by_name(folder, old, new, words) -> None:
    given = SCENARIO.split("\n")
    if new.endswith("#"):
        # Leave out the rest of the block.
        first = next(k for k, line in enumerate(given) if "PieceWiseConstant" in line)
        given[first : first + 5] = [new[:-1]]
    text = "\n".join(given) if new.endswith("#") else SCENARIO.replace(old, new)
    (folder / "refused.scone").write_text(text)
    with pytest.raises(OsimliteError, match=words):
        Scenario(folder / "refused.scone").walk({}, duration=0.01)
