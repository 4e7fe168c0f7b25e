"""What the muscles that OpenSim keeps for old files have in common."""

from __future__ import annotations

from collections.abc import Callable
from math import nan
from typing import Any

from osimlite.mechanics.laws.deprecated_muscles import (
    ROUNDS,
    TOLERANCE,
    OldMuscle,
    cos_upright,
    fitted,
    generic_velocity_factor,
    next_length,
)
from osimlite.mechanics.laws.muscles import MuscleInputs
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.kind import Kind, State
from osimlite.simulation.elements.muscle import height, muscle
from osimlite.simulation.elements.parameters import Fields, Number, Parameter, positive

Forces = Callable[[float, float, Any, Any], tuple[float, float, float]]
"""Active force at full activation, passive force and the tendon's, normalized; from a normalized
fiber length, a strain of the tendon, and numbers and curves that are the muscle's own.
"""

Fibers = tuple[float, float, float, float]


def fibers_at(now: MuscleInputs, m: OldMuscle, forces: Forces, own: Any, curves: Any) -> Fibers:
    """Cosine of pennation and `forces` of the fibers."""
    fiber_length = now.fiber_length
    cos = cos_upright(fiber_length, m.height)
    strain = (now.length - fiber_length * cos) / m.slack - 1.0
    active, passive, tendon = forces(fiber_length / m.optimal, strain, own, curves)
    return cos, active, passive, tendon


def recorded(
    now: MuscleInputs, fibers: Fibers, m: OldMuscle
) -> tuple[float, float, float, float, float, float, float, float]:
    """What is recorded of every muscle; nobody knows of a factor by velocity."""
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


def isometric_length(
    length: float,
    start: float,
    activation: float,
    m: OldMuscle,
    forces: Forces,
    own: Any,
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
        forces: of it.
        own: third argument of them.
        curves: fourth one.
    """
    if length < m.slack:
        return m.height
    guess = fitted(length, start, m)
    before, error_before = guess.length, 0.0
    for number in range(ROUNDS):
        active, passive, tendon = forces(guess.length / m.optimal, guess.strain, own, curves)
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


def strongest(
    now: MuscleInputs, start: float, m: OldMuscle, forces: Forces, own: Any, curves: Any
) -> float:
    """Force (N) in equilibrium at rest, fully activated, times a factor by the rate of the path.

    It is what OpenSim takes for the active force along a rigid tendon; see
    calcInextensibleTendonActiveFiberForce of ActivationFiberLengthMuscle_Deprecated. Args as of
    `isometric_length`.
    """
    if now.length < m.slack:
        return 0.0
    fiber_length = isometric_length(now.length, start, 1.0, m, forces, own, curves)
    at_rest = MuscleInputs(now.length, now.rate, 1.0, 1.0, fiber_length, 0.0, 0.0)
    _, _, _, tendon = fibers_at(at_rest, m, forces, own, curves)
    return m.strength * tendon * generic_velocity_factor(now.rate, m)


def _check(builder: ElementBuilder, force: Any) -> None:
    for flag in ("ignore_tendon_compliance", "ignore_activation_dynamics"):
        words = f"is true, which a {type(force).__name__} cannot do"
        Number(flag, lambda x: x == 0.0, words).read(builder, force)


def old_muscle(
    component: type,
    law: Callable[..., Any],
    equilibrium: Callable[..., Any],
    rigid: Callable[..., float],
    *parameters: Parameter,
    rates: tuple[str, ...] = (),
    states: tuple[State, ...] = (),
) -> Kind:
    """The kind of such a muscle: activation and fiber length start at 0, whatever the file says.

    Args:
        component: its class.
        law: gives what is recorded, and then rates.
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
        check=_check,
    )
