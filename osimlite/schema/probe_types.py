"""Probes: quantities a simulation reports."""

from osimlite.schema.fields import Flag, Number
from osimlite.schema.probes import Probe
from osimlite.schema.references import ActuatorNames, JointNames


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
