"""Muscle models that OpenSim keeps for old files only."""

from collections.abc import Iterator
from functools import partial
from typing import Annotated

from pydantic import Field

from osimlite.schema.default_curves import (
    make_active_force_length,
    make_force_velocity,
    make_passive_force_length,
    make_tendon_force_length,
)
from osimlite.schema.facts import NAN, Contradiction, Facts
from osimlite.schema.fields import LegacyOptional, Number, Single, real
from osimlite.schema.functions import Function
from osimlite.schema.muscles import Muscle, check_complete_dynamics


class ActivationFiberLengthMuscle_Deprecated(Muscle, abstract=True):
    """A muscle with two states: activation and fiber length."""

    facts = Facts(states="activation fiber_length")

    def find_contradictions(self) -> Iterator[Contradiction]:
        """Find missing properties of the muscle's dynamics, all of which OpenSim requires.

        Returns:
            A contradiction for each property of the dynamics that is missing.
        """
        return check_complete_dynamics(self)


class Thelen2003Muscle_Deprecated(ActivationFiberLengthMuscle_Deprecated):
    """The first form of the muscle of Thelen (2003)."""

    facts = Facts(mujoco={"vmax": "Vmax", "fvmax": "Flen"})

    activation_time_constant: Annotated[float, real(domain="> 0")] = 0.01
    """Time constant (s) of rising activation."""
    deactivation_time_constant: Annotated[float, real(domain="> 0")] = 0.04
    """Time constant (s) of falling activation."""
    Vmax: Annotated[float, real("fiber_length/s", "> 0")] = 10.0
    """Shortening velocity at which fully active fibers bear no force."""
    Vmax0: Annotated[float, real("fiber_length/s", "> 0")] = 5.0
    """Maximum shortening velocity at activation 0; in between it grows in proportion."""
    FmaxTendonStrain: Annotated[float, real(domain="> 0")] = 0.033
    """Strain at which the tendon bears `max_isometric_force`."""
    FmaxMuscleStrain: Annotated[float, real(domain="> 0")] = 0.6
    """Strain at which the passive fiber bears `max_isometric_force`."""
    KshapeActive: Annotated[float, real(domain="> 0")] = 0.5
    """Width of the active force over fiber length l, exp(-(l - 1)^2 / KshapeActive)."""
    KshapePassive: Annotated[float, real(domain="> 0")] = 4.0
    """Exponent of the passive force at full strain; more makes a softer toe."""
    damping: Annotated[float, real(domain=">= 0")] = 0.05
    """Added to the denominator of velocity over force, so that it is never 0."""
    Af: Annotated[float, real(domain="> 0")] = 0.3
    """Shape of force over velocity (Hill's a / F0); less is more curved."""
    Flen: Annotated[float, real(domain="> 1")] = 1.8
    """Force that lengthening fibers approach, of the isometric one."""


class Schutte1993Muscle_Deprecated(ActivationFiberLengthMuscle_Deprecated):
    """The muscle of Schutte et al. (1993)."""

    # Its velocity follows from `time_scale`: any max_contraction_velocity gives the same motion.
    facts = Facts(
        domains={"max_contraction_velocity": ""},
        zero={NAN: "optimal_fiber_length tendon_slack_length"},
        mujoco={"vmax": "", "fvmax": "", "rise": "", "fall": ""},
    )

    time_scale: Annotated[float, real(domain="> 0")] = 0.1
    """Time (s) by which the rates of activation and fiber length are divided."""
    activation1: Number = 7.667
    """Factor of the excitation u in the rate of rise (activation1 u + activation2) / time scale."""
    activation2: Number = 1.459854
    """Rate of falling activation, per time scale; also part of the rise."""
    damping: Annotated[float, real(domain=">= 0")] = 0.1
    """Damping force of the fiber over `max_isometric_force`, per normalised velocity."""
    tendon_force_length_curve: Single[Function] = Field(
        default_factory=partial(make_tendon_force_length, "tendon_force_length_curve")
    )
    """Force of the tendon over its strain."""
    active_force_length_curve: Single[Function] = Field(
        default_factory=partial(make_active_force_length, "active_force_length_curve")
    )
    """Active force over fiber length, both normalised."""
    passive_force_length_curve: Single[Function] = Field(
        default_factory=partial(make_passive_force_length, "passive_force_length_curve")
    )
    """Passive force over fiber length, both normalised."""


class Delp1990Muscle_Deprecated(ActivationFiberLengthMuscle_Deprecated):
    """The muscle of Delp et al. (1990), with a mass between fiber and tendon."""

    # Its velocity is a state, whose rate follows from `time_scale` and `mass`.
    facts = Facts(
        states="activation fiber_length fiber_velocity",
        domains={"max_contraction_velocity": ""},
        mujoco={"vmax": "", "fvmax": "", "rise": "", "fall": ""},
    )

    time_scale: Annotated[float, real(domain="> 0", legacy=True)] = 0.1
    """Time (s) by which the rates of the states are divided."""
    activation1: Annotated[float, real(legacy=True)] = 7.667
    """Factor of the excitation u in the rate of rise (activation1 u + activation2) / time scale."""
    activation2: Annotated[float, real(legacy=True)] = 1.459854
    """Rate of falling activation, per time scale; also part of the rise."""
    mass: Annotated[float, real(domain="> 0", legacy=True)] = 0.00287
    """Mass between fiber and tendon, normalised by force, time scale and optimal fiber length."""
    tendon_force_length_curve: LegacyOptional[Function] = Field(
        default_factory=make_tendon_force_length
    )
    """Force of the tendon over its strain."""
    active_force_length_curve: LegacyOptional[Function] = Field(
        default_factory=make_active_force_length
    )
    """Active force over fiber length, both normalised."""
    passive_force_length_curve: LegacyOptional[Function] = Field(
        default_factory=make_passive_force_length
    )
    """Passive force over fiber length, both normalised."""
    force_velocity_curve: LegacyOptional[Function] = Field(default_factory=make_force_velocity)
    """Factor of the active force over fiber velocity, normalised."""
