"""The first form of the muscle by Thelen."""

from typing import NamedTuple

from osimlite.mechanics.laws.deprecated_muscles import (
    NOTHING,
    OldMuscle,
    rigid_cos,
    thelen_active_force,
    thelen_passive_force,
    thelen_tendon_force,
    thelen_velocity,
)
from osimlite.mechanics.laws.muscles import MuscleInputs
from osimlite.schema.old_muscles import Thelen2003Muscle_Deprecated
from osimlite.simulation.elements.old_muscle import (
    fibers_at,
    isometric_length,
    old_muscle,
    recorded,
    strongest,
)
from osimlite.simulation.elements.parameters import Fields, Number, positive


class FirstThelen(NamedTuple):
    """The properties of the muscle, in the order and with the units of the file."""

    rising: float
    falling: float
    fastest: float
    slowest: float
    tendon_strain: float
    passive_strain: float
    width: float
    passive_shape: float
    damping: float
    shape: float
    most: float


def forces(
    length: float, strain: float, own: FirstThelen, curves: tuple[()]
) -> tuple[float, float, float]:
    """Active, passive and tendon force."""
    passive = thelen_passive_force(length, own.passive_strain, own.passive_shape)
    return (
        thelen_active_force(length, own.width),
        passive,
        thelen_tendon_force(strain, own.tendon_strain),
    )


def thelen(now: MuscleInputs, m: OldMuscle, own: FirstThelen) -> tuple[float, ...]:
    """The muscle at a moment; see Thelen2003Muscle_Deprecated::computeActuation of OpenSim."""
    fibers = fibers_at(now, m, forces, own, ())
    cos, active, passive, tendon = fibers
    if cos > NOTHING:
        fastest = own.slowest + min(now.activation, 1.0) * (own.fastest - own.slowest)
        borne = tendon / cos - passive
        velocity = thelen_velocity(now.activation, active, borne, own.damping, own.shape, own.most)
        velocity *= fastest * m.optimal
    else:
        velocity = now.rate / rigid_cos(now.length, m) if abs(tendon) > NOTHING else 0.0
    time = own.rising if now.excitation >= now.activation else own.falling
    return *recorded(now, fibers, m), (now.excitation - now.activation) / time, velocity


def equilibrium(now: MuscleInputs, m: OldMuscle, own: FirstThelen) -> tuple[bool, float]:
    """The fiber length in equilibrium."""
    return True, isometric_length(now.length, m.optimal, now.activation, m, forces, own, ())


def rigid(now: MuscleInputs, m: OldMuscle, own: FirstThelen) -> float:
    """The greatest force."""
    return strongest(now, m.optimal, m, forces, own, ())


KIND = old_muscle(
    Thelen2003Muscle_Deprecated,
    thelen,
    equilibrium,
    rigid,
    Fields(
        FirstThelen,
        (
            positive("activation_time_constant"),
            positive("deactivation_time_constant"),
            Number("Vmax"),
            Number("Vmax0"),
            *map(
                positive, ("FmaxTendonStrain", "FmaxMuscleStrain", "KshapeActive", "KshapePassive")
            ),
            Number("damping"),
            positive("Af"),
            Number("Flen", lambda x: x > 1.0, "is not above 1"),
        ),
    ),
)
