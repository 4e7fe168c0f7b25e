"""Thelen2003Muscle: fibers and tendon in equilibrium, with formulas in place of curves."""

from collections.abc import Sequence
from math import exp

from osimlite.mechanics.laws.muscles import pennation_constants
from osimlite.mechanics.laws.thelen2003 import (
    Thelen2003,
    tendon_shape,
    thelen2003,
    thelen2003_energy,
    thelen2003_equilibrium,
    thelen2003_rigid,
)
from osimlite.schema.muscles import Thelen2003Muscle
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.force_type import DeclaredForce, State
from osimlite.simulation.elements.muscle import check_muscle, define_muscle
from osimlite.simulation.elements.parameters import Fields, Number, require_positive
from osimlite.simulation.elements.registry import register_force_type


def _check_muscle(builder: ElementBuilder, force: Thelen2003Muscle) -> None:
    flags = "ignore_tendon_compliance", "ignore_activation_dynamics"
    check_muscle(
        builder,
        force,
        *(
            Number(
                flag,
                lambda x: x == 0.0,
                "is true, which a Thelen2003Muscle does not support; set it to false",
            )
            for flag in flags
        ),
        Number("minimum_activation", lambda x: x >= 0.01, "is less than 0.01"),
        *map(require_positive, ("FmaxTendonStrain", "FmaxMuscleStrain")),
        # exp(KshapePassive) must be finite and differ from 1.
        Number("KshapePassive", lambda x: 1e-9 < x < 700.0, "is not between 1e-9 and 700"),
        Number(
            "fv_linear_extrap_threshold", lambda x: x * force.Flen > 1.0, "is not above 1 / Flen"
        ),
    )


def _read_derived_fields(builder: ElementBuilder, force: Thelen2003Muscle) -> tuple[float, ...]:
    angles = force.pennation_angle_at_optimal, force.maximum_pennation_angle
    shape = force.KshapePassive
    return (
        *pennation_constants(force.optimal_fiber_length, *angles),
        *tendon_shape(force.FmaxTendonStrain),
        shape / force.FmaxMuscleStrain,
        1.0 / (exp(shape) - 1.0),
    )


def _compute_energy(force: DeclaredForce, record: Sequence[float]) -> float:
    named_values = force.list_named_values(record)
    return thelen2003_energy(
        force.values[1],
        named_values["length"],
        named_values["fiber_length"],
        named_values["cos_pennation"],
    )


register_force_type(
    define_muscle(
        Thelen2003Muscle,
        thelen2003,
        ("activation_rate", "fiber_velocity"),
        Fields(
            Thelen2003,
            (
                Number("max_isometric_force"),
                require_positive("optimal_fiber_length"),
                require_positive("tendon_slack_length"),
                require_positive("max_contraction_velocity"),
                require_positive("activation_time_constant"),
                require_positive("deactivation_time_constant"),
                Number("minimum_activation"),
                require_positive("KshapeActive"),
                require_positive("Af"),
                Number("Flen", lambda x: x > 1.0, "is not above 1"),
                Number("fv_linear_extrap_threshold"),
            ),
            _read_derived_fields,
        ),
        states=(
            State("activation"),
            State("fiber_length", output="fiber_velocity"),
        ),
        equilibrium=thelen2003_equilibrium,
        solved_states=("fiber_length",),
        rigid_law=thelen2003_rigid,
        compute_energy=_compute_energy,
        check=_check_muscle,
    )
)
