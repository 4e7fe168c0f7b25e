"""Probes of forces, powers and energies, and of the metabolic energy of muscles.

Metabolic energy is heat and mechanical work (Umberger et al. 2003, Bhargava et al. 2004).
"""

import math
from typing import Annotated

from osimlite.schema.base import Component, ModelComponent, Object, make_default, make_empty_list
from osimlite.schema.facts import Facts
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
from osimlite.schema.references import ActuatorNames, JointNames, MuscleSocket
from osimlite.schema.sets import Probe, Set
from osimlite.schema.splines import PiecewiseLinearFunction

_NAME_OF_MUSCLE = Reference("muscle-name", "Muscle")


class Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameter(Object):
    """Parameters of the probe for the muscle of the same name."""

    name_reference = _NAME_OF_MUSCLE

    specific_tension: Annotated[float, real("Pa", "> 0")] = 250000.0
    """Force per cross-section of the fibers; it gives the mass where none is provided."""
    density: Annotated[float, real("kg/m^3", "> 0")] = 1059.7
    """Mass per volume of the muscle; it gives the mass where none is provided."""
    ratio_slow_twitch_fibers: Annotated[float, real(domain="0 to 1")] = 0.5
    """Part of the muscle that is slow-twitch fibers; the rest is fast-twitch."""
    use_provided_muscle_mass: Flag = False
    """Whether the mass is the one given; otherwise density F_max l_opt / specific tension."""
    provided_muscle_mass: Annotated[float, real("kg", "> 0")] = math.nan
    """Mass of the muscle; only used where the switch above says so."""


class Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameterSet(Set):
    """The muscles of one probe."""

    objects: LegacyMany[Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameter] = (
        make_empty_list()
    )
    """Parameters of each muscle; muscles that are not here use no energy."""


class Umberger2010MuscleMetabolicsProbe(Probe):
    """Metabolic power by the model of Umberger et al. (2003) with the changes of Uchida et al. (2016)."""

    activation_maintenance_rate_on: Flag = True
    """Whether the heat of activation and maintenance counts."""
    shortening_rate_on: Flag = True
    """Whether the heat of shortening and lengthening counts."""
    basal_rate_on: Flag = True
    """Whether the basal rate of the whole body counts."""
    mechanical_work_rate_on: Flag = True
    """Whether the mechanical power of the fibers counts."""
    enforce_minimum_heat_rate_per_muscle: Flag = True
    """Whether the heat of a muscle is never below 1 W/kg. It needs all heat rates to be on."""
    aerobic_factor: Annotated[float, real(domain="> 0")] = 1.5
    """Factor of all heat rates: 1 for mainly anaerobic, 1.5 for mainly aerobic conditions."""
    basal_coefficient: Number = 1.2
    """Factor a of the basal rate a m^b (W), m being the mass (kg) of the whole model."""
    basal_exponent: Number = 1.0
    """Exponent b of the basal rate a m^b."""
    muscle_effort_scaling_factor: Number = 1.0
    """Factor of excitation, activation and active force, to make up for too much co-contraction."""
    use_Bhargava_recruitment_model: Flag = True
    """Whether the share of slow fibers follows excitation as Bhargava has it, instead of the fixed ratio."""
    include_negative_mechanical_work: Flag = True
    """Whether lengthening fibers take up work; with it the heat of lengthening has a coefficient of 4, not 0.3."""
    forbid_negative_total_power: Flag = True
    """Whether heat is added to a muscle where its power would be negative."""
    report_total_metabolics_only: Flag = True
    """Whether only the sum is reported, without the basal rate and each muscle."""
    metabolic_muscle_parameter_set: Unnamed[
        Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameterSet
    ] = make_default(Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameterSet)
    """Muscles that are included, with their parameters."""


