"""What muscles have in common: one tension along a path by an excitation, and what is recorded of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import pi, sin
from typing import Any

from osimlite.errors import ModelError
from osimlite.mechanics.laws.muscles import SIGNIFICANT, MuscleInputs
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.force_type import ForceType
from osimlite.simulation.elements.geometries.path import PATH
from osimlite.simulation.elements.parameters import Number, Parameter, Vector

RECORDED = (
    "tension",
    "activation",
    "fiber_length",
    "cos_pennation",
    "active_force_length",
    "force_velocity",
    "active_fiber_force",
    "passive_fiber_force",
)
"""What the law of a muscle gives first: N, m, N; what is kept of it besides are length and rate of
the path, and the velocity of the fibers.
"""

STRENGTH = "active_fiber_force"
"""The force (N) of fully active fibers, where the tendon is taken for rigid."""

SPRING = "elastic_fiber_force"
"""What of the passive force of fibers with damping is not by that, N."""

PENNATION = Number(
    "pennation_angle_at_optimal",
    lambda x: 0.0 <= x <= 0.5 * pi - SIGNIFICANT,
    "is not from 0 to less than pi/2",
)


def height(builder: ElementBuilder, force: Any) -> tuple[float]:
    """Of the fibers across the tendon, m."""
    return (
        force.optimal_fiber_length * sin(Number("pennation_angle_at_optimal").read(builder, force)),
    )


def curve(
    name: str,
    size: int,
    make: Callable[..., Sequence[float]],
    changed: Callable[[Any], dict[str, Any]] = lambda _: {},
) -> Vector:
    """The curve that a property of a muscle stands for; the law is given its numbers, as `curve_value` takes them.

    Args: name: of the property. size: how many numbers. make: makes them of the curve's own
        properties, in their order; a ValueError tells why there is no such curve. changed: those
        that the muscle changes.
    """

    def read(builder: ElementBuilder, force: Any) -> Sequence[float]:
        own = getattr(force, name)
        properties = {name: getattr(own, name) for name in type(own).__annotations__} | changed(
            force
        )
        try:
            return make(*properties.values())
        except ValueError as error:
            raise ModelError(
                f"the {name} of '{builder.path(force)}' makes no curve: {error}"
            ) from None

    return Vector(size, read)


def require(builder: ElementBuilder, force: Any, *numbers: Number) -> None:
    """Refuse a muscle that OpenSim refuses for its activation or its pennation, or for what `numbers` do not accept.

    Raises:
        ModelError: a property has no meaning; it is named.
    """
    least = force.minimum_activation
    usual = (
        PENNATION,
        Number("maximum_pennation_angle", lambda x: 0.0 <= x <= 0.5 * pi, "is not from 0 to pi/2"),
        Number(
            "minimum_activation",
            lambda x: 0.0 <= x < 1.0 - SIGNIFICANT,
            "is not from 0 to less than 1",
        ),
        Number(
            "min_control",
            lambda x: not x < least,
            f"is below its minimum_activation, {least:g}; raise it",
        ),
    )
    for number in (*usual, *numbers):
        number.read(builder, force)


def _told(known: Mapping[str, float]) -> str:
    off = known["length"] - known["tendon_slack_length"] - known["optimal_fiber_length"]
    # A search that is not for a fiber length has none to tell.
    fibers = (
        f", with fibers of {known['fiber_length']:.4g} m" if known["fiber_length"] > 0.0 else ""
    )
    return (
        f", whose path of {known['length']:.4g} m is {abs(off):.3g} m {'longer' if off > 0.0 else 'shorter'} than its "
        f"tendon_slack_length and optimal_fiber_length together{fibers}"
    )


def muscle(
    component: type,
    law: Callable[..., Any],
    rates: tuple[str, ...],
    *parameters: Parameter,
    **more: Any,
) -> ForceType:
    """The kind of a muscle.

    Args:
        component: its class.
        law: gives what is recorded, and then rates, from :class:`MuscleInputs` and the parameters.
        rates: of states, of which "fiber_velocity" is one, and what else the law gives.
        parameters: that the law is given.
        more: attributes of the kind.
    """
    return ForceType(
        component,
        PATH,
        law,
        outputs=(*RECORDED, *rates),
        parameters=parameters,
        kept=("length", "rate", "fiber_velocity"),
        controlled=True,
        together=MuscleInputs,
        labels={"{name}": "tension"},
        told=_told,
        **more,
    )
