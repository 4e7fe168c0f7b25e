"""Parts that muscle models share: activation dynamics and pennation."""

from typing import Annotated

from osimlite.schema.base import ModelComponent
from osimlite.schema.fields import real

MAXIMUM_PENNATION = 1.4706289056333368
"""The default of the largest pennation angle, arccos 0.1."""


class MuscleFirstOrderActivationDynamicModel(ModelComponent):
    """Activation that follows excitation with one time constant up and one down."""

    activation_time_constant: Annotated[float, real("s", "> 0")] = 0.01
    deactivation_time_constant: Annotated[float, real("s", "> 0")] = 0.04
    minimum_activation: Annotated[float, real(domain="0 to 1")] = 0.01


class MuscleFixedWidthPennationModel(ModelComponent):
    """Fibres that keep the width of the muscle: length times sine of pennation stays what it is at optimal length."""

    optimal_fiber_length: Annotated[float, real("m", "> 0")] = 1.0
    pennation_angle_at_optimal: Annotated[float, real("rad", ">= 0")] = 0.0
    maximum_pennation_angle: Annotated[float, real("rad", ">= 0")] = MAXIMUM_PENNATION
