"""RigidTendonMuscle: a muscle whose tendon keeps its slack length."""

from math import sqrt

from osimlite.base.named_tuples import NamedTuple
from osimlite.mechanics.kernels.functions import evaluate_function
from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.laws.muscles import MuscleInputs
from osimlite.schema.millard_muscles import RigidTendonMuscle
from osimlite.simulation.elements.muscle import compute_height, define_muscle
from osimlite.simulation.elements.parameters import (
    Curve,
    Fields,
    Number,
    ParameterGroup,
    require_positive,
)
from osimlite.simulation.elements.registry import register_force_type

MAX_PARALLEL_HEIGHT_M = 2.0**-26
"""Fibers of at most this height (m) are parallel to the tendon: Simbody's SqrtEps."""


class RigidTendonFields(NamedTuple):
    """Numbers of a muscle with a rigid tendon.

    Attributes:
        strength: max_isometric_force, N.
        optimal: optimal_fiber_length, m.
        slack: tendon_slack_length, m.
        fastest: max_contraction_velocity, optimal fiber lengths per second.
        height: height of the fibers across the tendon, m.
    """

    strength: float
    optimal: float
    slack: float
    fastest: float
    height: float


class RigidTendonCurves(NamedTuple):
    """Tables of the curves of a muscle with a rigid tendon, all normalized.

    Attributes:
        active: active force over fiber length.
        passive: passive force over fiber length; the law limits it to 0 to 10.
        velocity: factor of the active force over fiber velocity.
    """

    active: Floats
    passive: Floats
    velocity: Floats


def compute_rigid_tendon_muscle(
    now: MuscleInputs, m: RigidTendonFields, curves: RigidTendonCurves
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Return the quantities of a muscle with a rigid tendon.

    As OpenSim's RigidTendonMuscle, it uses the rate of the path as the fiber velocity.

    Args:
        now: path, excitation and states.
        m: numbers of the muscle.
        curves: curves of the muscle.

    Returns:
        Tension (N), activation, fiber length (m), cosine of pennation, force-length and force-velocity
        factors, active and passive fiber force (N), fiber velocity (m/s).
    """
    # A path shorter than the tendon leaves no fibers.
    along = max(now.length - m.slack, 0.0)
    fiber_length, cos = along, 1.0
    if m.height > MAX_PARALLEL_HEIGHT_M:
        fiber_length = sqrt(along * along + m.height * m.height)
        cos = along / fiber_length
    active, _, _ = evaluate_function(curves.active, fiber_length / m.optimal)
    passive, _, _ = evaluate_function(curves.passive, fiber_length / m.optimal)
    factor, _, _ = evaluate_function(curves.velocity, now.rate / (m.optimal * m.fastest))
    active_force = m.strength * now.excitation * active * factor
    # OpenSim clamps the passive curve between 0 and 10.
    passive_force = m.strength * min(max(passive, 0.0), 10.0)
    tension = (active_force + passive_force) * cos
    return (
        tension,
        now.excitation,
        fiber_length,
        cos,
        active,
        factor,
        active_force,
        passive_force,
        now.rate,
    )


def compute_full_force(now: MuscleInputs, m: RigidTendonFields, curves: RigidTendonCurves) -> float:
    """Return the force of fully active fibers along the tendon.

    Args:
        now: path, excitation and states.
        m: numbers of the muscle.
        curves: curves of the muscle.

    Returns:
        Force, N.
    """
    _, _, _, cos, active, factor, _, _, _ = compute_rigid_tendon_muscle(now, m, curves)
    return m.strength * active * factor * cos


register_force_type(
    define_muscle(
        RigidTendonMuscle,
        compute_rigid_tendon_muscle,
        ("fiber_velocity",),
        Fields(
            RigidTendonFields,
            (
                Number("max_isometric_force"),
                require_positive("optimal_fiber_length"),
                Number("tendon_slack_length"),
                require_positive("max_contraction_velocity"),
            ),
            compute_height,
        ),
        ParameterGroup(
            RigidTendonCurves,
            (
                Curve("active_force_length_curve"),
                Curve("passive_force_length_curve"),
                Curve("force_velocity_curve"),
            ),
        ),
        rigid_law=compute_full_force,
    )
)