class Bhargava2004MuscleMetabolicsProbe_MetabolicMuscleParameter(Object):
    """Parameters of the probe for the muscle of the same name."""

    name_reference = _NAME_OF_MUSCLE

    specific_tension: Annotated[float, real("Pa", "> 0")] = 250000.0
    """Force per cross-section of the fibers; it gives the mass where none is provided."""
    density: Annotated[float, real("kg/m^3", "> 0")] = 1059.7
    """Mass per volume of the muscle; it gives the mass where none is provided."""
    ratio_slow_twitch_fibers: Annotated[float, real(domain="0 to 1")] = 0.5
    """Part of the muscle that is slow-twitch fibers; the rest is fast-twitch."""
    use_provided_muscle_mass: MaybeFlag = False
    """Whether the mass is the one given; otherwise density F_max l_opt / specific tension."""
    provided_muscle_mass: Annotated[float | None, maybe("kg", "> 0")] = math.nan
    """Mass of the muscle; only used where the switch above says so."""
    activation_constant_slow_twitch: Annotated[float, real("W/kg", ">= 0")] = 40.0
    """Heat of activation per mass of fully excited slow-twitch fibers."""
    activation_constant_fast_twitch: Annotated[float, real("W/kg", ">= 0")] = 133.0
    """Heat of activation per mass of fully excited fast-twitch fibers."""
    maintenance_constant_slow_twitch: Annotated[float, real("W/kg", ">= 0")] = 74.0
    """Heat of maintenance per mass of fully excited slow-twitch fibers."""
    maintenance_constant_fast_twitch: Annotated[float, real("W/kg", ">= 0")] = 111.0
    """Heat of maintenance per mass of fully excited fast-twitch fibers."""


class Bhargava2004MuscleMetabolicsProbe_MetabolicMuscleParameterSet(Set):
    """The muscles of one probe."""

    objects: LegacyMany[Bhargava2004MuscleMetabolicsProbe_MetabolicMuscleParameter] = (
        make_empty_list()
    )
    """Parameters of each muscle; muscles that are not here use no energy."""


class Bhargava2004MuscleMetabolicsProbe(Probe):
    """Metabolic power by the model of Bhargava et al. (2004)."""

    activation_rate_on: Flag = True
    """Whether the heat of activation counts."""
    maintenance_rate_on: Flag = True
    """Whether the heat of maintenance counts."""
    shortening_rate_on: Flag = True
    """Whether the heat of shortening and lengthening counts."""
    basal_rate_on: Flag = True
    """Whether the basal rate of the whole body counts."""
    mechanical_work_rate_on: Flag = True
    """Whether the mechanical power of the fibers counts."""
    enforce_minimum_heat_rate_per_muscle: Flag = True
    """Whether the heat of a muscle is never below 1 W/kg. It needs all heat rates to be on."""
    normalized_fiber_length_dependence_on_maintenance_rate: Single[PiecewiseLinearFunction] = (
        make_default(
            PiecewiseLinearFunction,
            name="normalized_fiber_length_dependence_on_maintenance_rate",
            x=(0.0, 0.5, 1.0, 1.5, 2.0),
            y=(0.5, 0.5, 1.0, 0.0, 0.0),
        )
    )
    """Factor of the heat of maintenance over normalised fiber length."""
    use_force_dependent_shortening_prop_constant: Flag = False
    """Whether the heat of shortening depends on isometric force also; otherwise it is 0.25 fiber force times speed."""
    basal_coefficient: Number = 1.2
    """Factor a of the basal rate a m^b (W), m being the mass (kg) of the whole model."""
    basal_exponent: Number = 1.0
    """Exponent b of the basal rate a m^b."""
    muscle_effort_scaling_factor: Number = 1.0
    """Factor of excitation, activation and active force, to make up for too much co-contraction."""
    include_negative_mechanical_work: Flag = True
    """Whether lengthening fibers take up work, which then counts as negative power."""
    forbid_negative_total_power: Flag = True
    """Whether heat is added to a muscle where its power would be negative."""
    report_total_metabolics_only: Flag = True
    """Whether only the sum is reported, without the basal rate and each muscle."""
    metabolic_muscle_parameter_set: Unnamed[
        Bhargava2004MuscleMetabolicsProbe_MetabolicMuscleParameterSet
    ] = make_default(Bhargava2004MuscleMetabolicsProbe_MetabolicMuscleParameterSet)
    """Muscles that are included, with their parameters."""


