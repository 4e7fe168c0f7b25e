"""Compare the sensors of reflexes on bodies and muscles with OpenSim's values in the same states."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite import Body, Model
from osimlite.models.arm import arm

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

STEP, OFFSET = 0.005, (0.1, -0.2, 0.3)


def thrown() -> Model:
    """Return a model of a body that rotates about all axes, with a second one welded to it obliquely."""
    model = Model(name="thrown")
    whole, part = (
        model.add(Body(name=name, mass=1.0, inertia=(0.02, 0.03, 0.05, 0, 0, 0)))
        for name in ("ball", "fin_l")
    )
    joint = osimlite.FreeJoint(name="free")
    for coordinate, name, speed in zip(
        joint.coordinates,
        ("rx", "ry", "rz", "tx", "ty", "tz"),
        (3.0, -2.0, 4.0, 1.0, 2.0, 0.5),
        strict=True,
    ):
        coordinate.name, coordinate.default_speed_value = name, speed
    model.add(joint.between(model.ground, whole))
    weld = osimlite.WeldJoint(name="weld")
    model.add(weld.between(whole, part, at=(0.1, 0.2, 0.0), turned=(0.3, -0.5, 0.8)))
    model.add(osimlite.CoordinateActuator(name="motor", coordinate="rz", optimal_force=0.1))
    return model


def followed(model: Model, reflexes: dict[str, Any], folder: Any) -> tuple[Any, Any, Any]:
    """Simulate a model with reflexes.

    Returns:
        The controller, OpenSim's model, and an iterator over row numbers and OpenSim states.
    """
    given = {"ReflexController": {"dual_sided": 0, **reflexes}}
    moved = osimlite.simulate(model, 0.3, controller=osimlite.Feedback(given), report_interval=STEP)
    osimlite.write(model, folder / "model.osim")
    opensim.Logger.setLevelString("error")
    theirs = opensim.Model(str(folder / "model.osim"))
    state = theirs.initSystem()

    def states():
        for row in range(0, len(moved.times), 10):
            for name, column in zip(moved.states.columns, moved.states.rows.T, strict=True):
                theirs.setStateVariableValue(state, name, float(column[row]))
            theirs.realizeVelocity(state)
            yield row, state

    return moved.controller, theirs, states()


def test_bodies_are_felt_as_they_are(tmp_path) -> None:
    direction, axes = (0.5, -1.0, 2.0), np.eye(3).tolist()
    along = {"target": "motor", "offset": OFFSET, "direction": direction, "KP": 0.1, "KV": 0.1}
    turns: list[dict[str, Any]] = [
        {"target": "motor", "source": body, "axis": axis, "KP": 0.1, "KV": 0.1}
        for body, axis in product(("ball", "fin_l"), axes)
    ]
    reflexes = {
        "BodyPointReflex": [{"source": body, **along} for body in ("ball", "fin_l")],
        "BodyOrientationReflex": [
            *turns,
            {"target": "motor", "source": "ball", "axis": (3, 0, 4), "KV": 0.1},
        ],
    }
    told, model, states = followed(thrown(), reflexes, tmp_path)
    widest = 0.0
    for row, state in states:
        points, angles = [], []
        # Sensors on the left side are mirrored.
        for name, sides in (("ball", (1.0, 1.0, 1.0)), ("fin_l", (-1.0, -1.0, 1.0))):
            body = model.getBodySet().get(name)
            for what in ("Location", "Velocity"):
                found = getattr(body, f"findStation{what}InGround")(state, opensim.Vec3(*OFFSET))
                points.append(np.dot(direction, found.to_numpy()))
            rotation, turn = (
                body.getRotationInGround(state),
                body.getAngularVelocityInGround(state).to_numpy(),
            )
            y, z, x = rotation.convertThreeAxesRotationToThreeAngles(
                opensim.BodyRotationSequence, *(opensim.CoordinateAxis(axis) for axis in (1, 2, 0))
            ).to_numpy()
            rows = np.array([[rotation.asMat33().get(i, j) for j in range(3)] for i in range(3)])
            for angle, side, speed in zip((x, y, z), sides, turn @ rows, strict=True):
                angles += [side * angle, side * speed]
            if name == "ball":
                askew = turn @ rows @ (0.6, 0.0, 0.8)
        expected = [*points, *angles, askew]
        assert told.rows[row, : len(expected)] == pytest.approx(expected, abs=1e-11)
        widest = max(widest, np.ptp(angles))
    assert widest > 5.0


def test_muscles_are_felt_as_they_are(tmp_path) -> None:
    gains = {f"K{letter}": 0.1 for letter in "LVFSA"}
    told, model, states = followed(arm(), {"MuscleReflex": {"target": "flexor", **gains}}, tmp_path)
    muscle = model.getMuscles().get("flexor")
    for row, state in states:
        model.realizeDynamics(state)
        length, speed = muscle.getNormalizedFiberLength(state), muscle.getFiberVelocity(state)
        speed /= muscle.getOptimalFiberLength()
        spindle = length + 0.325 * np.copysign(np.sqrt(abs(speed)), speed)
        force = muscle.getActuation(state) / muscle.getMaxIsometricForce()
        expected = length, speed, force, max(spindle, 0.0), muscle.getActivation(state)
        assert told.rows[row, :5] == pytest.approx(expected, rel=1e-8, abs=1e-8)
    assert np.ptp(told["forceset/flexor.activation"]) > 0.01
