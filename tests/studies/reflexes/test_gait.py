"""Tests of the quantities that describe gaits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from osimlite.models.walking import write_scenario
from osimlite.studies.reflexes.gait import measure_gait, measure_strides
from osimlite.studies.reflexes.scenario import Scenario

TIMES: Any = np.linspace(0.0, 9.99, 1000)


def loads_of(phase) -> Any:
    """Return loads with peaks of 1.2 and 1.0 in the first 60 of 100 rows of each stride."""
    place = (np.arange(1000) - phase) % 100
    return np.where(place < 60, np.where(place == 15, 1.2, np.where(place == 45, 1.0, 0.6)), 0.0)


def test_strides_are_counted() -> None:
    loads = np.column_stack([loads_of(10), loads_of(60)])
    found = measure_strides(TIMES, 1.5 * TIMES, loads)
    assert found is not None and (found.number, found.touches) == (16, 20)
    assert (found.time, found.length, found.peak) == pytest.approx((1.0, 1.5, 1.2), abs=1e-12)
    assert found.stance == pytest.approx((0.6, 0.6), abs=1e-12) and found.both == pytest.approx(
        0.2, abs=0.01
    )
    assert found.humps == pytest.approx((1.2, 0.6, 1.0), abs=1e-12)
    assert measure_strides(TIMES[:250], TIMES[:250], loads[:250]) is None


def test_scuffs_and_bounces_are_no_steps() -> None:
    loads = np.column_stack([loads_of(10), loads_of(60)])
    expected = measure_strides(TIMES, TIMES, loads)
    loads[90:93, 0], loads[530:532, 0] = 0.3, 0.0
    found = measure_strides(TIMES, TIMES, loads)
    assert found is not None and expected is not None
    assert found[:5] == expected[:5] and found.touches == expected.touches


def test_a_stance_may_be_one_moment() -> None:
    times = np.arange(0.0, 4.0, 0.1)
    loads = np.zeros((40, 2))
    loads[::5, 0] = loads[2::5, 1] = 0.8
    found = measure_strides(times, times, loads)
    assert found is not None and found.humps == pytest.approx((0.8, 0.8, 0.8), abs=1e-15)


def test_our_human_s_gait(tmp_path) -> None:
    scenario = Scenario(write_scenario(tmp_path))
    walked = scenario.walk(scenario.best(), duration=6.0)
    gait = measure_gait(scenario, walked)
    assert gait is not None and gait.strides is not None
    pelvis = walked.states["/jointset/ground_pelvis/pelvis_ty/value"]
    assert gait.pelvis == pytest.approx((pelvis.mean(), pelvis.min(), pelvis.max()), abs=1e-9)
    assert 0.93 < gait.centre[1] < gait.centre[0] < gait.centre[2] < 1.05
    assert gait.speed == pytest.approx(walked.report["speed"][0], rel=0.05)
    assert all(0.5 < part < 0.65 for part in gait.strides.stance) and 0.05 < gait.strides.both < 0.2
    told = gait.describe()
    assert (
        list(told) == ["distance", "heights", "strides", "stance", "ground"]
        and "weights" in told["ground"]
    )
    # The metabolic power and the cost of transport are reported by two measures, and agree.
    assert walked.report["transport"] == pytest.approx(
        walked.report["power"] / gait.speed, rel=0.05
    )
