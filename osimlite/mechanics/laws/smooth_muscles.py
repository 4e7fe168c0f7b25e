"""Muscles with curves that are smooth everywhere, for direct collocation.

Forces are normalized by the maximum isometric force, fiber lengths by the optimal fiber length,
fiber velocities by the maximum contraction velocity times that length, tendon lengths by the tendon
slack length.

Sources: F. De Groote, A. L. Kinney, A. V. Rao and B. J. Fregly, Annals of Biomedical Engineering 44
(2016) 2922-2936; A. J. Meyer et al., Frontiers in Bioengineering and Biotechnology 4 (2016) 77;
with OpenSim's constants for their curves.
"""

from __future__ import annotations

from math import atan, copysign, exp, inf, log, nan, sinh, sqrt, tanh
from typing import NamedTuple

from osimlite.mechanics.laws.muscles import MuscleInputs

SHORTEST = 0.2
"""Normalized fiber length at which De Groote's passive force is 0."""
PASSIVE_SHAPE = 4.0
"""Exponent of De Groote's passive force at full strain."""
BELOW = 0.2
"""Offset of the exponential of the tendon force below 0."""
LARGEST_FORCE = 5.0
"""Upper end of the initial interval of tendon forces in the search for an equilibrium."""
CLOSE = 1e-10
"""Length of the interval at which the search ends."""
ROUNDS = 100
"""Largest number of bisections."""


class SmoothMuscle(NamedTuple):
    """Parameters that both muscles have."""

    strength: float  # max_isometric_force, N
    optimal: float  # optimal_fiber_length, m
    slack: float  # tendon_slack_length, m
    fastest: float  # max_contraction_velocity, 1/s
    scale: float  # active_force_width_scale
    damping: float  # fiber_damping
    height: float  # of the fibers, optimal sin(pennation_angle_at_optimal), m
    passive: float  # whether passive fibers bear a force
    follows: float  # whether activation is a state of its own, and not the excitation
    rising: float  # activation_time_constant, s
    falling: float  # deactivation_time_constant, s
    sharpness: float  # activation_dynamics_smoothing


class SmoothTendon(NamedTuple):
    """Further parameters of De Groote's muscle."""

    passive_strain: float  # passive_fiber_strain_at_one_norm_force
    # exponent k of the tendon force 0.2 (exp(k (l - 1)) - 1) at a length l, see `tendon_growth`
    growth: float
    elastic: float  # whether the tendon is
    # whether its force follows from the equilibrium with the fibers; if not, a solver
    # prescribes its rate
    explicit: float


def smooth_activation_rate(
    excitation: float, activation: float, rising: float, falling: float, sharpness: float
) -> float:
    """Return the rate of activation ((1/2 + f) / (rising z) + (1/2 - f) z / falling) (e - a) (1/s).

    Here z = 1/2 + 3 a / 2, and f = tanh(sharpness (e - a)) / 2 blends from falling to rising.

    Args:
        excitation: excitation e.
        activation: activation a.
        rising: activation time constant (s).
        falling: deactivation time constant (s).
        sharpness: steepness of the transition.
    """
    lacking = excitation - activation
    z, f = 0.5 + 1.5 * activation, 0.5 * tanh(sharpness * lacking)
    return ((0.5 + f) / (rising * z) + (0.5 - f) * z / falling) * lacking


def skewed_gaussian(x: float, height: float, middle: float, width: float, growth: float) -> float:
    """Return height exp(-d^2 / 2) with d = (x - middle) / (width + growth x), a skewed Gaussian."""
    distance = (x - middle) / (width + growth * x)
    return height * exp(-0.5 * distance * distance)


def degroote_active(length: float, scale: float) -> float:
    """Return De Groote's isometric force of fully active fibers, at a normalized length.

    Args:
        length: normalized fiber length.
        scale: factor of the width of the curve.
    """
    x = (length - 1.0) / scale + 1.0
    return (
        skewed_gaussian(
            x, 0.8150671134243542, 1.055033428970575, 0.162384573599574, 0.063303448465465
        )
        + skewed_gaussian(
            x, 0.433004984392647, 0.716775413397760, -0.029947116970696, 0.200356847296188
        )
        + skewed_gaussian(x, 0.1, 1.0, 0.353553390593274, 0.0)
    )


