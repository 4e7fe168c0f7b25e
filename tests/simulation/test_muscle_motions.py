"""Tests of motions of a block on a muscle, an arm and a gait model against OpenSim's.

The reference is in `motions.json.gz`, with 7 to 9 valid decimals.
"""

from __future__ import annotations

import gzip
import json
from math import pi

import numpy as np
import pytest

import osimlite
from osimlite import Sine
from osimlite.simulation.elements.registry import FORCE_TYPES
from tests.simulation.elements.muscle_rows import CONFIGURATIONS, FOLDER, hung, muscle

MUSCLES = {
    "hanging_thelen": "thelen_default",
    "hanging_millard": "millard_damped",
    "hanging_millard_undamped": "millard_undamped",
    "hanging_millard_rigid": "millard_rigid",
    "hanging_dgf": "dgf_default",
    "hanging_rigidtendon": "rigidtendon",
}
KNOWN = [
    case
    for case, name in MUSCLES.items()
    if FORCE_TYPES.find(CONFIGURATIONS[name]["cls"]) is not None
]


NAMES = "TRIlong", "TRIlat", "TRImed", "BIClong", "BICshort", "BRA"
REAL = {
    "arm26_constant": ("m0001", dict(zip(NAMES, (0.05, 0.1, 0.2, 0.3, 0.4, 0.15), strict=True))),
    "arm26_sine": (
        "m0001",
        {
            name: Sine(amplitude=0.2, omega=4.0 * pi, phase=0.3 * k, offset=0.3)
            for k, name in enumerate(NAMES)
        },
    ),
    "gait10dof18musc_default": ("m0005", None),
}
"""Corpus model and controls of each motion."""


def assert_moves_as(case, model, **choices):
    """Compare a motion with OpenSim's, within the valid digits of the reference."""
    with gzip.open(FOLDER / "motions.json.gz", "rt") as file:
        (motion,) = (item for item in json.load(file) if item["case"] == case)
    expected = np.array(motion["rows"])
    choices |= {"report_interval": expected[1, 0], "accuracy": 1e-10, "equilibrate": True}
    trajectory = osimlite.simulate(model, expected[-1, 0], **choices)
    assert np.abs(trajectory.times - expected[:, 0]).max() < 1e-12
    ours = dict(trajectory.auxiliary)
    for info, values, speeds in zip(
        trajectory.mechanism.coordinates, trajectory.values.T, trajectory.speeds.T, strict=True
    ):
        ours |= {f"{info.path}/value": values, f"{info.path}/speed": speeds}
    for path, column, digits in zip(
        motion["states"],
        expected[:, 1:].T,
        motion["max_difference_per_state"]["1e-09-1e-10"],
        strict=True,
    ):
        assert np.abs(ours[path] - column).max() < 2.0 * digits + 1e-10, path


@pytest.mark.parametrize("case", KNOWN)
def test_a_block_hangs_on_a_muscle(case):
    force = muscle(MUSCLES[case])
    if "default_activation" in type(force).model_fields:
        force.default_activation = 0.3
    model = hung(force, (0.5, 0.5), gravity=9.80665)
    model.find("/jointset/slide/x").default_value = 0.33
    assert_moves_as(case, model)


@pytest.mark.parametrize("engine", ["compiled", "bullet"])
@pytest.mark.parametrize("case", REAL)
def test_real_models_move(case, engine, corpus):
    number, controls = REAL[case]
    (path,) = (model.path for model in corpus if model.id == number)
    model = osimlite.read(path)
    if case.startswith("arm26"):
        for coordinate, value in zip(
            model.components(osimlite.Coordinate), (0.2, 0.7), strict=True
        ):
            coordinate.default_value = value
    assert_moves_as(case, model, engine=engine, controls=controls)
