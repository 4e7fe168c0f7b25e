"""The muscle of M. Millard et al. (Journal of Biomechanical Engineering 135, 2013) without a mass between its parts.

As OpenSim's Millard2012EquilibriumMuscle has it: with or without damping of the fibers, with an elastic or a rigid
tendon, with or without dynamics of activation. Forces are parts of the maximum isometric force F, fiber lengths of the
optimal fiber length, fiber velocities of the maximum contraction velocity times that length, tendon lengths of the
tendon slack length. The curves are those of :mod:`osimlite.forces.muscle_curves`.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan, nan
from typing import NamedTuple

from osimlite.forces.bezier import curve_integral, curve_value
from osimlite.forces.muscles import SIGNIFICANT, cos_pennation, fiber_length_along, first_order_activation_rate

VELOCITY_ROUNDS, LENGTH_ROUNDS = 20, 200
"""Newton's steps in the search for a velocity, and for an equilibrium."""
SMALLEST = 2.0**-26
"""Least part of a step, and the step (m) in the other direction where there is none."""


class Millard2012Equilibrium(NamedTuple):
    """The numbers of a muscle.

    Attributes:
        strength: max_isometric_force F, N.
        optimal: optimal_fiber_length, m.
        slack: tendon_slack_length, m.
        fastest: max_contraction_velocity, 1/s.
        rising: activation_time_constant, s.
        falling: deactivation_time_constant, s.
        is_rigid: ignore_tendon_compliance, 1 or 0.
        is_excited: ignore_activation_dynamics, 1 or 0: the excitation is the activation.
        damping: of the fibers, over F; 0 if they have none.
        least: activation.
        height: as of `pennation`, with the three that follow.
        smallest: fiber length that the curves and pennation allow, m.
    """

    strength: float
    optimal: float
    slack: float
    fastest: float
    rising: float
    falling: float
    is_rigid: float
    is_excited: float
    damping: float
    least: float
    height: float
    shortest: float
    largest_sin: float
    least_cos: float
    smallest: float


def millard2012_equilibrium(
    length: float,
    rate: float,
    excitation: float,
    activation: float,
    fiber_length: float,
    m: Millard2012Equilibrium,
    active_curve: Sequence[float],
    velocity_curve: Sequence[float],
    inverse_curve: Sequence[float],
    passive_curve: Sequence[float],
    tendon_curve: Sequence[float],
) -> tuple[float, float, float, float, float, float, float, float, bool, float, float, float]:
    """The muscle at a moment; see calcFiberVelocityInfo and calcMuscleDynamicsInfo of OpenSim's class.

    Fibers at their least length stay there as long as they would shorten, and bear nothing then. A rigid tendon does
    not bear pressure: the damping of fast fibers is bounded instead.

    Args:
        length: of the path, m.
        rate: of it, m/s.
        excitation: the control.
        activation: state, if there are dynamics of activation.
        fiber_length: state (m), if the tendon is elastic.
        m: the muscle.
        active_curve: active force over fiber length.
        velocity_curve: factor of the active force over fiber velocity.
        inverse_curve: roughly the inverse of that.
        passive_curve: passive force over fiber length.
        tendon_curve: force over tendon length.

    Returns:
        Tension (N), activation, fiber length (m), cosine of pennation, factors of the active force by length and by
        velocity, active and passive fiber force (N), whether a fiber velocity was found, rate of activation (1/s),
        fiber velocity (m/s), what of the passive force is not by damping (N).
    """
    active = min(max(excitation if m.is_excited else activation, m.least), 1.0)
    fiber = fiber_length
    if m.is_rigid:
        fiber = fiber_length_along(length - m.slack, m.height, m.shortest, m.least_cos)
    fiber = max(fiber, m.smallest)
    cos = cos_pennation(fiber, m.height, m.shortest, m.largest_sin, m.least_cos)
    along_tendon = length - fiber * cos
    by_length, _ = curve_value(active_curve, fiber / m.optimal)
    elastic, _ = curve_value(passive_curve, fiber / m.optimal)
    is_found, velocity, by_velocity, tendon = cos > SIGNIFICANT, 0.0, 1.0, 0.0
    if m.is_rigid:
        if along_tendon >= m.slack - SIGNIFICANT:
            velocity = rate * cos / (m.optimal * m.fastest)
            by_velocity, _ = curve_value(velocity_curve, velocity)
    elif is_found:
        tendon, _ = curve_value(tendon_curve, along_tendon / m.slack)
        if m.damping > 0.0:
            is_found, velocity, by_velocity = damped_velocity(
                m, active, by_length, elastic, tendon, cos, velocity_curve, inverse_curve
            )
        else:
            by_velocity = (tendon / cos - elastic) / (active * by_length)
            velocity, _ = curve_value(inverse_curve, by_velocity)
    pull = m.strength * (active * by_length * by_velocity)
    spring = m.strength * elastic
    passive = spring + m.strength * m.damping * velocity
    if fiber <= m.smallest and velocity <= 0.0:
        velocity, by_velocity, pull, spring, passive = 0.0, 1.0, 0.0, 0.0, 0.0
    if m.is_rigid:
        passive = max(passive, -pull)
        tension = (pull + passive) * cos
    else:
        tension = tendon * m.strength
    change = first_order_activation_rate(excitation, activation, m.rising, m.falling, m.least)
    speed = velocity * m.fastest * m.optimal
    return tension, active, fiber, cos, by_length, by_velocity, pull, passive, is_found, change, speed, spring


