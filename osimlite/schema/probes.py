"""Probes: quantities a simulation reports."""

from __future__ import annotations

from typing import Annotated

from osimlite.schema.base import ModelComponent, none
from osimlite.schema.fields import Flag, LegacyMany, Number, Reals, reals, word
from osimlite.schema.references import ActuatorNames, JointNames
from osimlite.schema.sets import ModelComponentSet, ObjectGroup


class Probe(ModelComponent, abstract=True):
    """Something measured along a simulation, possibly integrated or differentiated, times `gain`."""

    enabled: Flag = True
    probe_operation: Annotated[
        str, word("value", "integrate", "differentiate", "minimum", "minabs", "maximum", "maxabs")
    ] = "value"
    initial_conditions_for_integration: Annotated[Reals, reals()] = ()
    gain: Number = 1.0


class ActuatorForceProbe(Probe):
    """The forces of actuators, each to the power `exponent`; the one word `all` names every actuator."""

    actuator_names: ActuatorNames = ()
    sum_forces_together: Flag = False
    exponent: Number = 1.0


class ActuatorPowerProbe(Probe):
    """The powers of actuators, each to the power `exponent`; the one word `all` names every actuator."""

    actuator_names: ActuatorNames = ()
    sum_powers_together: Flag = False
    exponent: Number = 1.0


class JointInternalPowerProbe(Probe):
    """The powers of joint reactions, each to the power `exponent`; the one word `all` names every joint."""

    joint_names: JointNames = ()
    sum_powers_together: Flag = False
    exponent: Number = 1.0


class SystemEnergyProbe(Probe):
    """The kinetic and potential energy of the model."""

    compute_kinetic_energy: Flag = True
    compute_potential_energy: Flag = True


class ProbeSet(ModelComponentSet):
    """The probes of a model."""

    objects: LegacyMany[Probe] = none()
    groups: LegacyMany[ObjectGroup] = none()
