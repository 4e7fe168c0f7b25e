"""Metabolic energy of muscles: heat rates and mechanical work (Umberger et al. 2003, Bhargava et al. 2004)."""

import math
from typing import Annotated

from osimlite.schema.base import Component, ModelComponent, Object, made, none
from osimlite.schema.fields import (
    Flag,
    LegacyMany,
    Many,
    MaybeFlag,
    Number,
    Reference,
    Single,
    Unnamed,
    Value,
    maybe,
    real,
)
from osimlite.schema.functions import PiecewiseLinearFunction
from osimlite.schema.probes import Probe
from osimlite.schema.references import MuscleSocket
from osimlite.schema.sets import ObjectGroup

_NAME_OF_MUSCLE = Reference("muscle-name", "Muscle")


class Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameter(Object):
    """What the probe must know about one muscle, whose name the object bears."""

    name_reference = _NAME_OF_MUSCLE

    specific_tension: Annotated[float, real("Pa", "> 0")] = 250000.0
    density: Annotated[float, real("kg/m^3", "> 0")] = 1059.7
    ratio_slow_twitch_fibers: Annotated[float, real(domain="0 to 1")] = 0.5
    use_provided_muscle_mass: Flag = False
    provided_muscle_mass: Annotated[float, real("kg", "> 0")] = math.nan


class Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameterSet(Object):
    """The muscles of one probe."""

    objects: LegacyMany[Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameter] = none()
    groups: LegacyMany[ObjectGroup] = none()


class Umberger2010MuscleMetabolicsProbe(Probe):
    """Metabolic power by the model of Umberger et al. (2003) with the changes of Uchida et al. (2016)."""

    activation_maintenance_rate_on: Flag = True
    shortening_rate_on: Flag = True
    basal_rate_on: Flag = True
    mechanical_work_rate_on: Flag = True
    enforce_minimum_heat_rate_per_muscle: Flag = True
    aerobic_factor: Annotated[float, real(domain="> 0")] = 1.5
    basal_coefficient: Number = 1.2
    basal_exponent: Number = 1.0
    muscle_effort_scaling_factor: Number = 1.0
    use_Bhargava_recruitment_model: Flag = True
    include_negative_mechanical_work: Flag = True
    forbid_negative_total_power: Flag = True
    report_total_metabolics_only: Flag = True
    metabolic_muscle_parameter_set: Unnamed[Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameterSet] = made(
        Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameterSet
    )


class Bhargava2004MuscleMetabolicsProbe_MetabolicMuscleParameter(Object):
    """What the probe must know about one muscle, whose name the object bears."""

    name_reference = _NAME_OF_MUSCLE

    specific_tension: Annotated[float, real("Pa", "> 0")] = 250000.0
    density: Annotated[float, real("kg/m^3", "> 0")] = 1059.7
    ratio_slow_twitch_fibers: Annotated[float, real(domain="0 to 1")] = 0.5
    use_provided_muscle_mass: MaybeFlag = False
    provided_muscle_mass: Annotated[float | None, maybe("kg", "> 0")] = math.nan
    activation_constant_slow_twitch: Annotated[float, real("W/kg", ">= 0")] = 40.0
    activation_constant_fast_twitch: Annotated[float, real("W/kg", ">= 0")] = 133.0
    maintenance_constant_slow_twitch: Annotated[float, real("W/kg", ">= 0")] = 74.0
    maintenance_constant_fast_twitch: Annotated[float, real("W/kg", ">= 0")] = 111.0


class Bhargava2004MuscleMetabolicsProbe_MetabolicMuscleParameterSet(Object):
    """The muscles of one probe."""

    objects: LegacyMany[Bhargava2004MuscleMetabolicsProbe_MetabolicMuscleParameter] = none()
    groups: LegacyMany[ObjectGroup] = none()


class Bhargava2004MuscleMetabolicsProbe(Probe):
    """Metabolic power by the model of Bhargava et al. (2004)."""

    activation_rate_on: Flag = True
    maintenance_rate_on: Flag = True
    shortening_rate_on: Flag = True
    basal_rate_on: Flag = True
    mechanical_work_rate_on: Flag = True
    enforce_minimum_heat_rate_per_muscle: Flag = True
    normalized_fiber_length_dependence_on_maintenance_rate: Single[PiecewiseLinearFunction] = made(
        PiecewiseLinearFunction,
        name="normalized_fiber_length_dependence_on_maintenance_rate",
        x=(0.0, 0.5, 1.0, 1.5, 2.0),
        y=(0.5, 0.5, 1.0, 0.0, 0.0),
    )
    use_force_dependent_shortening_prop_constant: Flag = False
    basal_coefficient: Number = 1.2
    basal_exponent: Number = 1.0
    muscle_effort_scaling_factor: Number = 1.0
    include_negative_mechanical_work: Flag = True
    forbid_negative_total_power: Flag = True
    report_total_metabolics_only: Flag = True
    metabolic_muscle_parameter_set: Unnamed[Bhargava2004MuscleMetabolicsProbe_MetabolicMuscleParameterSet] = made(
        Bhargava2004MuscleMetabolicsProbe_MetabolicMuscleParameterSet
    )


class Bhargava2004SmoothedMuscleMetabolics_MuscleParameters(Component):
    """What the metabolics component must know about one muscle."""

    socket_muscle: MuscleSocket = ""
    specific_tension: Annotated[float, real("Pa", "> 0")] = 250000.0
    density: Annotated[float, real("kg/m^3", "> 0")] = 1059.7
    ratio_slow_twitch_fibers: Annotated[float, real(domain="0 to 1")] = 0.5
    use_provided_muscle_mass: MaybeFlag = False
    provided_muscle_mass: Annotated[float | None, maybe("kg", "> 0")] = math.nan
    activation_constant_slow_twitch: Annotated[float, real("W/kg", ">= 0")] = 40.0
    activation_constant_fast_twitch: Annotated[float, real("W/kg", ">= 0")] = 133.0
    maintenance_constant_slow_twitch: Annotated[float, real("W/kg", ">= 0")] = 74.0
    maintenance_constant_fast_twitch: Annotated[float, real("W/kg", ">= 0")] = 111.0


class Bhargava2004SmoothedMuscleMetabolics(ModelComponent):
    """The model of Bhargava et al. (2004) as a component with outputs, made smooth for optimisation."""

    muscle_parameters: Many[Bhargava2004SmoothedMuscleMetabolics_MuscleParameters] = none()
    enforce_minimum_heat_rate_per_muscle: Flag = True
    use_force_dependent_shortening_prop_constant: Flag = False
    basal_coefficient: Number = 1.2
    basal_exponent: Number = 1.0
    muscle_effort_scaling_factor: Number = 1.0
    include_negative_mechanical_work: Flag = True
    forbid_negative_total_power: Flag = True
    use_smoothing: MaybeFlag = False
    smoothing_type: Annotated[str | None, Value("string", "optional", choices=("tanh", "huber"))] = "tanh"
    velocity_smoothing: Annotated[float | None, maybe(domain="> 0")] = 10.0
    power_smoothing: Annotated[float | None, maybe(domain="> 0")] = 10.0
    heat_rate_smoothing: Annotated[float | None, maybe(domain="> 0")] = 10.0
