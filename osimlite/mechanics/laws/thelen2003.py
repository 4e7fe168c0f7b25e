"""Thelen's muscle, as in OpenSim's Thelen2003Muscle.

Source: D. G. Thelen, Journal of Biomechanical Engineering 125, 2003. Forces are normalized by the
maximum isometric force F, fiber lengths by the optimal fiber length, fiber velocities by the
maximum contraction velocity times that length, tendon lengths by the tendon slack length.

The fiber velocity follows from the equilibrium (fa + fp(l)) cos(phi) = ft, where fa = a fl(l) fv(v)
is the active force of fibers with activation a, fp the passive force, ft the tendon force and phi
the pennation angle.
"""

from __future__ import annotations

from math import exp, isnan, nan, sqrt
from typing import NamedTuple

from osimlite.mechanics.laws.muscles import (
    SIGNIFICANT,
    MuscleInputs,
    cos_pennation,
    fiber_length_along,
    first_order_activation_rate,
)

TOE_SHAPE = 3.0
"""Exponent of the tendon force at the end of its toe region."""
TOE_FORCE = 0.33
"""Tendon force at the end of its toe region."""
MAX_NEWTON_STEPS = 20
"""Largest number of Newton steps in the search for an equilibrium."""
INVERSE_ROUNDS = 100
"""Largest number of Newton steps in the search for a force at a velocity."""
VELOCITY_TOLERANCE = 1e-6
"""Tolerance of the normalized velocity with a rigid tendon, as in OpenSim."""
MIN_STEP = 2.0**-26
"""Smallest part of a step, and the step (m) in the opposite direction if that fails."""


class Thelen2003(NamedTuple):
    """Parameters of a Thelen2003Muscle."""

    strength: float  # max_isometric_force F, N
    optimal: float  # optimal_fiber_length, m
    slack: float  # tendon_slack_length, m
    fastest: float  # max_contraction_velocity, 1/s
    rising: float  # activation_time_constant, s
    falling: float  # deactivation_time_constant, s
    least: float  # minimum_activation
    width: float  # KshapeActive
    shape: float  # Af
    most: float  # Flen
    bound: float  # fv_linear_extrap_threshold
    height: float  # constant height of the fibers, see `pennation_constants`, m
    shortest: float  # smallest fiber length by the largest pennation angle, m
    largest_sin: float  # sine of the largest pennation angle
    least_cos: float  # cosine of the largest pennation angle
    toe: float  # strain at the end of the toe region, see `tendon_shape`
    growth: float  # exponent of the toe region over strain
    factor: float  # factor of the toe region
    slope: float  # slope of the linear region
    passive_growth: float  # KshapePassive / FmaxMuscleStrain
    passive_factor: float  # 1 / (exp(KshapePassive) - 1)


class ThelenFibers(NamedTuple):
    """Fibers of a given length in a muscle: forces of fibers and tendon, and their slopes."""

    length: float  # m
    cos: float  # cosine of the pennation angle
    is_taut: bool  # whether the tendon is longer than slack
    tendon: float  # normalized tendon force
    tendon_slope: float  # derivative of it by the tendon strain
    active: float  # normalized active force at full activation and zero velocity
    active_slope: float  # derivative of it by the normalized fiber length
    passive: float  # normalized passive force
    passive_slope: float  # derivative of it by the normalized fiber length


def fibers_at(m: Thelen2003, path_length: float, length: float) -> ThelenFibers:
    """Return the forces of fibers and tendon and their slopes for a path length and a fiber length.

    Args:
        m: parameters of the muscle.
        path_length: length of the path (m).
        length: fiber length (m).
    """
    cos = cos_pennation(length, m.height, m.shortest, m.largest_sin, m.least_cos)
    tendon_length = path_length - length * cos
    tendon, tendon_slope = tendon_force(
        tendon_length / m.slack - 1.0, m.toe, m.growth, m.factor, m.slope
    )
    active, active_slope = active_force(length / m.optimal, m.width)
    passive, passive_slope = passive_force(length / m.optimal, m.passive_growth, m.passive_factor)
    is_taut = tendon_length > m.slack
    return ThelenFibers(
        length, cos, is_taut, tendon, tendon_slope, active, active_slope, passive, passive_slope
    )


