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

ZERO_FORCE_LENGTH = 0.2
"""Normalized fiber length at which De Groote's passive force is 0."""
PASSIVE_SHAPE = 4.0
"""Exponent of De Groote's passive force at full strain."""
TENDON_FORCE_OFFSET = 0.2
"""Offset of the exponential of the tendon force below 0."""
LARGEST_FORCE = 5.0
"""Upper end of the initial interval of tendon forces in the search for an equilibrium."""
INTERVAL_TOLERANCE = 1e-10
"""Length of the interval at which the search ends."""
MAX_BISECTIONS = 100
"""Largest number of bisections."""


class SmoothMuscle(NamedTuple):
    """Parameters that both muscles have."""

    strength: float  # max_isometric_force, N
    optimal: float  # optimal_fiber_length, m
    slack: float  # tendon_slack_length, m
    fastest: float  # max_contraction_velocity, 1/s
    scale: float  # active_force_width_scale
    damping: float  # fiber_damping
    height: float  # height of the fibers: optimal sin(pennation_angle_at_optimal), m
    passive: float  # 1 if passive fibers bear a force, else 0
    follows: float  # 1 if activation is a state, 0 if it equals the excitation
    rising: float  # activation_time_constant, s
    falling: float  # deactivation_time_constant, s
    sharpness: float  # activation_dynamics_smoothing


class SmoothTendon(NamedTuple):
    """Further parameters of De Groote's muscle.

    The tendon force at a normalized length l is 0.2 (exp(k (l - 1)) - 1), where `growth` is k. If
    it is not `explicit`, a solver prescribes the rate of the tendon force, which otherwise follows
    from the equilibrium with the fibers.
    """

    passive_strain: float  # passive_fiber_strain_at_one_norm_force
    growth: float  # exponent k, see `tendon_growth`
    elastic: float  # 1 for an elastic tendon, 0 for a rigid one
    explicit: float  # 1 if equilibrium determines the rate of the tendon force, else 0


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
    # Unlike Thelen's rate this one is smooth at e = a, which collocation needs.
    lacking = excitation - activation
    z = 0.5 + 1.5 * activation
    f = 0.5 * tanh(sharpness * lacking)
    return ((0.5 + f) / (rising * z) + (0.5 - f) * z / falling) * lacking


def skewed_gaussian(x: float, height: float, middle: float, width: float, growth: float) -> float:
    """Return a skewed Gaussian: height exp(-d^2 / 2) with d = (x - middle) / (width + growth x).

    Args:
        x: argument, a normalized fiber length.
        height: value at the middle.
        middle: argument of the maximum.
        width: constant part of the standard deviation.
        growth: part of the standard deviation that is proportional to x.
    """
    distance = (x - middle) / (width + growth * x)
    return height * exp(-0.5 * distance * distance)


