"""The deprecated muscles that OpenSim keeps for old files: Delp 1990, Schutte 1993 and the first Thelen 2003."""

from collections.abc import Callable
from math import nan
from typing import Any, NamedTuple

from osimlite.mechanics.kernels.functions import value_at
from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.laws.deprecated_muscles import (
    NOTHING,
    ROUNDS,
    TOLERANCE,
    OldMuscle,
    cos_upright,
    fitted,
    generic_velocity_factor,
    next_length,
    rigid_cos,
    scaled_activation_rate,
    schutte_passive_force,
    schutte_velocity,
    thelen_active_force,
    thelen_passive_force,
    thelen_tendon_force,
    thelen_velocity,
)
from osimlite.mechanics.laws.muscles import MuscleInputs
from osimlite.schema.old_muscles import (
    Delp1990Muscle_Deprecated,
    Schutte1993Muscle_Deprecated,
    Thelen2003Muscle_Deprecated,
)
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.force_type import ForceType, State
from osimlite.simulation.elements.muscle import height, muscle
from osimlite.simulation.elements.parameters import (
    Curve,
    Fields,
    Number,
    Parameter,
    Together,
    positive,
)
from osimlite.simulation.elements.registry import register_force_type

ForceLaw = Callable[[float, float, Any, Any], tuple[float, float, float]]
"""Active force at full activation, passive force and the tendon's, normalized; from a normalized
fiber length, a strain of the tendon, and numbers and curves that are the muscle's fields.
"""

FiberForces = tuple[float, float, float, float]


def compute_fiber_forces(
    now: MuscleInputs, m: OldMuscle, force_law: ForceLaw, fields: Any, curves: Any
) -> FiberForces:
    """Cosine of pennation and `force_law` of the fibers."""
    fiber_length = now.fiber_length
    cos = cos_upright(fiber_length, m.height)
    strain = (now.length - fiber_length * cos) / m.slack - 1.0
    active, passive, tendon = force_law(fiber_length / m.optimal, strain, fields, curves)
    return cos, active, passive, tendon


def list_recorded(
    now: MuscleInputs, fibers: FiberForces, m: OldMuscle
) -> tuple[float, float, float, float, float, float, float, float]:
    """What is list_recorded of every muscle; nobody knows of a factor by velocity."""
    cos, active, passive, tendon = fibers
    tension, passive_force = m.strength * tendon, m.strength * passive
    return (
        tension,
        now.activation,
        now.fiber_length,
        cos,
        active,
        nan,
        tension / cos - passive_force,
        passive_force,
    )


def find_isometric_length(
    length: float,
    start: float,
    activation: float,
    m: OldMuscle,
    force_law: ForceLaw,
    fields: Any,
    curves: Any,
) -> float:
    """The fiber length, m, where fibers at rest and tendon are in equilibrium, as computeIsometricForce of OpenSim.

    To 0.01 N, or where the search has got to after its rounds; fibers stand upright where the path
    is too short.

    Args:
        length: of the path, m.
        start: fiber length that is tried first, m.
        activation: of the muscle.
        m: the muscle.
        force_law: of it.
        fields: third argument of them.
        curves: fourth one.
    """
    if length < m.slack:
        return m.height
    guess = fitted(length, start, m)
    before, error_before = guess.length, 0.0
    for number in range(ROUNDS):
        active, passive, tendon = force_law(guess.length / m.optimal, guess.strain, fields, curves)
        fibers = max(activation * active, 0.0) + max(passive, 0.0)
        error = (tendon - fibers * guess.cos) * m.strength
        if abs(error) <= TOLERANCE:
            break
        if number == 0:
            error_before = error
        tried = next_length(guess, before, error, error_before, fibers, active + passive, tendon, m)
        before, error_before = guess.length, error
        guess = fitted(length, tried, m)
    return guess.length


def compute_full_force(
    now: MuscleInputs, start: float, m: OldMuscle, force_law: ForceLaw, fields: Any, curves: Any
) -> float:
    """Force (N) in equilibrium at rest, fully activated, times a factor by the rate of the path.

    It is what OpenSim takes for the active force along a rigid tendon; see
    calcInextensibleTendonActiveFiberForce of ActivationFiberLengthMuscle_Deprecated. Args as of
    `find_isometric_length`.
    """
    if now.length < m.slack:
        return 0.0
    fiber_length = find_isometric_length(now.length, start, 1.0, m, force_law, fields, curves)
    at_rest = MuscleInputs(now.length, now.rate, 1.0, 1.0, fiber_length, 0.0, 0.0)
    _, _, _, tendon = compute_fiber_forces(at_rest, m, force_law, fields, curves)
    return m.strength * tendon * generic_velocity_factor(now.rate, m)


