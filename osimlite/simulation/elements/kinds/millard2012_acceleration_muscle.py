"""The muscle by Millard with a mass between fibers and tendon."""

from collections.abc import Sequence
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
from osimlite.mechanics.laws.muscles import pennation
from osimlite.schema.muscles import Millard2012AccelerationMuscle
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.kind import DeclaredForce, State
from osimlite.simulation.elements.muscle import PENNATION, curve, muscle
from osimlite.simulation.elements.parameters import Fields, Number, Together, positive


def _others(builder: ElementBuilder, force: Any) -> tuple[float, ...]:
    own = force.muscle_first_order_activation_dynamic_model
    angle = force.pennation_angle_at_optimal
    return (
        own.activation_time_constant,
        own.deactivation_time_constant,
        own.minimum_activation,
        *pennation(force.optimal_fiber_length, angle, 0.5 * pi),
        cos(angle),
    )


def _check(builder: ElementBuilder, force: Any) -> None:
    PENNATION.read(builder, force)


def _energy(force: DeclaredForce, record: Sequence[float]) -> float:
    _, m, curves = force.values
    known = force.known(record)
    return millard2012_acceleration_energy(
        m, known["length"], known["fiber_length"], known["cos_pennation"], curves
    )


KIND = muscle(
    Millard2012AccelerationMuscle,
    millard2012_acceleration,
    ("solved", "activation_rate", "fiber_velocity", "fiber_acceleration"),
    Fields(
        Millard2012Acceleration,
        (
            Number("max_isometric_force"),
            positive("optimal_fiber_length"),
            positive("tendon_slack_length"),
            positive("max_contraction_velocity"),
            positive("mass"),
            Number("tendon_force_length_damping"),
            Number("fiber_compressive_force_length_damping"),
            Number("fiber_force_length_damping"),
            Number("fiber_compressive_force_cos_pennation_damping"),
            Number("fiber_damping"),
        ),
        _others,
    ),
    Together(
        AccelerationCurves,
        (
            curve("active_force_length_curve", ACTIVE_SIZE, active_force_length),
            curve("force_velocity_curve", VELOCITY_SIZE, force_velocity),
            curve("fiber_force_length_curve", PASSIVE_SIZE, fiber_force_length),
            curve("tendon_force_length_curve", TENDON_SIZE, tendon_force_length),
            curve(
                "fiber_compressive_force_length_curve",
                COMPRESSIVE_SIZE,
                fiber_compressive_force_length,
            ),
            curve(
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
    settled=("fiber_length", "fiber_velocity"),
    rigid=millard2012_acceleration_rigid,
    stored=_energy,
    check=_check,
)
