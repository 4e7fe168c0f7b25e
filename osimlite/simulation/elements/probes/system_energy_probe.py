"""The kinetic and potential energy of the model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from osimlite.schema.probe_types import SystemEnergyProbe
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.probe import DeclaredProbe, ProbeKind, Reading


def _read(builder: ElementBuilder, probe: SystemEnergyProbe) -> Reading:
    kinds = (
        probe.compute_kinetic_energy,
        probe.compute_potential_energy,
        probe.compute_potential_energy,
    )
    return Reading((probe.name,), details=tuple(map(float, kinds)))


def _measure(probe: DeclaredProbe, system: Any, t: float, y: Sequence[float]) -> list[float]:
    """Of the kinetic energy and those of gravity and forces, the sum of those that are asked for."""
    return [
        sum(
            factor * part
            for factor, part in zip(probe.reading.details, system.energies(t, y), strict=True)
        )
    ]


PROBE = ProbeKind(SystemEnergyProbe, _read, measure=_measure)
