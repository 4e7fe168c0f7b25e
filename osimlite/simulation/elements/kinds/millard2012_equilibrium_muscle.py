"""The muscle by Millard whose fibers and tendon are in equilibrium."""

from collections.abc import Sequence
from functools import partial
from typing import Any

from osimlite.mechanics.laws.millard2012_equilibrium import (
    Fibers,
    Millard2012Equilibrium,
    MillardCurves,
    fibers_asking,
    fibers_at,
    fibers_loaded,
    fibers_moved,
    millard2012_again,
    millard2012_energy,
    millard2012_equilibrium,
    millard2012_equilibrium_length,
    millard2012_rigid,
    muscle_of,
)
from osimlite.mechanics.laws.muscle_curves import (
    ACTIVE_SIZE,
    PASSIVE_SIZE,
    TENDON_SIZE,
    VELOCITY_SIZE,
    active_force_length,
    fiber_force_length,
    force_velocity,
    tendon_force_length,
)
from osimlite.mechanics.laws.muscles import SIGNIFICANT, pennation
from osimlite.schema.muscle_parts import MuscleFirstOrderActivationDynamicModel
from osimlite.schema.muscles import Millard2012EquilibriumMuscle
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.kernel_text import Abreast, Asked, Sought
from osimlite.simulation.elements.kind import DeclaredForce, State
from osimlite.simulation.elements.muscle import SPRING, curve, muscle, require
from osimlite.simulation.elements.parameters import Fields, Number, Together, positive

LEAST_DAMPING = 0.001
"""A muscle whose `fiber_damping` is less has none, as in OpenSim."""


def _least_activation(force: Any) -> float:
    # Without dynamics of activation, OpenSim's part for them never hears of the property.
    owner = MuscleFirstOrderActivationDynamicModel() if force.ignore_activation_dynamics else force
    return float(owner.minimum_activation)


def _pennation(force: Any) -> tuple[float, ...]:
    return pennation(
        force.optimal_fiber_length, force.pennation_angle_at_optimal, force.maximum_pennation_angle
    )


def _smallest(force: Any) -> float:
    by_curve: float = (
        force.active_force_length_curve.min_norm_active_fiber_length * force.optimal_fiber_length
    )
    return max(SIGNIFICANT, by_curve, _pennation(force)[1])


def _others(builder: ElementBuilder, force: Any) -> tuple[float, ...]:
    damping = force.fiber_damping if force.fiber_damping >= LEAST_DAMPING else 0.0
    return damping, _least_activation(force), *_pennation(force), _smallest(force)


def _active(force: Any) -> dict[str, float]:
    least = force.active_force_length_curve.minimum_value
    return {"minimum_value": max(least, 0.1) if force.is_classic else min(least, 0.0)}


def _velocity(force: Any) -> dict[str, float]:
    own = force.force_velocity_curve
    ends = own.concentric_slope_at_vmax, own.eccentric_slope_at_vmax
    if force.is_classic:
        return _ends(*map(max, ends, _inverse(force).values()))
    return _ends(*(min(end, 0.0) for end in ends))


def _inverse(force: Any) -> dict[str, float]:
    own = force.force_velocity_curve
    return _ends(0.5 * own.concentric_slope_near_vmax, 0.5 * own.eccentric_slope_near_vmax)


def _ends(concentric: float, eccentric: float) -> dict[str, float]:
    return {"concentric_slope_at_vmax": concentric, "eccentric_slope_at_vmax": eccentric}


def _check(builder: ElementBuilder, force: Any) -> None:
    least = 0.01 if force.is_classic else 0.0
    slack = Number("tendon_slack_length", lambda x: x >= 0.0, "is negative")
    require(
        builder,
        force,
        Number("minimum_activation", lambda x: x >= least, f"is less than {least:g}"),
        slack if force.ignore_tendon_compliance else positive("tendon_slack_length"),
    )


def _energy(force: DeclaredForce, record: Sequence[float]) -> float:
    _, m, curves = force.values
    known = force.known(record)
    return millard2012_energy(
        m, known["length"], known["fiber_length"], known["cos_pennation"], curves
    )


KIND = muscle(
    Millard2012EquilibriumMuscle,
    millard2012_equilibrium,
    ("solved", "activation_rate", "fiber_velocity", SPRING),
    Fields(
        Millard2012Equilibrium,
        (
            Number("max_isometric_force"),
            positive("optimal_fiber_length"),
            Number("tendon_slack_length"),
            positive("max_contraction_velocity"),
            positive("activation_time_constant"),
            positive("deactivation_time_constant"),
            Number("ignore_tendon_compliance"),
            Number("ignore_activation_dynamics"),
        ),
        _others,
    ),
    Together(
        MillardCurves,
        (
            curve("active_force_length_curve", ACTIVE_SIZE, active_force_length, _active),
            curve("force_velocity_curve", VELOCITY_SIZE, force_velocity, _velocity),
            curve(
                "force_velocity_curve",
                VELOCITY_SIZE,
                partial(force_velocity, inverse=True),
                _inverse,
            ),
            curve("fiber_force_length_curve", PASSIVE_SIZE, fiber_force_length),
            curve("tendon_force_length_curve", TENDON_SIZE, tendon_force_length),
        ),
    ),
    states=(
        State(
            "activation",
            lambda force: min(max(force.default_activation, _least_activation(force)), 1.0),
        ),
        State(
            "fiber_length",
            lambda force: max(force.default_fiber_length, _smallest(force)),
            output="fiber_velocity",
        ),
    ),
    equilibrium=millard2012_equilibrium_length,
    settled=("fiber_length",),
    rigid=millard2012_rigid,
    again=millard2012_again,
    abreast=Abreast(
        Fibers,
        fibers_at,
        Asked(
            {"active": "by_length", "passive": "by_length", "tendon": "tendon"},
            fibers_loaded,
            ("velocity", "by_velocity", "by_length", "elastic", "tendon"),
        ),
        Sought(
            ("velocity", "inverse"),
            fibers_asking,
            fibers_moved,
            ("told_by", "velocity", "by_velocity"),
        ),
        muscle_of,
    ),
    stored=_energy,
    check=_check,
)
