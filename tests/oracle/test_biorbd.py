"""Compare exported bioMod files, read by a live biorbd, with the model.

The tests compare poses, mass matrices, markers, path lengths, moment arms and muscle parameters.
The variable OSIMLITE_BIORBD names a Python that has biorbd (``pip install biorbd``).
"""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.models.jumper import jumper
from osimlite.translate.biomod import to_biomod
from tests.translate.support import make_tilted

pytestmark = pytest.mark.full

VARIABLE = "OSIMLITE_BIORBD"

SCRIPT = """
import json, os, sys
import numpy as np
import biorbd

path, states = json.load(sys.stdin)
model = biorbd.Model(path)
names = [model.segment(index).name().to_string() for index in range(model.nbSegment())]
states_of_muscles = model.stateSet() if model.nbMuscles() else []
for each in states_of_muscles:
    each.setExcitation(0.8)
    each.setActivation(0.3)
rising = model.activationDot(states_of_muscles).to_array().tolist() if states_of_muscles else []
characteristics = [model.muscle(k).characteristics() for k in range(model.nbMuscles())]
numbers = [
    [each.forceIsoMax(), each.optimalLength(), each.tendonSlackLength(), each.pennationAngle(),
     each.maxShorteningSpeed()]
    for each in characteristics
]
result = []
for state in states:
    q = biorbd.GeneralizedCoordinates(np.array(state, float))
    if model.nbMuscles():
        model.updateMuscles(q, True)
    result.append({
        "poses": {name: pose.to_array().tolist() for name, pose in zip(names, model.allGlobalJCS(q))},
        "mass": model.massMatrix(q).to_array().tolist(),
        "markers": [marker.to_array().tolist() for marker in model.markers(q)],
        "lengths": [model.muscle(k).musculoTendonLength(model, q, False) for k in range(model.nbMuscles())],
        "arms": model.musclesLengthJacobian(q).to_array().tolist() if model.nbMuscles() else [],
        "muscles": numbers,
        "rising": rising,
    })
os.write(1, b"\\nANSWER" + json.dumps(result).encode() + b"\\n")
"""


def ask_biorbd(path: Path, states: list[list[float]]) -> Any:
    python = os.environ.get(VARIABLE)
    if not python:
        pytest.skip(f"needs biorbd: {VARIABLE} names no Python that has it")
    done = subprocess.run(
        [python, "-c", SCRIPT],
        input=json.dumps([str(path), states]),
        capture_output=True,
        text=True,
        check=False,
        timeout=240,
        env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
    )
    for line in done.stdout.splitlines():
        if line.startswith("ANSWER"):
            return json.loads(line.removeprefix("ANSWER"))
    raise AssertionError(f"biorbd ended with {done.returncode}: {done.stderr[-500:]}")


@pytest.mark.parametrize("make", [make_tilted, dynamic_walker, jumper])
def test_biorbd_computes_the_same(tmp_path: Path, make: Callable[[], osimlite.Model]) -> None:
    model = make()
    made = to_biomod(model, name="it")
    path = made.write(tmp_path)[0]
    mechanism, moving = made.robot.mechanism, made.robot.moving
    rng = np.random.default_rng(0)
    states = []
    for _ in range(10):
        q = mechanism.values({}) + rng.uniform(-0.4, 0.4, len(mechanism.coordinates))
        for index, info in enumerate(mechanism.coordinates):
            if info.locked:
                q[index] = info.default_value
        states.append(q)
    answer = ask_biorbd(path, [[float(joint.value(q)) for joint in moving] for q in states])
    order = [joint.coordinate for joint in moving]
    paths = osimlite.paths(model)
    for q, result in zip(states, answer, strict=True):
        state = mechanism.at(q)
        for index, body in enumerate(mechanism.bodies):
            link, frame = made.robot.link_of[body.path]
            np.testing.assert_allclose(
                np.array(result["poses"][link.name]) @ frame, state.transform(index), atol=1e-12
            )
        indices = [index for index in order if index is not None]
        if len(indices) == len(order):
            mass = np.asarray(mechanism.mass_matrix(q))[np.ix_(indices, indices)]
            np.testing.assert_allclose(result["mass"], mass, atol=1e-12 * np.abs(mass).max())
        wrapped = {record.component for record in made.fidelity if record.kind == "path"}
        lengths = paths.lengths(q)
        muscles = [each for each in model.components(osimlite.Muscle)]
        moment_arms = paths.moment_arms(q)
        for k, (muscle, length) in enumerate(zip(muscles, result["lengths"], strict=True)):
            characteristics = [
                muscle.max_isometric_force,
                muscle.optimal_fiber_length,
                muscle.tendon_slack_length,
                muscle.pennation_angle_at_optimal,
                muscle.max_contraction_velocity,
            ]
            # First-order activation dynamics of OpenSim with the time constants that biorbd uses.
            assert result["rising"][k] == pytest.approx((0.8 - 0.3) / (0.01 * (0.5 + 1.5 * 0.3)))
            assert result["muscles"][k] == pytest.approx(characteristics, abs=1e-12)
            if muscle.path in wrapped:
                continue
            assert length == pytest.approx(lengths[muscle.path], abs=1e-9)
            if len(indices) == len(order):
                arms = [
                    moment_arms[muscle.path].get(mechanism.coordinates[index].path, 0.0)
                    for index in indices
                ]
                # OpenSim defines the moment arm as the negative derivative of the length.
                np.testing.assert_allclose(-np.array(result["arms"][k]), arms, atol=1e-9)
