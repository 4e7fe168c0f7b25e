"""Metabolic power by the model of Umberger."""

from __future__ import annotations

from osimlite.mechanics.laws.metabolics import Umberger2010, umberger2010
from osimlite.schema.metabolics import Umberger2010MuscleMetabolicsProbe
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.metabolic import metabolic
from osimlite.simulation.elements.probe import ProbeKind, Reading


def _read(builder: ElementBuilder, probe: Umberger2010MuscleMetabolicsProbe) -> Reading:
    of_probe = [getattr(probe, name) for name in Umberger2010._fields[4:]]
    return metabolic(
        builder,
        probe,
        lambda item, muscle, mass: Umberger2010(
            muscle.max_contraction_velocity,
            muscle.optimal_fiber_length,
            mass,
            item.ratio_slow_twitch_fibers,
            *of_probe,
        ),
    )


PROBE = ProbeKind(
    Umberger2010MuscleMetabolicsProbe,
    _read,
    umberger2010,
    (
        "activation",
        "control",
        "active_fiber_force",
        "fiber_length",
        "fiber_velocity",
        "active_force_length",
    ),
    Umberger2010,
)
