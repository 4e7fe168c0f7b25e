"""Metabolic power by the model of Bhargava."""

from __future__ import annotations

from functools import partial
from typing import Any

from osimlite.mechanics.kernels.functions import value_at
from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.laws.metabolics import Bhargava2004, bhargava2004
from osimlite.schema.metabolics import Bhargava2004MuscleMetabolicsProbe
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.metabolic import metabolic
from osimlite.simulation.elements.probe import ProbeKind, Reading


def _law(
    activation: float,
    excitation: float,
    active_force: float,
    passive_force: float,
    fiber_length: float,
    fiber_velocity: float,
    force_length: float,
    curve: Floats,
    m: Bhargava2004,
) -> float:
    maintained, _, _ = value_at(curve, fiber_length / m.optimal_fiber_length)
    return bhargava2004(
        activation,
        excitation,
        active_force,
        passive_force,
        fiber_velocity,
        force_length,
        maintained,
        m,
    )


def of_muscle(probe: Any, item: Any, muscle: Any, mass: float) -> Bhargava2004:
    """What the law must know of a muscle and of a probe, whose switches are on if it has none."""
    return Bhargava2004(
        muscle.max_isometric_force,
        muscle.optimal_fiber_length,
        mass,
        *(getattr(item, name) for name in Bhargava2004._fields[3:8]),
        *(getattr(probe, name, True) for name in Bhargava2004._fields[8:]),
    )


def _read(builder: ElementBuilder, probe: Bhargava2004MuscleMetabolicsProbe) -> Reading:
    name = "normalized_fiber_length_dependence_on_maintenance_rate"
    curve = builder.function(probe, getattr(probe, name), name)
    return metabolic(builder, probe, partial(of_muscle, probe), curve)


READS = (
    "activation",
    "control",
    "active_fiber_force",
    "passive_fiber_force",
    "fiber_length",
    "fiber_velocity",
    "active_force_length",
)

PROBE = ProbeKind(
    Bhargava2004MuscleMetabolicsProbe, _read, _law, READS, Bhargava2004, has_curve=True
)
