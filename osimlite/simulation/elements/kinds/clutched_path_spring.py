"""A spring along a path that its control engages."""

from osimlite.schema.path_actuators import ClutchedPathSpring
from osimlite.simulation.elements.geometries.path import PATH
from osimlite.simulation.elements.kind import Kind, State
from osimlite.simulation.elements.parameters import Number, positive

OPEN = 2.0 ** (-52.0 * 7.0 / 8.0)
"""A control that is no larger does not engage the spring: Simbody's SignificantReal."""


def clutched(
    rate: float, control: float, stretch: float, k: float, d: float, relaxation: float
) -> tuple[float, float]:
    """Tension c k z (1 + d v), N, and rate of the stretch z, m/s: that of the path, -z / relaxation without control.

    Args:
        rate: v of the path, m/s.
        control: c, kept between 0 and 1.
        stretch: z, m.
        k: stiffness, N/m.
        d: dissipation, s/m.
        relaxation: time constant, s.
    """
    tension = min(max(control, 0.0), 1.0) * k * stretch * (1.0 + d * rate)
    return tension, rate if control > OPEN else -stretch / relaxation


def _at_least_zero(name: str) -> Number:
    return Number(name, lambda value: value >= 0.0, "is less than 0; give it one that is not")


KIND = Kind(
    ClutchedPathSpring,
    PATH,
    clutched,
    inputs=("rate",),
    outputs=("tension", "stretch_rate"),
    parameters=(
        _at_least_zero("stiffness"),
        _at_least_zero("dissipation"),
        positive("relaxation_time_constant"),
    ),
    controlled=True,
    states=(State("stretch", lambda spring: spring.initial_stretch),),
    labels={"{name}": "tension"},
    goes_on=True,
)