def degroote_active(length: float, scale: float) -> float:
    """Return De Groote's isometric force of fully active fibers, at a normalized length.

    Args:
        length: normalized fiber length.
        scale: factor of the width of the curve.
    """
    # OpenSim scales the curve about the optimal length. The sum of three Gaussians is 1 there.
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

    With k = 4 and the strain e at a force of 1, the force is (exp(k (l - 1) / e) - exp(k (l0 - 1) /
    e)) / (exp(k) - exp(k (l0 - 1) / e)), which vanishes at l0 = 0.2, the shortest length of
    OpenSim.

    Args:
        length: normalized fiber length.
        strain: strain at a force of 1.

    Returns:
        Normalized force, and its integral over the normalized length.
    """
    # Without this offset the force of short fibers would stay positive.
    none = exp(PASSIVE_SHAPE * (ZERO_FORCE_LENGTH - 1.0) / strain)
    rise = exp(PASSIVE_SHAPE * (length - 1.0) / strain) - none
    full = exp(PASSIVE_SHAPE) - none
    return rise / full, (strain / PASSIVE_SHAPE * rise - none * (length - ZERO_FORCE_LENGTH)) / full


def degroote_factor(velocity: float) -> float:
    """Return De Groote's factor of the active force at a normalized velocity v.

    It is d1 log(d2 v + d3 + sqrt((d2 v + d3)^2 + 1)) + d4 with OpenSim's constants: d1 = -0.321, d2
    = -8.149, d3 = -0.374 and d4 = 0.8825, rounded.
    """
    x = -8.149 * velocity - 0.374
    return -0.3211346127989808 * log(x + sqrt(x * x + 1.0)) + 0.8825327733249912


def degroote_velocity(factor: float) -> float:
    """Return the normalized velocity at a factor of the active force, the inverse of `degroote_factor`."""
    x = (factor - 0.8825327733249912) / -0.3211346127989808
    # Python's sinh raises an error on overflow.
    return ((copysign(inf, x) if abs(x) > 710.0 else sinh(x)) + 0.374) / -8.149


def tendon_growth(strain: float) -> float:
    """Return the exponent k of the tendon force: 0.2 (exp(k e) - 1) is 1 at the strain e."""
    return log((1.0 + TENDON_FORCE_OFFSET) / TENDON_FORCE_OFFSET) / strain


def smooth_tendon_length(force: float, growth: float) -> float:
    """Return the normalized tendon length at a force, NaN for forces of -0.2 or less.

    Args:
        force: normalized tendon force.
        growth: exponent of the tendon force.
    """
    return (
        log((force + TENDON_FORCE_OFFSET) / TENDON_FORCE_OFFSET) / growth + 1.0
        if force > -TENDON_FORCE_OFFSET
        else nan
    )


def degroote(
    inputs: MuscleInputs, m: SmoothMuscle, tendon: SmoothTendon
) -> tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float
]:
    """Compute forces and rates of OpenSim's DeGrooteFregly2016Muscle.

    The state is the normalized tendon force f. The tendon length follows from its curve, the fiber
    length from the constant height h of the fibers: l^2 = (path - tendon)^2 + h^2. The velocity v
    follows from the equilibrium f = (a fl(l) fv(v) + fp(l)) cos(phi), and df/dt = k (f + 0.2) times
    the normalized lengthening speed of the tendon.

    As in OpenSim, the damping of the fibers is not contained in the rate of the tendon force: with an
    elastic tendon it changes only the reported forces of the fibers.

    Args:
        inputs: inputs of the muscle.
        m: parameters of the muscle.
        tendon: parameters of the tendon.

    Returns:
        Tension (N), activation, fiber length (m), cosine of pennation, factors of the active force by
        length and by velocity, active and passive fiber force (N), rates of activation and of the
        normalized tendon force (1/s), fiber velocity (m/s), elastic part of the passive force (N),
        energy (J).
    """
    a = inputs.activation if m.follows else inputs.excitation
    force = inputs.normalized_tendon_force
    # The tendon force is the state, so its curve is inverted instead of the equilibrium solved.
    tendon_length = smooth_tendon_length(force, tendon.growth) if tendon.elastic else 1.0
    length_along = inputs.length - m.slack * tendon_length
    fiber_length = sqrt(length_along * length_along + m.height * m.height)
    cos = length_along / fiber_length
    active = degroote_active(fiber_length / m.optimal, m.scale)
    passive, energy = (
        degroote_passive(fiber_length / m.optimal, tendon.passive_strain)
        if m.passive
        else (0.0, 0.0)
    )
    energy *= m.strength * m.optimal
    fastest = m.fastest * m.optimal
    force_rate = 0.0
    if tendon.elastic and tendon.explicit:
        # Equilibrium along the tendon gives the factor; the inverse force-velocity curve gives the
        # velocity.
        factor = (force / cos - passive) / (a * active)
        velocity = degroote_velocity(factor)
        # Derivative of the tendon force by the normalized tendon length.
        slope = tendon.growth * (force + TENDON_FORCE_OFFSET)
        force_rate = (inputs.rate - velocity * fastest / cos) / m.slack * slope
    else:
        # With a rigid tendon, or a tendon force that is constant here, fibers take the rate of the
        # path.
        velocity = inputs.rate * cos / fastest
        factor = degroote_factor(velocity)
    active_force = m.strength * a * active * factor
    spring = m.strength * passive
    passive_force = m.strength * (passive + m.damping * velocity)
    tension = (active_force + passive_force) * cos
    if tendon.elastic:
        tension = m.strength * force
        # Integral of the tendon force over the stretch of the tendon.
        energy += (
            m.strength
            * m.slack
            * (force / tendon.growth - TENDON_FORCE_OFFSET * (tendon_length - 1.0))
        )
    activation_rate = smooth_activation_rate(inputs.excitation, a, m.rising, m.falling, m.sharpness)
    fibers = fiber_length, cos, active, factor, active_force, passive_force
    return tension, a, *fibers, activation_rate, force_rate, velocity * fastest, spring, energy


def degroote_rigid(inputs: MuscleInputs, m: SmoothMuscle, tendon: SmoothTendon) -> float:
    """Return the force of fully active fibers with a rigid tendon, along the fibers (N).

    As in OpenSim it is not projected onto the tendon.

    Args:
        inputs: inputs of the muscle.
        m: parameters of the muscle.
        tendon: parameters of the tendon, without effect.
    """
    fiber_length, velocity = rigid_fibers(inputs, m)
    return m.strength * degroote_active(fiber_length, m.scale) * degroote_factor(velocity)


def rigid_fibers(inputs: MuscleInputs, m: SmoothMuscle) -> tuple[float, float]:
    """Return normalized length and velocity of the fibers with a rigid tendon.

    Args:
        inputs: inputs of the muscle.
        m: parameters of the muscle.

    Returns:
        Length and velocity.
    """
    length_along = inputs.length - m.slack
    fiber_length = sqrt(length_along * length_along + m.height * m.height)
    return fiber_length / m.optimal, inputs.rate * (length_along / fiber_length) / (
        m.fastest * m.optimal
    )


def degroote_equilibrium(
    inputs: MuscleInputs, m: SmoothMuscle, tendon: SmoothTendon
) -> tuple[bool, float]:
    """Find the tendon force that the fibers bear while it is constant, by bisection from 0 to 5.

    The steps are those of OpenSim's solveBisection.

    Args:
        inputs: inputs of the muscle; the tendon force is not used.
        m: parameters of the muscle.
        tendon: parameters of the tendon.

    Returns:
        Whether there is such a force, and the normalized tendon force.
    """
    low, high = 0.0, LARGEST_FORCE
    at_low = degroote_residual(low, inputs, m, tendon)
    # OpenSim requires a change of sign between both ends. The search runs in any case.
    result = at_low * degroote_residual(high, inputs, m, tendon) < 0.0
    middle = low
    for _ in range(MAX_BISECTIONS):
        if high - low <= INTERVAL_TOLERANCE:
            break
        middle = 0.5 * (low + high)
        residual = degroote_residual(middle, inputs, m, tendon)
        if residual * at_low < 0.0:
            high = middle
        else:
            low, at_low = middle, residual
    return result, middle


def degroote_residual(
    force: float, inputs: MuscleInputs, m: SmoothMuscle, tendon: SmoothTendon
) -> float:
    """Return the tendon force less the force of the fibers along it, for a constant tendon force.

    Args:
        force: normalized tendon force.
        inputs: inputs of the muscle.
        m: parameters of the muscle.
        tendon: parameters of the tendon.
    """
    # A constant tendon force: the velocity of the fibers is that of the path, not that of the
    # equilibrium.
    constant_tendon = SmoothTendon(tendon.passive_strain, tendon.growth, tendon.elastic, 0.0)
    pulled = MuscleInputs(
        inputs.length, inputs.rate, inputs.excitation, inputs.activation, 0.0, 0.0, force
    )
    result = degroote(pulled, m, constant_tendon)
    # Fields 3, 6 and 7 of the result are the cosine of pennation and the active and passive fiber
    # force.
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
    """Return Meyer's passive force of fibers of a normalized length l.

    It is e1 log(exp(e2 (l - e3)) + 1) with OpenSim's constants, a smooth ramp.
    """
    x = 12.438535493526128 * (length - 1.329470475731338)
    # Beyond 50 the logarithm equals its argument in double precision, and exp would overflow later.
    return 0.232000797810576 * (log(exp(x) + 1.0) if x < 50.0 else x)


def meyer_factor(velocity: float) -> float:
    """Return Meyer's factor of the active force at a normalized velocity v.

    It is d1 + d2 atan(d3 + d4 atan(d5 + d6 v)) with OpenSim's constants.
    """
    inner = atan(-0.27671677680513945 + 8.053304562566995 * velocity)
    return -32.51401019139919 + 22.160392466960214 * atan(
        18.7932134796918 + 6.320952269683997 * inner
    )


def meyer(
    inputs: MuscleInputs, m: SmoothMuscle
) -> tuple[float, float, float, float, float, float, float, float, float, float, float]:
    """Compute forces and rates of Meyer's muscle, whose tendon is rigid.

    The tension is F (a fl(l) fv(v) + fp(l) + beta v) cos(phi), where beta is the damping.

    OpenSim defines no energy for it.

    Args:
        inputs: inputs of the muscle.
        m: parameters of the muscle.

    Returns:
        Tension (N), activation, fiber length (m), cosine of pennation, factors of the active force by
        length and by velocity, active and passive fiber force (N), rate of activation (1/s), fiber
        velocity (m/s), elastic part of the passive force (N).
    """
    a = inputs.activation if m.follows else inputs.excitation
    # The tendon is rigid: its length is always the slack length.
    length_along = inputs.length - m.slack
    fiber_length = sqrt(length_along * length_along + m.height * m.height)
    cos = length_along / fiber_length
    active = meyer_active(fiber_length / m.optimal, m.scale)
    passive = meyer_passive(fiber_length / m.optimal) if m.passive else 0.0
    velocity = inputs.rate * cos / (m.fastest * m.optimal)
    factor = meyer_factor(velocity)
    active_force = m.strength * a * active * factor
    passive_force = m.strength * (passive + m.damping * velocity)
    tension = (active_force + passive_force) * cos
    activation_rate = smooth_activation_rate(inputs.excitation, a, m.rising, m.falling, m.sharpness)
    fibers = fiber_length, cos, active, factor, active_force, passive_force
    return tension, a, *fibers, activation_rate, inputs.rate * cos, m.strength * passive


def meyer_rigid(inputs: MuscleInputs, m: SmoothMuscle) -> float:
    """Return the force of fully active fibers with a rigid tendon, along the fibers (N).

    As in OpenSim it is not projected onto the tendon.

    Args:
        inputs: inputs of the muscle.
        m: parameters of the muscle.
    """
    fiber_length, velocity = rigid_fibers(inputs, m)
    return m.strength * meyer_active(fiber_length, m.scale) * meyer_factor(velocity)
