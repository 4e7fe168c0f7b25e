"""Powers of actuators."""

from __future__ import annotations

from osimlite.schema.path_actuators import PathActuator
from osimlite.schema.probe_types import ActuatorPowerProbe
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.probe import ProbeKind, Reading, Subject, members_of
from osimlite.simulation.elements.probes.actuator_force_probe import Power, listed, raised


def actuator_power(actuation: float, speed: float, n: Power) -> float:
    """A power, W, to a power."""
    return raised(n.factor * actuation * speed, n.exponent)


def _read(builder: ElementBuilder, probe: ActuatorPowerProbe) -> Reading:
    actuators = members_of(builder, probe, probe.actuator_names, "/forceset", "Actuator")
    # A tension pulls against the lengthening speed.
    factors = [-1.0 if isinstance(item, PathActuator) else 1.0 for item in actuators]
    subjects = tuple(
        Subject(item, Power(factor, probe.exponent))
        for item, factor in zip(actuators, factors, strict=True)
    )
    return listed(
        probe.name, [item.name for item in actuators], subjects, is_sum=probe.sum_powers_together
    )


PROBE = ProbeKind(ActuatorPowerProbe, _read, actuator_power, ("actuation", "speed"), Power)
