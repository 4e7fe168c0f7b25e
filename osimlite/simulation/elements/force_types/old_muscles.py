"""Deprecated muscles that OpenSim keeps for old files: what they share, and Delp 1990 and Schutte 1993."""

from collections.abc import Callable
from math import nan
from typing import Any

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.text import add_article
from osimlite.mechanics.kernels.functions import evaluate_function
from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.laws.deprecated_muscles import (
    FORCE_TOLERANCE_N,
    MAX_TRIALS,
    ZERO_TOLERANCE,
    OldMuscle,
    compute_schutte_activation_rate,
    cos_pennation_of_fibers,
    generic_velocity_factor,
    make_guess,
    next_length,
    rigid_cos,
    schutte_passive_force,
    schutte_velocity,
)
from osimlite.mechanics.laws.muscles import MuscleInputs
from osimlite.schema.old_muscles import (
    Delp1990Muscle_Deprecated,
    Schutte1993Muscle_Deprecated,
)
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.force_type import ForceType, State
from osimlite.simulation.elements.muscle import compute_height, define_muscle
from osimlite.simulation.elements.parameters import (
    Curve,
    Fields,
    Number,
    Parameter,
    ParameterGroup,
    require_positive,
)
from osimlite.simulation.elements.registry import register_force_type

ForceLaw = Callable[[float, float, Any, Any], tuple[float, float, float]]
"""Function of normalized fiber length, tendon strain, fields and curves of a muscle.

It returns the active force at full activation, the passive force and the tendon force, normalized.
"""

FiberForces = tuple[float, float, float, float]
"""Cosine of pennation, and active, passive and tendon force, normalized."""


def compute_fiber_forces(
    now: MuscleInputs, m: OldMuscle, force_law: ForceLaw, fields: Any, curves: Any
) -> FiberForces:
    """Return the cosine of pennation and the normalized forces at the current fiber length.

    Args:
        now: path, excitation and states.
        m: numbers that all deprecated muscles have.
        force_law: forces of the class.
        fields: numbers of the class.
        curves: curves of the class.

    Returns:
        Cosine of pennation, and active, passive and tendon force over the maximum isometric force.
    """
    fiber_length = now.fiber_length
    cos = cos_pennation_of_fibers(fiber_length, m.height)
    # Strain of the tendon: what the fibers leave of the path.
    strain = (now.length - fiber_length * cos) / m.slack - 1.0
    active, passive, tendon = force_law(fiber_length / m.optimal, strain, fields, curves)
    return cos, active, passive, tendon


def list_recorded(
    now: MuscleInputs, fibers: FiberForces, m: OldMuscle
) -> tuple[float, float, float, float, float, float, float, float]:
    """Return the quantities of `muscle.RECORDED`; the force-velocity factor is unknown (NaN).

    Args:
        now: path, excitation and states.
        fibers: result of `compute_fiber_forces`.
        m: numbers of the muscle.

    Returns:
        The values in the order of `RECORDED`.
    """
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
    """Return the fiber length at which resting fibers and tendon are in equilibrium.

    The search is that of OpenSim's computeIsometricForce: it ends at an error of 0.01 N or after
    its last iteration. Fibers are perpendicular to the tendon if the path is too short.

    Args:
        length: length of the path, m.
        start: first guess of the fiber length, m.
        activation: activation of the muscle.
        m: numbers of the muscle.
        force_law: forces of the class.
        fields: numbers of the class.
        curves: curves of the class.

    Returns:
        Fiber length, m.
    """
    # The path is too short to leave any length along the tendon: the fibers are across it.
    if length < m.slack:
        # The height is the shortest fiber length.
        return m.height
    guess = make_guess(length, start, m)
    before, error_before = guess.length, 0.0
    for number in range(MAX_TRIALS):
        active, passive, tendon = force_law(guess.length / m.optimal, guess.strain, fields, curves)
        # Fibers only pull; curves of users can be negative.
        fibers = max(activation * active, 0.0) + max(passive, 0.0)
        error = (tendon - fibers * guess.cos) * m.strength
        if abs(error) <= FORCE_TOLERANCE_N:
            break
        # The first round has no earlier error to compare with.
        if number == 0:
            error_before = error
        tried = next_length(guess, before, error, error_before, fibers, active + passive, tendon, m)
        before, error_before = guess.length, error
        guess = make_guess(length, tried, m)
    return guess.length


