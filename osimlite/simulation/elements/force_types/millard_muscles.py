"""Muscles of Millard et al. 2013: fibers and tendon in equilibrium, or with a mass between them."""

from collections.abc import Sequence
from functools import partial
from math import cos, pi
from typing import Any

from osimlite.mechanics.laws.millard2012_acceleration import (
    AccelerationCurves,
    Millard2012Acceleration,
    millard2012_acceleration,
    millard2012_acceleration_energy,
    millard2012_acceleration_equilibrium,
    millard2012_acceleration_rigid,
)
from osimlite.mechanics.laws.millard2012_equilibrium import (
    Millard2012Equilibrium,
    MillardCurves,
    MillardFibers,
    combine_length_curves,
    combine_velocity_curve,
    fibers_at,
    make_muscle_results,
    millard2012_at_velocity,
    millard2012_energy,
    millard2012_equilibrium,
    millard2012_equilibrium_length,
    millard2012_rigid,
    request_velocity_curve,
)
from osimlite.mechanics.laws.muscle_curves import (
    ACTIVE_SIZE,
    COMPRESSIVE_SIZE,
    PASSIVE_SIZE,
    TENDON_SIZE,
    VELOCITY_SIZE,
    active_force_length,
    fiber_compressive_force_cos_pennation,
    fiber_compressive_force_length,
    fiber_force_length,
    force_velocity,
    tendon_force_length,
)
from osimlite.mechanics.laws.muscles import SIGNIFICANT, pennation_constants
from osimlite.schema.millard_muscles import (
    Millard2012AccelerationMuscle,
    Millard2012EquilibriumMuscle,
)
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.force_type import DeclaredForce, State
from osimlite.simulation.elements.kernel_text import BatchedLaw, LookupStage, SearchStage
from osimlite.simulation.elements.muscle import (
    PENNATION,
    SPRING,
    check_muscle,
    define_curve,
    define_muscle,
)
from osimlite.simulation.elements.parameters import Fields, Number, ParameterGroup, require_positive
from osimlite.simulation.elements.registry import register_force_type

MIN_FIBER_DAMPING = 0.001
"""As in OpenSim, a smaller `fiber_damping` counts as 0."""


def _read_pennation(force: Any) -> tuple[float, ...]:
    return pennation_constants(
        force.optimal_fiber_length, force.pennation_angle_at_optimal, force.maximum_pennation_angle
    )


def _min_fiber_length(force: Any) -> float:
    by_curve: float = (
        force.active_force_length_curve.min_norm_active_fiber_length * force.optimal_fiber_length
    )
    return max(SIGNIFICANT, by_curve, _read_pennation(force)[1])


def _read_equilibrium_fields(builder: ElementBuilder, force: Any) -> tuple[float, ...]:
    # OpenSim takes smaller damping for none and uses the classic form, which divides by the active
    # force.
    damping = force.fiber_damping if force.fiber_damping >= MIN_FIBER_DAMPING else 0.0
    return (
        damping,
        force.least_activation,
        *_read_pennation(force),
        _min_fiber_length(force),
    )


def _adapt_active_curve(force: Any) -> dict[str, float]:
    # For the classic elastic muscle OpenSim keeps the curve above 0.1, since that form
    # divides by the active force.
    least = force.active_force_length_curve.minimum_value
    return {"minimum_value": max(least, 0.1) if force.is_classic else min(least, 0.0)}


def _adapt_velocity_curve(force: Any) -> dict[str, float]:
    curve = force.force_velocity_curve
    ends = curve.concentric_slope_at_vmax, curve.eccentric_slope_at_vmax
    # The classic form inverts the force-velocity curve, which must then not be flat at its ends.
    if force.is_classic:
        return _set_end_slopes(*map(max, ends, _adapt_inverse_curve(force).values()))
    return _set_end_slopes(*(min(end, 0.0) for end in ends))


def _adapt_inverse_curve(force: Any) -> dict[str, float]:
    curve = force.force_velocity_curve
    return _set_end_slopes(
        0.5 * curve.concentric_slope_near_vmax, 0.5 * curve.eccentric_slope_near_vmax
    )


def _set_end_slopes(concentric: float, eccentric: float) -> dict[str, float]:
    """Return the end slopes of a force-velocity curve as arguments of its constructor."""
    return {"concentric_slope_at_vmax": concentric, "eccentric_slope_at_vmax": eccentric}


def _check_equilibrium_muscle(builder: ElementBuilder, force: Any) -> None:
    """Raise a ModelError if a parameter of a Millard2012EquilibriumMuscle is out of its domain."""
    # Without damping, the classic form divides by the activation; OpenSim's lower bound is 0.01.
    least = 0.01 if force.is_classic else 0.0
    slack = Number("tendon_slack_length", lambda x: x >= 0.0, "is negative")
    check_muscle(
        builder,
        force,
        Number("minimum_activation", lambda x: x >= least, f"is less than {least:g}"),
        slack if force.ignore_tendon_compliance else require_positive("tendon_slack_length"),
    )


def _compute_equilibrium_energy(force: DeclaredForce, record: Sequence[float]) -> float:
    _, m, curves = force.values
    named_values = force.list_named_values(record)
    return millard2012_energy(
        m,
        named_values["length"],
        named_values["fiber_length"],
        named_values["cos_pennation"],
        curves,
    )


