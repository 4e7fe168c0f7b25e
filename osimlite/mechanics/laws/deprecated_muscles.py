"""Muscles that OpenSim keeps for old files: its classes whose names end in Deprecated.

Forces are normalized by the maximum isometric force, fiber lengths by the optimal fiber length
where they are called normalized. Fibers are parallel and keep their height across the tendon, at
any angle.

Sources: L. M. Schutte, "Using musculoskeletal models to explore strategies for improving
performance in electrical stimulation-induced leg cycle ergometry" (Stanford University, 1993); S.
L. Delp, "Surgery simulation" (Stanford University, 1990); D. G. Thelen, Journal of Biomechanical
Engineering 125 (2003) 70-77; as OpenSim computes them.
"""

from __future__ import annotations

from math import exp, sqrt
from typing import NamedTuple

MIN_FIBER_LENGTH_M = 2.220446049250313e-16
"""Fiber length (m) below which fibers count as parallel to the tendon."""
RIGHT_ANGLE_COSINE = 6.123233995736766e-17
"""Cosine of a right angle as a float, for fibers that are no longer than high."""
ZERO_TOLERANCE = 2e-13
"""Absolute value up to which a number counts as 0."""
MAX_TRIALS = 100
"""Largest number of lengths that are tried in the search for an equilibrium."""
FORCE_TOLERANCE_N = 0.01
"""Accepted difference of the forces of fibers and tendon (N)."""
TENDON_MODULUS = 1200.0
"""Elastic modulus of a tendon (MPa)."""
TENDON_STRENGTH = 32.0
"""Stress of a tendon at the maximum isometric force (MPa)."""


class OldMuscle(NamedTuple):
    """Parameters that all these muscles have."""

    strength: float  # max_isometric_force, N
    optimal: float  # optimal_fiber_length, m
    slack: float  # tendon_slack_length, m
    fastest: float  # max_contraction_velocity, 1/s
    height: float  # height of the fibers: optimal sin(pennation_angle_at_optimal), m


class Guess(NamedTuple):
    """Guess of an equilibrium of fibers and tendon."""

    length: float  # fiber length, m
    cos: float  # cosine of the pennation angle
    strain: float  # tendon strain, not negative


def cos_pennation_of_fibers(length: float, height: float) -> float:
    """Return the cosine of the pennation angle of fibers with a constant height h: sqrt(l² - h²) / l.

    Fibers shorter than their height stand upright; their cosine is `RIGHT_ANGLE_COSINE`, not 0,
    since laws divide by it.

    Args:
        length: fiber length (m).
        height: constant height of the fibers across the tendon (m).
    """
    if length < MIN_FIBER_LENGTH_M:
        return 1.0
    # (l - h) (l + h) instead of l^2 - h^2 avoids cancellation for steep fibers.
    return (
        sqrt((length - height) * (length + height)) / length
        if height < length
        else RIGHT_ANGLE_COSINE
    )


def compute_schutte_activation_rate(
    excitation: float, activation: float, rate_difference: float, smallest_rate: float, time: float
) -> float:
    """Return the rate of activation of Schutte's muscle (1/s).

    It is (e - a) (k1 e + k2) / t for an excitation e >= a, the activation, and (e - a) k2 / t
    below.

    Args:
        excitation: excitation.
        activation: activation.
        rate_difference: activation1, the increase of the rate with the excitation while rising.
        smallest_rate: activation2, the rate while falling.
        time: time_scale (s).
    """
    speed = (
        rate_difference * excitation + smallest_rate if excitation >= activation else smallest_rate
    )
    return (excitation - activation) * speed / time


def rigid_cos(path_length: float, m: OldMuscle) -> float:
    """Return the cosine of pennation with a rigid tendon, as these classes of OpenSim compute it.

    It is x / sqrt(x^2 + h^2), where h is the height of the fibers and x their length along the
    tendon. As there, x is the normalized path length less the slack length in m, which mixes units.

    Args:
        path_length: length of the path (m).
        m: parameters of the muscle.
    """
    length_along = path_length / m.optimal - m.slack
    return cos_pennation_of_fibers(
        sqrt(length_along * length_along + m.height * m.height), m.height
    )


def generic_velocity_factor(rate: float, m: OldMuscle) -> float:
    """Return the factor by which OpenSim scales isometric forces of these muscles.

    It is 1.8 - 1.8 / (1 + exp((0.04 - v) / 0.18)) at the normalized velocity v = -cos(phi) rate /
    (fastest optimal), where phi is the pennation angle at the optimal length; v is positive for
    shortening.

    Args:
        rate: lengthening speed of the path (m/s).
        m: parameters of the muscle.
    """
    sin = m.height / m.optimal
    velocity = -sqrt(1.0 - sin * sin) * rate / (m.fastest * m.optimal)
    return 1.8 - 1.8 / (1.0 + exp((0.04 - velocity) / 0.18))


