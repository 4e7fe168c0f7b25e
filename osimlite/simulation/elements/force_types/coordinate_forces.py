"""Springs, stops and expressions that act on a coordinate."""

from math import exp
from typing import Any

from osimlite.errors import ModelError
from osimlite.mechanics.kernels.programs import run_binary_program
from osimlite.mechanics.laws.springs import coordinate_spring_force, spring_energy
from osimlite.schema.springs import (
    CoordinateLinearStopForce,
    ExponentialCoordinateLimitForce,
    ExpressionBasedCoordinateForce,
    SpringGeneralizedForce,
)
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.force_type import ForceType
from osimlite.simulation.elements.geometries.coordinate import COORDINATE, OnCoordinate
from osimlite.simulation.elements.parameters import Expression, Numbers
from osimlite.simulation.elements.registry import register_force_type


def compute_coordinate_spring(
    q: float, u: float, k: float, q0: float, c: float
) -> tuple[float, float]:
    """Return force and energy of a spring and damper on a coordinate.

    Args:
        q: coordinate, rad or m.
        u: speed of the coordinate, rad/s or m/s.
        k: stiffness, N.m/rad or N/m.
        q0: rest value, rad or m.
        c: viscosity, N.m.s/rad or N.s/m.

    Returns:
        Generalized force (N.m, N) and energy (J).
    """
    return coordinate_spring_force(q, u, k, q0, c), spring_energy(q - q0, k)


register_force_type(
    ForceType(
        SpringGeneralizedForce,
        COORDINATE,
        compute_coordinate_spring,
        outputs=("force", "energy"),
        parameters=("stiffness", "rest_length", "viscosity"),
        labels={"{name}_Force": "force"},
    )
)


register_force_type(
    ForceType(
        ExpressionBasedCoordinateForce,
        COORDINATE,
        run_binary_program,
        outputs=("force",),
        parameters=(Expression("expression", ("q", "qdot")),),
        labels={"{name}": "force"},
    )
)


def compute_linear_stop(
    q: float, u: float, k: float, d: float, upper: float, lower: float
) -> tuple[float, float]:
    """Return the force -k x (1 + d v) of a stop, which never pulls, and the energy k x^2 / 2.

    x is how far the coordinate is beyond the limit, and v its rate. Source: Simbody's
    MobilityLinearStop, according to the documentation of OpenSim's class.

    Args:
        q: coordinate, rad or m.
        u: speed of the coordinate, rad/s or m/s.
        k: stiffness, N.m/rad or N/m.
        d: damping, s/rad or s/m.
        upper: upper limit, rad or m.
        lower: lower limit, rad or m.

    Returns:
        Generalized force (N.m, N) and energy (J).
    """
    if q > upper:
        # A stop only pushes back: it does not hold a coordinate that leaves it fast.
        return min(0.0, -k * (q - upper) * (1.0 + d * u)), 0.5 * k * (q - upper) * (q - upper)
    if q < lower:
        return max(0.0, -k * (q - lower) * (1.0 - d * u)), 0.5 * k * (q - lower) * (q - lower)
    return 0.0, 0.0


def _check_linear_stop(builder: ElementBuilder, force: Any) -> None:
    if force.stiffness < 0.0 or force.damping < 0.0 or force.lower_limit > force.upper_limit:
        raise ModelError(
            f"'{builder.path(force)}' needs a stiffness and a damping that are not negative, and a lower_limit that is "
            "not above the upper_limit"
        )


register_force_type(
    ForceType(
        CoordinateLinearStopForce,
        OnCoordinate("socket_coordinate"),
        compute_linear_stop,
        outputs=("force", "energy"),
        parameters=("stiffness", "damping", "upper_limit", "lower_limit"),
        labels={"{name}": "force", "PotentialEnergy": "energy"},
        check=_check_linear_stop,
    )
)


def compute_exponential_limit(
    q: float, u: float, lower: float, upper: float, a: float, b: float, c: float, d: float
) -> tuple[float, float]:
    """Return the force a exp(-b (q - lower)) - c exp(d (q - upper)) and its energy.

    Source: F. C. Anderson and M. G. Pandy, "A dynamic optimization solution for vertical jumping in
    three dimensions", Computer Methods in Biomechanics and Biomedical Engineering 2 (1999) 201-231.

    Args:
        q: coordinate, rad or m.
        u: speed of the coordinate, which has no effect.
        lower: lower limit, rad or m.
        upper: upper limit, rad or m.
        a: force at the lower limit, N.m or N.
        b: growth rate of the force below the lower limit, 1/rad or 1/m.
        c: force at the upper limit, N.m or N.
        d: growth rate of the force above the upper limit, 1/rad or 1/m.

    Returns:
        Generalized force (N.m, N) and energy (J).
    """
    # Both exponentials act everywhere; each is small away from its limit.
    below, above = a * exp(-b * (q - lower)), c * exp(d * (q - upper))
    return below - above, below / b + above / d


def _read_shape_parameters(builder: ElementBuilder, force: Any) -> tuple[float, ...]:
    shapes = *force.lower_shape_parameters, *force.upper_shape_parameters
    if not all(shape > 0.0 for shape in shapes):
        raise ModelError(
            f"the shape parameters of '{builder.path(force)}' are not all positive; make them positive"
        )
    return shapes


register_force_type(
    ForceType(
        ExponentialCoordinateLimitForce,
        OnCoordinate("socket_coordinate"),
        compute_exponential_limit,
        outputs=("force", "energy"),
        parameters=("lower_limit", "upper_limit", Numbers(4, _read_shape_parameters)),
        labels={"{name}": "force", "PotentialEnergy": "energy"},
    )
)
