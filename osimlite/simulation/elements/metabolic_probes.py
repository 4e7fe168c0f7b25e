"""Probes of metabolic power: the models of Bhargava 2004, its smooth form, and Umberger 2010."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from osimlite.mechanics.kernels.functions import evaluate_function
from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.laws.metabolics import (
    Bhargava2004,
    SmoothTransitions,
    Umberger2010,
    bhargava2004,
    bhargava2004_smoothed,
    umberger2010,
)
from osimlite.mechanics.multibody.functions import PiecewiseLinear, SmoothFunction
from osimlite.schema.probe_types import (
    Bhargava2004MuscleMetabolicsProbe,
    Bhargava2004SmoothedMuscleMetabolics,
    Umberger2010MuscleMetabolicsProbe,
)
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.probe_type import DeclaredProbe, ProbeSubject, ProbeType, Reading
from osimlite.simulation.elements.registry import register_probe_type


def read_metabolic_probe(
    builder: ElementBuilder,
    probe: Any,
    numbers: Callable[[Any, Any, float], Any],
    curve: SmoothFunction | None = None,
) -> Reading:
    """Return the reading of a metabolic probe.

    Its results are the total power and, unless only that is requested, the basal power and that of
    each muscle, W.

    Args:
        builder: builder of the elements.
        probe: probe component of the model.
        numbers: function that returns the numbers of the law from the parameters of a muscle, the
            muscle, and its mass (kg).
        curve: curve that the law takes; None if it takes none.

    Returns:
        The reading with OpenSim's labels.

    Raises:
        UnsupportedError: OpenSim disables the probe, because a muscle does not exist or a number
            has no meaning.
    """
    muscles_by_name: dict[str, Any] = builder.tree.list_members("/forceset", "Muscle")
    parameters = probe.metabolic_muscle_parameter_set.objects
    subjects = []
    for item in parameters:
        muscle = muscles_by_name.get(item.name)
        if muscle is None:
            raise builder.make_unsupported_error(
                probe, f" of the muscle '{item.name}', which the model does not have"
            )
        subjects.append(
            ProbeSubject(
                muscle, numbers(item, muscle, find_muscle_mass(builder, probe, item, muscle))
            )
        )
    # The basal power is a constant of the motion.
    basal = (
        probe.basal_coefficient * builder.mechanism.total_mass**probe.basal_exponent
        if probe.basal_rate_on
        else 0.0
    )
    labels: tuple[str, ...] = (f"{probe.name}_TOTAL",)
    # -1: the results of single muscles are not reported.
    first = -1
    if not probe.report_total_metabolics_only:
        names = ("BASAL", *(item.name for item in parameters))
        labels = (*labels, *(f"{probe.name}_{name}" for name in names))
        first = 2
    return Reading(labels, tuple(subjects), first, basal, curve)


def find_muscle_mass(builder: ElementBuilder, probe: Any, item: Any, muscle: Any) -> float:
    """Return the mass of a muscle.

    It is the provided one, or m = density F0 / sigma l0 with the specific tension sigma.

    Args:
        builder: builder of the elements.
        probe: the probe, for messages.
        item: the probe's parameters of the muscle.
        muscle: the muscle.

    Returns:
        Mass, kg.

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
            # The reader stores None for a missing property.
            raise builder.make_unsupported_error(
                probe, f" of the muscle '{item.name}', whose {name} is not positive"
            )
    if not 0.0 <= item.ratio_slow_twitch_fibers <= 1.0:
        raise builder.make_unsupported_error(
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


def compute_bhargava(
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
    """Return the metabolic power (W) of one muscle.

    Args:
        activation: activation, 0 to 1.
        excitation: control, 0 to 1.
        active_force: active fiber force, N.
        passive_force: passive fiber force, N.
        fiber_length: fiber length, m.
        fiber_velocity: lengthening speed of the fibers, m/s.
        force_length: active force-length factor.
        curve: maintenance factor over normalized fiber length.
        m: parameters of the muscle and the probe.
    """
    maintained, _, _ = evaluate_function(curve, fiber_length / m.optimal_fiber_length)
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


def define_bhargava(probe: Any, item: Any, muscle: Any, mass: float) -> Bhargava2004:
    """Return the parameters of the law.

    Switches that the probe does not have, as in the smooth form, are on.

    Args:
        probe: probe component of the model.
        item: the probe's parameters of the muscle.
        muscle: the muscle.
        mass: mass of the muscle, kg.
    """
    return Bhargava2004(
        muscle.max_isometric_force,
        muscle.optimal_fiber_length,
        mass,
        *(getattr(item, name) for name in Bhargava2004._fields[3:8]),
        *(getattr(probe, name, True) for name in Bhargava2004._fields[8:]),
    )


def _read_bhargava(builder: ElementBuilder, probe: Bhargava2004MuscleMetabolicsProbe) -> Reading:
    name = "normalized_fiber_length_dependence_on_maintenance_rate"
    curve = builder.read_function(probe, getattr(probe, name), name)
    return read_metabolic_probe(builder, probe, partial(define_bhargava, probe), curve)


BHARGAVA_INPUTS = (
    "activation",
    "control",
    "active_fiber_force",
    "passive_fiber_force",
    "fiber_length",
    "fiber_velocity",
    "active_force_length",
)
"""Inputs of the law from the record of a muscle."""

register_probe_type(
    ProbeType(
        Bhargava2004MuscleMetabolicsProbe,
        _read_bhargava,
        compute_bhargava,
        BHARGAVA_INPUTS,
        Bhargava2004,
        has_curve=True,
    )
)


RATE_NAMES = "metabolic", "activation", "maintenance", "shortening", "mechanical_work"
"""Names of the rates in the labels of the outputs."""
MAINTENANCE_CURVE = PiecewiseLinear((0.0, 0.5, 1.0, 1.5, 10.0), (0.5, 0.5, 1.0, 0.0, 0.0))
"""Maintenance factor over normalized fiber length, as in OpenSim."""


def _read_smoothed(
    builder: ElementBuilder, component: Bhargava2004SmoothedMuscleMetabolics
) -> Reading:
    path = builder.path(component)
    # The law takes the form of the transitions as a number: 0 for sharp ones.
    forms = {"tanh": 1.0, "huber": 2.0}
    form = forms[component.smoothing_type or "tanh"] if component.use_smoothing else 0.0
    sharpness = (getattr(component, name) for name in SmoothTransitions._fields[1:])
    # Without a value OpenSim's smoothing parameter is 10.
    smoothed = SmoothTransitions(
        form, *(10.0 if number is None else number for number in sharpness)
    )
    subjects = []
    labels = [f"{path}|total_{rate}_rate" for rate in RATE_NAMES]
    for item in component.muscle_parameters:
        muscle: Any = builder.resolve_target(item, "socket_muscle", item.socket_muscle)
        numbers = define_bhargava(
            component, item, muscle, find_muscle_mass(builder, component, item, muscle)
        )
        subjects.append(ProbeSubject(muscle, (*numbers, *smoothed)))
        labels.append(f"{path}|muscle_metabolic_rate:{builder.path(muscle)}")
    basal = component.basal_coefficient * builder.mechanism.total_mass**component.basal_exponent
    return Reading(tuple(labels), tuple(subjects), constant=basal)


def _measure_smoothed(
    probe: DeclaredProbe, system: Any, t: float, y: Sequence[float]
) -> list[float]:
    """Return the metabolic rates of all muscles.

    Args:
        probe: probe component of the model.
        system: the system after an evaluation of its forces.
        t: time, s.
        y: state (y,).

    Returns:
        The sums of the rates of all muscles (the first with the basal rate), then each muscle's
        total rate, W.
    """
    rates = []
    for offsets, numbers in zip(probe.input_offsets, probe.numbers, strict=True):
        m = Bhargava2004(*numbers[: -len(SmoothTransitions._fields)])
        by = SmoothTransitions(*numbers[-len(SmoothTransitions._fields) :])
        # The record has the quantities in the order of `BHARGAVA_INPUTS`.
        activation, control, active, passive, length, velocity, factor = (
            system.read_record(*offset) for offset in offsets
        )
        maintained, _, _ = MAINTENANCE_CURVE.derivatives(length / m.optimal_fiber_length)
        rates.append(
            bhargava2004_smoothed(
                activation, control, active, passive, velocity, factor, maintained, m, by
            )
        )
    sums = [sum(column) for column in zip(*rates, strict=True)] or [0.0] * len(RATE_NAMES)
    return [sums[0] + probe.reading.constant, *sums[1:], *(row[0] for row in rates)]


register_probe_type(
    ProbeType(
        Bhargava2004SmoothedMuscleMetabolics,
        _read_smoothed,
        inputs=BHARGAVA_INPUTS,
        measure=_measure_smoothed,
    )
)


def _read_umberger(builder: ElementBuilder, probe: Umberger2010MuscleMetabolicsProbe) -> Reading:
    of_probe = [getattr(probe, name) for name in Umberger2010._fields[4:]]
    return read_metabolic_probe(
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


register_probe_type(
    ProbeType(
        Umberger2010MuscleMetabolicsProbe,
        _read_umberger,
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
)