class Bhargava2004SmoothedMuscleMetabolics_MuscleParameters(Component):
    """Parameters of the metabolics component for one muscle."""

    socket_muscle: MuscleSocket = ""
    """Muscle to which the numbers belong."""
    specific_tension: Annotated[float, real("Pa", "> 0")] = 250000.0
    """Force per cross-section of the fibers; it gives the mass where none is provided."""
    density: Annotated[float, real("kg/m^3", "> 0")] = 1059.7
    """Mass per volume of the muscle; it gives the mass where none is provided."""
    ratio_slow_twitch_fibers: Annotated[float, real(domain="0 to 1")] = 0.5
    """Part of the muscle that is slow-twitch fibers; the rest is fast-twitch."""
    use_provided_muscle_mass: MaybeFlag = False
    """Whether the mass is the one given; otherwise density F_max l_opt / specific tension."""
    provided_muscle_mass: Annotated[float | None, maybe("kg", "> 0")] = math.nan
    """Mass of the muscle; only used where the switch above says so."""
    activation_constant_slow_twitch: Annotated[float, real("W/kg", ">= 0")] = 40.0
    """Heat of activation per mass of fully excited slow-twitch fibers."""
    activation_constant_fast_twitch: Annotated[float, real("W/kg", ">= 0")] = 133.0
    """Heat of activation per mass of fully excited fast-twitch fibers."""
    maintenance_constant_slow_twitch: Annotated[float, real("W/kg", ">= 0")] = 74.0
    """Heat of maintenance per mass of fully excited slow-twitch fibers."""
    maintenance_constant_fast_twitch: Annotated[float, real("W/kg", ">= 0")] = 111.0
    """Heat of maintenance per mass of fully excited fast-twitch fibers."""


class Bhargava2004SmoothedMuscleMetabolics(ModelComponent):
    """The model of Bhargava et al. (2004) as a component with outputs, made smooth for optimisation."""

    facts = Facts(
        outputs="muscle_metabolic_rate[] total_activation_rate total_maintenance_rate total_mechanical_work_rate "
        "total_metabolic_rate total_shortening_rate"
    )

    muscle_parameters: Many[Bhargava2004SmoothedMuscleMetabolics_MuscleParameters] = (
        make_empty_list()
    )
    """Muscles that are included, with their parameters."""
    enforce_minimum_heat_rate_per_muscle: Flag = True
    """Whether the heat of a muscle is never below 1 W/kg."""
    use_force_dependent_shortening_prop_constant: Flag = False
    """Whether the heat of shortening depends on isometric force also; otherwise it is 0.25 fiber force times speed."""
    basal_coefficient: Number = 1.2
    """Factor a of the basal rate a m^b (W), m being the mass (kg) of the whole model."""
    basal_exponent: Number = 1.0
    """Exponent b of the basal rate a m^b."""
    muscle_effort_scaling_factor: Number = 1.0
    """Factor of excitation, activation and active force, to make up for too much co-contraction."""
    include_negative_mechanical_work: Flag = True
    """Whether lengthening fibers take up work, which then counts as negative power."""
    forbid_negative_total_power: Flag = True
    """Whether heat is added to a muscle where its power would be negative."""
    use_smoothing: MaybeFlag = False
    """Whether the switches of the model are replaced by smooth transitions."""
    smoothing_type: Annotated[
        str | None, Value("string", "optional", choices=("tanh", "huber"))
    ] = "tanh"
    """Shape of the transitions: hyperbolic tangent, or the function of Huber."""
    velocity_smoothing: Annotated[float | None, maybe(domain="> 0")] = 10.0
    """Sharpness of the transition from shortening to lengthening; higher is sharper."""
    power_smoothing: Annotated[float | None, maybe(domain="> 0")] = 10.0
    """Sharpness of the exclusion of negative power; higher is sharper."""
    heat_rate_smoothing: Annotated[float | None, maybe(domain="> 0")] = 10.0
    """Sharpness of the lower limit of heat, 1 W/kg; higher is sharper."""


class ActuatorForceProbe(Probe):
    """The forces of actuators, each to the power `exponent`."""

    actuator_names: ActuatorNames = ()
    """Names of the actuators; the one word `all` means every actuator."""
    sum_forces_together: Flag = False
    """Whether one sum is reported rather than each force."""
    exponent: Number = 1.0
    """Power to which each force is raised before they are summed."""


class ActuatorPowerProbe(Probe):
    """The powers of actuators, each to the power `exponent`."""

    actuator_names: ActuatorNames = ()
    """Names of the actuators; the one word `all` means every actuator."""
    sum_powers_together: Flag = False
    """Whether one sum is reported rather than each power."""
    exponent: Number = 1.0
    """Exponent to which each power is raised before they are summed."""


class JointInternalPowerProbe(Probe):
    """The powers of joint reactions, each to the power `exponent`."""

    joint_names: JointNames = ()
    """Names of the joints; the one word `all` means every joint."""
    sum_powers_together: Flag = False
    """Whether one sum is reported rather than each power."""
    exponent: Number = 1.0
    """Exponent to which each power is raised before they are summed."""


class SystemEnergyProbe(Probe):
    """The kinetic and potential energy of the model."""

    compute_kinetic_energy: Flag = True
    """Whether kinetic energy is part of the sum."""
    compute_potential_energy: Flag = True
    """Whether potential energy is part of the sum."""
