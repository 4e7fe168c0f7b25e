"""Muscles of Hill's type: fibre and tendon in series, along a path.

Forces are normalised by `max_isometric_force`, fibre lengths by `optimal_fiber_length`, tendon lengths by
`tendon_slack_length`.
"""

from functools import partial
from typing import Annotated

from pydantic import Field

from osimlite.schema.base import made
from osimlite.schema.default_curves import active_force_length, force_velocity, passive_force_length
from osimlite.schema.fields import Flag, Number, Single, Tag, Unnamed, real, word
from osimlite.schema.functions import Function
from osimlite.schema.geometry import Appearance
from osimlite.schema.muscle_curves import (
    ActiveForceLengthCurve,
    FiberCompressiveForceCosPennationCurve,
    FiberCompressiveForceLengthCurve,
    FiberForceLengthCurve,
    ForceVelocityCurve,
    TendonForceLengthCurve,
)
from osimlite.schema.muscle_parts import (
    MAXIMUM_PENNATION,
    MuscleFirstOrderActivationDynamicModel,
    MuscleFixedWidthPennationModel,
)
from osimlite.schema.path_actuators import PathActuator
from osimlite.schema.paths import AbstractGeometryPath, GeometryPath


class Muscle(PathActuator, abstract=True):
    """What every muscle has: its strength, its lengths, and what of it may be left out of the computation."""

    min_control: Number = 0.0
    max_control: Number = 1.0
    geometry_path: Annotated[Single[AbstractGeometryPath], Tag("path")] = made(
        GeometryPath, name="path", appearance=lambda: Appearance.build({"color": (0.8, 0.1, 0.1)}, set())
    )
    max_isometric_force: Annotated[float, real("N", "> 0")] = 1000.0
    optimal_fiber_length: Annotated[float, real("m", "> 0")] = 0.1
    tendon_slack_length: Annotated[float, real("m", "> 0")] = 0.2
    pennation_angle_at_optimal: Annotated[float, real("rad", ">= 0")] = 0.0
    max_contraction_velocity: Annotated[float, real("optimal_fiber_length/s", "> 0")] = 10.0
    ignore_tendon_compliance: Flag = False
    ignore_activation_dynamics: Flag = False


class ActivationFiberLengthMuscle(Muscle, abstract=True):
    """A muscle with two states: activation and fibre length."""

    default_activation: Annotated[float, real(domain="0 to 1")] = 0.05
    default_fiber_length: Annotated[float, real("m", "> 0")] = 0.1


class Thelen2003Muscle(ActivationFiberLengthMuscle):
    """The muscle of Thelen (2003), with tendon and fibre strains at full force and shape factors of its curves."""

    internal = (
        ("pennMdl", MuscleFixedWidthPennationModel),
        ("actMdl", MuscleFirstOrderActivationDynamicModel),
    )

    min_control: Number = 0.01
    FmaxTendonStrain: Annotated[float, real(domain="> 0")] = 0.04
    FmaxMuscleStrain: Annotated[float, real(domain="> 0")] = 0.6
    KshapeActive: Annotated[float, real(domain="> 0")] = 0.45
    KshapePassive: Annotated[float, real(domain="> 0")] = 5.0
    Af: Annotated[float, real(domain="> 0")] = 0.25
    Flen: Annotated[float, real(domain="> 1")] = 1.4
    fv_linear_extrap_threshold: Annotated[float, real(domain="> 0")] = 0.95
    maximum_pennation_angle: Annotated[float, real("rad", ">= 0")] = MAXIMUM_PENNATION
    activation_time_constant: Annotated[float, real("s", "> 0")] = 0.015
    deactivation_time_constant: Annotated[float, real("s", "> 0")] = 0.05
    minimum_activation: Annotated[float, real(domain="0 to 1")] = 0.01


class Millard2012EquilibriumMuscle(Muscle):
    """The muscle of Millard et al. (2013), tendon and fibre in equilibrium, with curves one can replace."""

    internal = (
        ("penMdl", MuscleFixedWidthPennationModel),
        ("actMdl", MuscleFirstOrderActivationDynamicModel),
    )

    min_control: Number = 0.01
    fiber_damping: Annotated[float, real(domain=">= 0")] = 0.1
    default_activation: Annotated[float, real(domain="0 to 1")] = 0.05
    default_fiber_length: Annotated[float, real("m", "> 0")] = 0.1
    activation_time_constant: Annotated[float, real("s", "> 0")] = 0.01
    deactivation_time_constant: Annotated[float, real("s", "> 0")] = 0.04
    minimum_activation: Annotated[float, real(domain="0 to 1")] = 0.01
    maximum_pennation_angle: Annotated[float, real("rad", ">= 0")] = MAXIMUM_PENNATION
    active_force_length_curve: Unnamed[ActiveForceLengthCurve] = made(
        ActiveForceLengthCurve, name="ActiveForceLengthCurve"
    )
    force_velocity_curve: Unnamed[ForceVelocityCurve] = made(ForceVelocityCurve, name="ForceVelocityCurve")
    fiber_force_length_curve: Unnamed[FiberForceLengthCurve] = made(FiberForceLengthCurve, name="FiberForceLengthCurve")
    tendon_force_length_curve: Unnamed[TendonForceLengthCurve] = made(
        TendonForceLengthCurve, name="TendonForceLengthCurve"
    )


