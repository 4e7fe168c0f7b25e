"""Probes of actuator forces and powers, of joint power, and of the energy of the model."""

from __future__ import annotations

from collections.abc import Sequence
from math import floor, inf, nan
from typing import Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.mechanics.multibody.constraints import Lock, PrescribedCoordinate
from osimlite.schema.muscles import PathActuator
from osimlite.schema.probe_types import (
    ActuatorForceProbe,
    ActuatorPowerProbe,
    JointInternalPowerProbe,
    SystemEnergyProbe,
)
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.probe_type import (
    DeclaredProbe,
    ProbeSubject,
    ProbeType,
    Reading,
    find_members,
)
from osimlite.simulation.elements.registry import register_probe_type


class Power(NamedTuple):
    """Factor of a quantity, and the exponent to which the product is raised.

    Attributes:
        factor: factor; -1 for the power of a tension.
        exponent: exponent, a property of the probe.
    """

    factor: float
    exponent: float


def raise_to_power(x: float, exponent: float) -> float:
    """Return x to a power, with the results of C++ for negative and zero bases.

    Python would return a complex number, or raise an error, where ``std::pow`` returns NaN or
    infinity.

    Args:
        x: base.
        exponent: exponent.
    """
    # As C's pow(), which OpenSim calls; Python would raise an error or return a complex number.
    if x < 0.0 and exponent != floor(exponent):
        return nan
    if x == 0.0 and exponent < 0.0:
        return inf
    return x**exponent


def compute_actuator_force(actuation: float, n: Power) -> float:
    """Return the force of an actuator, raised to a power.

    Args:
        actuation: force, N or N.m.
        n: factor and exponent.
    """
    return raise_to_power(n.factor * actuation, n.exponent)


def _read_forces(builder: ElementBuilder, probe: ActuatorForceProbe) -> Reading:
    actuators = find_members(builder, probe, probe.actuator_names, "/forceset", "Actuator")
    subjects = tuple(ProbeSubject(actuator, Power(1.0, probe.exponent)) for actuator in actuators)
    return define_reading(
        probe.name, [item.name for item in actuators], subjects, is_sum=probe.sum_forces_together
    )


def define_reading(
    name: str, subjects: list[str], read: tuple[ProbeSubject, ...], *, is_sum: bool
) -> Reading:
    """Return the reading of a probe whose results are those of its subjects, or their sum.

    Args:
        name: name of the probe.
        subjects: names of the subjects.
        read: the subjects.
        is_sum: whether the only result is the sum.

    Returns:
        The reading with OpenSim's labels.
    """
    if is_sum:
        return Reading((f"{name}_Summed",), read)
    return Reading(tuple(f"{name}_{subject}" for subject in subjects), read, first=0)


register_probe_type(
    ProbeType(ActuatorForceProbe, _read_forces, compute_actuator_force, ("actuation",), Power)
)


def compute_actuator_power(actuation: float, speed: float, n: Power) -> float:
    """Return the power of an actuator, raised to a power.

    Args:
        actuation: force, N or N.m.
        speed: speed along it, m/s or rad/s.
        n: factor and exponent.

    Returns:
        Power (W) to the exponent.
    """
    return raise_to_power(n.factor * actuation * speed, n.exponent)


def _read_powers(builder: ElementBuilder, probe: ActuatorPowerProbe) -> Reading:
    actuators = find_members(builder, probe, probe.actuator_names, "/forceset", "Actuator")
    # A tension acts against the lengthening speed.
    factors = [-1.0 if isinstance(item, PathActuator) else 1.0 for item in actuators]
    subjects = tuple(
        ProbeSubject(item, Power(factor, probe.exponent))
        for item, factor in zip(actuators, factors, strict=True)
    )
    return define_reading(
        probe.name, [item.name for item in actuators], subjects, is_sum=probe.sum_powers_together
    )


register_probe_type(
    ProbeType(
        ActuatorPowerProbe, _read_powers, compute_actuator_power, ("actuation", "speed"), Power
    )
)


def _read_joints(builder: ElementBuilder, probe: JointInternalPowerProbe) -> Reading:
    mechanism = builder.mechanism
    joints = find_members(builder, probe, probe.joint_names, "/jointset", "Joint")
    infos = [
        (index, info)
        for index, info in enumerate(mechanism.coordinates)
        if info.prescribed is not None
    ]
    # OpenSim's joint power is that of the forces that prescribe the coordinates of the joint. The
    # forces of couplers and loops would have to be distributed over joints, which is not unique.
    driven = [
        [index for index, info in infos if info.joint == builder.path(joint)] for joint in joints
    ]
    if any(driven) and not all(
        isinstance(item, Lock | PrescribedCoordinate) for item in mechanism.constraints
    ):
        raise builder.make_unsupported_error(
            probe, " of prescribed coordinates in a model that also has constraints"
        )
    reading = define_reading(
        probe.name, [joint.name for joint in joints], (), is_sum=probe.sum_powers_together
    )
    return reading._replace(details=(driven, probe.exponent, probe.sum_powers_together))


def _measure_joint_power(
    probe: DeclaredProbe, system: Any, t: float, y: Sequence[float]
) -> list[float]:
    """Return the power of the joints' prescribed coordinates.

    It is the generalized force that the motion requires besides gravity and the forces, times the speed.
    """
    driven, exponent, is_sum = probe.reading.details
    powers = np.zeros(len(system.mechanism.coordinates))
    if any(driven):
        state = system.state
        count = len(system.order)
        q, u = state.values(y), state.speeds(y)
        forces = state.spread_to_all(
            system.compute_applied_forces(t, y)[count : 2 * count], [0.0] * len(q)
        )
        # With the accelerations known, what inverse dynamics requires beyond the applied forces is
        # what prescribes the coordinates.
        udot = system.mechanism.acceleration(q, u, forces, time=t)
        powers = (system.mechanism.inverse_dynamics(q, u, udot) - forces) * u
    result = [raise_to_power(float(sum(powers[indices])), exponent) for indices in driven]
    return [sum(result)] if is_sum else result


register_probe_type(ProbeType(JointInternalPowerProbe, _read_joints, measure=_measure_joint_power))


def _read_energies(builder: ElementBuilder, probe: SystemEnergyProbe) -> Reading:
    kinds = (
        probe.compute_kinetic_energy,
        # Twice: the potential energy of gravity, and that of the springs.
        probe.compute_potential_energy,
        probe.compute_potential_energy,
    )
    return Reading((probe.name,), details=tuple(map(float, kinds)))


def _measure_energy(probe: DeclaredProbe, system: Any, t: float, y: Sequence[float]) -> list[float]:
    """Return the sum of the requested energies: kinetic, of gravity, and of forces."""
    return [
        sum(
            factor * part
            for factor, part in zip(
                probe.reading.details, system.compute_energies(t, y), strict=True
            )
        )
    ]


register_probe_type(ProbeType(SystemEnergyProbe, _read_energies, measure=_measure_energy))
