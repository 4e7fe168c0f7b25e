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
                f"the properties of the {name} of '{builder.path(force)}' do not define a curve: {error}"
            ) from None

    return Vector(size, read)


def check_muscle(builder: ElementBuilder, force: Any, *numbers: Number) -> None:
    """Check the properties that all muscles have, as OpenSim does.

    Args:
        builder: builder of the model's elements.
        force: the muscle.
        numbers: further properties of the muscle's class.

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


def _describe_failure(values: Mapping[str, float]) -> str:
    """Return the part of a message that says why a muscle has no equilibrium.

    Args:
        values: values of inputs, parameters and outputs of the law, by name.
    """
    # Most failures come from a path whose length does not fit the fibers and the tendon.
    excess_length = (
        values["length"] - values["tendon_slack_length"] - values["optimal_fiber_length"]
    )
    # Not every search is for a fiber length.
    fibers_text = (
        f"; the search stopped at a fiber length of {values['fiber_length']:.4g} m"
        if values["fiber_length"] > 0.0
        else ""
    )
    return (
        f", whose path of {values['length']:.4g} m is {abs(excess_length):.3g} m "
        f"{'longer' if excess_length > 0.0 else 'shorter'} than the sum of its "
        f"tendon_slack_length and optimal_fiber_length{fibers_text}"
    )


def define_muscle(
    component_class: type,
    law: Callable[..., Any],
    further_outputs: tuple[str, ...],
    *parameters: Parameter,
    **attributes: Any,
) -> ForceType:
    """Return the declaration of a muscle: a tension along a path that a control excites.

    Args:
        component_class: class of the muscle.
        law: function of :class:`MuscleInputs` and the parameters, which returns the outputs
            `RECORDED` and `further_outputs`.
        further_outputs: names of the outputs after `RECORDED`: rates of states, including
            "fiber_velocity", and other quantities of the class.
        parameters: parameters of the law.
        attributes: further attributes of :class:`ForceType`, such as its states.

    Returns:
        The declaration, which still has to be registered.
    """
    return ForceType(
        component_class,
        PATH,
        law,
        outputs=(*RECORDED, *further_outputs),
        parameters=parameters,
        # Recorded as well, since reports and messages of muscles show them.
        recorded_inputs=("length", "rate", "fiber_velocity"),
        has_control=True,
        inputs_type=MuscleInputs,
        # OpenSim's force reporter has one column for a muscle: its name, with the tension.
        labels={"{name}": "tension"},
        describe_failure=_describe_failure,
        **attributes,
    )
