"""Forces of actuators."""

from __future__ import annotations

from math import floor, inf, nan
from typing import NamedTuple

from osimlite.schema.probe_types import ActuatorForceProbe
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.probe import ProbeKind, Reading, Subject, members_of


class Power(NamedTuple):
    """A factor of a quantity, and the power to which both are raised."""

    factor: float
    exponent: float


def raised(x: float, exponent: float) -> float:
    """A power of a number, as C++ has it."""
    if x < 0.0 and exponent != floor(exponent):
        return nan
    if x == 0.0 and exponent < 0.0:
        return inf
    return x**exponent


def actuator_force(actuation: float, n: Power) -> float:
    """A force, N or N.m, to a power."""
    return raised(n.factor * actuation, n.exponent)


def _read(builder: ElementBuilder, probe: ActuatorForceProbe) -> Reading:
    actuators = members_of(builder, probe, probe.actuator_names, "/forceset", "Actuator")
    subjects = tuple(Subject(actuator, Power(1.0, probe.exponent)) for actuator in actuators)
    return listed(
        probe.name, [item.name for item in actuators], subjects, is_sum=probe.sum_forces_together
    )


def listed(name: str, subjects: list[str], read: tuple[Subject, ...], *, is_sum: bool) -> Reading:
    """What a probe reads whose results are those of its subjects, or their sum."""
    if is_sum:
        return Reading((f"{name}_Summed",), read)
    return Reading(tuple(f"{name}_{subject}" for subject in subjects), read, first=0)


PROBE = ProbeKind(ActuatorForceProbe, _read, actuator_force, ("actuation",), Power)
