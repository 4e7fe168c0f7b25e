"""A stop that a coordinate runs into."""

from typing import Any

from osimlite.errors import ModelError
from osimlite.schema.coordinate_stops import CoordinateLinearStopForce
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.geometries.coordinate import OnCoordinate
from osimlite.simulation.elements.kind import Kind


def stop(q: float, u: float, k: float, d: float, upper: float, lower: float) -> tuple[float, float]:
    """Generalized force -k x (1 + d v), N.m (N for a translation), which never pulls, and energy k x^2 / 2, J.

    x is how far the coordinate is beyond the limit, and v how fast it runs on. Source: Simbody's
    MobilityLinearStop, as the documentation of OpenSim's class has it.

    Args:
        q: coordinate, rad (m).
        u: its speed, rad/s (m/s).
        k: stiffness, N.m/rad (N/m).
        d: damping, s/rad (s/m).
        upper: limit, rad (m).
        lower: limit, rad (m).
    """
    if q > upper:
        return min(0.0, -k * (q - upper) * (1.0 + d * u)), 0.5 * k * (q - upper) * (q - upper)
    if q < lower:
        return max(0.0, -k * (q - lower) * (1.0 - d * u)), 0.5 * k * (q - lower) * (q - lower)
    return 0.0, 0.0


def _check(builder: ElementBuilder, force: Any) -> None:
    if force.stiffness < 0.0 or force.damping < 0.0 or force.lower_limit > force.upper_limit:
        raise ModelError(
            f"'{builder.path(force)}' needs a stiffness and a damping that are not negative, and a lower_limit that is "
            "not above the upper_limit"
        )


KIND = Kind(
    CoordinateLinearStopForce,
    OnCoordinate("socket_coordinate"),
    stop,
    outputs=("force", "energy"),
    parameters=("stiffness", "damping", "upper_limit", "lower_limit"),
    labels={"{name}": "force", "PotentialEnergy": "energy"},
    check=_check,
)
