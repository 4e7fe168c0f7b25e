"""Activation dynamics and pennation, which the laws of all muscles share.

The fibers of a muscle are parallel and keep their distance (F. E. Zajac, Critical Reviews in
Biomedical Engineering 17, 1989): the height h = l sin(phi) of fibers of length l, at the pennation
angle phi to the tendon, is constant. OpenSim's MuscleFixedWidthPennationModel bounds the angle from
above, and thereby the length from below.
"""

from __future__ import annotations

from math import cos, sin, sqrt
from typing import NamedTuple

SIGNIFICANT = 2.0 ** (-52.0 * 7.0 / 8.0)
"""Simbody's SignificantReal, eps^(7/8)."""
NO_ANGLE = 2.0**-52
"""Pennation angle (rad) up to which fibers count as parallel to the tendon."""


class MuscleInputs(NamedTuple):
    """Inputs of the law of a muscle; a state that the muscle does not have is 0."""

    length: float  # length of the path, m
    rate: float  # lengthening speed of the path, m/s
    excitation: float  # control of the muscle
    activation: float = 0.0  # state: activation
    fiber_length: float = 0.0  # state: fiber length, m
    fiber_velocity: float = 0.0  # state: fiber velocity, m/s
    normalized_tendon_force: float = 0.0  # state: tendon force over the maximum isometric force


def first_order_activation_rate(
    excitation: float, activation: float, rising: float, falling: float, least: float
) -> float:
    """Return the rate of activation (1/s).

    It is (e - a) / tau, with tau = rising (0.5 + 1.5 a) for e > a, else falling / (0.5 + 1.5 a). As in
    OpenSim the activation is clamped to its bounds, and the excitation is not: below the smallest
    activation the rate stays constant. Source: D. G. Thelen, Journal of Biomechanical Engineering 125,
    2003, eq. 1 and 2.

    Args:
        excitation: excitation e.
        activation: activation a.
        rising: activation time constant (s).
        falling: deactivation time constant (s).
        least: smallest activation.
    """
    # OpenSim clamps only the activation, so that the excitation may be below the smallest
    # activation.
    active = min(max(activation, least), 1.0)
    slow = 0.5 + 1.5 * active
    return (excitation - active) / (rising * slow if excitation > active else falling / slow)


def pennation_constants(
    optimal_length: float, optimal_angle: float, largest_angle: float
) -> tuple[float, float, float, float]:
    """Return the constants of pennation.

    Args:
        optimal_length: optimal fiber length (m).
        optimal_angle: pennation angle at that length (rad).
        largest_angle: largest pennation angle (rad).

    Returns:
        Height (m), smallest fiber length (m), and sine and cosine of the largest angle.
    """
    height = optimal_length * sin(optimal_angle)
    # OpenSim takes 1 % of the optimal length where no angle bounds the length.
    shortest = height / sin(largest_angle) if largest_angle > SIGNIFICANT else 0.01 * optimal_length
    # Parallel fibers: every length has the cosine 1.
    if optimal_angle <= NO_ANGLE:
        return height, shortest, 0.0, 1.0
    return height, shortest, sin(largest_angle), cos(largest_angle)


def cos_pennation(
    length: float, height: float, shortest: float, largest_sin: float, least_cos: float
) -> float:
    """Return the cosine of the pennation angle of fibers of a length.

    It is sqrt(1 - (h / l)^2), not less than the cosine of the largest angle.

    Args:
        length: fiber length l (m).
        height: height h of the fibers (m), from `pennation_constants` as all that follow.
        shortest: smallest fiber length (m).
        largest_sin: sine of the largest angle.
        least_cos: cosine of the largest angle.
    """
    if length <= shortest or height >= largest_sin * length:
        return least_cos
    # (l - h) (l + h) instead of l^2 - h^2 avoids cancellation for steep fibers.
    return sqrt((length - height) * (length + height)) / length


def fiber_length_along(
    length_along: float, height: float, shortest: float, least_cos: float
) -> float:
    """Return the fiber length for a length along the tendon (m).

    It is sqrt(h^2 + along^2), not less than the smallest fiber length.

    Args:
        length_along: length of the fibers along the tendon (m).
        height: height h of the fibers (m), from `pennation_constants` as all that follow.
        shortest: smallest fiber length (m).
        least_cos: cosine of the largest angle.
    """
    return (
        sqrt(height * height + length_along * length_along)
        if length_along >= shortest * least_cos
        else shortest
    )
