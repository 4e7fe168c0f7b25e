"""Metabolic power of muscles (W): heats of activation, maintenance and shortening, and work.

The formulas are those of OpenSim 4.6's probes, which are described in T. Uchida et al., "Stretching
your energetic budget: how tendon compliance affects the metabolic cost of running", PLoS ONE 11,
2016. Original models: B. R. Umberger et al. (2003) and B. R. Umberger (2010); L. J. Bhargava et
al., Journal of Biomechanics 37 (2004). Smoothed form: A. Falisse et al., J. R. Soc. Interface 16
(2019).
"""

from __future__ import annotations

from math import cos, nan, pi, sin, tanh
from typing import NamedTuple


class Umberger2010(NamedTuple):
    """Parameters of a muscle and of its Umberger2010 probe.

    The fields after `aerobic_factor` are switches: 1 for yes and 0 for no.
    """

    max_contraction_velocity: float  # optimal fiber lengths a second
    optimal_fiber_length: float  # m
    mass: float  # kg
    ratio_slow_twitch_fibers: float  # fraction of slow fibers
    muscle_effort_scaling_factor: float  # factor of excitation, activation and active force
    aerobic_factor: float  # factor of all heat rates
    activation_maintenance_rate_on: float
    shortening_rate_on: float
    mechanical_work_rate_on: float
    enforce_minimum_heat_rate_per_muscle: float
    use_Bhargava_recruitment_model: float
    include_negative_mechanical_work: float
    forbid_negative_total_power: float


def umberger2010(
    activation: float,
    excitation: float,
    active_force: float,
    fiber_length: float,
    fiber_velocity: float,
    force_length: float,
    m: Umberger2010,
) -> float:
    """Return the power by the model of B. Umberger (2010) with T. Uchida's changes (2016) (W).

    With effort A, part s of slow fibers, aerobic factor S, normalized length l, velocity v (optimal
    lengths a second), largest velocity vmax, and factor fl of the active force by length, the terms
    per kg of muscle are

    - heat of activation and maintenance: S A^0.6 (128 (1 - s) + 25), times 0.4 + 0.6 fl for l > 1;
    - heat of shortening, v <= 0: S A^2 (min(-ks v, 100) s - kf v (1 - s)), where kf = 153 / vmax
      and ks = 250 / vmax;
    - heat of lengthening, v > 0: 0.3 S A ks v, or 4 S A ks v if negative work is included;
    - work: minus the active force times the fiber velocity (m/s), over the mass.

    The heat of shortening or lengthening is multiplied by fl for l > 1.

    Args:
        activation: activation of the fibers.
        excitation: excitation of the muscle.
        active_force: active fiber force (N).
        fiber_length: fiber length (m).
        fiber_velocity: fiber velocity, negative for shortening (m/s).
        force_length: factor of the active force by length.
        m: parameters of the muscle and of its probe.

    Returns:
        Power of the muscle (W): heat rates and work rate per kg of muscle, times its mass.
    """
    forbids = m.forbid_negative_total_power
    activation *= m.muscle_effort_scaling_factor
    excitation *= m.muscle_effort_scaling_factor
    active_force *= m.muscle_effort_scaling_factor
    length = fiber_length / m.optimal_fiber_length
    velocity = fiber_velocity / m.optimal_fiber_length
    # Umberger et al. 2003: the effort follows the excitation while it exceeds the
    # activation, else their mean.
    effort = excitation if excitation > activation else (excitation + activation) / 2.0
    slow = m.ratio_slow_twitch_fibers
    # Bhargava's recruitment makes the part of slow fibers depend on the excitation.
    if m.use_Bhargava_recruitment_model:
        of_slow, of_fast = recruit_fibers(excitation, slow)
        slow = 1.0 if excitation == 0.0 else of_slow / (of_slow + of_fast)
    upkeep = shortening = work = 0.0
    if forbids or m.activation_maintenance_rate_on:
        # Umberger et al. 2003: heat of activation and maintenance of fully active fibers
        # (W/kg), 25 for slow fibers and 153 for fast ones.
        unscaled = 128.0 * (1.0 - slow) + 25.0
        # A negative number has no real power of 0.6: NaN shows the error in the result.
        upkeep = m.aerobic_factor * (effort**0.6 if effort >= 0.0 else nan)
        # Beyond the optimal length, 40 % of the heat belong to activation and do not fall with the
        # force.
        upkeep *= unscaled if length <= 1.0 else 0.4 * unscaled + 0.6 * unscaled * force_length
    if forbids or m.shortening_rate_on:
        # Heat coefficients of shortening (Umberger et al. 2003); the largest velocity
        # of slow fibers is 1 / 2.5 of that of fast ones.
        of_fast = 153.0 / m.max_contraction_velocity
        of_slow = 100.0 / (m.max_contraction_velocity / 2.5)
        if velocity <= 0.0:
            # The heat of slow fibers is limited to 100 W/kg, as in OpenSim.
            heat = min(-of_slow * velocity, 100.0) * slow - of_fast * velocity * (1.0 - slow)
            shortening = m.aerobic_factor * effort * effort * heat
        else:
            # Lengthening: 4 times the slow coefficient in the model of 2003, where negative work is
            # subtracted; 0.3 times in that of 2010, where it is not.
            heat = (4.0 if m.include_negative_mechanical_work else 0.3) * of_slow * velocity
            shortening = m.aerobic_factor * effort * heat
        if length > 1.0:
            shortening *= force_length
    if (forbids or m.mechanical_work_rate_on) and (
        m.include_negative_mechanical_work or fiber_velocity <= 0.0
    ):
        work = -max(active_force, 0.0) * fiber_velocity / m.mass
    # Uchida et al. 2016: raise the shortening heat until the total power is not negative.
    if forbids:
        shortening -= min(upkeep + shortening + work, 0.0)
    heat = (upkeep if m.activation_maintenance_rate_on else 0.0) + (
        shortening if m.shortening_rate_on else 0.0
    )
    if (
        m.activation_maintenance_rate_on
        and m.shortening_rate_on
        and m.enforce_minimum_heat_rate_per_muscle
    ):
        # Heat is at least 1 W/kg, but only if all heat rates are counted (Umberger et al. 2003).
        heat = max(heat, 1.0)
    return (heat + (work if m.mechanical_work_rate_on else 0.0)) * m.mass


