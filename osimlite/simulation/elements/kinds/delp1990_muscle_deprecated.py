"""The muscle by Delp, with a mass between fibers and tendon."""

from typing import NamedTuple

from osimlite.mechanics.kernels.functions import value_at
from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.laws.deprecated_muscles import OldMuscle, scaled_activation_rate
from osimlite.mechanics.laws.muscles import MuscleInputs
from osimlite.schema.old_muscles import Delp1990Muscle_Deprecated
from osimlite.simulation.elements.kind import State
from osimlite.simulation.elements.old_muscle import (
    fibers_at,
    isometric_length,
    old_muscle,
    recorded,
    strongest,
)
from osimlite.simulation.elements.parameters import Curve, Fields, Number, Together, positive


class DelpCurves(NamedTuple):
    """The curves of the muscle."""

    active: Floats
    passive: Floats
    tendon: Floats
    velocity: Floats


class Delp(NamedTuple):
    """The properties of the muscle that are numbers."""

    time: float
    more: float
    least: float
    mass: float


def forces(
    length: float, strain: float, own: Delp, curves: DelpCurves
) -> tuple[float, float, float]:
    """Active, passive and tendon force."""
    active, _, _ = value_at(curves.active, length)
    passive, _, _ = value_at(curves.passive, length)
    tendon, _, _ = value_at(curves.tendon, strain)
    return active, passive, tendon if strain >= 0.0 else 0.0


def delp(now: MuscleInputs, m: OldMuscle, own: Delp, curves: DelpCurves) -> tuple[float, ...]:
    """The muscle at a moment; see Delp1990Muscle_Deprecated::computeActuation of OpenSim.

    Its acceleration is no number while the fibers have no length, as before they are brought into
    equilibrium.
    """
    fibers = fibers_at(now, m, forces, own, curves)
    cos, active, passive, tendon = fibers
    unit = m.optimal / own.time
    velocity = now.fiber_velocity / unit
    factor, _, _ = value_at(curves.velocity, velocity)
    pulled = (
        (tendon - (now.activation * active * factor + passive) * cos)
        * cos
        / (own.mass * unit * unit)
    )
    turned = velocity * velocity * (1.0 - cos * cos) / (cos * cos) / (now.fiber_length / m.optimal)
    activation_rate = scaled_activation_rate(
        now.excitation, now.activation, own.more, own.least, own.time
    )
    known = recorded(now, fibers, m)
    return *known, activation_rate, now.fiber_velocity, (pulled + turned) * unit / own.time


def equilibrium(
    now: MuscleInputs, m: OldMuscle, own: Delp, curves: DelpCurves
) -> tuple[bool, float]:
    """The fiber length in equilibrium; the velocity stays as it is."""
    return True, isometric_length(
        now.length, now.length - m.slack, now.activation, m, forces, own, curves
    )


def rigid(now: MuscleInputs, m: OldMuscle, own: Delp, curves: DelpCurves) -> float:
    """The greatest force."""
    return strongest(now, now.length - m.slack, m, forces, own, curves)


KIND = old_muscle(
    Delp1990Muscle_Deprecated,
    delp,
    equilibrium,
    rigid,
    Fields(
        Delp,
        (positive("time_scale"), Number("activation1"), Number("activation2"), positive("mass")),
    ),
    Together(
        DelpCurves,
        (
            Curve("active_force_length_curve"),
            Curve("passive_force_length_curve"),
            Curve("tendon_force_length_curve"),
            Curve("force_velocity_curve"),
        ),
    ),
    rates=("fiber_velocity_rate",),
    states=(State("fiber_velocity"),),
)
