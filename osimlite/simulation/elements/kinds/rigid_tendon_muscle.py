"""A muscle whose tendon keeps its slack length."""

from math import sqrt

from osimlite.schema.muscles import RigidTendonMuscle
from osimlite.simulation.elements.muscle import height, muscle
from osimlite.simulation.elements.parameters import Curve, Number, Numbers, positive
from osimlite.simulation.kernels.functions import value_at
from osimlite.simulation.kernels.pointers import Floats

PARALLEL = 2.0**-26
"""Fibers that are no higher (m) are in line with the tendon: Simbody's SqrtEps."""


def rigid_tendon(
    length: float,
    rate: float,
    excitation: float,
    strength: float,
    optimal: float,
    slack: float,
    fastest: float,
    height: float,
    active_curve: Floats,
    passive_curve: Floats,
    velocity_curve: Floats,
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """The muscle at a moment; see RigidTendonMuscle of OpenSim, which takes the path's rate for the fibers' velocity.

    Args:
        length: of the path, m.
        rate: of it, m/s.
        excitation: the control, which is the activation.
        strength: max_isometric_force, N.
        optimal: optimal_fiber_length, m.
        slack: tendon_slack_length, m.
        fastest: max_contraction_velocity, 1/s.
        height: of the fibers across the tendon, m.
        active_curve: force over length, both normalized.
        passive_curve: likewise; kept from 0 to 10.
        velocity_curve: factor of the active force over velocity.

    Returns:
        Tension (N), activation, fiber length (m), cosine of pennation, factors of the active force by length and by
        velocity, active and passive fiber force (N), fiber velocity (m/s).
    """
    along = max(length - slack, 0.0)
    fiber_length, cos = along, 1.0
    if height > PARALLEL:
        fiber_length = sqrt(along * along + height * height)
        cos = along / fiber_length
    active, _, _ = value_at(active_curve, fiber_length / optimal)
    passive, _, _ = value_at(passive_curve, fiber_length / optimal)
    factor, _, _ = value_at(velocity_curve, rate / (optimal * fastest))
    active_force = strength * excitation * active * factor
    passive_force = strength * min(max(passive, 0.0), 10.0)
    tension = (active_force + passive_force) * cos
    return tension, excitation, fiber_length, cos, active, factor, active_force, passive_force, rate


def strongest(
    length: float,
    rate: float,
    excitation: float,
    strength: float,
    optimal: float,
    slack: float,
    fastest: float,
    height: float,
    active_curve: Floats,
    passive_curve: Floats,
    velocity_curve: Floats,
) -> float:
    """Force (N) of fully active fibers along the tendon; args as of `rigid_tendon`."""
    _, _, _, cos, active, factor, _, _, _ = rigid_tendon(
        length, rate, 1.0, strength, optimal, slack, fastest, height, active_curve, passive_curve, velocity_curve
    )
    return strength * active * factor * cos


KIND = muscle(
    RigidTendonMuscle,
    rigid_tendon,
    ("fiber_velocity",),
    Number("max_isometric_force"),
    positive("optimal_fiber_length"),
    Number("tendon_slack_length"),
    positive("max_contraction_velocity"),
    Numbers(1, height),
    Curve("active_force_length_curve"),
    Curve("passive_force_length_curve"),
    Curve("force_velocity_curve"),
    rigid=strongest,
)