class Bhargava2004(NamedTuple):
    """Parameters of a muscle and of its Bhargava2004 probe.

    The fields after `muscle_effort_scaling_factor` are switches: 1 for yes and 0 for no.
    """

    max_isometric_force: float  # N
    optimal_fiber_length: float  # m
    mass: float  # kg
    ratio_slow_twitch_fibers: float  # fraction of slow fibers
    activation_constant_slow_twitch: float  # W/kg
    activation_constant_fast_twitch: float  # W/kg
    maintenance_constant_slow_twitch: float  # W/kg
    maintenance_constant_fast_twitch: float  # W/kg
    muscle_effort_scaling_factor: float  # factor of excitation, activation and active force
    activation_rate_on: float
    maintenance_rate_on: float
    shortening_rate_on: float
    mechanical_work_rate_on: float
    enforce_minimum_heat_rate_per_muscle: float
    use_force_dependent_shortening_prop_constant: float
    include_negative_mechanical_work: float
    forbid_negative_total_power: float


def bhargava2004(
    activation: float,
    excitation: float,
    active_force: float,
    passive_force: float,
    fiber_velocity: float,
    force_length: float,
    maintained: float,
    m: Bhargava2004,
) -> float:
    """Return the power by the model of L. Bhargava et al. (2004) (W).

    With the mass m, the excited parts rs and rf of slow and fast fibers (see `recruit_fibers`), the
    constants as, af, bs and bf of activation and maintenance, the factor g of maintenance by length,
    the active force fa and the fiber velocity v, the terms are the heats of activation m (as rs + af
    rf), of maintenance m g (bs rs + bf rf) and of shortening -alpha v, and the work -fa v. The
    coefficient alpha (N) depends on the forces of the fibers and on the sign of v.

    Args:
        activation: activation of the fibers.
        excitation: excitation of the muscle.
        active_force: active fiber force (N).
        passive_force: passive fiber force (N).
        fiber_velocity: fiber velocity, negative for shortening (m/s).
        force_length: factor of the active force by length.
        maintained: factor of the heat of maintenance by length.
        m: parameters of the muscle and of its probe.

    Returns:
        Power of the muscle (W).
    """
    forbids = m.forbid_negative_total_power
    active_force *= m.muscle_effort_scaling_factor
    # As in OpenSim, the passive force is not scaled by the effort.
    total = active_force + passive_force
    slow, fast = recruit_fibers(
        m.muscle_effort_scaling_factor * excitation, m.ratio_slow_twitch_fibers
    )
    starting = keeping = shortening = work = 0.0
    if forbids or m.activation_rate_on:
        starting = m.mass * (
            m.activation_constant_slow_twitch * slow + m.activation_constant_fast_twitch * fast
        )
    if forbids or m.maintenance_rate_on:
        keeping = (
            m.maintenance_constant_slow_twitch * slow + m.maintenance_constant_fast_twitch * fast
        )
        keeping *= m.mass * maintained
    if forbids or m.shortening_rate_on:
        if not m.use_force_dependent_shortening_prop_constant:
            # Constant form: 0.25 of the fiber force while shortening, no heat while lengthening.
            factor = 0.25 * total if fiber_velocity <= 0.0 else 0.0
        elif fiber_velocity <= 0.0:
            isometric = (
                m.muscle_effort_scaling_factor * activation * force_length * m.max_isometric_force
            )
            # Bhargava et al. 2004: 0.16 of the isometric force plus 0.18 of the force for
            # shortening, 0.157 of the force for lengthening.
            factor = 0.16 * isometric + 0.18 * total
        else:
            factor = 0.157 * total
        shortening = -factor * fiber_velocity
    if (forbids or m.mechanical_work_rate_on) and (
        m.include_negative_mechanical_work or fiber_velocity <= 0.0
    ):
        work = -active_force * fiber_velocity
    if forbids:
        # Uchida et al. 2016: raise the shortening heat until the total power is not negative.
        shortening -= min(starting + keeping + shortening + work, 0.0)
    heat = (starting if m.activation_rate_on else 0.0) + (keeping if m.maintenance_rate_on else 0.0)
    heat += shortening if m.shortening_rate_on else 0.0
    all_on = m.activation_rate_on and m.maintenance_rate_on and m.shortening_rate_on
    if all_on and m.enforce_minimum_heat_rate_per_muscle:
        # At least 1 W per kg of muscle, but only if all heats are counted.
        heat = max(heat, m.mass)
    return heat + (work if m.mechanical_work_rate_on else 0.0)


