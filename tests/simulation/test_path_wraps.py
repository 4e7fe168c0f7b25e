"""Tests of paths around surfaces against tables from OpenSim 4.6."""

from __future__ import annotations

import pytest

import osimlite
from tests.simulation.checked import Checked
from tests.simulation.support import PATH, SETUPS, wrapped


def compare(paths, case):
    q = [0, 0, 0, *case["p_A"], 0, 0, 0, *case["p_B"], *case["q_W"]]
    u = [0, 0, 0, *case["v_A"], 0, 0, 0, *case["v_B"], *case["u_W"]]
    length, speed = paths.lengths(q)[PATH], paths.speeds(q, u)[PATH]
    arms = paths.moment_arms(q)[PATH]
    forces = [arms.get(info.path, 0.0) for info in paths.mechanism.coordinates]
    expected = [*[0.0] * 3, *case["force_A"], *[0.0] * 3, *case["force_B"], *case["u_force_W"]]
    assert length == pytest.approx(case["length"], rel=0, abs=1e-12, nan_ok=True)
    assert speed == pytest.approx(case["speed"], rel=0, abs=1e-10)
    assert forces == pytest.approx(expected, rel=0, abs=1e-10)


@pytest.mark.parametrize("name", SETUPS)
def test_wrapped(name):
    paths = osimlite.paths(wrapped(SETUPS[name]))
    for case in SETUPS[name]["cases"]:
        compare(paths, case)


@pytest.mark.parametrize(
    "name", [name for name, setup in SETUPS.items() if len(setup["objects"]) > 1]
)
def test_several_as_python(name, monkeypatch):
    """Kernels of a path access only their own vectors."""
    monkeypatch.setattr("osimlite.simulation.evaluation.select_code", lambda: Checked("Python"))
    paths = osimlite.paths(wrapped(SETUPS[name]))
    for case in SETUPS[name]["cases"][:1]:
        compare(paths, case)
