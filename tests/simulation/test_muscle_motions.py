"""Motions of a block that hangs on a muscle, against OpenSim's: `motions.json.gz`, of 7 to 9 real decimals."""

from __future__ import annotations

import gzip
import json

import numpy as np
import pytest

import osimlite
from osimlite.schema.registry import class_for
from osimlite.simulation.elements.kind import kind_of_class
from tests.simulation.elements.muscle_rows import CONFIGURATIONS, FOLDER, hung, muscle

pytest.importorskip("numba", reason="needs numba (extra 'sim')")

MUSCLES = {
    "hanging_thelen": "thelen_default",
    "hanging_millard": "millard_damped",
    "hanging_millard_undamped": "millard_undamped",
    "hanging_millard_rigid": "millard_rigid",
    "hanging_dgf": "dgf_default",
    "hanging_rigidtendon": "rigidtendon",
}
KNOWN = [case for case, name in MUSCLES.items() if kind_of_class(class_for(CONFIGURATIONS[name]["cls"])) is not None]


@pytest.mark.parametrize("case", KNOWN)
def test_a_block_hangs_on_a_muscle(case):
    with gzip.open(FOLDER / "motions.json.gz", "rt") as file:
        (motion,) = (item for item in json.load(file) if item["case"] == case)
    force = muscle(MUSCLES[case])
    if "default_activation" in type(force).model_fields:
        force.default_activation = 0.3
    model = hung(force, (0.5, 0.5), gravity=9.80665)
    model.find("/jointset/slide/x").default_value = 0.33
    trajectory = osimlite.simulate(model, 0.5, accuracy=1e-10, report_interval=0.05, equilibrate=True)
    expected = np.array(motion["rows"])
    assert np.abs(trajectory.times - expected[:, 0]).max() < 1e-12
    ours = {"value": trajectory.values[:, 0], "speed": trajectory.speeds[:, 0]}
    ours |= {path.rpartition("/")[2]: column for path, column in trajectory.auxiliary.items()}
    for path, column, digits in zip(
        motion["states"], expected[:, 1:].T, motion["max_difference_per_state"]["1e-09-1e-10"], strict=True
    ):
        assert np.abs(ours[path.rpartition("/")[2]] - column).max() < 2.0 * digits + 1e-10
