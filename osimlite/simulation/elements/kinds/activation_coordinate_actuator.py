"""A generalized force on a coordinate, by an activation that follows the control."""

from osimlite.schema.actuators import ActivationCoordinateActuator
from osimlite.simulation.elements.geometries.coordinate import COORDINATE
from osimlite.simulation.elements.kind import Kind, State
from osimlite.simulation.elements.parameters import positive


def effort(
    control: float, activation: float, optimal_force: float, time: float
) -> tuple[float, float]:
    """The activation times the optimal force, and its rate: what it lacks of the control over a time constant (s)."""
    return optimal_force * activation, (control - activation) / time


KIND = Kind(
    ActivationCoordinateActuator,
    COORDINATE,
    effort,
    inputs=(),
    outputs=("force", "activation_rate"),
    parameters=("optimal_force", positive("activation_time_constant")),
    controlled=True,
    states=(State("activation"),),
    labels={"{name}": "force"},
    goes_on=True,
)
