"""Moving path points at the ends of the ranges of their coordinates.

Outside the range OpenSim keeps the position of a point constant, but computes with a nonzero speed.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import inf
from typing import Any

import numpy as np

from osimlite.lint.measures import CoordinateSetting, MovingPoint
from osimlite.mechanics.kernels.paths import NODE_TYPE
from osimlite.mechanics.multibody.functions import ScaledFunction
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.elements.geometries.paths.geometry_path import Node, ThroughPoints
from osimlite.simulation.paths import Paths


def measure_moving_points(paths: Paths) -> Iterator[MovingPoint]:
    """Yield each moving point at both ends of the range of its coordinate."""
    for name, route in paths.routes.items():
        for point in route.points if isinstance(route, ThroughPoints) else ():
            if point.kind != NODE_TYPE.MOVING:
                continue
            info = paths.mechanism.coordinates[point.coordinate]
            low, high = _find_defined_range(point)
            for end in info.range:
                clamped = min(max(end, low), high)
                position, rate = _evaluate_point(point, end)
                yield MovingPoint(
                    name,
                    point.name,
                    CoordinateSetting(info.name, end, info.unit),
                    abs(end - clamped),
                    float(np.linalg.norm(position - _evaluate_point(point, clamped)[0])),
                    float(np.linalg.norm(rate)),
                )


def _evaluate_point(point: Node, value: float) -> tuple[Array, Array]:
    """Return the position of a point at a value of its coordinate, and its derivative."""
    result = [function.evaluate(np.array([value])) for function in point.functions]
    return np.array([coordinate for coordinate, _, _ in result]), np.array(
        [slope[0] for _, slope, _ in result]
    )


def _find_defined_range(point: Node) -> tuple[float, float]:
    """Return the values of the coordinate for which all functions of a point are defined."""
    ranges = [_find_function_range(function) for function in point.functions]
    return max(low for low, _ in ranges), min(high for _, high in ranges)


def _find_function_range(function: Any) -> tuple[float, float]:
    while isinstance(function, ScaledFunction):
        function = function.function
    x: Any = getattr(function, "x", getattr(function, "knots", ()))
    return (float(x[0]), float(x[-1])) if len(x) else (-inf, inf)
