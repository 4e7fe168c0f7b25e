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
from osimlite.forces.muscles import (
    SIGNIFICANT,
    MuscleInputs,
    cos_pennation,
    fiber_length_along,
    first_order_activation_rate,
)

VELOCITY_ROUNDS, LENGTH_ROUNDS = 20, 200
VELOCITY_TOLERANCE = 1e-10  # of the strength
"""Newton's steps in the search for a velocity, and for an equilibrium."""
SMALLEST = 2.0**-26
"""Least part of a step, and the step (m) in the other direction where there is none."""


class Millard2012Equilibrium(NamedTuple):
    """The numbers of a muscle."""

    strength: float  # max_isometric_force F, N
    optimal: float  # optimal_fiber_length, m
    slack: float  # tendon_slack_length, m
    fastest: float  # max_contraction_velocity, 1/s
    rising: float  # activation_time_constant, s
    falling: float  # deactivation_time_constant, s
    is_rigid: float  # ignore_tendon_compliance, 1 or 0
    is_excited: float  # ignore_activation_dynamics, 1 or 0: the excitation is the activation
    damping: float  # of the fibers, over F; 0 if they have none
    least: float  # activation
    height: float  # as of `pennation`, with the three that follow
    shortest: float
    largest_sin: float
    least_cos: float
    smallest: float  # fiber length that the curves and pennation allow, m


class MillardCurves(NamedTuple):
    """The curves of a muscle, as `curve_value` takes them."""

    active: Sequence[float]  # active force over fiber length
    velocity: Sequence[float]  # factor of the active force over fiber velocity
    inverse: Sequence[float]  # roughly the inverse of that
    passive: Sequence[float]  # passive force over fiber length
    tendon: Sequence[float]  # force over tendon length


def millard2012_equilibrium(
    now: MuscleInputs, m: Millard2012Equilibrium, curves: MillardCurves
) -> tuple[float, float, float, float, float, float, float, float, bool, float, float, float]:
    """The muscle at a moment; see calcFiberVelocityInfo and calcMuscleDynamicsInfo of OpenSim's class.

    Fibers at their least length stay there as long as they would shorten, and bear nothing then. A rigid tendon does
    not bear pressure: the damping of fast fibers is bounded instead.

    Returns:
        Tension (N), activation, fiber length (m), cosine of pennation, factors of the active force by length and by
        velocity, active and passive fiber force (N), whether a fiber velocity was found, rate of activation (1/s),
        fiber velocity (m/s), what of the passive force is not by damping (N).
    """
    active = min(max(now.excitation if m.is_excited else now.activation, m.least), 1.0)
    fiber = now.fiber_length
    if m.is_rigid:
        fiber = fiber_length_along(now.length - m.slack, m.height, m.shortest, m.least_cos)
    fiber = max(fiber, m.smallest)
    cos = cos_pennation(fiber, m.height, m.shortest, m.largest_sin, m.least_cos)
    along_tendon = now.length - fiber * cos
    by_length, _ = curve_value(curves.active, fiber / m.optimal)
    elastic, _ = curve_value(curves.passive, fiber / m.optimal)
    is_found, velocity, by_velocity, tendon = cos > SIGNIFICANT, 0.0, 1.0, 0.0
    if m.is_rigid:
        if along_tendon >= m.slack - SIGNIFICANT:
            velocity = now.rate * cos / (m.optimal * m.fastest)
            by_velocity, _ = curve_value(curves.velocity, velocity)
    elif is_found:
        tendon, _ = curve_value(curves.tendon, along_tendon / m.slack)
        if m.damping > 0.0:
            is_found, velocity, by_velocity = damped_velocity(m, active, by_length, elastic, tendon, cos, curves)
        else:
            by_velocity = (tendon / cos - elastic) / (active * by_length)
            velocity, _ = curve_value(curves.inverse, by_velocity)
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
    change = first_order_activation_rate(now.excitation, now.activation, m.rising, m.falling, m.least)
    speed = velocity * m.fastest * m.optimal
    return tension, active, fiber, cos, by_length, by_velocity, pull, passive, is_found, change, speed, spring


def millard2012_rigid(now: MuscleInputs, m: Millard2012Equilibrium, curves: MillardCurves) -> float:
    """Force (N) of fully active fibers along a rigid tendon; see calcInextensibleTendonActiveFiberForce of OpenSim.

    As there, the pennation that takes the force to the tendon is that of fibers as many meters long as they have
    optimal lengths: next to none.
    """
    fiber = fiber_length_along(now.length - m.slack, m.height, m.shortest, m.least_cos)
    if fiber <= m.smallest:
        return 0.0
    cos = cos_pennation(fiber, m.height, m.shortest, m.largest_sin, m.least_cos)
    by_length, _ = curve_value(curves.active, fiber / m.optimal)
    by_velocity, _ = curve_value(curves.velocity, now.rate * cos / (m.optimal * m.fastest))
    taken = cos_pennation(fiber / m.optimal, m.height, m.shortest, m.largest_sin, m.least_cos)
    return m.strength * by_length * by_velocity * taken