def millard2012_rigid(
    length: float,
    rate: float,
    excitation: float,
    activation: float,
    fiber_length: float,
    m: Millard2012Equilibrium,
    active_curve: Sequence[float],
    velocity_curve: Sequence[float],
    inverse_curve: Sequence[float],
    passive_curve: Sequence[float],
    tendon_curve: Sequence[float],
) -> float:
    """Force (N) of fully active fibers along a rigid tendon; see calcInextensibleTendonActiveFiberForce of OpenSim.

    As there, the pennation that takes the force to the tendon is that of fibers as many meters long as they have
    optimal lengths: next to none.

    Args as of `millard2012_equilibrium`; the states do not count.
    """
    fiber = fiber_length_along(length - m.slack, m.height, m.shortest, m.least_cos)
    if fiber <= m.smallest:
        return 0.0
    cos = cos_pennation(fiber, m.height, m.shortest, m.largest_sin, m.least_cos)
    by_length, _ = curve_value(active_curve, fiber / m.optimal)
    by_velocity, _ = curve_value(velocity_curve, rate * cos / (m.optimal * m.fastest))
    taken = cos_pennation(fiber / m.optimal, m.height, m.shortest, m.largest_sin, m.least_cos)
    return m.strength * by_length * by_velocity * taken


def damped_velocity(
    m: Millard2012Equilibrium,
    active: float,
    by_length: float,
    elastic: float,
    tendon: float,
    cos: float,
    velocity_curve: Sequence[float],
    inverse_curve: Sequence[float],
) -> tuple[bool, float, float]:
    """The normalized fiber velocity at which damped fibers bear what the tendon does, by Newton's method.

    Args:
        m: the muscle.
        active: activation.
        by_length: active force at rest, fully activated.
        elastic: passive force.
        tendon: its force.
        cos: of pennation.
        velocity_curve: factor of the active force by velocity.
        inverse_curve: where to start from.

    Returns:
        Whether there is one, the velocity, and the factor of the active force there.
    """
    tolerance = max(1e-10 * m.strength, 100.0 * SIGNIFICANT)
    guess = (tendon / max(cos, 0.01) - elastic) / (max(active, 0.01) * max(by_length, 0.01))
    velocity, _ = curve_value(inverse_curve, guess)
    velocity, factor = min(max(velocity, -1.0), 1.0), 0.0
    for _ in range(VELOCITY_ROUNDS):
        factor, slope = curve_value(velocity_curve, velocity)
        passive = m.strength * elastic + m.strength * m.damping * velocity
        error = (m.strength * (active * by_length * factor) + passive) * cos - tendon * m.strength
        if abs(error) <= tolerance:
            return True, velocity, factor
        velocity -= error / (m.strength * (active * by_length * slope + m.damping) * cos)
    return False, velocity, factor


