"""Parts that muscle models share: activation dynamics and pennation."""

from typing import Annotated

from osimlite.schema.base import ModelComponent
from osimlite.schema.facts import BELOW_QUARTER_TURN, UP_TO_QUARTER_TURN, Facts
from osimlite.schema.fields import real

MAXIMUM_PENNATION = 1.4706289056333368
"""The default of the largest pennation angle, arccos 0.1."""


class MuscleFirstOrderActivationDynamicModel(ModelComponent):
    """Activation that follows excitation with one time constant up and one down."""

    activation_time_constant: Annotated[float, real("s", "> 0")] = 0.01
    """Time constant of rising activation; a muscle that owns the part puts in its own."""
    deactivation_time_constant: Annotated[float, real("s", "> 0")] = 0.04
    """Time constant of falling activation; a muscle that owns the part puts in its own."""
    minimum_activation: Annotated[float, real(domain="0 to 1")] = 0.01
    """Activation below which the muscle does not go, whatever its control."""


class MuscleFixedWidthPennationModel(ModelComponent):
    """Fibers that keep the width of the muscle: length times sine of pennation stays what it is at optimal length."""

    facts = Facts(
        domains={
            "pennation_angle_at_optimal": BELOW_QUARTER_TURN,
            "maximum_pennation_angle": UP_TO_QUARTER_TURN,
        },
        refused="optimal_fiber_length pennation_angle_at_optimal maximum_pennation_angle",
    )

    optimal_fiber_length: Annotated[float, real("m", "> 0")] = 1.0
    """Fiber length at which `pennation_angle_at_optimal` is measured."""
    pennation_angle_at_optimal: Annotated[float, real("rad", ">= 0")] = 0.0
    """Angle between fibers and tendon at optimal fiber length; 0 is parallel."""
    maximum_pennation_angle: Annotated[float, real("rad", ">= 0")] = MAXIMUM_PENNATION
    """Angle that the fibers do not go beyond; it bounds their length from below."""
