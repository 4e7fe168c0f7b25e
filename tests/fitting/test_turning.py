"""Subjects that turn around: a clamped angle comes to an end of its range, and goes on at the other."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares  # type: ignore[import-untyped]

import osimlite

NAMES = ("pelvis_tilt", "pelvis_list", "pelvis_rotation", "pelvis_tx", "pelvis_ty", "pelvis_tz")
AXES = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
PLACES = ((0.05, 0.05, 0.13), (0.05, 0.05, -0.13), (-0.12, 0.04, 0.0), (0.02, 0.4, 0.03))
FACING = 2
"""The place of pelvis_rotation."""


def turner(low: float, high: float) -> osimlite.Model:
    """A pelvis, jointed as gait models are, whose rotation is clamped (degrees), and a thigh."""
    model = osimlite.Model(name="turner")
    bodies = [
        osimlite.Body(name=name, mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0))
        for name in ("pelvis", "leg")
    ]
    for body in bodies:
        model.add(body)
        for number, place in enumerate(PLACES):
            model.add(
                osimlite.Marker(
                    name=f"{body.name}{number}", socket_parent_frame=body, location=place
                )
            )
    coordinates = [osimlite.Coordinate(name=name) for name in NAMES]
    coordinates[FACING].clamped, coordinates[FACING].range = (
        True,
        (float(np.radians(low)), float(np.radians(high))),
    )
    moves = osimlite.SpatialTransform()
    for number, name in enumerate(NAMES):
        kind = f"{'translation' if number > 2 else 'rotation'}{number % 3 + 1}"
        line = osimlite.LinearFunction(coefficients=(1.0, 0.0))
        axis = np.eye(3)[number % 3].tolist() if number > 2 else AXES[number]
        setattr(
            moves,
            kind,
            osimlite.TransformAxis(name=kind, coordinates=(name,), axis=tuple(axis), function=line),
        )
    joint = osimlite.CustomJoint(
        name="root", socket_parent_frame=model.ground, socket_child_frame=bodies[0], coordinates=coordinates,
        spatial_transform=moves,
    )  # fmt: skip
    hip = osimlite.PinJoint(
        name="hip", socket_parent_frame=bodies[0], socket_child_frame=bodies[1],
        coordinates=[osimlite.Coordinate(name="hip", clamped=True, range=(-2.0, 0.5))],
    )  # fmt: skip
    model.add(joint)
    model.add(hip)
    return model


def poses(angles: Any) -> Any:
    """Of somebody who walks in a circle, facing these angles (degrees): (t, 7)."""
    facing, steps = np.radians(angles), np.arange(len(angles))
    return np.column_stack(
        [0.1 * np.sin(0.3 * steps), 0.05 * np.cos(0.2 * steps), facing, np.sin(facing), 0.9 + 0.0 * facing,
         np.cos(facing), 0.4 * np.sin(0.25 * steps)]
    )  # fmt: skip


def trial_of(model: osimlite.Model, values: Any, noise: float = 0.0) -> Any:
    """The mechanism, its stations, and where they were measured (t, m, 3)."""
    mechanism: Any = osimlite.mechanism(model)
    stations = [mechanism.stations[marker.path] for marker in model.components(osimlite.Marker)]
    places = np.array([[mechanism.at(q).point(*station) for station in stations] for q in values])
    return mechanism, stations, places + noise * np.random.default_rng(5).normal(size=places.shape)


def fitted(model: osimlite.Model, places: Any) -> Any:
    """The motion that fits."""
    names = [marker.name for marker in model.components(osimlite.Marker)]
    return osimlite.inverse_kinematics(model, {name: places[:, k] for k, name in enumerate(names)})


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize(
    ("low", "high"), [(-180.0, 180.0), (-200.0, 200.0), (0.0, 360.0), (-180.0, 540.0)]
)
def test_who_turns_around_goes_on_at_the_other_end(low: float, high: float, way: float) -> None:
    """Twice around and back; nothing is lost on the way, and no coordinate leaps without need."""
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
    # Only where going on would leave the range.
    on = facing[leaps] + np.diff(angles)[leaps]
    assert ((on < low) | (on > high)).all()
    others = np.delete(result.values, FACING, axis=1)
    assert others == pytest.approx(np.delete(poses(angles), FACING, axis=1), abs=1e-8)


@pytest.mark.parametrize("turning", [0, 1, 2])
@pytest.mark.parametrize("widest", [90.0, 180.0])
def test_who_turns_over_is_followed(turning: int, widest: float) -> None:
    """Head over heels, sideways or on the spot: the ranges of the three angles leave no rotation out."""
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
    """Against a search from all around, also where the range leaves out a part of the turn."""
    angles = np.arange(60.0, 420.0, 25.0)
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

        least = np.inf
        for start in np.linspace(ends[0] + 0.1, ends[1] - 0.1, 3):
            begin = np.array([0.0, 0.0, start, *wanted[:3].mean(axis=0), 0.0])
            least = min(least, least_squares(residuals, begin, bounds=bounds.T).cost)
        assert cost <= least * (1.0 + 1e-6) + 1e-15