def recruit_fibers(excitation: float, ratio_slow_twitch_fibers: float) -> tuple[float, float]:
    """Return the excited parts of all fibers, of slow and of fast ones.

    Source: L. J. Bhargava et al. 2004: slow fibers follow sin(pi e / 2) of the
    excitation e, fast ones 1 - cos(pi e / 2), so that slow fibers are recruited first.

    Args:
        excitation: excitation e, scaled.
        ratio_slow_twitch_fibers: part of slow fibers in the muscle.

    Returns:
        Parts of slow and of fast fibers.
    """
    angle = 0.5 * pi * excitation
    return ratio_slow_twitch_fibers * sin(angle), (1.0 - ratio_slow_twitch_fibers) * (
        1.0 - cos(angle)
    )


class SmoothTransitions(NamedTuple):
    """Transitions of Bhargava2004SmoothedMuscleMetabolics.

    `form` 0 is no smoothing, 1 the hyperbolic tangent, 2 the function of Huber.
    """

    form: float  # form of the transitions: 0, 1 or 2
    velocity_smoothing: float  # sharpness of the transition from shortening to lengthening
    power_smoothing: float  # sharpness of the lower bound of the power, 0
    heat_rate_smoothing: float  # sharpness of the lower bound of the heat rate, 1 W/kg


