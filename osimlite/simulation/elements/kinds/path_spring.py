"""A spring along a path."""

from osimlite.mechanics.laws.springs import path_spring_energy, path_spring_tension
from osimlite.schema.path_forces import PathSpring
from osimlite.simulation.elements.geometries.path import PATH
from osimlite.simulation.elements.kind import Kind


def spring(length: float, rate: float, l0: float, k: float, d: float) -> tuple[float, float]:
    """Tension and energy."""
    return path_spring_tension(length, rate, l0, k, d), path_spring_energy(length, l0, k)


KIND = Kind(
    PathSpring,
    PATH,
    spring,
    outputs=("tension", "energy"),
    parameters=("resting_length", "stiffness", "dissipation"),
    labels={"{name}_tension": "tension"},
)
