"""Millard's muscle without a mass, as in OpenSim's Millard2012EquilibriumMuscle.

Source: M. Millard et al., Journal of Biomechanical Engineering 135, 2013. The fibers may be damped
or not, the tendon elastic or rigid, with or without activation dynamics. Forces are normalized by
the maximum isometric force F, fiber lengths by the optimal fiber length, fiber velocities by the
maximum contraction velocity times that length, tendon lengths by the tendon slack length. The
curves are those of :mod:`osimlite.mechanics.laws.muscle_curves`.

With an elastic tendon, the fiber velocity v follows from the equilibrium

(a fl(l) fv(v) + fp(l) + beta v) cos(phi) = ft

where a is the activation, fl, fv, fp, ft are the curves, beta is the damping, and phi the pennation
angle. Machine code evaluates the curves of several muscles together, between `fibers_at`,
`combine_length_curves` and `combine_velocity_curve`.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan, nan
from typing import NamedTuple

from osimlite.mechanics.laws.bezier import curve_integral, curve_value, solve_sum
from osimlite.mechanics.laws.dual_numbers import differentiate_root, strip_derivatives
from osimlite.mechanics.laws.muscles import (
    SIGNIFICANT,
    MuscleInputs,
    cos_pennation,
    fiber_length_along,
    first_order_activation_rate,
)

LENGTH_ROUNDS = 200
"""Largest number of Newton steps in the search for an equilibrium."""
VELOCITY_TOLERANCE = 1e-10
"""Accepted residual of the equation for the velocity, relative to F; usually it is rounding."""
NONE = 0.0
"""The velocity is undefined."""
DAMPED = 1.0
"""The velocity follows from the equation with damping."""
INVERSE = 2.0
"""The velocity follows from the inverse force-velocity curve."""
RIGID = 3.0
"""The velocity follows from that of the path, with a rigid tendon."""
SLACK = 4.0
"""The velocity is 0, as a rigid tendon is slack."""
MIN_STEP = 2.0**-26
"""Smallest part of a step, and the step (m) in the opposite direction if that fails."""


class Millard2012Equilibrium(NamedTuple):
    """Parameters of a Millard2012EquilibriumMuscle."""

    strength: float  # max_isometric_force F, N
    optimal: float  # optimal_fiber_length, m
    slack: float  # tendon_slack_length, m
    fastest: float  # max_contraction_velocity, 1/s
    rising: float  # activation_time_constant, s
    falling: float  # deactivation_time_constant, s
    is_rigid: float  # ignore_tendon_compliance, 1 or 0
    is_excited: float  # ignore_activation_dynamics, 1 or 0: the excitation is the activation
    damping: float  # damping of the fibers, over F; 0 without damping
    least: float  # smallest activation
    height: float  # constant height of the fibers, see `pennation_constants`, m
    shortest: float  # smallest fiber length by the largest pennation angle, m
    largest_sin: float  # sine of the largest pennation angle
    least_cos: float  # cosine of the largest pennation angle
    smallest: float  # fiber length that the curves and pennation allow, m


class MillardCurves(NamedTuple):
    """Curves of a muscle, as `curve_value` takes them."""

    active: Sequence[float]  # active force over fiber length
    velocity: Sequence[float]  # factor of the active force over fiber velocity
    inverse: Sequence[float]  # fiber velocity over this factor: roughly the inverse of `velocity`
    passive: Sequence[float]  # passive force over fiber length
    tendon: Sequence[float]  # force over tendon length


class MillardFibers(NamedTuple):
    """Intermediate results of a muscle.

    A field for the value of a curve has the argument of the curve until it is evaluated.
    """

    # condition that determines the velocity: NONE, DAMPED, INVERSE, RIGID or SLACK
    velocity_source: float
    velocity: float  # normalized fiber velocity, or the value that determines it
    by_velocity: float  # factor of the active force by velocity
    active: float  # activation
    length: float  # fiber length, m
    cos: float  # cosine of the pennation angle
    by_length: float  # normalized active force at full activation and zero velocity
    elastic: float  # normalized passive force
    tendon: float  # normalized tendon force
    change: float  # rate of activation, 1/s


def millard2012_equilibrium(
    inputs: MuscleInputs, m: Millard2012Equilibrium, curves: MillardCurves
) -> tuple[float, float, float, float, float, float, float, float, bool, float, float, float]:
    """Compute forces and rates of a muscle.

    See OpenSim's calcFiberVelocityInfo and calcMuscleDynamicsInfo.

    Fibers at their smallest length stay there as long as they would shorten, and then bear no force. A
    rigid tendon bears no pressure: the damping of fast fibers is bounded instead.

    Args:
        inputs: inputs of the muscle.
        m: parameters of the muscle.
        curves: curves of the muscle.

    Returns:
        Tension (N), activation, fiber length (m), cosine of pennation, factors of the active force by
        length and by velocity, active and passive fiber force (N), whether a fiber velocity exists,
        rate of activation (1/s), fiber velocity (m/s), elastic part of the passive force (N).
    """
    fibers = evaluate_length_curves(inputs, m, curves)
    is_found = fibers.velocity_source != NONE
    velocity = fibers.velocity
    by_velocity = fibers.by_velocity
    # Only the branch that applies evaluates a curve over velocity.
    if fibers.velocity_source == RIGID:
        by_velocity, _ = curve_value(curves.velocity, velocity)
    elif fibers.velocity_source == DAMPED:
        is_found, velocity, by_velocity = find_damped_velocity(
            m, fibers.active, fibers.by_length, fibers.elastic, fibers.tendon, fibers.cos, curves
        )
    elif fibers.velocity_source == INVERSE:
        velocity, _ = curve_value(curves.inverse, velocity)
    return compute_muscle_results(
        fibers, m, is_found, velocity, by_velocity, fibers.by_length, fibers.elastic, fibers.tendon
    )


def millard2012_at_velocity(
    inputs: MuscleInputs, m: Millard2012Equilibrium, curves: MillardCurves, fiber_velocity: float
) -> tuple[float, float, float, float, float, float, float, float, bool, float, float, float]:
    """Compute the muscle with a known velocity of damped fibers, to obtain all derivatives.

    The search for the velocity is not differentiated: its result is refined once, by the implicit
    function theorem, with the derivatives of the other quantities.

    Args:
        inputs: inputs of the muscle.
        m: parameters of the muscle.
        curves: curves of the muscle.
        fiber_velocity: known fiber velocity (m/s).

    Returns:
        The results of `millard2012_equilibrium`.
    """
    fibers = evaluate_length_curves(inputs, m, curves)
    velocity = (
        strip_derivatives(fiber_velocity) / (m.fastest * m.optimal)
        if fibers.velocity_source == DAMPED
        else fibers.velocity
    )
    by_velocity, slope = 1.0, 0.0
    if fibers.velocity_source == INVERSE:
        velocity, _ = curve_value(curves.inverse, velocity)
    else:
        by_velocity, slope = curve_value(curves.velocity, velocity)
    if fibers.velocity_source == DAMPED:
        # Residual of the equilibrium; its derivative by the velocity gives the derivatives of the
        # root.
        active_factor = fibers.active * fibers.by_length
        residual = active_factor * by_velocity + m.damping * velocity - fibers.velocity
        velocity = differentiate_root(velocity, residual, active_factor * slope + m.damping)
    by_length, elastic, tendon = fibers.by_length, fibers.elastic, fibers.tendon
    return compute_muscle_results(
        fibers, m, True, velocity, by_velocity, by_length, elastic, tendon
    )


def evaluate_length_curves(
    inputs: MuscleInputs, m: Millard2012Equilibrium, curves: MillardCurves
) -> MillardFibers:
    """Evaluate the curves over length, but not those over velocity.

    Args:
        inputs: inputs of the muscle.
        m: parameters of the muscle.
        curves: curves of the muscle.

    Returns:
        Fibers, with the values of the curves over length and what determines the velocity.
    """
    fibers = fibers_at(inputs, m)
    tendon = 0.0
    by_length, _ = curve_value(curves.active, fibers.by_length)
    elastic, _ = curve_value(curves.passive, fibers.by_length)
    if not m.is_rigid:
        tendon, _ = curve_value(curves.tendon, fibers.tendon)
    velocity, by_velocity, by_length, elastic, tendon = combine_length_curves(
        fibers, m, by_length, elastic, tendon
    )
    return MillardFibers(
        fibers.velocity_source,
        velocity,
        by_velocity,
        fibers.active,
        fibers.length,
        fibers.cos,
        by_length,
        elastic,
        tendon,
        fibers.change,
    )


def fibers_at(inputs: MuscleInputs, m: Millard2012Equilibrium) -> MillardFibers:
    """Compute the arguments of all curves.

    Args:
        inputs: inputs of the muscle.
        m: parameters of the muscle.

    Returns:
        Fibers, where `by_length` and `elastic` are the normalized fiber length and `tendon` the
        normalized tendon length.
    """
    # OpenSim clamps the activation before it enters the equilibrium.
    active = min(max(inputs.excitation if m.is_excited else inputs.activation, m.least), 1.0)
    fiber = inputs.fiber_length
    if m.is_rigid:
        fiber = fiber_length_along(inputs.length - m.slack, m.height, m.shortest, m.least_cos)
    fiber = max(fiber, m.smallest)
    cos = cos_pennation(fiber, m.height, m.shortest, m.largest_sin, m.least_cos)
    along_tendon = inputs.length - fiber * cos
    velocity_source = DAMPED if m.damping > 0.0 else INVERSE
    velocity = tendon = 0.0
    if m.is_rigid:
        velocity_source = SLACK
        # A rigid tendon is slack where the path is too short for it; SIGNIFICANT allows for
        # rounding.
        if along_tendon >= m.slack - SIGNIFICANT:
            velocity_source = RIGID
            velocity = inputs.rate * cos / (m.optimal * m.fastest)
    else:
        tendon = along_tendon / m.slack
    # Perpendicular fibers cannot balance a tendon.
    if not cos > SIGNIFICANT:
        velocity_source = NONE
    change = first_order_activation_rate(
        inputs.excitation, inputs.activation, m.rising, m.falling, m.least
    )
    normalized_length = fiber / m.optimal
    return MillardFibers(
        velocity_source,
        velocity,
        1.0,
        active,
        fiber,
        cos,
        normalized_length,
        normalized_length,
        tendon,
        change,
    )


def combine_length_curves(
    fibers: MillardFibers,
    m: Millard2012Equilibrium,
    by_length: float,
    elastic: float,
    tendon: float,
) -> tuple[float, float, float, float, float]:
    """Combine the values of the curves over length.

    Args:
        fibers: fibers from `fibers_at`.
        m: parameters of the muscle.
        by_length: value of the active force-length curve.
        elastic: value of the passive force-length curve.
        tendon: value of the tendon force-length curve.

    Returns:
        Velocity, or the value that determines it, factor of the active force by velocity, factor by
        length, passive force, and tendon force; all normalized.
    """
    velocity, by_velocity = fibers.velocity, 1.0
    if m.is_rigid or fibers.velocity_source == NONE:
        tendon = 0.0
    elif m.damping > 0.0:
        # The equation with damping needs the force that active fibers and dampers must bear.
        velocity = tendon / fibers.cos - elastic
    else:
        # Without damping the equilibrium gives the force-velocity factor directly; its inverse
        # curve gives the velocity.
        velocity = by_velocity = (tendon / fibers.cos - elastic) / (fibers.active * by_length)
    return velocity, by_velocity, by_length, elastic, tendon


def request_velocity_curve(
    fibers: MillardFibers, m: Millard2012Equilibrium
) -> tuple[int, float, float, float]:
    """Return which curve over velocity must be evaluated, and for what sum.

    The sum is of_y y + of_x x, as in `solve_sum`; with factors 0 and 1 it is just the argument x,
    and the curve is evaluated.

    Args:
        fibers: fibers after `combine_length_curves`.
        m: parameters of the muscle.

    Returns:
        Number of the curve (0 for the factor by velocity, 1 for its inverse), factors of its value
        and of its argument, and the value of their sum.
    """
    if fibers.velocity_source == DAMPED:
        return 0, fibers.active * fibers.by_length, m.damping, fibers.velocity
    return 1 if fibers.velocity_source == INVERSE else 0, 0.0, 1.0, fibers.velocity


def combine_velocity_curve(
    fibers: MillardFibers, m: Millard2012Equilibrium, value: float, missed: float
) -> tuple[float, float, float]:
    """Combine the value of the requested curve.

    Args:
        fibers: fibers after `combine_length_curves`.
        m: parameters of the muscle.
        value: value of the curve.
        missed: residual of the search.

    Returns:
        Value that determines the velocity, normalized velocity, and factor of the active force.
    """
    if fibers.velocity_source == DAMPED:
        is_found, velocity = check_damped_velocity(
            m, fibers.active * fibers.by_length, fibers.velocity, value, missed
        )
        return DAMPED if is_found else NONE, velocity, value
    if fibers.velocity_source == INVERSE:
        return INVERSE, value, fibers.by_velocity
    return (
        fibers.velocity_source,
        fibers.velocity,
        value if fibers.velocity_source == RIGID else 1.0,
    )


def make_muscle_results(
    fibers: MillardFibers, m: Millard2012Equilibrium
) -> tuple[float, float, float, float, float, float, float, float, bool, float, float, float]:
    """Return the results of `millard2012_equilibrium`, after all curves have been evaluated.

    Args:
        fibers: fibers with the values of all curves.
        m: parameters of the muscle.

    Returns:
        The results of `millard2012_equilibrium`.
    """
    of_curves = fibers.by_length, fibers.elastic, fibers.tendon
    return compute_muscle_results(
        fibers, m, fibers.velocity_source != NONE, fibers.velocity, fibers.by_velocity, *of_curves
    )


def compute_muscle_results(
    fibers: MillardFibers,
    m: Millard2012Equilibrium,
    is_found: bool,
    velocity: float,
    by_velocity: float,
    by_length: float,
    elastic: float,
    tendon: float,
) -> tuple[float, float, float, float, float, float, float, float, bool, float, float, float]:
    """Return the results of `millard2012_equilibrium` for known values of the curves.

    Args:
        fibers: fibers; activation, length, cosine and rate of activation are used.
        m: parameters of the muscle.
        is_found: whether a fiber velocity exists.
        velocity: normalized fiber velocity.
        by_velocity: factor of the active force by velocity.
        by_length: factor of the active force by length.
        elastic: normalized passive force.
        tendon: normalized tendon force.

    Returns:
        The results of `millard2012_equilibrium`.
    """
    active, fiber, cos = fibers.active, fibers.length, fibers.cos
    pull = m.strength * (active * by_length * by_velocity)
    spring = m.strength * elastic
    passive = spring + m.strength * m.damping * velocity
    # OpenSim holds fibers at their smallest length, where they bear no force.
    if fiber <= m.smallest and velocity <= 0.0:
        velocity, by_velocity, pull, spring, passive = 0.0, 1.0, 0.0, 0.0, 0.0
    if m.is_rigid:
        # Fast shortening would make the dampers push on a rigid tendon: bound the passive force.
        passive = max(passive, -pull)
        tension = (pull + passive) * cos
    else:
        tension = tendon * m.strength
    speed = velocity * m.fastest * m.optimal
    return (
        tension,
        active,
        fiber,
        cos,
        by_length,
        by_velocity,
        pull,
        passive,
        is_found,
        fibers.change,
        speed,
        spring,
    )


def millard2012_rigid(
    inputs: MuscleInputs, m: Millard2012Equilibrium, curves: MillardCurves
) -> float:
    """Return the force of fully active fibers along a rigid tendon (N).

    See OpenSim's calcInextensibleTendonActiveFiberForce. As there, the pennation that projects the
    force onto the tendon is that of fibers with their normalized length in m: next to none.

    Args:
        inputs: inputs of the muscle.
        m: parameters of the muscle.
        curves: curves of the muscle.
    """
    fiber = fiber_length_along(inputs.length - m.slack, m.height, m.shortest, m.least_cos)
    if fiber <= m.smallest:
        return 0.0
    cos = cos_pennation(fiber, m.height, m.shortest, m.largest_sin, m.least_cos)
    by_length, _ = curve_value(curves.active, fiber / m.optimal)
    by_velocity, _ = curve_value(curves.velocity, inputs.rate * cos / (m.optimal * m.fastest))
    normalized_cos = cos_pennation(
        fiber / m.optimal, m.height, m.shortest, m.largest_sin, m.least_cos
    )
    return m.strength * by_length * by_velocity * normalized_cos


def find_damped_velocity(
    m: Millard2012Equilibrium,
    active: float,
    by_length: float,
    elastic: float,
    tendon: float,
    cos: float,
    curves: MillardCurves,
) -> tuple[bool, float, float]:
    """Find the normalized velocity at which damped fibers balance the tendon.

    OpenSim uses Newton's method with a tolerance of 1e-10; here the search is that on a curve.

    Args:
        m: parameters of the muscle.
        active: activation.
        by_length: factor of the active force by length.
        elastic: normalized passive force.
        tendon: normalized tendon force.
        cos: cosine of pennation.
        curves: curves of the muscle.

    Returns:
        Whether there is such a velocity, the normalized velocity, and the factor of the active
        force there.
    """
    isometric = active * by_length
    velocity_force = tendon / cos - elastic
    factor, residual = solve_sum(curves.velocity, isometric, m.damping, velocity_force)
    is_found, velocity = check_damped_velocity(m, isometric, velocity_force, factor, residual)
    return is_found, velocity, factor


def check_damped_velocity(
    m: Millard2012Equilibrium,
    isometric: float,
    velocity_force: float,
    factor: float,
    residual: float,
) -> tuple[bool, float]:
    """Return whether a search for the velocity converged, and the velocity.

    Args:
        m: parameters of the muscle.
        isometric: active isometric force.
        velocity_force: force of the fibers without their elastic passive force.
        factor: factor of the active force by velocity.
        residual: residual of the search.

    Returns:
        Whether it converged, and the velocity.
    """
    return abs(residual) <= VELOCITY_TOLERANCE, (velocity_force - isometric * factor) / m.damping


def millard2012_energy(
    m: Millard2012Equilibrium, length: float, fiber_length: float, cos: float, curves: MillardCurves
) -> float:
    """Return the potential energy of fibers and tendon (J).

    OpenSim computes it from splines of the integrals, with errors of 1e-9, and 1e-6 at the ends of the
    curves.

    Args:
        m: parameters of the muscle.
        length: length of the path (m).
        fiber_length: fiber length (m).
        cos: cosine of pennation.
        curves: curves of the muscle.
    """
    energy = m.optimal * curve_integral(curves.passive, fiber_length / m.optimal)
    if not m.is_rigid:
        energy += m.slack * curve_integral(curves.tendon, (length - fiber_length * cos) / m.slack)
    return m.strength * energy


def millard2012_equilibrium_length(
    inputs: MuscleInputs, m: Millard2012Equilibrium, curves: MillardCurves
) -> tuple[bool, float]:
    """Find the fiber length at which resting fibers and tendon bear the same force.

    Newton's method with halved steps, step for step as in estimateMuscleFiberState of OpenSim's class,
    which ignores the rate of the path. A length below the smallest one is replaced by it.

    Args:
        inputs: inputs of the muscle.
        m: parameters of the muscle.
        curves: curves of the muscle.

    Returns:
        Whether there is such a length, and the fiber length (m).
    """
    length = inputs.length
    active = min(max(inputs.excitation if m.is_excited else inputs.activation, m.least), 1.0)
    # OpenSim's tolerance, and its start with a tendon strained by 1 %.
    tolerance = max(1e-8 * m.strength, 10.0 * SIGNIFICANT)
    fiber = max(
        fiber_length_along(length - 1.01 * m.slack, m.height, m.shortest, m.least_cos), m.smallest
    )
    error, slope = force_imbalance(m, length, fiber, active, curves)
    for _ in range(LENGTH_ROUNDS):
        if not abs(error) > tolerance:
            break
        previous_error = error
        previous_fiber = fiber
        fraction = 1.0
        direction = error / slope
        # Halve the step until the residual decreases.
        while abs(error) >= abs(previous_error):
            step = -fraction * direction
            # A vanishing step cannot help; OpenSim then tries a tiny step the other way.
            if not abs(step) > SIGNIFICANT:
                step = -MIN_STEP if step > 0.0 else MIN_STEP if step < 0.0 else 0.0
                fraction = 0.0
            fiber = max(previous_fiber + step, m.smallest)
            error, slope = force_imbalance(m, length, fiber, active, curves)
            if fraction <= MIN_STEP:
                break
            fraction *= 0.5
    # At the smallest length any residual is accepted, because the fibers cannot shorten further.
    return abs(error) < tolerance or (fiber <= m.smallest and not isnan(error)), fiber


def force_imbalance(
    m: Millard2012Equilibrium, length: float, fiber: float, active: float, curves: MillardCurves
) -> tuple[float, float]:
    """Return the force of resting fibers along the tendon less the tendon force, and its derivative.

    Args:
        m: parameters of the muscle.
        length: length of the path (m).
        fiber: fiber length (m).
        active: activation.
        curves: curves of the muscle.

    Returns:
        Residual (N) and derivative by the fiber length (N/m).
    """
    # Fibers no longer than high have no pennation angle.
    if fiber <= m.height:
        return nan, nan
    cos = cos_pennation(fiber, m.height, m.shortest, m.largest_sin, m.least_cos)
    by_length, active_slope = curve_value(curves.active, fiber / m.optimal)
    elastic, passive_slope = curve_value(curves.passive, fiber / m.optimal)
    tendon, tendon_slope = curve_value(curves.tendon, (length - fiber * cos) / m.slack)
    fiber_force = m.strength * (active * by_length) + m.strength * elastic
    sin = m.height / fiber
    # d(cos phi)/dl = sin^2(phi) / (l cos(phi)), because l sin(phi) is constant.
    turn = sin * sin / cos
    fiber_stiffness = (
        m.strength * (active * active_slope + passive_slope) / m.optimal * cos
        + fiber_force * turn / fiber
    )
    return (
        fiber_force * cos - tendon * m.strength,
        fiber_stiffness + tendon_slope * m.strength / m.slack * (cos + turn),
    )
