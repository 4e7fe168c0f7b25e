"""Exponential springs at the limits of a coordinate."""

from math import exp
from typing import Any

from osimlite.errors import ModelError
from osimlite.schema.coordinate_stops import ExponentialCoordinateLimitForce
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.geometries.coordinate import OnCoordinate
from osimlite.simulation.elements.kind import Kind
from osimlite.simulation.elements.parameters import Numbers


def limits(
    q: float, u: float, lower: float, upper: float, a: float, b: float, c: float, d: float
) -> tuple[float, float]:
    """Generalized force a exp(-b (q - lower)) - c exp(d (q - upper)), N.m (N for a translation), and its energy, J.

    Source: F. C. Anderson and M. G. Pandy, "A dynamic optimization solution for vertical jumping in
    three dimensions", Computer Methods in Biomechanics and Biomedical Engineering 2 (1999) 201-231.

    Args:
        q: coordinate, rad (m).
        u: its speed; nothing depends on it.
        lower: limit, rad (m).
        upper: limit, rad (m).
        a: force at the lower limit, N.m (N).
        b: how steeply it grows, 1/rad (1/m).
        c: force at the upper limit, N.m (N).
        d: how steeply it grows, 1/rad (1/m).
    """
    below, above = a * exp(-b * (q - lower)), c * exp(d * (q - upper))
    return below - above, below / b + above / d


def _shapes(builder: ElementBuilder, force: Any) -> tuple[float, ...]:
    shapes = *force.lower_shape_parameters, *force.upper_shape_parameters
    if not all(shape > 0.0 for shape in shapes):
        raise ModelError(
            f"the shape parameters of '{builder.path(force)}' are not all positive; give such"
        )
    return shapes


KIND = Kind(
    ExponentialCoordinateLimitForce,
    OnCoordinate("socket_coordinate"),
    limits,
    outputs=("force", "energy"),
    parameters=("lower_limit", "upper_limit", Numbers(4, _shapes)),
    labels={"{name}": "force", "PotentialEnergy": "energy"},
)
