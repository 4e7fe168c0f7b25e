"""Muscles that are smooth everywhere: DeGrooteFregly2016Muscle and MeyerFregly2016Muscle."""

from collections.abc import Callable
from typing import Any

from osimlite.mechanics.laws.smooth_muscles import (
    LARGEST_FORCE,
    SmoothMuscle,
    SmoothTendon,
    degroote,
    degroote_equilibrium,
    degroote_rigid,
    meyer,
    meyer_rigid,
    tendon_growth,
)
from osimlite.schema.smooth_muscles import DeGrooteFregly2016Muscle, MeyerFregly2016Muscle
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.force_type import State
from osimlite.simulation.elements.muscle import PENNATION, SPRING, compute_height, define_muscle
from osimlite.simulation.elements.parameters import Fields, Number, require_positive
from osimlite.simulation.elements.registry import register_force_type

ACTIVATION = State("activation")
"""State of both muscles, which starts at `default_activation`."""


def define_smooth_fields(
    timed: Callable[[ElementBuilder, Any], Any] = lambda builder, force: force,
) -> Fields:
    """Return the parameter with the numbers of a smooth muscle.

    Args:
        timed: function that returns the muscle whose activation constants are used.

    Returns:
        Parameter with the fields of `SmoothMuscle`.
    """

    def others(builder: ElementBuilder, force: Any) -> tuple[float, ...]:
        # The constants of activation may be those of another muscle, see `_find_activation_owner`.
        first = timed(builder, force)
        return (
            *compute_height(builder, force),
            not force.ignore_passive_fiber_force,
            not force.ignore_activation_dynamics,
            first.activation_time_constant,
            first.deactivation_time_constant,
            first.activation_dynamics_smoothing,
        )

    return Fields(
        SmoothMuscle,
        (
            Number("max_isometric_force"),
            require_positive("optimal_fiber_length"),
            Number("tendon_slack_length"),
            require_positive("max_contraction_velocity"),
            Number("active_force_width_scale", lambda x: x >= 1.0, "is less than 1"),
            Number("fiber_damping", lambda x: x >= 0.0, "is less than 0"),
        ),
        others,
    )


def check_smooth(builder: ElementBuilder, force: Any) -> None:
    """Check the properties of a smooth muscle as OpenSim does.

    Args:
        builder: builder of the model's elements.
        force: the muscle.

    Raises:
        ModelError: a property has no meaning; the message names it.
    """
    times = (
        "activation_time_constant",
        "deactivation_time_constant",
        "activation_dynamics_smoothing",
    )
    for number in (PENNATION, *map(require_positive, (*times, "default_activation"))):
        number.read(builder, force)


def _find_activation_owner(
    builder: ElementBuilder, force: DeGrooteFregly2016Muscle
) -> DeGrooteFregly2016Muscle:
    """Return the muscle whose activation constants count.

    OpenSim stores them in static variables, so that all muscles use those of the first muscle that the
    process computes: the first in the model, if the process computes no other.
    """
    muscles = (
        [] if builder.own_activation_times else builder.model.components(DeGrooteFregly2016Muscle)
    )
    return next((muscle for muscle in muscles if not muscle.ignore_activation_dynamics), force)


def _check_degroote(builder: ElementBuilder, force: DeGrooteFregly2016Muscle) -> None:
    check_smooth(builder, force)
    require_positive("tendon_strain_at_one_norm_force").read(builder, force)
    words = f"is not from 0 to {LARGEST_FORCE:g}"
    Number("default_normalized_tendon_force", lambda x: 0.0 <= x <= LARGEST_FORCE, words).read(
        builder, force
    )


def _read_tendon_fields(
    builder: ElementBuilder, force: DeGrooteFregly2016Muscle
) -> tuple[float, ...]:
    is_explicit = force.tendon_compliance_dynamics_mode == "explicit"
    return (
        tendon_growth(force.tendon_strain_at_one_norm_force),
        not force.ignore_tendon_compliance,
        is_explicit,
    )


register_force_type(
    define_muscle(
        DeGrooteFregly2016Muscle,
        degroote,
        ("activation_rate", "normalized_tendon_force_rate", "fiber_velocity", SPRING, "energy"),
        define_smooth_fields(_find_activation_owner),
        Fields(
            SmoothTendon,
            (require_positive("passive_fiber_strain_at_one_norm_force"),),
            _read_tendon_fields,
        ),
        states=(
            ACTIVATION,
            State("normalized_tendon_force"),
        ),
        equilibrium=degroote_equilibrium,
        solved_states=("normalized_tendon_force",),
        rigid_law=degroote_rigid,
        check=_check_degroote,
        shares_numbers=True,
        states_change_when_off=True,
    )
)


register_force_type(
    define_muscle(
        MeyerFregly2016Muscle,
        meyer,
        ("activation_rate", "fiber_velocity", SPRING),
        define_smooth_fields(),
        states=(ACTIVATION,),
        rigid_law=meyer_rigid,
        check=check_smooth,
        states_change_when_off=True,
    )
)
