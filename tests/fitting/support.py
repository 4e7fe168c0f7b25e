"""Models, data and comparisons for the tests of fitting."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.fitting.inverse_kinematics import find_marker_stations
from osimlite.fitting.pose_layout import MarkerTarget
from osimlite.fitting.scaling import scale_model
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.base import Object
from tests.simple_models import make_marked_body

MARKERS = ("one", "two", "three", "four")


# Positions of the markers on the body (m).
POINTS = np.array(((0.1, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.3), (0.1, 0.1, 0.1)))


def free_body() -> osimlite.Model:
    """Return a model of a free body with four markers."""
    return make_marked_body(dict(zip(MARKERS, POINTS.tolist(), strict=True)))


def positions(values: Any) -> Any:
    """Return the positions of the four markers (t, 4, 3) at poses of the free body."""
    mechanism = osimlite.mechanism(free_body())
    return np.array([[mechanism.at(q).point(0, point) for point in POINTS] for q in values])


# Scale factor of each segment of the simulated person.
SIZES = {
    "Pelvis": 1.06,
    "RightThigh": 1.12,
    "LeftThigh": 1.12,
    "RightShank": 0.93,
    "LeftShank": 0.93,
}


# Positions of markers on bony landmarks of a segment (m), which a fit may hold fixed.
BONES = {"lateral": (0.0, -0.15, 0.05), "medial": (0.0, -0.15, -0.05)}


# Nominal positions of the other markers of a segment (m); on a person they are displaced.
CLUSTER = {"upper": (0.05, 0.02, 0.02), "front": (0.08, -0.1, 0.0), "back": (-0.07, -0.05, 0.03)}


# Markers that fits hold fixed on their segments.
HELD = tuple(f"{body}_{name}" for body in SIZES for name in BONES)


def marked() -> osimlite.Model:
    """Return the dynamic walker with five markers on each segment."""
    model = dynamic_walker()
    for body in list(model.components(osimlite.Body)):
        if body.name in SIZES:
            for name, place in (BONES | CLUSTER).items():
                model.add(
                    osimlite.Marker(
                        name=f"{body.name}_{name}", socket_parent_frame=body, location=place
                    )
                )
    return model


def person(
    seed: int, noise: float = 0.0, frames: int = 60
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Simulate a person: scale the marked walker, displace the markers of the clusters, and move it.

    Args:
        seed: seed of motion, displacements and noise.
        noise: standard deviation of the marker noise (m).
        frames: number of frames.

    Returns:
        Measured positions (t, 3) by marker, and displacements of the markers of the clusters (m).
    """
    rng, model = np.random.default_rng(seed), marked()
    scale_model(model, {body: (size,) * 3 for body, size in SIZES.items()})
    offsets = {}
    for marker in model.components(osimlite.Marker):
        if marker.name not in HELD:
            offsets[marker.name] = rng.normal(0.0, 0.02, 3)
            marker.location = tuple((np.array(marker.location) + offsets[marker.name]).tolist())
    mechanism = osimlite.mechanism(model)
    moments, rate = np.arange(frames) / frames, rng.uniform(1.0, 6.0, len(mechanism.coordinates))
    stations = find_marker_stations(model, mechanism)
    result: dict[str, list[Any]] = {name: [] for name in stations}
    for t in moments:
        q = 0.5 * np.sin(rate * (t + 0.2))
        q[mechanism.coordinate_index("platform_rz")] = 0.0
        state = mechanism.at(q)
        for name, place in stations.items():
            result[name].append(state.point(*place) + rng.normal(0.0, noise, 3))
    return {name: np.array(rows) for name, rows in result.items()}, offsets


def places_at(mechanism: Mechanism, markers: list[MarkerTarget], q: Any) -> Any:
    """Return the positions of the markers (m, 3) at a pose."""
    state = mechanism.at(q)
    return np.array([state.point(*marker.station) for marker in markers])