def _check_flags(builder: ElementBuilder, force: Any) -> None:
    for flag in ("ignore_tendon_compliance", "ignore_activation_dynamics"):
        words = f"is true, which a {type(force).__name__} cannot do"
        Number(flag, lambda x: x == 0.0, words).read(builder, force)


def define_old_muscle(
    component: type,
    law: Callable[..., Any],
    equilibrium: Callable[..., Any],
    rigid: Callable[..., float],
    *parameters: Parameter,
    rates: tuple[str, ...] = (),
    states: tuple[State, ...] = (),
) -> ForceType:
    """The kind of such a muscle: activation and fiber length start at 0, whatever the file says.

    Args:
        component: its class.
        law: gives what is list_recorded, and then rates.
        equilibrium: gives the fiber length.
        rigid: gives the greatest force.
        parameters: that both are given besides the muscle's numbers.
        rates: of states besides activation and fiber length.
        states: besides these.
    """
    numbers = (
        Number("max_isometric_force"),
        positive("optimal_fiber_length"),
        positive("tendon_slack_length"),
        Number("max_contraction_velocity"),
    )
    return muscle(
        component,
        law,
        ("activation_rate", "fiber_velocity", *rates),
        Fields(OldMuscle, numbers, height),
        *parameters,
        states=(State("activation"), State("fiber_length", output="fiber_velocity"), *states),
        equilibrium=equilibrium,
        settled=("fiber_length",),
        rigid=rigid,
        check=_check_flags,
    )


class DelpCurves(NamedTuple):
    """The curves of the muscle."""

    active: Floats
    passive: Floats
    tendon: Floats
    velocity: Floats


class DelpFields(NamedTuple):
    """The properties of the muscle that are numbers."""

    time: float
    more: float
    least: float
    mass: float


def compute_delp_forces(
    length: float, strain: float, fields: DelpFields, curves: DelpCurves
) -> tuple[float, float, float]:
    """Active, passive and tendon force."""
    active, _, _ = value_at(curves.active, length)
    passive, _, _ = value_at(curves.passive, length)
    tendon, _, _ = value_at(curves.tendon, strain)
    return active, passive, tendon if strain >= 0.0 else 0.0


def compute_delp(
    now: MuscleInputs, m: OldMuscle, fields: DelpFields, curves: DelpCurves
) -> tuple[float, ...]:
    """The muscle at a moment; see Delp1990Muscle_Deprecated::computeActuation of OpenSim.

    Its acceleration is no number while the fibers have no length, as before they are brought into
    equilibrate_delp.
    """
    fibers = compute_fiber_forces(now, m, compute_delp_forces, fields, curves)
    cos, active, passive, tendon = fibers
    unit = m.optimal / fields.time
    velocity = now.fiber_velocity / unit
    factor, _, _ = value_at(curves.velocity, velocity)
    pulled = (
        (tendon - (now.activation * active * factor + passive) * cos)
        * cos
        / (fields.mass * unit * unit)
    )
    turned = velocity * velocity * (1.0 - cos * cos) / (cos * cos) / (now.fiber_length / m.optimal)
    activation_rate = scaled_activation_rate(
        now.excitation, now.activation, fields.more, fields.least, fields.time
    )
    known = list_recorded(now, fibers, m)
    return *known, activation_rate, now.fiber_velocity, (pulled + turned) * unit / fields.time


def equilibrate_delp(
    now: MuscleInputs, m: OldMuscle, fields: DelpFields, curves: DelpCurves
) -> tuple[bool, float]:
    """The fiber length in equilibrate_delp; the velocity stays as it is."""
    return True, find_isometric_length(
        now.length, now.length - m.slack, now.activation, m, compute_delp_forces, fields, curves
    )


def compute_rigid_delp(
    now: MuscleInputs, m: OldMuscle, fields: DelpFields, curves: DelpCurves
) -> float:
    """The greatest force."""
    return compute_full_force(now, now.length - m.slack, m, compute_delp_forces, fields, curves)