register_force_type(
    define_muscle(
        Millard2012EquilibriumMuscle,
        millard2012_equilibrium,
        ("solved", "activation_rate", "fiber_velocity", SPRING),
        Fields(
            Millard2012Equilibrium,
            (
                Number("max_isometric_force"),
                require_positive("optimal_fiber_length"),
                Number("tendon_slack_length"),
                require_positive("max_contraction_velocity"),
                require_positive("activation_time_constant"),
                require_positive("deactivation_time_constant"),
                Number("ignore_tendon_compliance"),
                Number("ignore_activation_dynamics"),
            ),
            _read_equilibrium_fields,
        ),
        ParameterGroup(
            MillardCurves,
            (
                define_curve(
                    "active_force_length_curve",
                    ACTIVE_SIZE,
                    active_force_length,
                    _adapt_active_curve,
                ),
                define_curve(
                    "force_velocity_curve", VELOCITY_SIZE, force_velocity, _adapt_velocity_curve
                ),
                define_curve(
                    "force_velocity_curve",
                    VELOCITY_SIZE,
                    partial(force_velocity, inverse=True),
                    _adapt_inverse_curve,
                ),
                define_curve("fiber_force_length_curve", PASSIVE_SIZE, fiber_force_length),
                define_curve("tendon_force_length_curve", TENDON_SIZE, tendon_force_length),
            ),
        ),
        states=(
            State(
                "activation",
                lambda force: min(max(force.default_activation, force.least_activation), 1.0),
            ),
            State(
                "fiber_length",
                lambda force: max(force.default_fiber_length, _min_fiber_length(force)),
                output="fiber_velocity",
            ),
        ),
        equilibrium=millard2012_equilibrium_length,
        solved_states=("fiber_length",),
        rigid_law=millard2012_rigid,
        law_from_record=millard2012_at_velocity,
        batched=BatchedLaw(
            MillardFibers,
            fibers_at,
            LookupStage(
                {"active": "by_length", "passive": "by_length", "tendon": "tendon"},
                combine_length_curves,
                ("velocity", "by_velocity", "by_length", "elastic", "tendon"),
            ),
            SearchStage(
                ("velocity", "inverse"),
                request_velocity_curve,
                combine_velocity_curve,
                ("velocity_source", "velocity", "by_velocity"),
            ),
            make_muscle_results,
        ),
        compute_energy=_compute_equilibrium_energy,
        check=_check_equilibrium_muscle,
    )
)


def _read_acceleration_fields(builder: ElementBuilder, force: Any) -> tuple[float, ...]:
    dynamics = force.muscle_first_order_activation_dynamic_model
    angle = force.pennation_angle_at_optimal
    return (
        dynamics.activation_time_constant,
        dynamics.deactivation_time_constant,
        dynamics.minimum_activation,
        *pennation_constants(force.optimal_fiber_length, angle, 0.5 * pi),
        cos(angle),
    )


def _check_acceleration_muscle(builder: ElementBuilder, force: Any) -> None:
    PENNATION.read(builder, force)


def _compute_acceleration_energy(force: DeclaredForce, record: Sequence[float]) -> float:
    _, m, curves = force.values
    named_values = force.list_named_values(record)
    return millard2012_acceleration_energy(
        m,
        named_values["length"],
        named_values["fiber_length"],
        named_values["cos_pennation"],
        curves,
    )


register_force_type(
    define_muscle(
        Millard2012AccelerationMuscle,
        millard2012_acceleration,
        ("solved", "activation_rate", "fiber_velocity", "fiber_acceleration"),
        Fields(
            Millard2012Acceleration,
            (
                Number("max_isometric_force"),
                require_positive("optimal_fiber_length"),
                require_positive("tendon_slack_length"),
                require_positive("max_contraction_velocity"),
                require_positive("mass"),
                Number("tendon_force_length_damping"),
                Number("fiber_compressive_force_length_damping"),
                Number("fiber_force_length_damping"),
                Number("fiber_compressive_force_cos_pennation_damping"),
                Number("fiber_damping"),
            ),
            _read_acceleration_fields,
        ),
        ParameterGroup(
            AccelerationCurves,
            (
                define_curve("active_force_length_curve", ACTIVE_SIZE, active_force_length),
                define_curve("force_velocity_curve", VELOCITY_SIZE, force_velocity),
                define_curve("fiber_force_length_curve", PASSIVE_SIZE, fiber_force_length),
                define_curve("tendon_force_length_curve", TENDON_SIZE, tendon_force_length),
                define_curve(
                    "fiber_compressive_force_length_curve",
                    COMPRESSIVE_SIZE,
                    fiber_compressive_force_length,
                ),
                define_curve(
                    "fiber_compressive_force_cos_pennation_curve",
                    COMPRESSIVE_SIZE,
                    fiber_compressive_force_cos_pennation,
                ),
            ),
        ),
        states=(
            State("activation"),
            State("fiber_length", output="fiber_velocity"),
            State("fiber_velocity", output="fiber_acceleration"),
        ),
        equilibrium=millard2012_acceleration_equilibrium,
        solved_states=("fiber_length", "fiber_velocity"),
        rigid_law=millard2012_acceleration_rigid,
        compute_energy=_compute_acceleration_energy,
        check=_check_acceleration_muscle,
    )
)
