"""Millard's muscle with a mass between fibers and tendon, as in Millard2012AccelerationMuscle.

Source: M. Millard et al., Journal of Biomechanical Engineering 135, 2013. Forces are normalized by
the maximum isometric force F; the curves are those of :mod:`osimlite.mechanics.laws.muscle_curves`.
Each elastic force f is damped to f max(1 + c v, 0), or f max(1 - c v, 0) if it resists short or
steep fibers, where v is the velocity over the optimal or slack length and c a damping constant (s),
so that its sign does not change. The mass m accelerates the fibers of length l and pennation phi:

l'' = (ft - (a fl fv + fp) cos(phi) + fs) F cos(phi) / m + l phi'^2

where a is the activation, fl and fv are the factors by length and velocity, fp is the passive force
with the linear damping of the fibers, ft the tendon force and fs the force against steep fibers.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import NamedTuple

from osimlite.mechanics.laws.bezier import LAST, curve_integral, curve_value
from osimlite.mechanics.laws.muscles import (
    SIGNIFICANT,
    MuscleInputs,
    cos_pennation,
    fiber_length_along,
    first_order_activation_rate,
)

MAX_NEWTON_STEPS = 500
"""Largest number of steps in the search for an equilibrium."""
STEP_FRACTION = 0.75
"""Part of a Newton step that is taken, as in OpenSim."""


class Millard2012Acceleration(NamedTuple):
    """Parameters of a Millard2012AccelerationMuscle."""

    strength: float  # max_isometric_force F, N
    optimal: float  # optimal_fiber_length, m
    slack: float  # tendon_slack_length, m
    fastest: float  # max_contraction_velocity, 1/s
    mass: float  # kg
    tendon_damping: float  # tendon_force_length_damping, s
    short_damping: float  # fiber_compressive_force_length_damping, s
    passive_damping: float  # fiber_force_length_damping, s
    steep_damping: float  # fiber_compressive_force_cos_pennation_damping, s
    fiber_damping: float  # damping of the fibers parallel to the active force, over F, s
    rising: float  # activation time constant, s
    falling: float  # deactivation time constant, s
    least: float  # smallest activation in the formula of its rate
    height: float  # constant height of the fibers, see `pennation_constants`, m
    shortest: float  # smallest fiber length by the largest pennation angle, m
    largest_sin: float  # sine of the largest pennation angle
    least_cos: float  # cosine of the largest pennation angle
    optimal_cos: float  # cosine of pennation at optimal length


class AccelerationCurves(NamedTuple):
    """Curves of a muscle, as `curve_value` takes them."""

    active: Sequence[float]  # active force over fiber length
    velocity: Sequence[float]  # factor of the active force over fiber velocity
    passive: Sequence[float]  # passive force over fiber length
    tendon: Sequence[float]  # force over tendon length
    short: Sequence[float]  # force against short fibers over their length
    steep: Sequence[float]  # force against steep fibers over the cosine of pennation


class MuscleDynamics(NamedTuple):
    """Forces and accelerations of fibers, tendon and the mass between them."""

    cos: float  # cosine of the pennation angle
    by_length: float  # normalized active force at full activation and zero velocity
    by_velocity: float  # factor of the active force by velocity
    passive: float  # passive force of the fibers without their linear damping, N
    tension: float  # tendon force, N
    acceleration: float  # second derivative of the fiber length, m/s^2
    slope: float  # derivative of `acceleration` by the fiber length at constant speeds, 1/s^2
    stiffness: float  # stiffness of the fibers along the tendon, N/m
    tendon_stiffness: float  # stiffness of the tendon, N/m


def evaluate_dynamics(
    m: Millard2012Acceleration,
    active: float,
    fiber: float,
    velocity: float,
    tendon: float,
    rate: float,
    curves: AccelerationCurves,
) -> MuscleDynamics:
    """Compute forces and accelerations at a fiber length.

    See calcAccelerationMuscleInfo and calcMuscleDynamicsInfo of OpenSim's class.

    Args:
        m: parameters of the muscle.
        active: activation.
        fiber: fiber length (m).
        velocity: fiber velocity (m/s).
        tendon: tendon length (m).
        rate: tendon velocity (m/s).
        curves: curves of the muscle.

    Returns:
        Forces, accelerations and stiffnesses.
    """
    cos = cos_pennation(fiber, m.height, m.shortest, m.largest_sin, m.least_cos)
    sin = m.height / fiber
    tan = sin / cos
    # Rates of the pennation angle phi, as l sin(phi) is constant: phi' = -(v / l) tan(phi) and
    # dphi/dl = -tan(phi) / l.
    turning = -velocity / fiber * tan
    turn = -tan / fiber
    # Fiber velocity along the tendon, and derivatives by the fiber length at the same fiber
    # velocity.
    velocity_along = velocity * cos - fiber * sin * turning
    turning_slope = velocity / (fiber * fiber) * tan - velocity / fiber * (1.0 + tan * tan) * turn
    along_slope = (
        -velocity * sin * turn
        - sin * turning
        - fiber * cos * turn * turning
        - fiber * sin * turning_slope
    )
    by_length, active_slope = curve_value(curves.active, fiber / m.optimal)
    by_velocity, _ = curve_value(curves.velocity, velocity / (m.fastest * m.optimal))

    pull, pull_slope = curve_value(curves.tendon, tendon / m.slack)
    # The factor of damping is not negative, so that a tendon never pushes.
    damped = max(1.0 + m.tendon_damping * rate / m.slack, 0.0)
    tension = m.strength * pull * damped
    tendon_stiffness = m.strength * pull_slope / m.slack * damped
    stretch, stretch_slope = curve_value(curves.passive, fiber / m.optimal)
    short, short_slope = curve_value(curves.short, fiber / m.optimal)
    stretched = max(1.0 + m.passive_damping * velocity / m.optimal, 0.0)
    shortened = max(1.0 - m.short_damping * velocity / m.optimal, 0.0)
    steep, steep_slope = curve_value(curves.steep, cos)
    # The damping of steep fibers acts on their velocity along the tendon, normalized by the optimal
    # length along it.
    normal = m.steep_damping / (m.optimal * m.optimal_cos)
    steepened = max(1.0 - normal * velocity_along, 0.0)
    steep_slope = -steep_slope * sin * turn * steepened - (
        steep * normal * along_slope if steepened > 0.0 else 0.0
    )

    # Short fibers push, stretched ones pull; the damping in parallel is linear in the velocity.
    passive = stretch * stretched - short * shortened + m.fiber_damping * velocity / m.optimal
    fiber_force = active * by_length * by_velocity + passive
    fiber_force_slope = (
        active * active_slope * by_velocity + stretch_slope * stretched - short_slope * shortened
    )
    net = tension - m.strength * (fiber_force * cos - steep * steepened)
    stiffness = m.strength * (
        fiber_force_slope / m.optimal * cos - fiber_force * sin * turn - steep_slope
    )
    # The second term is the centripetal acceleration of fibers that rotate by pennation.
    acceleration = net * cos / m.mass + fiber * turning * turning
    # A longer fiber shortens the tendon by d(l cos phi)/dl.
    net_slope = tendon_stiffness * (fiber * sin * turn - cos) - stiffness
    slope = (
        (net_slope * cos - net * sin * turn) / m.mass
        + turning * turning
        + 2.0 * fiber * turning * turning_slope
    )
    # OpenSim does not count the fibers' own damping as a passive force.
    reported_passive = m.strength * (
        stretch * stretched - short * shortened - steep * steepened * cos
    )
    # From stiffness by fiber length to stiffness by length along the tendon.
    stiffness /= cos - fiber * sin * turn
    return MuscleDynamics(
        cos,
        by_length,
        by_velocity,
        reported_passive,
        tension,
        acceleration,
        slope,
        stiffness,
        tendon_stiffness,
    )


def millard2012_acceleration(
    inputs: MuscleInputs, m: Millard2012Acceleration, curves: AccelerationCurves
) -> tuple[float, float, float, float, float, float, float, float, bool, float, float, float]:
    """Compute forces and rates of a muscle.

    Only the rate of activation is bounded, and no fiber length.

    Args:
        inputs: inputs of the muscle.
        m: parameters of the muscle.
        curves: curves of the muscle.

    Returns:
        Tension (N), activation, fiber length (m), cosine of pennation, factors of the active force by
        length and by velocity, active and passive fiber force (N), whether the fibers are longer than
        the muscle is wide, rate of activation (1/s), fiber velocity (m/s) and its rate (m/s²).
    """
    fiber_length, velocity = inputs.fiber_length, inputs.fiber_velocity
    cos = cos_pennation(fiber_length, m.height, m.shortest, m.largest_sin, m.least_cos)
    # With constant height the rate of the length along the tendon is v / cos(phi).
    tendon = inputs.length - fiber_length * cos
    rate = inputs.rate - velocity / cos
    dynamics = evaluate_dynamics(m, inputs.activation, fiber_length, velocity, tendon, rate, curves)
    pull = inputs.activation * dynamics.by_length * dynamics.by_velocity * m.strength
    change = first_order_activation_rate(
        inputs.excitation, inputs.activation, m.rising, m.falling, m.least
    )
    return (
        dynamics.tension,
        inputs.activation,
        fiber_length,
        dynamics.cos,
        dynamics.by_length,
        dynamics.by_velocity,
        pull,
        dynamics.passive,
        fiber_length > m.height,
        change,
        velocity,
        dynamics.acceleration,
    )


def millard2012_acceleration_rigid(
    inputs: MuscleInputs, m: Millard2012Acceleration, curves: AccelerationCurves
) -> float:
    """Return the force of fully active fibers along a rigid tendon (N).

    See OpenSim's calcInextensibleTendonActiveFiberForce.

    Args:
        inputs: inputs of the muscle.
        m: parameters of the muscle.
        curves: curves of the muscle.
    """
    # Fibers clamped to their smallest length bear no force along a rigid tendon.
    fiber = fiber_length_along(inputs.length - m.slack, m.height, m.shortest, m.least_cos)
    if not fiber > m.shortest:
        return 0.0
    cos = cos_pennation(fiber, m.height, m.shortest, m.largest_sin, m.least_cos)
    by_length, _ = curve_value(curves.active, fiber / m.optimal)
    by_velocity, _ = curve_value(curves.velocity, inputs.rate * cos / (m.optimal * m.fastest))
    return m.strength * by_length * by_velocity * cos


def millard2012_acceleration_equilibrium(
    inputs: MuscleInputs, m: Millard2012Acceleration, curves: AccelerationCurves
) -> tuple[bool, float, float]:
    """Find a fiber length that is not accelerated.

    Step for step as in initMuscleState of OpenSim's class: parts of Newton steps, while the rate of the
    path is distributed over fibers and tendon by their stiffness. Where the slope vanishes, OpenSim
    continues at a random length; here the search ends. It ends, as there, where a tendon without
    stiffness becomes taut.

    Args:
        inputs: inputs of the muscle; only length, rate, activation and fiber velocity are used.
        m: parameters of the muscle.
        curves: curves of the muscle.

    Returns:
        Whether there is such a length, the fiber length (m), and the fiber velocity (m/s).
    """
    length, rate = inputs.length, inputs.rate
    # OpenSim starts with a tendon strained by 1 % and at rest. Its tolerance is that of a force,
    # but bounds the acceleration.
    tolerance = max(1e-8 * m.strength, 10.0 * SIGNIFICANT)
    tendon = 1.01 * m.slack
    tendon_rate = 0.0
    fiber = fiber_length_along(length - tendon, m.height, m.shortest, m.least_cos)
    for _ in range(MAX_NEWTON_STEPS):
        if not fiber > m.height:
            break
        cos = cos_pennation(fiber, m.height, m.shortest, m.largest_sin, m.least_cos)
        velocity = (rate - tendon_rate) * cos
        dynamics = evaluate_dynamics(
            m, inputs.activation, fiber, velocity, tendon, tendon_rate, curves
        )
        if abs(dynamics.acceleration) <= tolerance:
            return True, fiber, velocity
        # Also false for NaN: an undefined slope ends the search.
        if not SIGNIFICANT < abs(dynamics.slope) < inf:
            break
        fiber = max(fiber - STEP_FRACTION * dynamics.acceleration / dynamics.slope, m.shortest)
        tendon = length - fiber * cos_pennation(
            fiber, m.height, m.shortest, m.largest_sin, m.least_cos
        )
        # A slack tendon takes the complete rate; a taut one its part by the stiffness of the
        # fibers.
        total_stiffness = dynamics.stiffness + dynamics.tendon_stiffness
        tendon_rate = rate
        if tendon > m.slack and abs(total_stiffness) > SIGNIFICANT:
            if dynamics.tendon_stiffness == 0.0:
                break
            tendon_rate = dynamics.stiffness / total_stiffness * rate
    return False, fiber, inputs.fiber_velocity


def millard2012_acceleration_energy(
    m: Millard2012Acceleration,
    length: float,
    fiber_length: float,
    cos: float,
    curves: AccelerationCurves,
) -> float:
    """Return the potential energy, without the kinetic energy of the mass (J).

    Args:
        m: parameters of the muscle.
        length: length of the path (m).
        fiber_length: fiber length (m).
        cos: cosine of pennation.
        curves: curves of the muscle.
    """
    short, steep = curves.short, curves.steep
    stretched = curve_integral(curves.passive, fiber_length / m.optimal)
    shortened = curve_integral(short, short[LAST]) - curve_integral(short, fiber_length / m.optimal)
    pulled = curve_integral(curves.tendon, (length - fiber_length * cos) / m.slack)
    steepened = curve_integral(steep, steep[LAST]) - curve_integral(steep, cos)
    # As in OpenSim, the last term lacks a factor of length.
    return m.strength * (m.optimal * (stretched + shortened) + m.slack * pulled + steepened)
