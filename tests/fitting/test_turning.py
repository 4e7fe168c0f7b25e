"""Tests of subjects that turn around: at one end of its range, a clamped angle continues at the other end."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import osimlite
from tests.fitting.support import FACING, poses, trial_of, turner
from tests.suite import choose


def fitted(model: osimlite.Model, places: Any) -> Any:
    """Return the result of inverse kinematics for these marker positions (t, m, 3)."""
    names = [marker.name for marker in model.components(osimlite.Marker)]
    return osimlite.inverse_kinematics(model, {name: places[:, k] for k, name in enumerate(names)})


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize(
    ("low", "high"), [(-180.0, 180.0), (-200.0, 200.0), (0.0, 360.0), (-180.0, 540.0)]
)
def test_who_turns_around_goes_on_at_the_other_end(low: float, high: float, way: float) -> None:
    """After two turns and back, the fit is exact, and coordinates jump only at the ends of the range."""
    angles = way * np.concatenate([np.arange(100.0, 760.0, 8.0), np.arange(760.0, 100.0, -30.0)])
    model = turner(low, high)
    _, _, places = trial_of(model, poses(angles))
    result = fitted(model, places)
    assert result.costs.max() < 1e-15 and not result.unsettled
    facing = np.degrees(result.values[:, FACING])
    assert (low - 1e-9 <= facing).all() and (facing <= high + 1e-9).all()
    off = facing - angles
    assert off == pytest.approx(360.0 * np.round(off / 360.0), abs=1e-6)
    leaps = np.flatnonzero(np.abs(np.diff(facing)) > 31.0)
    # A jump is necessary only if continuing would leave the range.
    on = facing[leaps] + np.diff(angles)[leaps]
    assert ((on < low) | (on > high)).all()
    others = np.delete(result.values, FACING, axis=1)
    assert others == pytest.approx(np.delete(poses(angles), FACING, axis=1), abs=1e-8)


@pytest.mark.parametrize("turning", [0, 1, 2])
@pytest.mark.parametrize("widest", [90.0, 180.0])
def test_who_turns_over_is_followed(turning: int, widest: float) -> None:
    """The ranges of the three angles contain all orientations, so turns about any axis are followed."""
    model = turner(-180.0, 180.0)
    steps = np.arange(0.0, 720.0, 8.0)
    values = poses(steps)
    values[:, :3] = 0.2 * np.sin(0.1 * np.arange(len(steps))[:, None] + np.arange(3.0))
    values[:, turning] = np.radians(steps)
    _, _, places = trial_of(model, values)
    for number, coordinate in enumerate([*model.components(osimlite.Coordinate)][:3]):
        end = float(np.radians(widest if number == 1 else 180.0))
        coordinate.clamped, coordinate.range = True, (-end, end)
    result = fitted(model, places)
    assert result.costs.max() < 1e-15 and not result.unsettled
    assert result.values[:, 3:] == pytest.approx(values[:, 3:], abs=1e-7)


@pytest.mark.parametrize(("low", "high"), [(-170.0, 170.0), (-90.0, 90.0), (-180.0, 180.0)])
def test_every_frame_is_at_the_least_of_all_minima(low: float, high: float) -> None:
    """Compare with minima from several starting angles, also where the range excludes part of the turn."""
    angles = np.arange(60.0, 420.0, choose(75.0, 25.0))
    model = turner(low, high)
    mechanism, stations, places = trial_of(model, poses(angles), 0.005)
    ends = np.radians((low, high))
    bounds = np.array([(-np.inf, np.inf)] * 7)
    bounds[FACING], bounds[6] = ends, (-2.0, 0.5)
    result = fitted(model, places)
    for wanted, cost in zip(places, result.costs, strict=True):

        def residuals(q: Any, wanted: Any = wanted) -> Any:
            state = mechanism.at(q)
            return (
                np.array([state.point(*station) for station in stations]) - wanted
            ).ravel() / np.sqrt(len(stations))

        # Import here: collecting the tests does not need SciPy, whose import is slow.
        from scipy.optimize import least_squares  # type: ignore[import-untyped]

        least = np.inf
        for start in np.linspace(ends[0] + 0.1, ends[1] - 0.1, 3):
            begin = np.array([0.0, 0.0, start, *wanted[:3].mean(axis=0), 0.0])
            least = min(least, least_squares(residuals, begin, bounds=bounds.T).cost)
        assert cost <= least * (1.0 + 1e-6) + 1e-15