register_force_type(
    define_old_muscle(
        Delp1990Muscle_Deprecated,
        compute_delp,
        equilibrate_delp,
        compute_rigid_delp,
        Fields(
            DelpFields,
            (
                positive("time_scale"),
                Number("activation1"),
                Number("activation2"),
                positive("mass"),
            ),
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
)


class SchutteCurves(NamedTuple):
    """The curves of the muscle."""

    active: Floats
    passive: Floats
    tendon: Floats


class SchutteFields(NamedTuple):
    """The properties of the muscle that are numbers, and whether the file has a curve of the passive force."""

    time: float
    more: float
    least: float
    damping: float
    has_curve: float


def compute_schutte_forces(
    length: float, strain: float, fields: SchutteFields, curves: SchutteCurves
) -> tuple[float, float, float]:
    """Active, passive and tendon force."""
    active, _, _ = value_at(curves.active, length)
    tendon, _, _ = value_at(curves.tendon, strain)
    passive = (
        value_at(curves.passive, length)[0] if fields.has_curve else schutte_passive_force(length)
    )
    return active, passive, tendon if strain >= 0.0 else 0.0


def compute_schutte(
    now: MuscleInputs, m: OldMuscle, fields: SchutteFields, curves: SchutteCurves
) -> tuple[float, ...]:
    """The muscle at a moment; see Schutte1993Muscle_Deprecated::computeActuation of OpenSim."""
    fibers = compute_fiber_forces(now, m, compute_schutte_forces, fields, curves)
    cos, active, passive, tendon = fibers
    if cos > NOTHING:
        borne = max(tendon / cos - passive, 0.0)
        velocity = (
            schutte_velocity(now.activation, max(active, 0.0), borne, fields.damping)
            * m.optimal
            / fields.time
        )
    else:
        velocity = now.rate * rigid_cos(now.length, m) if abs(tendon) > NOTHING else 0.0
    activation_rate = scaled_activation_rate(
        now.excitation, now.activation, fields.more, fields.least, fields.time
    )
    return *list_recorded(now, fibers, m), activation_rate, velocity


def equilibrate_schutte(
    now: MuscleInputs, m: OldMuscle, fields: SchutteFields, curves: SchutteCurves
) -> tuple[bool, float]:
    """The fiber length in equilibrate_schutte."""
    return True, find_isometric_length(
        now.length, m.optimal, now.activation, m, compute_schutte_forces, fields, curves
    )


def compute_rigid_schutte(
    now: MuscleInputs, m: OldMuscle, fields: SchutteFields, curves: SchutteCurves
) -> float:
    """The greatest force."""
    return compute_full_force(now, m.optimal, m, compute_schutte_forces, fields, curves)


def _has_curve(builder: ElementBuilder, force: Schutte1993Muscle_Deprecated) -> tuple[bool]:
    return ("passive_force_length_curve" in force.model_fields_set,)


register_force_type(
    define_old_muscle(
        Schutte1993Muscle_Deprecated,
        compute_schutte,
        equilibrate_schutte,
        compute_rigid_schutte,
        Fields(
            SchutteFields,
            (
                positive("time_scale"),
                Number("activation1"),
                Number("activation2"),
                positive("damping"),
            ),
            _has_curve,
        ),
        Together(
            SchutteCurves,
            tuple(Curve(f"{name}_force_length_curve") for name in SchutteCurves._fields),
        ),
    )
)


class ThelenFields(NamedTuple):
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


def compute_thelen_forces(
    length: float, strain: float, fields: ThelenFields, curves: tuple[()]
) -> tuple[float, float, float]:
    """Active, passive and tendon force."""
    passive = thelen_passive_force(length, fields.passive_strain, fields.passive_shape)
    return (
        thelen_active_force(length, fields.width),
        passive,
        thelen_tendon_force(strain, fields.tendon_strain),
    )


def compute_thelen(now: MuscleInputs, m: OldMuscle, fields: ThelenFields) -> tuple[float, ...]:
    """The muscle at a moment; see Thelen2003Muscle_Deprecated::computeActuation of OpenSim."""
    fibers = compute_fiber_forces(now, m, compute_thelen_forces, fields, ())
    cos, active, passive, tendon = fibers
    if cos > NOTHING:
        fastest = fields.slowest + min(now.activation, 1.0) * (fields.fastest - fields.slowest)
        borne = tendon / cos - passive
        velocity = thelen_velocity(
            now.activation, active, borne, fields.damping, fields.shape, fields.most
        )
        velocity *= fastest * m.optimal
    else:
        velocity = now.rate / rigid_cos(now.length, m) if abs(tendon) > NOTHING else 0.0
    time = fields.rising if now.excitation >= now.activation else fields.falling
    return *list_recorded(now, fibers, m), (now.excitation - now.activation) / time, velocity


def equilibrate_thelen(now: MuscleInputs, m: OldMuscle, fields: ThelenFields) -> tuple[bool, float]:
    """The fiber length in equilibrate_thelen."""
    return True, find_isometric_length(
        now.length, m.optimal, now.activation, m, compute_thelen_forces, fields, ()
    )


def compute_rigid_thelen(now: MuscleInputs, m: OldMuscle, fields: ThelenFields) -> float:
    """The greatest force."""
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
                positive("activation_time_constant"),
                positive("deactivation_time_constant"),
                Number("Vmax"),
                Number("Vmax0"),
                *map(
                    positive,
                    ("FmaxTendonStrain", "FmaxMuscleStrain", "KshapeActive", "KshapePassive"),
                ),
                Number("damping"),
                positive("Af"),
                Number("Flen", lambda x: x > 1.0, "is not above 1"),
            ),
        ),
    )
)