class Millard2012AccelerationMuscle(Muscle):
    """The muscle of Millard et al. (2013) with a mass between fibre and tendon, whose place and speed are states."""

    default_activation: Annotated[float, real(domain="0 to 1")] = 0.0
    default_fiber_length: Annotated[float, real("m", "> 0")] = 0.1
    default_fiber_velocity: Number = 0.0
    muscle_first_order_activation_dynamic_model: Unnamed[MuscleFirstOrderActivationDynamicModel] = made(
        MuscleFirstOrderActivationDynamicModel, name="_activation", minimum_activation=0.0
    )
    active_force_length_curve: Unnamed[ActiveForceLengthCurve] = made(
        ActiveForceLengthCurve, name="ActiveForceLengthCurve", minimum_value=0.0
    )
    force_velocity_curve: Unnamed[ForceVelocityCurve] = made(ForceVelocityCurve, name="ForceVelocityCurve")
    fiber_force_length_curve: Unnamed[FiberForceLengthCurve] = made(FiberForceLengthCurve, name="FiberForceLengthCurve")
    tendon_force_length_curve: Unnamed[TendonForceLengthCurve] = made(
        TendonForceLengthCurve, name="TendonForceLengthCurve"
    )
    fiber_compressive_force_length_curve: Unnamed[FiberCompressiveForceLengthCurve] = made(
        FiberCompressiveForceLengthCurve, name="default_FiberCompressiveForceLengthCurve"
    )
    fiber_compressive_force_cos_pennation_curve: Unnamed[FiberCompressiveForceCosPennationCurve] = made(
        FiberCompressiveForceCosPennationCurve, name="default_FiberCompressiveForceCosPennationCurve"
    )
    tendon_force_length_damping: Annotated[float, real(domain=">= 0")] = 0.1
    fiber_compressive_force_length_damping: Annotated[float, real(domain=">= 0")] = 1.0
    fiber_force_length_damping: Annotated[float, real(domain=">= 0")] = 0.01
    fiber_compressive_force_cos_pennation_damping: Annotated[float, real(domain=">= 0")] = 1.0
    fiber_damping: Annotated[float, real(domain=">= 0")] = 0.01
    mass: Annotated[float, real(domain="> 0")] = 0.1


class DeGrooteFregly2016Muscle(Muscle):
    """The muscle of De Groote et al. (2016), smooth everywhere, made for direct collocation."""

    activation_time_constant: Annotated[float, real("s", "> 0")] = 0.015
    deactivation_time_constant: Annotated[float, real("s", "> 0")] = 0.06
    default_activation: Annotated[float, real(domain="0 to 1")] = 0.5
    default_normalized_tendon_force: Annotated[float, real(domain=">= 0")] = 0.5
    active_force_width_scale: Annotated[float, real(domain=">= 1")] = 1.0
    fiber_damping: Annotated[float, real(domain=">= 0")] = 0.0
    passive_fiber_strain_at_one_norm_force: Annotated[float, real(domain="> 0")] = 0.6
    tendon_strain_at_one_norm_force: Annotated[float, real(domain="> 0")] = 0.049
    ignore_passive_fiber_force: Flag = False
    tendon_compliance_dynamics_mode: Annotated[str, word("explicit", "implicit")] = "explicit"
    activation_dynamics_smoothing: Annotated[float, real(domain="> 0")] = 0.1


class MeyerFregly2016Muscle(Muscle):
    """A rigid-tendon muscle with the curves of Meyer et al. (2016)."""

    activation_time_constant: Annotated[float, real("s", "> 0")] = 0.015
    deactivation_time_constant: Annotated[float, real("s", "> 0")] = 0.06
    default_activation: Annotated[float, real(domain="0 to 1")] = 0.5
    active_force_width_scale: Annotated[float, real(domain=">= 1")] = 1.0
    fiber_damping: Annotated[float, real(domain=">= 0")] = 0.0
    ignore_passive_fiber_force: Flag = False
    activation_dynamics_smoothing: Annotated[float, real(domain="> 0")] = 0.1


class RigidTendonMuscle(Muscle):
    """A muscle whose tendon keeps its slack length, with splines as curves."""

    active_force_length_curve: Single[Function] = Field(
        default_factory=partial(active_force_length, "active_force_length_curve")
    )
    passive_force_length_curve: Single[Function] = Field(
        default_factory=partial(passive_force_length, "passive_force_length_curve")
    )
    force_velocity_curve: Single[Function] = Field(default_factory=partial(force_velocity, "force_velocity_curve"))