def degroote_passive(length: float, strain: float) -> tuple[float, float]:
    """Return the passive force of fibers of a normalized length, and its integral over the length.

    Args:
        length: normalized fiber length.
        strain: strain at a force of 1.

    Returns:
        Force and integral.
    """
    none = exp(PASSIVE_SHAPE * (SHORTEST - 1.0) / strain)
    rise, full = exp(PASSIVE_SHAPE * (length - 1.0) / strain) - none, exp(PASSIVE_SHAPE) - none
    return rise / full, (strain / PASSIVE_SHAPE * rise - none * (length - SHORTEST)) / full


def degroote_factor(velocity: float) -> float:
    """Return the factor of the active force at a normalized velocity."""
    x = -8.149 * velocity - 0.374
    return -0.3211346127989808 * log(x + sqrt(x * x + 1.0)) + 0.8825327733249912


def degroote_velocity(factor: float) -> float:
    """Return the normalized velocity at a factor of the active force, the inverse of `degroote_factor`."""
    x = (factor - 0.8825327733249912) / -0.3211346127989808
    # Python's sinh raises an error on overflow.
    return ((copysign(inf, x) if abs(x) > 710.0 else sinh(x)) + 0.374) / -8.149


def tendon_growth(strain: float) -> float:
    """Return the exponent of the tendon force from its strain at a force of 1."""
    return log((1.0 + BELOW) / BELOW) / strain


def smooth_tendon_length(force: float, growth: float) -> float:
    """Return the normalized tendon length at a force, NaN for forces of -0.2 or less."""
    return log((force + BELOW) / BELOW) / growth + 1.0 if force > -BELOW else nan


def degroote(
    now: MuscleInputs, m: SmoothMuscle, tendon: SmoothTendon
) -> tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float
]:
    """Compute forces and rates of OpenSim's DeGrooteFregly2016Muscle.

    As in OpenSim, the damping of the fibers is not contained in the rate of the tendon force: with an
    elastic tendon it changes only what is reported of the fibers.

    Returns:
        Tension (N), activation, fiber length (m), cosine of pennation, factors of the active force by
        length and by velocity, active and passive fiber force (N), rates of activation and of the
        normalized tendon force (1/s), fiber velocity (m/s), elastic part of the passive force (N),
        energy (J).
    """
    a = now.activation if m.follows else now.excitation
    force = now.normalized_tendon_force
    tendon_length = smooth_tendon_length(force, tendon.growth) if tendon.elastic else 1.0
    along = now.length - m.slack * tendon_length
    fiber_length = sqrt(along * along + m.height * m.height)
    cos = along / fiber_length
    active = degroote_active(fiber_length / m.optimal, m.scale)
    passive, energy = (
        degroote_passive(fiber_length / m.optimal, tendon.passive_strain)
        if m.passive
        else (0.0, 0.0)
    )
    energy *= m.strength * m.optimal
    fastest, force_rate = m.fastest * m.optimal, 0.0
    if tendon.elastic and tendon.explicit:
        factor = (force / cos - passive) / (a * active)
        velocity = degroote_velocity(factor)
        slope = tendon.growth * (force + BELOW)
        force_rate = (now.rate - velocity * fastest / cos) / m.slack * slope
    else:
        velocity = now.rate * cos / fastest
        factor = degroote_factor(velocity)
    active_force = m.strength * a * active * factor
    spring = m.strength * passive
    passive_force = m.strength * (passive + m.damping * velocity)
    tension = (active_force + passive_force) * cos
    if tendon.elastic:
        tension = m.strength * force
        energy += m.strength * m.slack * (force / tendon.growth - BELOW * (tendon_length - 1.0))
    activation_rate = smooth_activation_rate(now.excitation, a, m.rising, m.falling, m.sharpness)
    fibers = fiber_length, cos, active, factor, active_force, passive_force
    return tension, a, *fibers, activation_rate, force_rate, velocity * fastest, spring, energy


def degroote_rigid(now: MuscleInputs, m: SmoothMuscle, tendon: SmoothTendon) -> float:
    """Return the force of fully active fibers with a rigid tendon, along the fibers as in OpenSim (N)."""
    fiber_length, velocity = rigid_fibers(now, m)
    return m.strength * degroote_active(fiber_length, m.scale) * degroote_factor(velocity)


def rigid_fibers(now: MuscleInputs, m: SmoothMuscle) -> tuple[float, float]:
    """Return normalized length and velocity of the fibers with a rigid tendon.

    Returns:
        Length and velocity.
    """
    along = now.length - m.slack
    fiber_length = sqrt(along * along + m.height * m.height)
    return fiber_length / m.optimal, now.rate * (along / fiber_length) / (m.fastest * m.optimal)