def damped_velocity(
    m: Millard2012Equilibrium,
    active: float,
    by_length: float,
    elastic: float,
    tendon: float,
    cos: float,
    curves: MillardCurves,
) -> tuple[bool, float, float]:
    """The normalized fiber velocity at which damped fibers bear what the tendon does, by Newton's method.

    Args:
        m: the muscle.
        active: activation.
        by_length: active force at rest, fully activated.
        elastic: passive force.
        tendon: its force.
        cos: of pennation.
        curves: of the muscle; the search starts from where the inverse one leads.

    Returns:
        Whether there is one, the velocity, and the factor of the active force there.
    """
    tolerance = max(VELOCITY_TOLERANCE * m.strength, 100.0 * SIGNIFICANT)
    guess = (tendon / max(cos, 0.01) - elastic) / (max(active, 0.01) * max(by_length, 0.01))
    velocity, _ = curve_value(curves.inverse, guess)
    velocity, factor = min(max(velocity, -1.0), 1.0), 0.0
    for _ in range(VELOCITY_ROUNDS):
        factor, slope = curve_value(curves.velocity, velocity)
        passive = m.strength * elastic + m.strength * m.damping * velocity
        error = (m.strength * (active * by_length * factor) + passive) * cos - tendon * m.strength
        if abs(error) <= tolerance:
            return True, velocity, factor
        velocity -= error / (m.strength * (active * by_length * slope + m.damping) * cos)
    return False, velocity, factor


def millard2012_energy(
    m: Millard2012Equilibrium, length: float, fiber_length: float, cos: float, curves: MillardCurves
) -> float:
    """Potential energy of fibers and tendon, J.

    OpenSim has it from splines of the integrals, which are good to 1e-9 but for the ends of the curves: 1e-6 there.

    Args:
        m: the muscle.
        length: of the path, m.
        fiber_length: m.
        cos: of pennation.
        curves: of the muscle.
    """
    stored = m.optimal * curve_integral(curves.passive, fiber_length / m.optimal)
    if not m.is_rigid:
        stored += m.slack * curve_integral(curves.tendon, (length - fiber_length * cos) / m.slack)
    return m.strength * stored


def millard2012_equilibrium_length(
    now: MuscleInputs, m: Millard2012Equilibrium, curves: MillardCurves
) -> tuple[bool, float]:
    """Whether there is a fiber length at which fibers at rest and tendon bear the same, and that length (m).

    Newton's method with halved steps, step for step as in estimateMuscleFiberState of OpenSim's class, which knows
    nothing of the rate of the path. A length that would be below the least is that.
    """
    length, active = now.length, min(max(now.excitation if m.is_excited else now.activation, m.least), 1.0)
    tolerance = max(1e-8 * m.strength, 10.0 * SIGNIFICANT)
    fiber = max(fiber_length_along(length - 1.01 * m.slack, m.height, m.shortest, m.least_cos), m.smallest)
    error, slope = imbalance(m, length, fiber, active, curves)
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
            error, slope = imbalance(m, length, fiber, active, curves)
            if part <= SMALLEST:
                break
            part *= 0.5
    return abs(error) < tolerance or (fiber <= m.smallest and not isnan(error)), fiber


def imbalance(
    m: Millard2012Equilibrium, length: float, fiber: float, active: float, curves: MillardCurves
) -> tuple[float, float]:
    """What fibers at rest bear along the tendon and the tendon does not, N, and its derivative, N/m.

    Args:
        m: the muscle.
        length: of the path, m.
        fiber: length of the fibers, m.
        active: activation.
        curves: of the muscle.
    """
    if fiber <= m.height:
        return nan, nan
    cos = cos_pennation(fiber, m.height, m.shortest, m.largest_sin, m.least_cos)
    by_length, active_slope = curve_value(curves.active, fiber / m.optimal)
    elastic, passive_slope = curve_value(curves.passive, fiber / m.optimal)
    tendon, tendon_slope = curve_value(curves.tendon, (length - fiber * cos) / m.slack)
    borne = m.strength * (active * by_length) + m.strength * elastic
    sin = m.height / fiber
    turn = sin * sin / cos
    along = m.strength * (active * active_slope + passive_slope) / m.optimal * cos + borne * turn / fiber
    return borne * cos - tendon * m.strength, along + tendon_slope * m.strength / m.slack * (cos + turn)
