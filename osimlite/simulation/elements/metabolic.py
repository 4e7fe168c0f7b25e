"""What the probes of metabolic power have in common."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from osimlite.mechanics.multibody.functions import Function
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.probe import Reading, Subject


def metabolic(
    builder: ElementBuilder,
    probe: Any,
    numbers: Callable[[Any, Any, float], Any],
    curve: Function | None = None,
) -> Reading:
    """The power of all muscles of a probe and the basal one, and, if the probe reports them, that and each muscle's.

    Args: builder: of the elements. probe: that reads. numbers: what the law is given, from the
        parameters of a muscle, the muscle, and its mass (kg). curve: that the law is given.

    Raises: UnsupportedError: OpenSim switches the probe off, for a muscle that does not exist or a
        number without meaning.
    """
    known: dict[str, Any] = builder.tree.members("/forceset", "Muscle")
    parameters = probe.metabolic_muscle_parameter_set.objects
    subjects = []
    for item in parameters:
        muscle = known.get(item.name)
        if muscle is None:
            raise builder.unsupported(
                probe, f" of the muscle '{item.name}', which the model does not have"
            )
        subjects.append(Subject(muscle, numbers(item, muscle, mass(builder, probe, item, muscle))))
    basal = (
        probe.basal_coefficient * builder.mechanism.total_mass**probe.basal_exponent
        if probe.basal_rate_on
        else 0.0
    )
    labels: tuple[str, ...] = (f"{probe.name}_TOTAL",)
    first = -1
    if not probe.report_total_metabolics_only:
        names = ("BASAL", *(item.name for item in parameters))
        labels, first = (*labels, *(f"{probe.name}_{name}" for name in names)), 2
    return Reading(labels, tuple(subjects), first, basal, curve)


def mass(builder: ElementBuilder, probe: Any, item: Any, muscle: Any) -> float:
    """Of a muscle, kg: the one that is provided, or density, optimal fiber length and cross-section.

    Raises:
        UnsupportedError: a number has no meaning.
    """
    provided = item.provided_muscle_mass
    names = (
        ["specific_tension", "density"]
        if not item.use_provided_muscle_mass
        else ["provided_muscle_mass"]
    )
    for name in names:
        if not (getattr(item, name) or 0.0) > 0.0:
            raise builder.unsupported(
                probe, f" of the muscle '{item.name}', whose {name} is not positive"
            )
    if not 0.0 <= item.ratio_slow_twitch_fibers <= 1.0:
        raise builder.unsupported(
            probe, f" of the muscle '{item.name}', whose ratio_slow_twitch_fibers is not 0 to 1"
        )
    if item.use_provided_muscle_mass:
        return float(provided)
    return float(
        muscle.max_isometric_force
        / item.specific_tension
        * item.density
        * muscle.optimal_fiber_length
    )