def millard2012_energy(
    m: Millard2012Equilibrium,
    length: float,
    fiber_length: float,
    cos: float,
    passive_curve: Sequence[float],
    tendon_curve: Sequence[float],
) -> float:
    """Potential energy of fibers and tendon, J.

    OpenSim has it from splines of the integrals, which are good to 1e-9 but for the ends of the curves: 1e-6 there.

    Args:
        m: the muscle.
        length: of the path, m.
        fiber_length: m.
        cos: of pennation.
        passive_curve: passive force over fiber length.
        tendon_curve: force over tendon length.
    """
    stored = m.optimal * curve_integral(passive_curve, fiber_length / m.optimal)
    if not m.is_rigid:
        stored += m.slack * curve_integral(tendon_curve, (length - fiber_length * cos) / m.slack)
    return m.strength * stored


def millard2012_equilibrium_length(
    length: float,
    rate: float,
    excitation: float,
    activation: float,
    fiber_length: float,
    m: Millard2012Equilibrium,
    active_curve: Sequence[float],
    velocity_curve: Sequence[float],
    inverse_curve: Sequence[float],
    passive_curve: Sequence[float],
    tendon_curve: Sequence[float],
) -> tuple[bool, float]:
    """Whether there is a fiber length at which fibers at rest and tendon bear the same, and that length (m).

    Newton's method with halved steps, step for step as in estimateMuscleFiberState of OpenSim's class, which knows
    nothing of the rate of the path. A length that would be below the least is that.

    Args as of `millard2012_equilibrium`.
    """
    active = min(max(excitation if m.is_excited else activation, m.least), 1.0)
    tolerance = max(1e-8 * m.strength, 10.0 * SIGNIFICANT)
    fiber = max(fiber_length_along(length - 1.01 * m.slack, m.height, m.shortest, m.least_cos), m.smallest)
    error, slope = imbalance(m, length, fiber, active, active_curve, passive_curve, tendon_curve)
    for _ in range(LENGTH_ROUNDS):
        if not abs(error) > tolerance:
            break
        before, last, part, direction = error, fiber, 1.0, error / slope
        while abs(error) >= abs(before):
            step = -part * direction
            if not abs(step) > SIGNIFICANT:
                # Perhaps the other direction leads on.
                step, part = -SMALLEST if step > 0.0 else SMALLEST if step < 0.0 else 0.0, 0.0
            fiber = max(last + step, m.smallest)
            error, slope = imbalance(m, length, fiber, active, active_curve, passive_curve, tendon_curve)
            if part <= SMALLEST:
                break
            part *= 0.5
    return abs(error) < tolerance or (fiber <= m.smallest and not isnan(error)), fiber


def imbalance(
    m: Millard2012Equilibrium,
    length: float,
    fiber: float,
    active: float,
    active_curve: Sequence[float],
    passive_curve: Sequence[float],
    tendon_curve: Sequence[float],
) -> tuple[float, float]:
    """What fibers at rest bear along the tendon and the tendon does not, N, and its derivative, N/m.

    Args:
        m: the muscle.
        length: of the path, m.
        fiber: length of the fibers, m.
        active: activation.
        active_curve: active force over fiber length.
        passive_curve: passive force over fiber length.
        tendon_curve: force over tendon length.
    """
    if fiber <= m.height:
        return nan, nan
    cos = cos_pennation(fiber, m.height, m.shortest, m.largest_sin, m.least_cos)
    by_length, active_slope = curve_value(active_curve, fiber / m.optimal)
    elastic, passive_slope = curve_value(passive_curve, fiber / m.optimal)
    tendon, tendon_slope = curve_value(tendon_curve, (length - fiber * cos) / m.slack)
    borne = m.strength * (active * by_length) + m.strength * elastic
    sin = m.height / fiber
    turn = sin * sin / cos
    along = m.strength * (active * active_slope + passive_slope) / m.optimal * cos + borne * turn / fiber
    return borne * cos - tendon * m.strength, along + tendon_slope * m.strength / m.slack * (cos + turn)
