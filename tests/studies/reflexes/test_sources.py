"""Tests of the sensors of reflexes; :mod:`tests.oracle.test_reflex_sources` compares with OpenSim."""

from __future__ import annotations

from typing import Any

import pytest

import osimlite
from osimlite.errors import OsimliteError
from osimlite.models.arm import arm
from osimlite.models.walking import write_scenario
from osimlite.simulation.control_steps import KernelController

POINT = {"target": "flexor", "source": "forearm", "offset": [0, -0.2, 0], "direction": [0, 1, 0]}
TURN = {"target": "flexor", "source": "forearm", "KP": "~0.1<0,1>", "KV": 0.1}


def held(
    model: Any, given: dict[str, Any], values: dict[str, float] | None = None
) -> KernelController:
    controller = osimlite.Feedback({"ReflexController": given}, values or {})
    return controller.compile_for(model, osimlite.simulation.Simulation(model, "compiled").engine)


@pytest.mark.parametrize(
    ("kind", "changed", "words"),
    [
        ("BodyPointReflex", {"direction": None, "KP": 1}, "'direction' is missing"),
        ("BodyPointReflex", {"direction": [0, 0, 0], "KP": 1}, "'direction' is 0 0 0"),
        (
            "BodyPointReflex",
            {"direction": [1, 0], "KP": 1},
            r"'direction' must be three numbers, as \[ 0 0 1 \], not",
        ),
        ("BodyPointReflex", {"KA": 1}, "does not support 'KA' of reflexes"),
        (
            "BodyPointReflex",
            {"source": "forarm"},
            "the model has no 'forarm'.*did you mean 'forearm'",
        ),
        (
            "BodyPointReflex",
            {"allow_neg_P": 0},
            "does not support 'allow_neg_P' of a BodyPointReflex",
        ),
        (
            "BodyOrientationReflex",
            {"axis": [1, 1, 0]},
            "an angle needs the 'axis' .* only KV is supported",
        ),
        ("BodyOrientationReflex", {"axis": [0, 0, 0]}, "'axis' is 0 0 0"),
        (
            "BodyOrientationReflex",
            {"use_rotation_vector": 1},
            "does not support 'use_rotation_vector' of reflexes",
        ),
        ("BodyOrientationReflex", {"source": None}, "'source' is missing"),
        (
            "BodyPostureMuscleReflex",
            {},
            "does not support 'BodyPostureMuscleReflex' of a ReflexController",
        ),
        ("MuscleReflex", {"source": "flexor", "KP": 1}, "does not support 'KP' of a MuscleReflex"),
        (
            "MuscleReflex",
            {"source": "flexor", "dof": "elbow"},
            "does not support 'dof' of a MuscleReflex",
        ),
    ],
)
def test_what_has_no_meaning_is_refused(kind, changed, words) -> None:
    given = {
        **(
            POINT if kind == "BodyPointReflex" else TURN if "Body" in kind else {"target": "flexor"}
        ),
        **changed,
    }
    reflex = {key: value for key, value in given.items() if value is not None}
    with pytest.raises(OsimliteError, match=words):
        held(
            arm(),
            {"dual_sided": 0, "DofReflex": {"target": "flexor", "source": "elbow"}, kind: reflex},
        )


def test_a_gain_that_is_looked_for_is_felt_even_where_it_is_none() -> None:
    """The sensors do not depend on values of parameters, so that candidates differ in numbers only."""
    model, given = arm(), {"dual_sided": 0, "BodyOrientationReflex": TURN}
    one, none = held(model, given), held(model, given, {"flexor-forearm.KP": 0.0})
    assert one.plan.tolist() == none.plan.tolist() and one.sensors == none.sensors == (
        "forearm.angle(0,0,1)", "forearm.turn(0,0,1)",
    )  # fmt: skip


def test_sides(tmp_path) -> None:
    model = osimlite.read(write_scenario(tmp_path).with_name("human.osim"))
    turn = {"target": "vasti", "source": "femur_o", "axis": [1, 0, 0], "KP": "~0.1<0,1>"}
    controller = osimlite.Feedback({"ReflexController": {"symmetric": 1, "BodyOrientationReflex": turn}},
                                   {"vasti-femur_o.KP": 0.2})  # fmt: skip
    felt = controller.compile_for(model, osimlite.simulation.Simulation(model, "compiled").engine)
    assert felt.sensors == ("femur_r.angle(1,0,0)", "femur_l.angle(-1,0,0)")


def test_kernels_as_python_feel_likewise(monkeypatch) -> None:
    """Vectors with bounds raise an error for indices outside."""
    from tests.simulation.checked import Checked

    given = {
        "dual_sided": 0,
        "MuscleReflex": {"target": "extensor", "KA": 0.1, "KS": 0.1, "delay": 0.005},
        "BodyPointReflex": {**POINT, "KP": 0.1, "KV": 0.1},
        "BodyOrientationReflex": TURN,
    }
    model, controller = arm(), osimlite.Feedback({"ReflexController": given})
    expected = osimlite.simulation.Simulation(model, "compiled").run(0.02, controller=controller)
    with monkeypatch.context() as patched:
        patched.setattr("osimlite.simulation.evaluation.select_code", lambda: Checked("Python"))
        plain = osimlite.simulation.Simulation(model, "compiled").run(0.02, controller=controller)
    assert expected.controller is not None and plain.controller is not None
    assert plain.controller.rows == pytest.approx(expected.controller.rows, rel=1e-9, abs=1e-12)
