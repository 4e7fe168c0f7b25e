"""The power of what keeps prescribed coordinates to their functions, by joint."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from osimlite.mechanics.multibody.constraints import Lock, Prescribed
from osimlite.schema.probe_types import JointInternalPowerProbe
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.probe import DeclaredProbe, ProbeKind, Reading, members_of
from osimlite.simulation.elements.probes.actuator_force_probe import listed, raised


def _read(builder: ElementBuilder, probe: JointInternalPowerProbe) -> Reading:
    mechanism, joints = (
        builder.mechanism,
        members_of(builder, probe, probe.joint_names, "/jointset", "Joint"),
    )
    infos = [
        (place, info)
        for place, info in enumerate(mechanism.coordinates)
        if info.prescribed is not None
    ]
    driven = [
        [place for place, info in infos if info.joint == builder.path(joint)] for joint in joints
    ]
    if any(driven) and not all(
        isinstance(item, Lock | Prescribed) for item in mechanism.constraints
    ):
        raise builder.unsupported(probe, " of prescribed coordinates beside other constraints")
    reading = listed(
        probe.name, [joint.name for joint in joints], (), is_sum=probe.sum_powers_together
    )
    return reading._replace(details=(driven, probe.exponent, probe.sum_powers_together))


def _measure(probe: DeclaredProbe, system: Any, t: float, y: Sequence[float]) -> list[float]:
    """What the motion takes besides gravity and the forces, times the speeds."""
    driven, exponent, is_sum = probe.reading.details
    powers = np.zeros(len(system.mechanism.coordinates))
    if any(driven):
        state, count = system.state, len(system.order)
        q, u = state.values(y), state.speeds(y)
        forces = state.spread(system.applied(t, y)[count : 2 * count], [0.0] * len(q))
        udot = system.mechanism.acceleration(q, u, forces, time=t)
        powers = (system.mechanism.inverse_dynamics(q, u, udot) - forces) * u
    result = [raised(float(sum(powers[places])), exponent) for places in driven]
    return [sum(result)] if is_sum else result


PROBE = ProbeKind(JointInternalPowerProbe, _read, measure=_measure)