def compute_full_force(
    now: MuscleInputs, start: float, m: OldMuscle, force_law: ForceLaw, fields: Any, curves: Any
) -> float:
    """Return the force in equilibrium at rest and full activation, times a factor of the path's rate.

    OpenSim uses it as the active force along a rigid tendon; see
    calcInextensibleTendonActiveFiberForce of ActivationFiberLengthMuscle_Deprecated.

    Args:
        now: path, excitation and states.
        start: first guess of the fiber length, m.
        m: numbers of the muscle.
        force_law: forces of the class.
        fields: numbers of the class.
        curves: curves of the class.

    Returns:
        Force, N; 0 for a path that is shorter than the tendon.
    """
    if now.length < m.slack:
        return 0.0
    fiber_length = find_isometric_length(now.length, start, 1.0, m, force_law, fields, curves)
    # Fully active fibers at rest; the factor of the velocity multiplies their force afterwards.
    at_rest = MuscleInputs(now.length, now.rate, 1.0, 1.0, fiber_length, 0.0, 0.0)
    _, _, _, tendon = compute_fiber_forces(at_rest, m, force_law, fields, curves)
    return m.strength * tendon * generic_velocity_factor(now.rate, m)


def _check_flags(builder: ElementBuilder, force: Any) -> None:
    # These classes have the flags of their base, but not the behaviour.
    for flag in ("ignore_tendon_compliance", "ignore_activation_dynamics"):
        words = (
            f"is true, which {add_article(type(force).__name__)} does not support; set it to false"
        )
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
    """Return the force type of a deprecated muscle, whose activation and fiber length start at 0.

    Args:
        component: class of the muscle.
        law: function that returns `RECORDED` and the rates.
        equilibrium: function that returns the fiber length.
        rigid: function that returns the force of fully active fibers.
        parameters: parameters of these functions after the muscle's numbers.
        rates: outputs after the rates of activation and fiber length.
        states: states after activation and fiber length.

    Returns:
        The declaration, which still has to be registered.
    """
    numbers = (
        Number("max_isometric_force"),
        require_positive("optimal_fiber_length"),
        require_positive("tendon_slack_length"),
        Number("max_contraction_velocity"),
    )
    return define_muscle(
        component,
        law,
        ("activation_rate", "fiber_velocity", *rates),
        Fields(OldMuscle, numbers, compute_height),
        *parameters,
        states=(State("activation"), State("fiber_length", output="fiber_velocity"), *states),
        equilibrium=equilibrium,
        solved_states=("fiber_length",),
        rigid_law=rigid,
        check=_check_flags,
    )


class DelpCurves(NamedTuple):
    """Tables of the curves of Delp1990Muscle_Deprecated, all normalized.

    Attributes:
        active: active force over fiber length.
        passive: passive force over fiber length.
        tendon: tendon force over tendon strain.
        velocity: factor of the active force over fiber velocity.
    """

    active: Floats
    passive: Floats
    tendon: Floats
    velocity: Floats


class DelpFields(NamedTuple):
    """Numbers of Delp1990Muscle_Deprecated.

    Attributes:
        time: time_scale, s, the unit of time of the equations.
        more: activation1, a rate constant of the activation.
        least: activation2, a rate constant of the activation.
        mass: mass between fibers and tendon, normalized.
    """

    time: float
    more: float
    least: float
    mass: float


