"""Springs and dampers that act once a coordinate has left its limits."""

from osimlite.mechanics.laws.coordinate_limit import (
    limit_constants,
    limit_dissipation,
    limit_energy,
    limit_force,
)
from osimlite.mechanics.multibody.mechanism import CoordinateInfo
from osimlite.schema.forces import CoordinateLimitForce
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.geometries.coordinate import COORDINATE
from osimlite.simulation.elements.kind import Kind, State
from osimlite.simulation.elements.parameters import Numbers


def limit(
    q: float, u: float, Ku: float, qu: float, Kl: float, ql: float, D: float, t: float
) -> tuple[float, float, float]:
    """Force, power that the damper takes up, energy."""
    if ql <= q <= qu:
        return 0.0, 0.0, 0.0
    force = limit_force(q, u, Ku, qu, Kl, ql, D, t)
    return force, limit_dissipation(q, u, qu, ql, D, t), limit_energy(q, Ku, qu, Kl, ql, t)


def constants(
    force: CoordinateLimitForce, info: CoordinateInfo
) -> tuple[float, float, float, float, float, float]:
    """What the law is given besides the state, from the properties of the force and what its coordinate is."""
    return limit_constants(
        force.upper_stiffness,
        force.upper_limit,
        force.lower_stiffness,
        force.lower_limit,
        force.damping,
        force.transition,
        info.motion_type == "rotational",
    )


def _constants(builder: ElementBuilder, force: CoordinateLimitForce) -> tuple[float, ...]:
    return constants(force, builder.mechanism.coordinates[builder.coordinate(force)])


KIND = Kind(
    CoordinateLimitForce,
    COORDINATE,
    limit,
    outputs=("force", "dissipatedEnergy_rate", "energy"),
    parameters=(Numbers(6, _constants),),
    states=(State("dissipatedEnergy", given=False),),
    labels={"{name}": "force", "{name}.PotentialEnergy": "energy"},
)