def tendon_shape(strain_at_one: float) -> tuple[float, float, float, float]:
    """Return the constants of the tendon force over strain: an exponential toe and a line.

    Args:
        strain_at_one: strain at the maximum isometric force.

    Returns:
        Strain at the end of the toe, exponent over strain and factor of the toe, slope of the line.
    """
    # Closed form of the conditions that force and slope are continuous at the end of the toe, and
    # the force is 1 at `strain_at_one`; 99/166 and 67/166 are OpenSim's fractions for a toe force
    # of 0.33.
    end = 99.0 * strain_at_one * exp(TOE_SHAPE) / (166.0 * exp(TOE_SHAPE) - 67.0)
    return end, TOE_SHAPE / end, TOE_FORCE / (exp(TOE_SHAPE) - 1.0), 0.67 / (strain_at_one - end)


def tendon_force(
    strain: float, toe: float, growth: float, factor: float, slope: float
) -> tuple[float, float]:
    """Return the tendon force and its derivative by strain.

    It is 0 for e <= 0, factor (exp(growth e) - 1) up to the strain `toe`, and 0.33 + slope (e - toe)
    beyond.

    Args:
        strain: strain e of the tendon.
        toe: strain at the end of the toe region, from `tendon_shape` as all that follow.
        growth: exponent of the toe region.
        factor: factor of the toe region.
        slope: slope of the linear region.

    Returns:
        Force and derivative.
    """
    if strain > toe:
        return slope * (strain - toe) + TOE_FORCE, slope
    if strain > 0.0:
        grown = exp(growth * strain)
        return factor * (grown - 1.0), factor * growth * grown
    return 0.0, 0.0


def tendon_energy(strain: float, toe: float, growth: float, factor: float, slope: float) -> float:
    """Return the integral of the tendon force over its strain.

    Args:
        strain: strain of the tendon.
        toe: strain at the end of the toe region, from `tendon_shape` as all that follow.
        growth: exponent of the toe region.
        factor: factor of the toe region.
        slope: slope of the linear region.
    """
    # Split at the end of the toe, so that each part is integrated in its own form.
    toe_strain = min(max(strain, 0.0), toe)
    straight = max(strain - toe, 0.0)
    return factor * ((exp(growth * toe_strain) - 1.0) / growth - toe_strain) + straight * (
        TOE_FORCE + 0.5 * slope * straight
    )


def passive_energy(length: float, growth: float, factor: float) -> float:
    """Return the integral of the passive force over the normalized fiber length.

    Args:
        length: normalized fiber length.
        growth: KshapePassive / FmaxMuscleStrain.
        factor: 1 / (exp(KshapePassive) - 1).
    """
    strain = max(length - 1.0, 0.0)
    return factor * ((exp(growth * strain) - 1.0) / growth - strain)


def passive_force(length: float, growth: float, factor: float) -> tuple[float, float]:
    """Return the passive force of fibers of a normalized length, and its derivative.

    It is factor (exp(growth (l - 1)) - 1) for l > 1, else 0.

    Args:
        length: normalized fiber length l.
        growth: KshapePassive / FmaxMuscleStrain.
        factor: 1 / (exp(KshapePassive) - 1).

    Returns:
        Force and derivative.
    """
    if length <= 1.0:
        return 0.0, 0.0
    grown = exp(growth * (length - 1.0))
    return factor * (grown - 1.0), factor * growth * grown


def active_force(length: float, width: float) -> tuple[float, float]:
    """Return the isometric force of fully active fibers, and its derivative.

    The force is exp(-(l - 1)^2 / width).

    Args:
        length: normalized fiber length l.
        width: KshapeActive.

    Returns:
        Force and derivative.
    """
    strain = length - 1.0
    force = exp(-strain * strain / width)
    return force, -2.0 * strain / width * force


