"""Declarations that all muscles share: one tension along a path, an excitation, and the recorded quantities."""

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
"""First outputs of the law of a muscle; forces in N, lengths in m.

The record also has length and rate of the path, and the fiber velocity.
"""

STRENGTH = "active_fiber_force"
"""Output with the force (N) of fully active fibers, of muscles with a rigid tendon."""

SPRING = "elastic_fiber_force"
"""Output with the elastic part (N) of the passive force of fibers with damping."""

PENNATION = Number(
    "pennation_angle_at_optimal",
    lambda x: 0.0 <= x <= 0.5 * pi - SIGNIFICANT,
    "is not from 0 to less than pi/2",
)
"""Pennation angle of a muscle at optimal fiber length, rad."""


def compute_height(builder: ElementBuilder, force: Any) -> tuple[float]:
    """Return the height of the fibers across the tendon, as a tuple of one number.

    The height h = l0 sin(a0) is constant, as in OpenSim's MuscleFixedWidthPennationModel.

    Args:
        builder: builder of the model's elements.
        force: the muscle.

    Returns:
        Optimal fiber length times the sine of the pennation angle there, m.
    """
    return (
        force.optimal_fiber_length * sin(Number("pennation_angle_at_optimal").read(builder, force)),
    )


def define_curve(
    name: str,
    size: int,
    make: Callable[..., Sequence[float]],
    changed: Callable[[Any], dict[str, Any]] = lambda _: {},
) -> Vector:
    """Return the parameter for a curve of a muscle; the law takes its numbers, for `curve_value`.

    Args:
        name: property with the curve.
        size: number of numbers.
        make: function that computes the numbers from the curve's properties, in their order; its
            ValueError says why the properties make no curve.
        changed: function that returns the properties of the curve that the muscle changes.

    Returns:
        Parameter with these numbers.
    """

    def read(builder: ElementBuilder, force: Any) -> Sequence[float]:
        # Muscles overwrite some properties of their curves.
        curve = getattr(force, name)
        properties = {name: getattr(curve, name) for name in type(curve).__annotations__} | changed(
            force
        )
        try:
            return make(*properties.values())
        except ValueError as error:
            raise ModelError(
                f"the {name} of '{builder.path(force)}' makes no curve: {error}"
            ) from None

    return Vector(size, read)


def check_muscle(builder: ElementBuilder, force: Any, *numbers: Number) -> None:
    """Check the properties that all muscles have, as OpenSim does.

    Args:
        builder: builder of the model's elements.
        force: the muscle.
        numbers: further properties of its class.

    Raises:
        ModelError: a property has no meaning; the message names it.
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


def _describe_failure(known: Mapping[str, float]) -> str:
    # Most failures come from a path whose length does not fit the fibers and the tendon.
    off = known["length"] - known["tendon_slack_length"] - known["optimal_fiber_length"]
    # Not every search is for a fiber length.
    fibers = (
        f", with fibers of {known['fiber_length']:.4g} m" if known["fiber_length"] > 0.0 else ""
    )
    return (
        f", whose path of {known['length']:.4g} m is {abs(off):.3g} m {'longer' if off > 0.0 else 'shorter'} than its "
        f"tendon_slack_length and optimal_fiber_length together{fibers}"
    )


def define_muscle(
    component: type,
    law: Callable[..., Any],
    rates: tuple[str, ...],
    *parameters: Parameter,
    **more: Any,
) -> ForceType:
    """Return the force type of a muscle.

    Args:
        component: class of the muscle.
        law: function of :class:`MuscleInputs` and the parameters, which returns `RECORDED` and
            `rates`.
        rates: outputs after `RECORDED`: rates of states, including "fiber_velocity", and others.
        parameters: parameters of the law.
        more: attributes of the force type.

    Returns:
        The declaration, which still has to be registered.
    """
    return ForceType(
        component,
        PATH,
        law,
        outputs=(*RECORDED, *rates),
        parameters=parameters,
        recorded_inputs=("length", "rate", "fiber_velocity"),
        has_control=True,
        inputs_type=MuscleInputs,
        labels={"{name}": "tension"},
        describe_failure=_describe_failure,
        **more,
    )
