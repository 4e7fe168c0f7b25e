"""Compare OpenSim's verdict on small models with one fault with the table of verdicts.

OpenSim must fail, or compute finite accelerations, as `tests/lint/verdict_cases.py` says.
"""

from __future__ import annotations

import math
import os
import signal
from pathlib import Path

import pytest

from tests.lint.verdict_cases import CASES, FAILS, RUNS
from tests.suite import choose

pytestmark = pytest.mark.oracle
opensim = pytest.importorskip("opensim")

SECONDS = 60
"""Time limit (s) after which a model that OpenSim does not finish counts as failed."""


def verdict_of_opensim(path: Path) -> str:
    """Return OpenSim's verdict on a model file, which it examines in a child process."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        signal.alarm(SECONDS)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        verdict = FAILS
        try:
            model = opensim.Model(str(path))
            state = model.initSystem()
            model.realizeAcceleration(state)
            if all(map(math.isfinite, state.getUDot().to_numpy())):
                manager = opensim.Manager(model)
                manager.initialize(state)
                manager.integrate(0.01)
                verdict = RUNS
        except RuntimeError:
            verdict = FAILS
        os.write(writer, verdict.encode())
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader, "rb") as pipe:
        answer = pipe.read().decode()
    os.waitpid(child, 0)
    return answer or FAILS


def test_opensim_does_what_the_table_says(tmp_path: Path):
    path = tmp_path / "m.osim"
    wrong = []
    for case in CASES[:: choose(10, 1)]:
        path.write_text(case.text, encoding="utf-8")
        verdict = verdict_of_opensim(path)
        if verdict != case.verdict:
            wrong.append(f"{case.name}: OpenSim {verdict}")
    assert not wrong, "\n".join(wrong)