def compute_delp_forces(
    length: float, strain: float, fields: DelpFields, curves: DelpCurves
) -> tuple[float, float, float]:
    """Return active, passive and tendon force, normalized.

    Args:
        length: fiber length over the optimal one.
        strain: strain of the tendon.
        fields: numbers of the class.
        curves: curves of the class.

    Returns:
        The three forces over the maximum isometric force.
    """
    active, _, _ = evaluate_function(curves.active, length)
    passive, _, _ = evaluate_function(curves.passive, length)
    tendon, _, _ = evaluate_function(curves.tendon, strain)
    # A slack tendon does not push; the curve may have values below zero strain.
    return active, passive, tendon if strain >= 0.0 else 0.0


def compute_delp(
    now: MuscleInputs, m: OldMuscle, fields: DelpFields, curves: DelpCurves
) -> tuple[float, ...]:
    """Return the quantities of a muscle with a mass between fibers and tendon.

    Source: Delp1990Muscle_Deprecated::computeActuation of OpenSim. The acceleration is NaN while
    the fiber length is 0, before the equilibrium is computed.

    Args:
        now: path, excitation and states.
        m: numbers that all deprecated muscles have.
        fields: numbers of the class.
        curves: curves of the class.

    Returns:
        `RECORDED`, then activation rate (1/s), fiber velocity (m/s) and fiber acceleration (m/s^2).
    """
    fibers = compute_fiber_forces(now, m, compute_delp_forces, fields, curves)
    cos, active, passive, tendon = fibers
    # Delp's model is in normalized time: lengths in optimal fiber lengths, times in time_scale.
    unit = m.optimal / fields.time
    velocity = now.fiber_velocity / unit
    factor, _, _ = evaluate_function(curves.velocity, velocity)
    force_acceleration = (
        (tendon - (now.activation * active * factor + passive) * cos)
        * cos
        / (fields.mass * unit * unit)
    )
    # The fibers keep their height, so that they turn while they move: the centrifugal part of the
    # acceleration.
    centrifugal_acceleration = (
        velocity * velocity * (1.0 - cos * cos) / (cos * cos) / (now.fiber_length / m.optimal)
    )
    activation_rate = compute_schutte_activation_rate(
        now.excitation, now.activation, fields.more, fields.least, fields.time
    )
    recorded = list_recorded(now, fibers, m)
    return (
        *recorded,
        activation_rate,
        now.fiber_velocity,
        (force_acceleration + centrifugal_acceleration) * unit / fields.time,
    )


def equilibrate_delp(
    now: MuscleInputs, m: OldMuscle, fields: DelpFields, curves: DelpCurves
) -> tuple[bool, float]:
    """Return the fiber length in equilibrium; the velocity does not change.

    Args:
        now: path, excitation and states.
        m: numbers that all deprecated muscles have.
        fields: numbers of the class.
        curves: curves of the class.

    Returns:
        True, and the fiber length (m).
    """
    return True, find_isometric_length(
        now.length, now.length - m.slack, now.activation, m, compute_delp_forces, fields, curves
    )