def fiber_velocity(
    m: Thelen2003, force: float, activation: float, isometric: float
) -> tuple[float, float]:
    """Return the normalized velocity of fibers that actively bear a force, and its derivative.

    With force f, isometric force i and activation a it is (1/4 + 3 a / 4) (f - i) / b, where b = i
    + f / Af for shortening and (2 + 2 / Af) (i Flen - f) / (Flen - 1) for lengthening.

    The published curve is continued by straight lines for forces below 0, and near the asymptote of
    lengthening fibers.

    Args:
        m: parameters of the muscle.
        force: active force of the fibers over the maximum isometric force.
        activation: activation within its bounds.
        isometric: active force at this activation and fiber length and at rest, over the maximum
            isometric force.

    Returns:
        Velocity and derivative by the force.
    """
    # Evaluate the curve within its bounds; the line through that point continues it.
    bounded_force = 0.0 if force <= 0.0 else min(force, m.bound * (isometric * m.most))
    speed = 0.25 + 0.75 * activation
    if bounded_force <= isometric:
        divisor = isometric + bounded_force / m.shape
        change = 1.0 / m.shape
    else:
        steepness = (2.0 + 2.0 / m.shape) / (m.most - 1.0)
        divisor = steepness * (isometric * m.most - bounded_force)
        change = -steepness
    velocity = speed * (bounded_force - isometric) / divisor
    slope = (speed - velocity * change) / divisor
    return velocity + slope * (force - bounded_force), slope


def force_at_velocity(
    m: Thelen2003, velocity: float, activation: float, isometric: float, enough: float
) -> float:
    """Return the active force at a velocity over the isometric force: the inverse of `fiber_velocity`.

    Args:
        m: parameters of the muscle.
        velocity: normalized fiber velocity.
        activation: activation within its bounds.
        isometric: active force at this activation and fiber length and at rest, over the maximum
            isometric force.
        enough: tolerance of the velocity.

    Returns:
        The ratio, NaN if Newton's method does not converge.
    """
    # Newton's method starts at zero velocity.
    force = isometric
    for _ in range(INVERSE_ROUNDS):
        result, slope = fiber_velocity(m, force, activation, isometric)
        # A vanishing slope would send the next force to infinity.
        if abs(slope) > SIGNIFICANT:
            force -= (result - velocity) / slope
        if abs(result - velocity) < enough:
            # A negative force, on the line below the curve, counts as none.
            return max(0.0, force / isometric)
    return nan


def equilibrium_tolerance(m: Thelen2003) -> float:
    """Return the accepted residual of an equilibrium (N)."""
    # OpenSim's tolerance: 1e-8 F, but not below ten times SignificantReal.
    return max(1e-8 * m.strength, 10.0 * SIGNIFICANT)


def thelen2003(
    inputs: MuscleInputs, m: Thelen2003
) -> tuple[float, float, float, float, float, float, float, float, float, float]:
    """Compute forces and rates of a muscle.

    See OpenSim's calcFiberVelocityInfo and calcMuscleDynamicsInfo.

    Fibers at their smallest length stay there as long as they would shorten, and then bear no active
    force.

    Args:
        inputs: inputs of the muscle.
        m: parameters of the muscle.

    Returns:
        Tension (N), activation, fiber length (m), cosine of pennation, factors of the active force by
        length and by velocity, active and passive fiber force (N), rate of activation (1/s), fiber
        velocity (m/s).
    """
    active = min(max(inputs.activation, m.least), 1.0)
    fibers = fibers_at(m, inputs.length, max(inputs.fiber_length, m.shortest))
    # What the tendon bears and the passive force does not is the active force.
    isometric = active * fibers.active
    active_force = fibers.tendon / fibers.cos - fibers.passive
    velocity, _ = fiber_velocity(m, active_force, active, isometric)
    by_velocity = active_force / isometric
    # OpenSim holds fibers at their smallest length and sets their active force to 0 there.
    if inputs.fiber_length <= m.shortest and velocity <= 0.0:
        velocity, by_velocity, active_force = 0.0, 1.0, 0.0
    return (
        fibers.tendon * m.strength,
        active,
        fibers.length,
        fibers.cos,
        fibers.active,
        by_velocity,
        active_force * m.strength,
        fibers.passive * m.strength,
        first_order_activation_rate(
            inputs.excitation, inputs.activation, m.rising, m.falling, m.least
        ),
        velocity * m.fastest * m.optimal,
    )