def schutte_passive_force(length: float) -> float:
    """Return the passive force of fibers of a normalized length, if the file defines no curve."""
    return exp(8.0 * (length - 1.0)) / exp(4.0)


def schutte_velocity(
    activation: float, active: float, velocity_force: float, damping: float
) -> float:
    """Return the fiber velocity v, in optimal fiber lengths per time scale, from the force balance.

    The balance is i f(v) + damping v = velocity_force with the isometric force i = activation active
    and Hill's curves f = 0.15 (1 + v) / (0.15 - v) for shortening and f = (1.4 v + s) / (v + s), s =
    0.13 0.15 / 1.15, for lengthening. Each gives a quadratic equation in v. Faster than v = -1 the
    fibers bear no active force.

    Args:
        activation: activation.
        active: isometric force, fully activated.
        velocity_force: force that depends on the velocity: that of the tendon without the passive one.
        damping: damping force at a velocity of 1.
    """
    isometric = activation * active
    if velocity_force < -damping:
        return velocity_force / damping
    if velocity_force < isometric:
        b = -(velocity_force + 0.15 * (isometric + damping)) / damping
        c = 0.15 * (velocity_force - isometric) / damping
        # The smaller root: v must be between -1 and 0.
        return 0.5 * (-b - sqrt(b * b - 4.0 * c))
    slope = 0.13 * 0.15 / 1.15
    b = slope - (velocity_force - 1.4 * isometric) / damping
    c = slope * (isometric - velocity_force) / damping
    # The larger root: v must not be negative.
    return 0.5 * (-b + sqrt(b * b - 4.0 * c))


def thelen_tendon_force(strain: float, strain_at_one: float) -> float:
    """Return the tendon force: an exponential toe and a line, plus 0.001 (1 + strain).

    With the strain e1 at a force of 1 and the end e0 = 0.609 e1 of the toe, the toe is (exp(3 e / e0)
    - 1) / (exp(3) - 1) / 3 for e > 0, and the line 1/3 + 1.712 (e - e0) / e1. As in OpenSim, 1/3 is
    rounded to 0.333333.

    Args:
        strain: strain of the tendon.
        strain_at_one: strain at the maximum isometric force.
    """
    # The toe ends at 0.609 of the strain at one, where the force is 1/3; OpenSim rounds the
    # constants.
    toe = 0.609 * strain_at_one
    force = 0.001 * (1.0 + strain)
    if strain > toe:
        return force + 1.712 / strain_at_one * (strain - toe) + 0.333333
    return (
        force + 0.333333 * (exp(3.0 * strain / toe) - 1.0) / (exp(3.0) - 1.0)
        if strain > 0.0
        else force
    )


def thelen_passive_force(length: float, strain_at_one: float, shape: float) -> float:
    """Return the passive force of fibers: an exponential, and a line beyond its force of 1.

    With e the strain at a force of 1 and k the shape, it is exp(k (l - 1) / e - k) up to l = 1 + e,
    and 1 + k (l - 1 - e) / e beyond. It does not vanish for short fibers.

    Args:
        length: normalized fiber length l.
        strain_at_one: strain e at a force of 1.
        shape: exponent k.
    """
    beyond = length - (1.0 + strain_at_one)
    return (
        1.0 + shape / strain_at_one * beyond
        if beyond > 0.0
        else exp(shape * (length - 1.0) / strain_at_one - shape)
    )


def thelen_active_force(length: float, width: float) -> float:
    """Return the isometric force of fully activated fibers of a normalized length.

    It is exp(-(l - 1)^2 / width).

    Args:
        length: normalized fiber length l.
        width: KshapeActive.
    """
    return exp(-(length - 1.0) * (length - 1.0) / width)


