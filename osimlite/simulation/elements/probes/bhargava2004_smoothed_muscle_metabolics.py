"""The outputs of the component with metabolic power by the model of Bhargava, made smooth."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from osimlite.mechanics.laws.metabolics import Bhargava2004, Smoothed, bhargava2004_smoothed
from osimlite.mechanics.multibody.functions import PiecewiseLinear
from osimlite.schema.metabolics import Bhargava2004SmoothedMuscleMetabolics
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.metabolic import mass
from osimlite.simulation.elements.probe import DeclaredProbe, ProbeKind, Reading, Subject
from osimlite.simulation.elements.probes.bhargava2004_muscle_metabolics_probe import (
    READS,
    of_muscle,
)

RATES = "metabolic", "activation", "maintenance", "shortening", "mechanical_work"
MAINTAINED = PiecewiseLinear((0.0, 0.5, 1.0, 1.5, 10.0), (0.5, 0.5, 1.0, 0.0, 0.0))


def _read(builder: ElementBuilder, component: Bhargava2004SmoothedMuscleMetabolics) -> Reading:
    path = builder.path(component)
    forms = {"tanh": 1.0, "huber": 2.0}
    form = forms[component.smoothing_type or "tanh"] if component.use_smoothing else 0.0
    sharpness = (getattr(component, name) for name in Smoothed._fields[1:])
    smoothed = Smoothed(form, *(10.0 if number is None else number for number in sharpness))
    subjects = []
    labels = [f"{path}|total_{rate}_rate" for rate in RATES]
    for item in component.muscle_parameters:
        muscle: Any = builder.target(item, "socket_muscle", item.socket_muscle)
        numbers = of_muscle(component, item, muscle, mass(builder, component, item, muscle))
        subjects.append(Subject(muscle, (*numbers, *smoothed)))
        labels.append(f"{path}|muscle_metabolic_rate:{builder.path(muscle)}")
    basal = component.basal_coefficient * builder.mechanism.total_mass**component.basal_exponent
    return Reading(tuple(labels), tuple(subjects), constant=basal)


def _measure(probe: DeclaredProbe, system: Any, t: float, y: Sequence[float]) -> list[float]:
    """Sums of the rates of all muscles, the basal one added to the first, and the whole rate of each."""
    rates = []
    for places, numbers in zip(probe.places, probe.numbers, strict=True):
        m, by = (
            Bhargava2004(*numbers[: -len(Smoothed._fields)]),
            Smoothed(*numbers[-len(Smoothed._fields) :]),
        )
        activation, control, active, passive, length, velocity, factor = (
            system.recorded(*place) for place in places
        )
        maintained, _, _ = MAINTAINED.derivatives(length / m.optimal_fiber_length)
        rates.append(
            bhargava2004_smoothed(
                activation, control, active, passive, velocity, factor, maintained, m, by
            )
        )
    sums = [sum(column) for column in zip(*rates, strict=True)] or [0.0] * len(RATES)
    return [sums[0] + probe.reading.constant, *sums[1:], *(row[0] for row in rates)]


PROBE = ProbeKind(Bhargava2004SmoothedMuscleMetabolics, _read, reads=READS, measure=_measure)