def cost_of(mechanism: Mechanism, markers: list[MarkerTarget], measured: Any, q: Any) -> float:
    """Return the cost that OpenSim minimizes: half the weighted mean of squared distances of visible markers."""
    weights = np.array([marker.weight for marker in markers]) * np.isfinite(measured).all(axis=1)
    squares = np.sum((places_at(mechanism, markers, q) - np.nan_to_num(measured)) ** 2, axis=1)
    return float(0.5 * weights @ squares / weights.sum())


def numbers_of(item: Object, path: str = "") -> dict[str, Any]:
    """List all values of an object and of the objects in it.

    Args:
        item: the object.
        path: path of the object, which precedes all keys.

    Returns:
        Values of properties and names of classes, by path.
    """
    result: dict[str, Any] = {f"{path}": type(item).__name__}
    for spec in type(item).field_specs().values():
        value = getattr(item, spec.name)
        many = value if isinstance(value, list) else [value]
        for number, one in enumerate(many):
            if isinstance(one, Object):
                result |= numbers_of(one, f"{path}/{spec.name}[{number}]")
            else:
                result[f"{path}/{spec.name}"] = one
    return result


def assert_same(ours: Object, theirs: Object, but: str = "/socket_frame") -> None:
    """Assert that two objects have equal values; numbers agree to 1e-9.

    Args:
        ours: object to check.
        theirs: reference.
        but: ending of a path that is left out.
    """
    left_out = "/socket_frame", but
    one, other = (
        {k: v for k, v in numbers_of(item).items() if not k.endswith(left_out)}
        for item in (ours, theirs)
    )
    assert one.keys() == other.keys()
    for place, value in other.items():
        if isinstance(value, float) or (
            isinstance(value, tuple) and value and isinstance(value[0], float)
        ):
            # OpenSim prints points of splines with six digits.
            rel = 1e-5 if place.endswith(("/x", "/y")) else 1e-9
            assert np.asarray(one[place]) == pytest.approx(
                np.asarray(value), rel=rel, abs=1e-12, nan_ok=True
            ), place
        else:
            assert one[place] == value, place


# Coordinates of the root joint, in the order of its axes.
NAMES = ("pelvis_tilt", "pelvis_list", "pelvis_rotation", "pelvis_tx", "pelvis_ty", "pelvis_tz")


# Rotation axes of the root joint, as in OpenSim's gait models: z, x, y.
AXES = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


# Positions of the markers on each body (m).
PLACES = ((0.05, 0.05, 0.13), (0.05, 0.05, -0.13), (-0.12, 0.04, 0.0), (0.02, 0.4, 0.03))


FACING = 2
"""Index of the coordinate pelvis_rotation."""


def turner(low: float, high: float) -> osimlite.Model:
    """Return a pelvis and a leg with markers, with the root joint of gait models.

    Args:
        low: lower end of the range of pelvis_rotation (degrees), which is clamped.
        high: upper end of that range (degrees).
    """
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
    """Return poses (t, 7) of a subject that walks in a circle and faces these angles (degrees)."""
    facing, steps = np.radians(angles), np.arange(len(angles))
    return np.column_stack(
        [0.1 * np.sin(0.3 * steps), 0.05 * np.cos(0.2 * steps), facing, np.sin(facing), 0.9 + 0.0 * facing,
         np.cos(facing), 0.4 * np.sin(0.25 * steps)]
    )  # fmt: skip


def trial_of(model: osimlite.Model, values: Any, noise: float = 0.0) -> Any:
    """Measure the markers of a model.

    Args:
        model: the model.
        values: poses (t, n).
        noise: standard deviation of the noise (m).

    Returns:
        Mechanism, stations of the markers, and their measured positions (t, m, 3).
    """
    mechanism: Any = osimlite.mechanism(model)
    stations = [mechanism.stations[marker.path] for marker in model.components(osimlite.Marker)]
    places = np.array([[mechanism.at(q).point(*station) for station in stations] for q in values])
    return mechanism, stations, places + noise * np.random.default_rng(5).normal(size=places.shape)
