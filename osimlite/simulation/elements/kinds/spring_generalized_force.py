"""Springs on a coordinate."""

from osimlite.mechanics.laws.springs import coordinate_spring_force, spring_energy
from osimlite.schema.springs import SpringGeneralizedForce
from osimlite.simulation.elements.geometries.coordinate import COORDINATE
from osimlite.simulation.elements.kind import Kind


def spring(q: float, u: float, k: float, q0: float, c: float) -> tuple[float, float]:
    """Force and energy."""
    return coordinate_spring_force(q, u, k, q0, c), spring_energy(q - q0, k)


KIND = Kind(
    SpringGeneralizedForce,
    COORDINATE,
    spring,
    outputs=("force", "energy"),
    parameters=("stiffness", "rest_length", "viscosity"),
    labels={"{name}_Force": "force"},
)
