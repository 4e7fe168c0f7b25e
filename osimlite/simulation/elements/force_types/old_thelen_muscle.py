"""Thelen2003Muscle_Deprecated: the first form of Thelen's muscle, which OpenSim keeps for old files."""

from osimlite.base.named_tuples import NamedTuple
from osimlite.mechanics.laws.deprecated_muscles import (
    ZERO_TOLERANCE,
    OldMuscle,
    rigid_cos,
    thelen_active_force,
    thelen_passive_force,
    thelen_tendon_force,
    thelen_velocity,
)
from osimlite.mechanics.laws.muscles import MuscleInputs
from osimlite.schema.old_muscles import (
    Thelen2003Muscle_Deprecated,
)
from osimlite.simulation.elements.force_types.old_muscles import (
    compute_fiber_forces,
    compute_full_force,
    define_old_muscle,
    find_isometric_length,
    list_recorded,
)
from osimlite.simulation.elements.parameters import (
    Fields,
    Number,
    require_positive,
)
from osimlite.simulation.elements.registry import register_force_type


class ThelenFields(NamedTuple):
    """Numbers of Thelen2003Muscle_Deprecated, in the order and with the units of the file.

    Attributes:
        rising: activation_time_constant, s.
        falling: deactivation_time_constant, s.
        fastest: Vmax, the maximum contraction velocity at full activation.
        slowest: Vmax0, the maximum contraction velocity at low activation.
        tendon_strain: FmaxTendonStrain, tendon strain at the maximum isometric force.
        passive_strain: FmaxMuscleStrain, fiber strain at which the passive force equals it.
        width: KshapeActive, width of the active curve.
        passive_shape: KshapePassive, growth of the passive curve.
        damping: damping of the fibers.
        shape: Af, shape of the force-velocity curve.
        most: Flen, largest factor of the active force while lengthening.
    """

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


def compute_thelen_forces(
    length: float, strain: float, fields: ThelenFields, curves: tuple[()]
) -> tuple[float, float, float]:
    """Return active, passive and tendon force, normalized.

    Args:
        length: fiber length over the optimal one.
        strain: strain of the tendon.
        fields: numbers of the class.
        curves: nothing; the class has formulas in place of curves.

    Returns:
        The three forces over the maximum isometric force.
    """
    passive = thelen_passive_force(length, fields.passive_strain, fields.passive_shape)
    return (
        thelen_active_force(length, fields.width),
        passive,
        thelen_tendon_force(strain, fields.tendon_strain),
    )


def compute_thelen(now: MuscleInputs, m: OldMuscle, fields: ThelenFields) -> tuple[float, ...]:
    """Return the quantities of the muscle.

    Source: Thelen2003Muscle_Deprecated::computeActuation of OpenSim.

    Args:
        now: path, excitation and states.
        m: numbers that all deprecated muscles have.
        fields: numbers of the class.

    Returns:
        `RECORDED`, then activation rate (1/s) and fiber velocity (m/s).
    """
    fibers = compute_fiber_forces(now, m, compute_thelen_forces, fields, ())
    cos, active, passive, tendon = fibers
    if cos > ZERO_TOLERANCE:
        # In this version the maximum speed depends on the activation: Vmax0 without, Vmax with full
        # activation.
        fastest = fields.slowest + min(now.activation, 1.0) * (fields.fastest - fields.slowest)
        active_force = tendon / cos - passive
        velocity = thelen_velocity(
            now.activation, active, active_force, fields.damping, fields.shape, fields.most
        )
        velocity *= fastest * m.optimal
    else:
        velocity = now.rate / rigid_cos(now.length, m) if abs(tendon) > ZERO_TOLERANCE else 0.0
    # Thelen's first activation dynamics: two constants, and no product with the activation as in
    # later models.
    time = fields.rising if now.excitation >= now.activation else fields.falling
    return *list_recorded(now, fibers, m), (now.excitation - now.activation) / time, velocity


def equilibrate_thelen(now: MuscleInputs, m: OldMuscle, fields: ThelenFields) -> tuple[bool, float]:
    """Return the fiber length in equilibrium.

    Args:
        now: path, excitation and states.
        m: numbers that all deprecated muscles have.
        fields: numbers of the class.

    Returns:
        True, and the fiber length (m).
    """
    return True, find_isometric_length(
        now.length, m.optimal, now.activation, m, compute_thelen_forces, fields, ()
    )


def compute_rigid_thelen(now: MuscleInputs, m: OldMuscle, fields: ThelenFields) -> float:
    """Return the force of fully active fibers along a rigid tendon.

    Args:
        now: path, excitation and states.
        m: numbers that all deprecated muscles have.
        fields: numbers of the class.

    Returns:
        Force, N.
    """
    return compute_full_force(now, m.optimal, m, compute_thelen_forces, fields, ())


register_force_type(
    define_old_muscle(
        Thelen2003Muscle_Deprecated,
        compute_thelen,
        equilibrate_thelen,
        compute_rigid_thelen,
        Fields(
            ThelenFields,
            (
                require_positive("activation_time_constant"),
                require_positive("deactivation_time_constant"),
                Number("Vmax"),
                Number("Vmax0"),
                *map(
                    require_positive,
                    ("FmaxTendonStrain", "FmaxMuscleStrain", "KshapeActive", "KshapePassive"),
                ),
                Number("damping"),
                require_positive("Af"),
                Number("Flen", lambda x: x > 1.0, "is not above 1"),
            ),
        ),
    )
)
