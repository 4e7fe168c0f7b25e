"""What muscles have in common: activation that follows excitation, and fibers that turn as they shorten.

The fibers of a muscle are parallel, and stay as far apart as they are (F. E. Zajac, Critical
Reviews in Biomedical Engineering 17, 1989): the height h = l sin(phi) of fibers of length l, at the
pennation angle phi to the tendon, is constant. OpenSim's MuscleFixedWidthPennationModel bounds the
angle, and so the length from below.
"""

from __future__ import annotations

from math import cos, sin, sqrt
from typing import NamedTuple

SIGNIFICANT = 2.0 ** (-52.0 * 7.0 / 8.0)
"""Simbody's SignificantReal."""
NO_ANGLE = 2.0**-52
"""Fibers at a smaller angle are as straight as the tendon."""


class MuscleInputs(NamedTuple):
    """What the law of a muscle is given of a moment; a state that the muscle has not is 0."""

    length: float  # of the path, m
    rate: float  # of it, m/s
    excitation: float  # the control
    activation: float = 0.0  # state
    fiber_length: float = 0.0  # state, m
    fiber_velocity: float = 0.0  # state, m/s
    normalized_tendon_force: float = 0.0  # state


def first_order_activation_rate(
    excitation: float, activation: float, rising: float, falling: float, least: float
) -> float:
    """Rate of activation, 1/s (D. G. Thelen, Journal of Biomechanical Engineering 125, 2003, eq. 1 and 2).

    As in OpenSim, the activation is kept within its bounds here, and the excitation is not: below
    the least activation the rate stays what it is at it.

    Args:
        excitation: what the control asks for.
        activation: the state.
        rising: activation time constant, s.
        falling: deactivation time constant, s.
        least: activation.
    """
    active = min(max(activation, least), 1.0)
    slow = 0.5 + 1.5 * active
    return (excitation - active) / (rising * slow if excitation > active else falling / slow)


def pennation(
    optimal_length: float, optimal_angle: float, largest_angle: float
) -> tuple[float, float, float, float]:
    """What the laws are given of pennation.

    Args:
        optimal_length: of the fibers, m.
        optimal_angle: between fibers and tendon at that length, rad.
        largest_angle: that is possible, rad.

    Returns:
        Height (m), least length of the fibers (m), sine and cosine of the angle there.
    """
    height = optimal_length * sin(optimal_angle)
    shortest = height / sin(largest_angle) if largest_angle > SIGNIFICANT else 0.01 * optimal_length
    if optimal_angle <= NO_ANGLE:
        return height, shortest, 0.0, 1.0
    return height, shortest, sin(largest_angle), cos(largest_angle)


def cos_pennation(
    length: float, height: float, shortest: float, largest_sin: float, least_cos: float
) -> float:
    """Cosine of the pennation angle of fibers of a length (m); the rest as of `pennation`."""
    if length <= shortest or height >= largest_sin * length:
        return least_cos
    return sqrt((length - height) * (length + height)) / length


def fiber_length_along(along: float, height: float, shortest: float, least_cos: float) -> float:
    """Length (m) of fibers that reach so far along the tendon (m); the rest as of `pennation`."""
    return sqrt(height * height + along * along) if along >= shortest * least_cos else shortest