def degroote_equilibrium(
    now: MuscleInputs, m: SmoothMuscle, tendon: SmoothTendon
) -> tuple[bool, float]:
    """Find the tendon force that the fibers bear while it is constant, by bisection from 0 to 5.

    The steps are those of OpenSim's solveBisection.

    Returns:
        Whether there is one, and the force.
    """
    low, high = 0.0, LARGEST_FORCE
    at_low = degroote_residual(low, now, m, tendon)
    result = at_low * degroote_residual(high, now, m, tendon) < 0.0
    middle = low
    for _ in range(ROUNDS):
        if high - low <= CLOSE:
            break
        middle = 0.5 * (low + high)
        residual = degroote_residual(middle, now, m, tendon)
        if residual * at_low < 0.0:
            high = middle
        else:
            low, at_low = middle, residual
    return result, middle


def degroote_residual(
    force: float, now: MuscleInputs, m: SmoothMuscle, tendon: SmoothTendon
) -> float:
    """Return the tendon force less the force of the fibers along it, for a constant tendon force."""
    still = SmoothTendon(tendon.passive_strain, tendon.growth, tendon.elastic, 0.0)
    pulled = MuscleInputs(now.length, now.rate, now.excitation, now.activation, 0.0, 0.0, force)
    result = degroote(pulled, m, still)
    return force - (result[6] + result[7]) / m.strength * result[3]


def meyer_active(length: float, scale: float) -> float:
    """Return Meyer's isometric force of fully active fibers, at a normalized length.

    Args:
        length: normalized fiber length.
        scale: factor of the width of the curve.
    """
    x = (length - 1.0) / scale + 1.0
    return (
        skewed_gaussian(
            x, 0.8174335195120225, 1.054348561163096, 0.16194288662761705, 0.06381565266097716
        )
        + skewed_gaussian(
            x, 0.43130780147182907, 0.7163004817144202, -0.029060905806803296, 0.19835014521987723
        )
        + skewed_gaussian(x, 0.1, 1.0, 0.353553390593274, 0.0)
    )


def meyer_passive(length: float) -> float:
    """Return Meyer's passive force of fibers of a normalized length."""
    x = 12.438535493526128 * (length - 1.329470475731338)
    return 0.232000797810576 * (log(exp(x) + 1.0) if x < 50.0 else x)


def meyer_factor(velocity: float) -> float:
    """Return Meyer's factor of the active force at a normalized velocity."""
    inner = atan(-0.27671677680513945 + 8.053304562566995 * velocity)
    return -32.51401019139919 + 22.160392466960214 * atan(
        18.7932134796918 + 6.320952269683997 * inner
    )


def meyer(
    now: MuscleInputs, m: SmoothMuscle
) -> tuple[float, float, float, float, float, float, float, float, float, float, float]:
    """Compute forces and rates of Meyer's muscle, whose tendon is rigid.

    OpenSim defines no energy for it.

    Returns:
        Tension (N), activation, fiber length (m), cosine of pennation, factors of the active force by
        length and by velocity, active and passive fiber force (N), rate of activation (1/s), fiber
        velocity (m/s), elastic part of the passive force (N).
    """
    a = now.activation if m.follows else now.excitation
    along = now.length - m.slack
    fiber_length = sqrt(along * along + m.height * m.height)
    cos = along / fiber_length
    active = meyer_active(fiber_length / m.optimal, m.scale)
    passive = meyer_passive(fiber_length / m.optimal) if m.passive else 0.0
    velocity = now.rate * cos / (m.fastest * m.optimal)
    factor = meyer_factor(velocity)
    active_force = m.strength * a * active * factor
    passive_force = m.strength * (passive + m.damping * velocity)
    tension = (active_force + passive_force) * cos
    activation_rate = smooth_activation_rate(now.excitation, a, m.rising, m.falling, m.sharpness)
    fibers = fiber_length, cos, active, factor, active_force, passive_force
    return tension, a, *fibers, activation_rate, now.rate * cos, m.strength * passive


def meyer_rigid(now: MuscleInputs, m: SmoothMuscle) -> float:
    """Return the force of fully active fibers with a rigid tendon, along the fibers as in OpenSim (N)."""
    fiber_length, velocity = rigid_fibers(now, m)
    return m.strength * meyer_active(fiber_length, m.scale) * meyer_factor(velocity)
