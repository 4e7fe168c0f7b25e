"""Probes: quantities a simulation reports."""

from osimlite.schema.fields import Flag, Number
from osimlite.schema.probes import Probe
from osimlite.schema.references import ActuatorNames, JointNames


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
