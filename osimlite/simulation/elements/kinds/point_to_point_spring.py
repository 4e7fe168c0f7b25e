"""A spring between two points."""

from osimlite.mechanics.laws.springs import point_spring_tension, spring_energy
from osimlite.schema.springs import PointToPointSpring
from osimlite.simulation.elements.geometries.line import BetweenPoints
from osimlite.simulation.elements.kind import Kind


def spring(length: float, k: float, l0: float) -> tuple[float, float]:
    """Tension and energy."""
    return point_spring_tension(length, k, l0), spring_energy(length - l0, k)


KIND = Kind(
    PointToPointSpring,
    BetweenPoints(("socket_body1", "socket_body2")),
    spring,
    inputs=("length",),
    outputs=("tension", "energy"),
    parameters=("stiffness", "rest_length"),
)
