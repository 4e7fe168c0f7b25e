"""The muscle by Schutte."""

from typing import NamedTuple

from osimlite.mechanics.kernels.functions import value_at
from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.laws.deprecated_muscles import (
    NOTHING,
    OldMuscle,
    rigid_cos,
    scaled_activation_rate,
    schutte_passive_force,
    schutte_velocity,
)
from osimlite.mechanics.laws.muscles import MuscleInputs
from osimlite.schema.old_muscles import Schutte1993Muscle_Deprecated
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.old_muscle import (
    fibers_at,
    isometric_length,
    old_muscle,
    recorded,
    strongest,
)
from osimlite.simulation.elements.parameters import Curve, Fields, Number, Together, positive


class SchutteCurves(NamedTuple):
    """The curves of the muscle."""

    active: Floats
    passive: Floats
    tendon: Floats


class Schutte(NamedTuple):
    """The properties of the muscle that are numbers, and whether the file has a curve of the passive force."""

    time: float
    more: float
    least: float
    damping: float
    has_curve: float


def forces(
    length: float, strain: float, own: Schutte, curves: SchutteCurves
) -> tuple[float, float, float]:
    """Active, passive and tendon force."""
    active, _, _ = value_at(curves.active, length)
    tendon, _, _ = value_at(curves.tendon, strain)
    passive = (
        value_at(curves.passive, length)[0] if own.has_curve else schutte_passive_force(length)
    )
    return active, passive, tendon if strain >= 0.0 else 0.0


def schutte(
    now: MuscleInputs, m: OldMuscle, own: Schutte, curves: SchutteCurves
) -> tuple[float, ...]:
    """The muscle at a moment; see Schutte1993Muscle_Deprecated::computeActuation of OpenSim."""
    fibers = fibers_at(now, m, forces, own, curves)
    cos, active, passive, tendon = fibers
    if cos > NOTHING:
        borne = max(tendon / cos - passive, 0.0)
        velocity = (
            schutte_velocity(now.activation, max(active, 0.0), borne, own.damping)
            * m.optimal
            / own.time
        )
    else:
        velocity = now.rate * rigid_cos(now.length, m) if abs(tendon) > NOTHING else 0.0
    activation_rate = scaled_activation_rate(
        now.excitation, now.activation, own.more, own.least, own.time
    )
    return *recorded(now, fibers, m), activation_rate, velocity


def equilibrium(
    now: MuscleInputs, m: OldMuscle, own: Schutte, curves: SchutteCurves
) -> tuple[bool, float]:
    """The fiber length in equilibrium."""
    return True, isometric_length(now.length, m.optimal, now.activation, m, forces, own, curves)


def rigid(now: MuscleInputs, m: OldMuscle, own: Schutte, curves: SchutteCurves) -> float:
    """The greatest force."""
    return strongest(now, m.optimal, m, forces, own, curves)


def _has_curve(builder: ElementBuilder, force: Schutte1993Muscle_Deprecated) -> tuple[bool]:
    return ("passive_force_length_curve" in force.model_fields_set,)


KIND = old_muscle(
    Schutte1993Muscle_Deprecated,
    schutte,
    equilibrium,
    rigid,
    Fields(
        Schutte,
        (positive("time_scale"), Number("activation1"), Number("activation2"), positive("damping")),
        _has_curve,
    ),
    Together(
        SchutteCurves, tuple(Curve(f"{name}_force_length_curve") for name in SchutteCurves._fields)
    ),
)
