"""Compare OpenSim's verdict on small models with one fault with the table of verdicts.

OpenSim must fail, or compute finite accelerations, as `tests/lint/verdict_cases.py` says.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tests.lint.verdict_cases import CASES, FAILS, RUNS
from tests.scripts import run_script
from tests.suite import choose

pytestmark = pytest.mark.oracle
pytest.importorskip("opensim")

SECONDS = 60
"""Time limit (s) after which a model that OpenSim does not finish counts as failed."""

SIMULATE = """
import math
import sys

import opensim

opensim.Logger.setLevelString("Off")
model = opensim.Model(sys.argv[1])
state = model.initSystem()
model.realizeAcceleration(state)
if all(map(math.isfinite, state.getUDot().to_numpy())):
    manager = opensim.Manager(model)
    manager.initialize(state)
    manager.integrate(0.01)
    print("finished")
"""
"""Script that simulates a model for 10 ms, and says so at the end."""


def verdict_of_opensim(path: Path) -> str:
    """Return OpenSim's verdict on a model file.

    Each file has a new process: one that other tests have used may compute a singular system
    differently.
    """
    try:
        done = run_script(SIMULATE, path, check=False, timeout=SECONDS)
    except subprocess.TimeoutExpired:
        return FAILS
    return RUNS if done.stdout.endswith("finished\n") else FAILS


def test_opensim_does_what_the_table_says(tmp_path: Path):
    path = tmp_path / "m.osim"
    wrong = []
    for case in CASES[:: choose(10, 1)]:
        path.write_text(case.text, encoding="utf-8")
        verdict = verdict_of_opensim(path)
        if verdict != case.verdict:
            wrong.append(f"{case.name}: OpenSim {verdict}")
    assert not wrong, "\n".join(wrong)