def thelen_velocity(
    activation: float,
    active: float,
    velocity_force: float,
    damping: float,
    shape: float,
    eccentric_limit: float,
) -> float:
    """Return the fiber velocity over the maximum one; the curve continues linearly at its ends.

    Args:
        activation: activation.
        active: isometric force, fully activated.
        velocity_force: force f that depends on the velocity.
        damping: constant c that is added to the denominator.
        shape: property Af of the muscle.
        eccentric_limit: property Flen: largest force of lengthening fibers over the isometric one.
    """
    # Without activation the isometric force would be 0 and the curve degenerate.
    isometric = max(activation, 1e-6) * active
    small_force = 1e-6
    if velocity_force < isometric:
        if velocity_force >= 0.0:
            return thelen_shortening(velocity_force, isometric, damping, shape)
        # Continue below zero force with the slope of a secant over `small_force` at the end, as OpenSim
        # does.
        at_end = thelen_shortening(0.0, isometric, damping, shape)
        return at_end + velocity_force / (
            small_force / (thelen_shortening(small_force, isometric, damping, shape) - at_end)
        )
    # The hyperbola has its asymptote at `eccentric_limit`; beyond 95 % of it the curve continues as a line.
    end = 0.95 * isometric * eccentric_limit
    if velocity_force < end:
        return thelen_lengthening(velocity_force, isometric, damping, shape, eccentric_limit)
    next_force = (0.95 + small_force) * isometric * eccentric_limit
    at_end = thelen_lengthening(end, isometric, damping, shape, eccentric_limit)
    slope = (
        thelen_lengthening(next_force, isometric, damping, shape, eccentric_limit) - at_end
    ) / (next_force - end)
    return at_end + slope * (velocity_force - end)


def thelen_shortening(
    velocity_force: float, isometric: float, damping: float, shape: float
) -> float:
    """Return the fiber velocity (f - i) / (i + f / Af + c) below the isometric force i.

    See `thelen_velocity`.

    Args:
        velocity_force: force f that depends on the velocity.
        isometric: isometric force at the present activation.
        damping: constant c that is added to the denominator.
        shape: property Af of the muscle.
    """
    return (velocity_force - isometric) / (isometric + velocity_force / shape + damping)


def thelen_lengthening(
    velocity_force: float, isometric: float, damping: float, shape: float, eccentric_limit: float
) -> float:
    """Return the fiber velocity above the isometric force i, see `thelen_velocity`.

    It is (f - i) / ((2 + 2 / Af) (i Flen - f) / (Flen - 1) + c), where c is the damping.

    Args:
        velocity_force: force f that depends on the velocity.
        isometric: isometric force at the present activation.
        damping: constant c that is added to the denominator.
        shape: property Af of the muscle.
        eccentric_limit: property Flen: largest force of lengthening fibers over the isometric one.
    """
    return (velocity_force - isometric) / (
        (2.0 + 2.0 / shape)
        * (isometric * eccentric_limit - velocity_force)
        / (eccentric_limit - 1.0)
        + damping
    )


def make_guess(path_length: float, length: float, m: OldMuscle) -> Guess:
    """Return a guess with a fiber length that leaves the tendon at least as long as slack.

    Args:
        path_length: length of the path (m).
        length: fiber length to try (m).
        m: parameters of the muscle.

    Returns:
        Guess. Where the tendon would be shorter than slack, the fibers span what remains of the
        path.
    """
    cos = cos_pennation_of_fibers(length, m.height)
    tendon = path_length - length * cos
    if not tendon >= m.slack:
        length_along = path_length - m.slack
        tendon = m.slack
        cos = max(
            length_along / sqrt(length_along * length_along + m.height * m.height),
            RIGHT_ANGLE_COSINE,
        )
        length = max(length_along / cos, m.height)
    return Guess(length, cos, tendon / m.slack - 1.0)


def next_length(
    guess: Guess,
    previous_length: float,
    error: float,
    error_before: float,
    fibers: float,
    fully_active: float,
    tendon: float,
    m: OldMuscle,
) -> float:
    """Return the fiber length that the search tries next (m).

    It is interpolated between two lengths if one of them is too short and the other too long; else
    it follows from the stiffness of fibers and tendon, estimated as their forces over their
    lengths, with a step of at most half an optimal fiber length.

    Args:
        guess: last guess.
        previous_length: fiber length of the previous guess (m).
        error: tendon force less fiber force (N).
        error_before: the same for the previous guess (N).
        fibers: normalized fiber force at the present activation.
        fully_active: normalized fiber force at full activation.
        tendon: normalized tendon force.
        m: parameters of the muscle.
    """
    # A change of sign brackets the equilibrium: regula falsi. Without it, take a damped Newton
    # step.
    if (error >= 0.0) != (error_before >= 0.0):
        return guess.length + abs(error) / (abs(error) + abs(error_before)) * (
            previous_length - guess.length
        )
    # A slack tendon has no stiffness; its modulus over its strength bounds the estimate from below.
    of_tendon = max(tendon, fibers * TENDON_MODULUS / TENDON_STRENGTH) * m.strength / m.slack
    step = min(
        abs(error / (m.strength / m.optimal * fully_active / guess.cos + of_tendon)),
        0.5 * m.optimal,
    )
    return guess.length + step if error > 0.0 else guess.length - step