def thelen2003_rigid(inputs: MuscleInputs, m: Thelen2003) -> float:
    """Return the force of fully active fibers along a rigid tendon (N).

    See OpenSim's calcInextensibleTendonActiveFiberForce.

    Args:
        inputs: inputs of the muscle.
        m: parameters of the muscle.
    """
    fiber = fiber_length_along(inputs.length - m.slack, m.height, m.shortest, m.least_cos)
    if not fiber > m.shortest:
        return 0.0
    cos = cos_pennation(fiber, m.height, m.shortest, m.largest_sin, m.least_cos)
    isometric, _ = active_force(fiber / m.optimal, m.width)
    factor = force_at_velocity(
        m, inputs.rate * cos / (m.optimal * m.fastest), 1.0, isometric, VELOCITY_TOLERANCE
    )
    return m.strength * isometric * factor * cos


def thelen2003_energy(m: Thelen2003, length: float, fiber_length: float, cos: float) -> float:
    """Return the potential energy of tendon and fibers (J).

    OpenSim evaluates the passive energy at the fiber length in m instead of the normalized one, so
    that fibers below 1 m store nothing. This function does the same.

    Args:
        m: parameters of the muscle.
        length: length of the path (m).
        fiber_length: fiber length (m).
        cos: cosine of pennation.
    """
    strain = (length - fiber_length * cos) / m.slack - 1.0
    tendon = m.slack * tendon_energy(strain, m.toe, m.growth, m.factor, m.slope)
    return m.strength * (
        tendon + m.optimal * passive_energy(fiber_length, m.passive_growth, m.passive_factor)
    )


def thelen2003_equilibrium(inputs: MuscleInputs, m: Thelen2003) -> tuple[bool, float]:
    """Find the fiber length at which fibers and tendon bear the same force.

    Newton's method with halved steps, step for step as in Thelen2003Muscle::initMuscleState: the rate
    of the path is distributed over fibers and tendon by their stiffness, so that a muscle whose path
    moves does not start at rest. A length below the smallest one is replaced by it.

    Args:
        inputs: inputs of the muscle.
        m: parameters of the muscle.

    Returns:
        Whether there is such a length, and the fiber length (m).
    """
    length = inputs.length
    active = min(max(inputs.activation, m.least), 1.0)
    # OpenSim starts with a tendon strained by 1 %.
    fibers = fibers_at(
        m, length, fiber_length_along(length - 1.01 * m.slack, m.height, m.shortest, m.least_cos)
    )
    stiffness, _ = force_stiffnesses(m, fibers, active, 0.0)
    by_velocity = find_velocity_factor(m, fibers, active, inputs.rate, stiffness)
    fiber_force, error = fiber_balance(m, fibers, active * by_velocity)
    stiffness, of_tendon = force_stiffnesses(m, fibers, active * by_velocity, fiber_force)
    for _ in range(MAX_NEWTON_STEPS):
        if not abs(error) > equilibrium_tolerance(m):
            break
        previous_error, previous_length, fraction = error, fibers.length, 1.0
        # Halve the step until the residual decreases.
        while abs(error) >= abs(previous_error):
            step = -fraction * previous_error / (stiffness - of_tendon)
            # A vanishing step cannot help; OpenSim then tries a tiny step the other way.
            if not abs(step) > SIGNIFICANT:
                step = -MIN_STEP if step > 0.0 else MIN_STEP if step < 0.0 else 0.0
                fraction = 0.0
            fibers = fibers_at(m, length, max(previous_length + step, m.shortest))
            fiber_force, error = fiber_balance(m, fibers, active * by_velocity)
            if fraction <= MIN_STEP:
                break
            fraction *= 0.5
        stiffness, of_tendon = force_stiffnesses(m, fibers, active * by_velocity, fiber_force)
        # Outside of the line search, as in OpenSim: the factor by velocity stays constant along a
        # step.
        by_velocity = find_velocity_factor(m, fibers, active, inputs.rate, stiffness)
    if isnan(by_velocity):
        return False, fibers.length
    # At the smallest length any residual is accepted, because the fibers cannot shorten further.
    return abs(error) < equilibrium_tolerance(m) or fibers.length <= m.shortest, fibers.length


