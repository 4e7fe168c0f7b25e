"""Muscle models that OpenSim keeps for old files only."""

from functools import partial
from typing import Annotated

from pydantic import Field

from osimlite.schema.default_curves import (
    active_force_length,
    force_velocity,
    passive_force_length,
    tendon_force_length,
)
from osimlite.schema.fields import LegacyOptional, Number, Single, real
from osimlite.schema.functions import Function
from osimlite.schema.muscles import Muscle


class ActivationFiberLengthMuscle_Deprecated(Muscle, abstract=True):
    """A muscle with two states: activation and fibre length."""


class Thelen2003Muscle_Deprecated(ActivationFiberLengthMuscle_Deprecated):
    """The first form of the muscle of Thelen (2003); `Vmax0` is the shortening speed without activation."""

    activation_time_constant: Annotated[float, real(domain="> 0")] = 0.01
    deactivation_time_constant: Annotated[float, real(domain="> 0")] = 0.04
    Vmax: Annotated[float, real("fiber_length/s", "> 0")] = 10.0
    Vmax0: Annotated[float, real("fiber_length/s", "> 0")] = 5.0
    FmaxTendonStrain: Annotated[float, real(domain="> 0")] = 0.033
    FmaxMuscleStrain: Annotated[float, real(domain="> 0")] = 0.6
    KshapeActive: Annotated[float, real(domain="> 0")] = 0.5
    KshapePassive: Annotated[float, real(domain="> 0")] = 4.0
    damping: Annotated[float, real(domain=">= 0")] = 0.05
    Af: Annotated[float, real(domain="> 0")] = 0.3
    Flen: Annotated[float, real(domain="> 1")] = 1.8


class Schutte1993Muscle_Deprecated(ActivationFiberLengthMuscle_Deprecated):
    """The muscle of Schutte et al. (1993); `activation1` and `activation2` are rates scaled by `time_scale`."""

    time_scale: Annotated[float, real(domain="> 0")] = 0.1
    activation1: Number = 7.667
    activation2: Number = 1.459854
    damping: Annotated[float, real(domain=">= 0")] = 0.1
    tendon_force_length_curve: Single[Function] = Field(
        default_factory=partial(tendon_force_length, "tendon_force_length_curve")
    )
    active_force_length_curve: Single[Function] = Field(
        default_factory=partial(active_force_length, "active_force_length_curve")
    )
    passive_force_length_curve: Single[Function] = Field(
        default_factory=partial(passive_force_length, "passive_force_length_curve")
    )


class Delp1990Muscle_Deprecated(ActivationFiberLengthMuscle_Deprecated):
    """The muscle of Delp et al. (1990), with a mass between fibre and tendon."""

    time_scale: Annotated[float, real(domain="> 0", legacy=True)] = 0.1
    activation1: Annotated[float, real(legacy=True)] = 7.667
    activation2: Annotated[float, real(legacy=True)] = 1.459854
    mass: Annotated[float, real(domain="> 0", legacy=True)] = 0.00287
    tendon_force_length_curve: LegacyOptional[Function] = Field(default_factory=tendon_force_length)
    active_force_length_curve: LegacyOptional[Function] = Field(default_factory=active_force_length)
    passive_force_length_curve: LegacyOptional[Function] = Field(default_factory=passive_force_length)
    force_velocity_curve: LegacyOptional[Function] = Field(default_factory=force_velocity)
