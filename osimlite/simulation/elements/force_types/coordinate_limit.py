"""CoordinateLimitForce: a spring and damper beyond the limits of a coordinate."""

from osimlite.mechanics.laws.coordinate_limit import (
    limit_constants,
    limit_dissipation,
    limit_energy,
    limit_force,
)
from osimlite.mechanics.multibody.mechanism import CoordinateInfo
from osimlite.schema.forces import CoordinateLimitForce
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.force_type import ForceType, State
from osimlite.simulation.elements.geometries.coordinate import COORDINATE
from osimlite.simulation.elements.parameters import Numbers
from osimlite.simulation.elements.registry import register_force_type


def compute_coordinate_limit(
    q: float, u: float, Ku: float, qu: float, Kl: float, ql: float, D: float, t: float
) -> tuple[float, float, float]:
    """Return the force of a spring and damper that act beyond the limits of a coordinate.

    Args:
        q: coordinate, rad or m.
        u: speed of the coordinate, rad/s or m/s.
        Ku: stiffness at the upper limit, N.m/rad or N/m.
        qu: upper limit, rad or m.
        Kl: stiffness at the lower limit, N.m/rad or N/m.
        ql: lower limit, rad or m.
        D: damping, N.m.s/rad or N.s/m.
        t: width of the transition zone, rad or m.

    Returns:
        Generalized force (N.m, N), dissipated power (W), and energy (J).
    """
    # Within the limits the smooth steps of the law are exactly zero: their evaluation is saved.
    if ql <= q <= qu:
        return 0.0, 0.0, 0.0
    force = limit_force(q, u, Ku, qu, Kl, ql, D, t)
    return force, limit_dissipation(q, u, qu, ql, D, t), limit_energy(q, Ku, qu, Kl, ql, t)


def read_limit_constants(
    force: CoordinateLimitForce, info: CoordinateInfo
) -> tuple[float, float, float, float, float, float]:
    """Return the constants of the law of a CoordinateLimitForce, in radians or metres.

    Args:
        force: the component, with degrees for rotations.
        info: the coordinate.

    Returns:
        Ku, qu, Kl, ql, D, t of `compute_coordinate_limit`.
    """
    return limit_constants(
        force.upper_stiffness,
        force.upper_limit,
        force.lower_stiffness,
        force.lower_limit,
        force.damping,
        force.transition,
        info.motion_type == "rotational",
    )


def _read_limit_parameters(
    builder: ElementBuilder, force: CoordinateLimitForce
) -> tuple[float, ...]:
    return read_limit_constants(
        force, builder.mechanism.coordinates[builder.find_coordinate(force)]
    )


register_force_type(
    ForceType(
        CoordinateLimitForce,
        COORDINATE,
        compute_coordinate_limit,
        outputs=("force", "dissipatedEnergy_rate", "energy"),
        parameters=(Numbers(6, _read_limit_parameters),),
        states=(State("dissipatedEnergy", is_argument=False),),
        labels={"{name}": "force", "{name}.PotentialEnergy": "energy"},
    )
)
