"""Tests of sweeps with constraints: varied values hold, others follow, impossible samples fail with a reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from osimlite.simulation import simulate
from osimlite.studies.sweep.plan import plan
from osimlite.studies.sweep.runner import Runner

pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")

from tests.simulation.support import four_bars

VARY = {"p0/speed": (-1.0, 1.0), "p1": (-0.6, -0.2)}
MEASURES = ("p0/value", "p2/value", "p2/speed")


def test_the_rest_follows_from_what_is_set():
    made = plan(four_bars(), VARY, measures=MEASURES, to=0.4, accuracy=1e-6)
    rows = np.array([(0.8, -0.5), (-0.3, -0.25), (0.1, 3.0)])
    result = Runner(made).run(rows)
    assert result.status == ["done", "done", "failed"]
    assert "no pose of 'pins' near the requested pose fulfils /constraintset/loop" in str(
        result.reasons[2]
    )
    other = Runner(replace(made, engine="bullet")).run(rows)
    assert other.status == result.status
    for name in result.measures:
        assert result.measures[name] == pytest.approx(other.measures[name], abs=1e-8, nan_ok=True)
    for number, (speed, value) in enumerate(rows[:2].tolist()):
        alone = simulate(
            four_bars(),
            0.4,
            "compiled",
            accuracy=1e-6,
            initial={"p1": value},
            initial_speeds={"p0": speed},
        )
        assert result.measures["p0/value"][number] == pytest.approx(alone.values[-1, 0], abs=1e-12)