def bhargava2004_smoothed(
    activation: float,
    excitation: float,
    active_force: float,
    passive_force: float,
    fiber_velocity: float,
    force_length: float,
    maintained: float,
    m: Bhargava2004,
    transitions: SmoothTransitions,
) -> tuple[float, float, float, float, float]:
    """Return the powers by Bhargava's model with smooth transitions (W).

    Source: A. Falisse et al., J. R. Soc. Interface 16, 2019. The switches of single rates in `m`
    have no effect here.

    Args:
        activation: activation of the fibers.
        excitation: excitation of the muscle.
        active_force: active fiber force (N).
        passive_force: passive fiber force (N).
        fiber_velocity: fiber velocity, negative for shortening (m/s).
        force_length: factor of the active force by length.
        maintained: factor of the heat of maintenance by length.
        m: parameters of the muscle and of its probe.
        transitions: parameters of the transitions.

    Returns:
        Total power, and the parts of activation, maintenance, shortening and work (W).
    """
    active_force *= m.muscle_effort_scaling_factor
    total = active_force + passive_force
    slow, fast = recruit_fibers(
        m.muscle_effort_scaling_factor * excitation, m.ratio_slow_twitch_fibers
    )
    starting = m.mass * (
        m.activation_constant_slow_twitch * slow + m.activation_constant_fast_twitch * fast
    )
    keeping = m.maintenance_constant_slow_twitch * slow + m.maintenance_constant_fast_twitch * fast
    keeping *= m.mass * maintained
    # OpenSim keeps the argument of the Huber function away from 0.
    velocity = fiber_velocity + 1e-16
    if m.use_force_dependent_shortening_prop_constant:
        isometric = (
            m.muscle_effort_scaling_factor * activation * force_length * m.max_isometric_force
        )
        ends = 0.16 * isometric + 0.18 * total, 0.157 * total
        # OpenSim has no Huber form of this transition and takes the hyperbolic tangent instead.
        factor = blend_values(
            velocity, *ends, transitions.velocity_smoothing, -1.0, min(transitions.form, 1.0)
        )
    else:
        factor = blend_values(
            velocity, 0.25 * total, 0.0, transitions.velocity_smoothing, -1.0, transitions.form
        )
    shortening = -factor * velocity
    work = -active_force * fiber_velocity
    if not m.include_negative_mechanical_work:
        # Negative work, of lengthening fibers, is blended out.
        work = blend_values(
            velocity, work, 0.0, transitions.velocity_smoothing, -1.0, transitions.form
        )
    if m.forbid_negative_total_power:
        # Power that would be negative is blended into additional heat of shortening.
        power = starting + keeping + shortening + work
        shortening -= blend_values(
            -power, 0.0, power, transitions.power_smoothing, 1.0, transitions.form
        )
    heat = starting + keeping + shortening
    if m.enforce_minimum_heat_rate_per_muscle:
        heat = blend_values(
            m.mass - heat, heat, m.mass, transitions.heat_rate_smoothing, 1.0, transitions.form
        )
    return heat + work, starting, keeping, shortening, work


def blend_values(
    x: float, left: float, right: float, sharpness: float, direction: float, form: float
) -> float:
    """Return a smooth blend from `left` for negative x to `right` for positive x.

    Args:
        x: variable of the transition.
        left: value for negative x.
        right: value for positive x.
        sharpness: steepness of the transition.
        direction: direction of the Huber function, 1 or -1.
        form: form of the transition, see :class:`SmoothTransitions`.
    """
    if form == 0.0:
        return left if x <= 0.0 else right
    if form == 1.0:
        return left + (right - left) * (0.5 + 0.5 * tanh(sharpness * x))
    # Huber's function is quadratic within half a unit of the transition and linear beyond; OpenSim
    # divides by x, which callers keep away from 0.
    offset = left if direction > 0.0 else right
    y = sharpness * direction * x + 0.5
    rise = offset
    if y > 1.0:
        rise += y - 0.5
    elif y >= 0.0:
        rise += 0.5 * y * y
    return (right - left) / x * (rise / sharpness + offset * (1.0 - 1.0 / sharpness))