def compute_rigid_delp(
    now: MuscleInputs, m: OldMuscle, fields: DelpFields, curves: DelpCurves
) -> float:
    """Return the force of fully active fibers along a rigid tendon.

    Args:
        now: path, excitation and states.
        m: numbers that all deprecated muscles have.
        fields: numbers of the class.
        curves: curves of the class.

    Returns:
        Force, N.
    """
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
                require_positive("time_scale"),
                Number("activation1"),
                Number("activation2"),
                require_positive("mass"),
            ),
        ),
        ParameterGroup(
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
    """Tables of the curves of Schutte1993Muscle_Deprecated, all normalized.

    Attributes:
        active: active force over fiber length.
        passive: passive force over fiber length.
        tendon: tendon force over tendon strain.
    """

    active: Floats
    passive: Floats
    tendon: Floats


class SchutteFields(NamedTuple):
    """Numbers of Schutte1993Muscle_Deprecated.

    Attributes:
        time: time_scale, s, the unit of time of the equations.
        more: activation1, a rate constant of the activation.
        least: activation2, a rate constant of the activation.
        damping: damping of the fibers, normalized.
        has_curve: 1 if the file has a passive curve, else 0.
    """

    time: float
    more: float
    least: float
    damping: float
    has_curve: float


def compute_schutte_forces(
    length: float, strain: float, fields: SchutteFields, curves: SchutteCurves
) -> tuple[float, float, float]:
    """Return active, passive and tendon force, normalized.

    Args:
        length: fiber length over the optimal one.
        strain: strain of the tendon.
        fields: numbers of the class.
        curves: curves of the class.

    Returns:
        The three forces over the maximum isometric force.
    """
    active, _, _ = evaluate_function(curves.active, length)
    tendon, _, _ = evaluate_function(curves.tendon, strain)
    passive = (
        evaluate_function(curves.passive, length)[0]
        # OpenSim uses its built-in law where the file has no curve.
        if fields.has_curve
        else schutte_passive_force(length)
    )
    return active, passive, tendon if strain >= 0.0 else 0.0


def compute_schutte(
    now: MuscleInputs, m: OldMuscle, fields: SchutteFields, curves: SchutteCurves
) -> tuple[float, ...]:
    """Return the quantities of the muscle.

    Source: Schutte1993Muscle_Deprecated::computeActuation of OpenSim.

    Args:
        now: path, excitation and states.
        m: numbers that all deprecated muscles have.
        fields: numbers of the class.
        curves: curves of the class.

    Returns:
        `RECORDED`, then activation rate (1/s) and fiber velocity (m/s).
    """
    fibers = compute_fiber_forces(now, m, compute_schutte_forces, fields, curves)
    cos, active, passive, tendon = fibers
    # Fibers across the tendon carry nothing along it; OpenSim then takes the velocity of the path.
    if cos > ZERO_TOLERANCE:
        active_force = max(tendon / cos - passive, 0.0)
        # The velocity follows from the force that the tendon bears.
        velocity = (
            schutte_velocity(now.activation, max(active, 0.0), active_force, fields.damping)
            * m.optimal
            / fields.time
        )
    else:
        velocity = now.rate * rigid_cos(now.length, m) if abs(tendon) > ZERO_TOLERANCE else 0.0
    activation_rate = compute_schutte_activation_rate(
        now.excitation, now.activation, fields.more, fields.least, fields.time
    )
    return *list_recorded(now, fibers, m), activation_rate, velocity


def equilibrate_schutte(
    now: MuscleInputs, m: OldMuscle, fields: SchutteFields, curves: SchutteCurves
) -> tuple[bool, float]:
    """Return the fiber length in equilibrium.

    Args:
        now: path, excitation and states.
        m: numbers that all deprecated muscles have.
        fields: numbers of the class.
        curves: curves of the class.

    Returns:
        True, and the fiber length (m).
    """
    return True, find_isometric_length(
        now.length, m.optimal, now.activation, m, compute_schutte_forces, fields, curves
    )


def compute_rigid_schutte(
    now: MuscleInputs, m: OldMuscle, fields: SchutteFields, curves: SchutteCurves
) -> float:
    """Return the force of fully active fibers along a rigid tendon.

    Args:
        now: path, excitation and states.
        m: numbers that all deprecated muscles have.
        fields: numbers of the class.
        curves: curves of the class.

    Returns:
        Force, N.
    """
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
                require_positive("time_scale"),
                Number("activation1"),
                Number("activation2"),
                require_positive("damping"),
            ),
            _has_curve,
        ),
        ParameterGroup(
            SchutteCurves,
            tuple(Curve(f"{name}_force_length_curve") for name in SchutteCurves._fields),
        ),
    )
)