def fiber_balance(m: Thelen2003, fibers: ThelenFibers, active: float) -> tuple[float, float]:
    """Return the force of the fibers, and its component along the tendon less the tendon force (N).

    Args:
        m: parameters of the muscle.
        fibers: fiber length and normalized forces, from `fibers_at`.
        active: product of activation and force-velocity factor.

    Returns:
        Force of the fibers and residual (N).
    """
    fiber_force = (active * fibers.active + fibers.passive) * m.strength
    return fiber_force, fiber_force * fibers.cos - fibers.tendon * m.strength


def force_stiffnesses(
    m: Thelen2003, fibers: ThelenFibers, active: float, fiber_force: float
) -> tuple[float, float]:
    """Return the derivatives of both forces along the tendon by the fiber length (N/m).

    Args:
        m: parameters of the muscle.
        fibers: fiber length and normalized forces, from `fibers_at`.
        active: product of activation and force-velocity factor.
        fiber_force: force of the fibers (N).

    Returns:
        Derivatives of the fiber force and of the tendon force along the tendon (N/m).
    """
    length = fibers.length
    # Fibers no longer than high have no pennation angle.
    if length <= m.height:
        return nan, nan
    sin = m.height / length
    cos = sqrt(1.0 - sin * sin)
    stiffness = (active * fibers.active_slope + fibers.passive_slope) * m.strength / m.optimal
    # d(l cos phi)/dl = cos(phi) + sin^2(phi) / cos(phi), because l sin(phi) is constant.
    of_tendon = fibers.tendon_slope * m.strength / m.slack * (-fibers.cos - sin * sin / cos)
    return stiffness * fibers.cos + fiber_force * sin * sin / (length * cos), of_tendon


def find_velocity_factor(
    m: Thelen2003, fibers: ThelenFibers, activation: float, rate: float, stiffness: float
) -> float:
    """Return the factor of the active force by velocity, if the stiffer part moves less.

    Fibers and tendon are springs in series: the tendon takes the part kf / (kf + kt) of the rate of
    the path, where k are stiffnesses along the tendon.

    Args:
        m: parameters of the muscle.
        fibers: fiber length and normalized forces, from `fibers_at`.
        activation: activation within its bounds.
        rate: lengthening speed of the path (m/s).
        stiffness: stiffness of the fibers, see `force_stiffnesses` (N/m).
    """
    if rate == 0.0:
        return 1.0
    # The products with cosines and the limit are those of OpenSim's initMuscleState.
    fiber_stiffness = stiffness * fibers.cos
    of_tendon = fibers.tendon_slope * m.strength / m.slack
    of_rate = rate
    if fibers.is_taut and abs(fiber_stiffness + of_tendon) > SIGNIFICANT:
        of_rate = fiber_stiffness / (fiber_stiffness + of_tendon) * rate
    velocity = (rate - of_rate) * fibers.cos / (m.fastest * m.optimal)
    return force_at_velocity(
        m, velocity, activation, activation * fibers.active, equilibrium_tolerance(m)
    )
