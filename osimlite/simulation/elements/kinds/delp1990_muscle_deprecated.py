"""The muscle by Delp, with a mass between fibers and tendon."""

from typing import NamedTuple

from osimlite.forces.old_muscles import OldMuscle, scaled_activation_rate
from osimlite.schema.old_muscles import Delp1990Muscle_Deprecated
from osimlite.simulation.elements.kind import State
from osimlite.simulation.elements.old_muscle import fibers_at, isometric_length, old_muscle, recorded, strongest
from osimlite.simulation.elements.parameters import Curves, Fields, Number, positive
from osimlite.simulation.kernels.functions import value_at
from osimlite.simulation.kernels.pointers import Floats

Tables = tuple[Floats, Floats, Floats, Floats]


class Delp(NamedTuple):
    """The properties of the muscle that are numbers."""

    time: float
    more: float
    least: float
    mass: float


def forces(length: float, strain: float, own: Delp, curves: Tables) -> tuple[float, float, float]:
    """Active, passive and tendon force."""
    active_curve, passive_curve, tendon_curve, _ = curves
    active, _, _ = value_at(active_curve, length)
    passive, _, _ = value_at(passive_curve, length)
    tendon, _, _ = value_at(tendon_curve, strain)
    return active, passive, tendon if strain >= 0.0 else 0.0


def delp(
    length: float,
    rate: float,
    excitation: float,
    activation: float,
    fiber_length: float,
    fiber_velocity: float,
    m: OldMuscle,
    own: Delp,
    curves: Tables,
) -> tuple[float, ...]:
    """The muscle at a moment; see Delp1990Muscle_Deprecated::computeActuation of OpenSim.

    Its acceleration is no number while the fibers have no length, as before they are brought into equilibrium.
    """
    fibers = fibers_at(length, fiber_length, m, forces, own, curves)
    cos, active, passive, tendon = fibers
    unit = m.optimal / own.time
    velocity = fiber_velocity / unit
    factor, _, _ = value_at(curves[3], velocity)
    pulled = (tendon - (activation * active * factor + passive) * cos) * cos / (own.mass * unit * unit)
    turned = velocity * velocity * (1.0 - cos * cos) / (cos * cos) / (fiber_length / m.optimal)
    activation_rate = scaled_activation_rate(excitation, activation, own.more, own.least, own.time)
    known = recorded(activation, fiber_length, fibers, m)
    return *known, activation_rate, fiber_velocity, (pulled + turned) * unit / own.time


def equilibrium(
    length: float,
    rate: float,
    excitation: float,
    activation: float,
    fiber_length: float,
    fiber_velocity: float,
    m: OldMuscle,
    own: Delp,
    curves: Tables,
) -> tuple[bool, float]:
    """The fiber length in equilibrium; the velocity stays as it is."""
    return True, isometric_length(length, length - m.slack, activation, m, forces, own, curves)


def rigid(
    length: float,
    rate: float,
    excitation: float,
    activation: float,
    fiber_length: float,
    fiber_velocity: float,
    m: OldMuscle,
    own: Delp,
    curves: Tables,
) -> float:
    """The greatest force."""
    return strongest(length, rate, length - m.slack, m, forces, own, curves)


KIND = old_muscle(
    Delp1990Muscle_Deprecated,
    delp,
    equilibrium,
    rigid,
    Fields(
        Delp,
        (positive("time_scale"), Number("activation1"), Number("activation2"), positive("mass")),
    ),
    Curves(
        (
            "active_force_length_curve",
            "passive_force_length_curve",
            "tendon_force_length_curve",
            "force_velocity_curve",
        )
    ),
    rates=("fiber_velocity_rate",),
    states=(State("fiber_velocity"),),
)
