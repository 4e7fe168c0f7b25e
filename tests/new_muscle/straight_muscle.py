"""Example of a muscle class that OpenSim does not have, in one file: class, facts, law and force type."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

from osimlite.mechanics.laws.muscles import MuscleInputs
from osimlite.schema.facts import NAN, Contradiction, Facts
from osimlite.schema.fields import real
from osimlite.schema.muscles import Muscle
from osimlite.simulation.elements.force_type import State
from osimlite.simulation.elements.muscle import define_muscle
from osimlite.simulation.elements.parameters import Number, require_positive
from osimlite.simulation.elements.registry import register_force_type


class StraightMuscle(Muscle):
    """Muscle with a rigid tendon in line with the fibers and a piecewise linear force-length relation."""

    facts = Facts(
        states="activation",
        outputs="spare_force",
        domains={"pennation_angle_at_optimal": "0 to 0"},
        refused="width",
        zero={NAN: "rise_time"},
        doubtful={"grip": "lengthening fibers bear less than at rest"},
        mujoco={"fvmax": "grip", "vmax": "fastest", "rise": "rise_time", "fall": "rise_time"},
    )

    default_activation: Annotated[float, real(domain="0 to 1")] = 0.05
    """Activation at the start of a simulation."""
    rise_time: Annotated[float, real("s", "> 0")] = 0.02
    """Time constant of the activation."""
    width: Annotated[float, real(domain="> 0")] = 0.5
    """Strain at which fibers have no active force."""
    fastest: Annotated[float, real("fiber_length/s", "> 0")] = 10.0
    """Shortening velocity without force."""
    grip: Annotated[float, real(domain=">= 1")] = 1.5
    """Largest force of lengthening fibers, relative to the isometric force."""

    def find_contradictions(self) -> Iterator[Contradiction]:
        """Yield a contradiction if `grip` exceeds 1 + `width`."""
        if self.grip > 1.0 + self.width:
            yield "grip", "its grip is above 1 + width"


def straight(
    now: MuscleInputs,
    strength: float,
    optimal: float,
    slack: float,
    fastest: float,
    width: float,
    grip: float,
    rise: float,
) -> tuple[float, float, float, float, float, float, float, float, float, float]:
    """Compute the tension of a muscle with a rigid tendon and linear force-length and force-velocity relations.

    Returns:
        Tension (N), activation, fiber length (m), cosine of pennation, active force-length
        multiplier, force-velocity multiplier, active force (N), passive force (N), activation rate
        (1/s), fiber velocity (m/s).
    """
    fibers = now.length - slack
    active = max(1.0 - abs(fibers / optimal - 1.0) / width, 0.0)
    factor = min(max(1.0 + now.rate / (optimal * fastest), 0.0), grip)
    force = strength * now.activation * active * factor
    change = (now.excitation - now.activation) / rise
    return force, now.activation, fibers, 1.0, active, factor, force, 0.0, change, now.rate


register_force_type(
    define_muscle(
        StraightMuscle,
        straight,
        ("activation_rate", "fiber_velocity"),
        Number("max_isometric_force"),
        require_positive("optimal_fiber_length"),
        Number("tendon_slack_length"),
        require_positive("fastest"),
        require_positive("width"),
        Number("grip"),
        require_positive("rise_time"),
        states=(State("activation", lambda force: force.default_activation),),
    )
)
