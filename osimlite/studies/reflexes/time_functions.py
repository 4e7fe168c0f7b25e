"""SCONE's functions of time as sums of powers: piecewise constant, piecewise linear and polynomial.

The kernels compute terms `gain * (t - start)**power` only, each from its start on. Steps, ramps and
polynomials are sums of such terms.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from osimlite.mechanics.multibody.spatial import Array
from osimlite.studies.reflexes.parameters import Parameters
from osimlite.studies.reflexes.settings import SettingNode

PowerTerms = Iterable[tuple[int, Array, Array]]
"""Terms whose sum is a function of time: power, and per candidate start (w,) (s) and gain (w,)."""
MAX_CONTROL_POINTS = 99
"""Most control points of a function, and highest degree of a polynomial."""


def _read_integer(node: SettingNode, key: str, minimum: int) -> int:
    """Return a setting that is a whole number from `minimum` to `MAX_CONTROL_POINTS`."""
    number = node.number(key)
    if number not in range(minimum, MAX_CONTROL_POINTS + 1):
        raise node.error(
            f"'{key}' must be a whole number from {minimum} to {MAX_CONTROL_POINTS}, not {number:g}"
        )
    return int(number)


def _read_control_points(
    node: SettingNode, parameters: Parameters, prefix: str
) -> tuple[Array, Array]:
    """Return times (n, w) (s) and values (n, w) of the control points of a function."""
    count = _read_integer(node, "control_points", 1)
    # The value is required, although `get_number` would accept a default.
    node.text("control_point_y")
    if node.get("control_point_dt") is None and count > 1:
        raise node.error("several control points need 'control_point_dt'")
    values = [
        parameters.get_number(node, "control_point_y", 0.0, f"{prefix}Y{k}") for k in range(count)
    ]
    intervals = [
        parameters.get_number(node, "control_point_dt", 0.0, f"{prefix}DT{k}")
        for k in range(count - 1)
    ]
    if np.any(np.array(intervals) <= 0.0):
        raise node.error("'control_point_dt' must be positive")
    # Scenarios give intervals between points; each may be a parameter.
    return np.cumsum([np.zeros_like(values[0]), *intervals], axis=0), np.array(values)


def _read_piecewise_constant(node: SettingNode, parameters: Parameters, prefix: str) -> PowerTerms:
    """Return the terms of a function that keeps each value until the next time."""
    times, values = _read_control_points(node, parameters, prefix)
    # Steps of constants: each point adds the difference to the previous value from its time on.
    return [(0, *point) for point in zip(times, np.diff(values, axis=0, prepend=0.0), strict=True)]


def _read_piecewise_linear(node: SettingNode, parameters: Parameters, prefix: str) -> PowerTerms:
    """Return a broken line as a constant and changes of slope.

    After the last point the last slope continues, unless `flat_extrapolation` is set.
    """
    times, values = _read_control_points(node, parameters, prefix)
    # A broken line is its first value plus ramps that start at each point with the change of slope
    # there; a last ramp of slope 0 ends it flat.
    slopes = np.diff(values, axis=0) / np.diff(times, axis=0)
    end_slope = [np.zeros_like(values[:1])] if node.flag("flat_extrapolation", False) else []
    bends = np.diff(np.concatenate([np.zeros_like(values[:1]), slopes, *end_slope]), axis=0)
    return [
        (0, times[0], values[0]),
        *((1, *bend_at_time) for bend_at_time in zip(times, bends, strict=False)),
    ]


def _read_polynomial(node: SettingNode, parameters: Parameters, prefix: str) -> PowerTerms:
    """Return the terms of a polynomial of time; each coefficient is a parameter."""
    degree = _read_integer(node, "degree" if node.get("order") is None else "order", 0)
    for k in range(degree + 1):
        node.text(f"coefficient{k}")
    gains = [
        parameters.get_number(node, f"coefficient{k}", 0.0, f"{prefix}C{k}")
        for k in range(degree + 1)
    ]
    return [(k, np.zeros_like(gain), gain) for k, gain in enumerate(gains)]


TIME_FUNCTIONS: dict[str, Callable[[SettingNode, Parameters, str], PowerTerms]] = {
    "PieceWiseConstant": _read_piecewise_constant,
    "PieceWiseLinear": _read_piecewise_linear,
    "Polynomial": _read_polynomial,
}
"""Readers of the supported functions of time, by SCONE's names."""
