"""What the muscles that are smooth everywhere have in common."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from osimlite.mechanics.laws.smooth_muscles import SmoothMuscle
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.kind import State
from osimlite.simulation.elements.muscle import PENNATION, height
from osimlite.simulation.elements.parameters import Fields, Number, positive

ACTIVATION = State("activation")


def smooth_fields(
    timed: Callable[[ElementBuilder, Any], Any] = lambda builder, force: force,
) -> Fields:
    """The numbers of such a muscle; `timed` gives the one that has its constants of activation."""

    def others(builder: ElementBuilder, force: Any) -> tuple[float, ...]:
        first = timed(builder, force)
        return (
            *height(builder, force),
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
            positive("optimal_fiber_length"),
            Number("tendon_slack_length"),
            positive("max_contraction_velocity"),
            Number("active_force_width_scale", lambda x: x >= 1.0, "is less than 1"),
            Number("fiber_damping", lambda x: x >= 0.0, "is less than 0"),
        ),
        others,
    )


def check_smooth(builder: ElementBuilder, force: Any) -> None:
    """Refuse such a muscle as OpenSim does.

    Raises:
        ModelError: a property has no meaning; it is named.
    """
    times = (
        "activation_time_constant",
        "deactivation_time_constant",
        "activation_dynamics_smoothing",
    )
    for number in (PENNATION, *map(positive, (*times, "default_activation"))):
        number.read(builder, force)
