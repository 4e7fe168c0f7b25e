"""What OpenSim's classes of muscles say of their fibers and tendons, from what the laws of the muscles record."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.muscles import (
    DeGrooteFregly2016Muscle,
    MeyerFregly2016Muscle,
    Millard2012AccelerationMuscle,
    Millard2012EquilibriumMuscle,
    Muscle,
    RigidTendonMuscle,
    Thelen2003Muscle,
)
from osimlite.schema.old_muscles import (
    Schutte1993Muscle_Deprecated,
    Thelen2003Muscle_Deprecated,
)
from osimlite.simulation.elements.muscle import SPRING

KNOWN = (
    "tension",
    "fiber_length",
    "cos_pennation",
    "active_fiber_force",
    "passive_fiber_force",
    "length",
    "rate",
    "fiber_velocity",
)
"""What all laws record, and is needed here."""

OF_DYNAMICS = (
    "FiberVelocity",
    "NormFiberVelocity",
    "PennationAngularVelocity",
    "FiberActivePower",
    "FiberPassivePower",
    "TendonPower",
    "MuscleActuatorPower",
)
"""Tables without numbers for a model without mass, whose dynamics OpenSim does not compute."""

Tables = dict[str, Array]
"""Rows (t, m) for m muscles, by the ends of the names of MuscleAnalysis' files."""


def quantities(known: Mapping[str, Array], muscles: Sequence[Any]) -> Tables:
    """The tables of some muscles of one class, as by its base class; some classes change some of them.

    Args:
        known: rows (t, m) of `KNOWN`, and of SPRING if the law has it.
        muscles: m of them.
    """
    length, cos, speed = known["fiber_length"], known["cos_pennation"], known["fiber_velocity"]
    active, passive, tension = (
        known["active_fiber_force"],
        known["passive_fiber_force"],
        known["tension"],
    )
    # OpenSim counts the power of damping, which is part of the passive force, to the active power.
    spring = known.get(SPRING, passive)
    optimal = np.array([muscle.optimal_fiber_length for muscle in muscles])
    fastest = np.array([muscle.max_contraction_velocity for muscle in muscles])
    angle = np.arccos(np.clip(cos, -1.0, 1.0))
    # The fibers keep their distance across the tendon.
    turning = -speed / length * np.tan(angle)
    along = speed * cos - length * np.sin(angle) * turning
    result = {
        "PennationAngle": angle,
        "Length": known["length"],
        "FiberLength": length,
        "TendonLength": known["length"] - length * cos,
        "NormalizedFiberLength": length / optimal,
        "FiberVelocity": speed,
        "NormFiberVelocity": speed / (optimal * fastest),
        "PennationAngularVelocity": turning,
        "TendonForce": tension,
        "FiberForce": active + passive,
        "ActiveFiberForce": active,
        "PassiveFiberForce": passive,
        "ActiveFiberForceAlongTendon": active * cos,
        "PassiveFiberForceAlongTendon": passive * cos,
        "FiberActivePower": -(active + (passive - spring)) * speed,
        "FiberPassivePower": -spring * speed,
        "TendonPower": -tension * (known["rate"] - along),
        "MuscleActuatorPower": -tension * known["rate"],
    }
    return result | CHECKED[type(muscles[0])](result, muscles)


def _thelen(found: Tables, muscles: Sequence[Any]) -> Tables:
    """Fibers at their least length that would shorten bear nothing together, though there is a passive force."""
    still = (found["FiberVelocity"] == 0.0) & (found["ActiveFiberForce"] == 0.0)
    return {"FiberForce": np.where(still, 0.0, found["FiberForce"])}


def _millard(found: Tables, muscles: Sequence[Any]) -> Tables:
    return _still(found, [muscle.ignore_tendon_compliance for muscle in muscles])


def _still(found: Tables, is_rigid: Sequence[bool]) -> Tables:
    """The tendon of some has no velocity."""
    return {"TendonPower": np.where(is_rigid, 0.0, found["TendonPower"])}


def _accelerated(found: Tables, muscles: Sequence[Any]) -> Tables:
    """What damps the fibers is part of their force, and the power of the mass at their end of the passive one."""
    damping = [
        muscle.fiber_damping * muscle.max_isometric_force / muscle.optimal_fiber_length
        for muscle in muscles
    ]
    damped = found["FiberVelocity"] * np.array(damping)
    along = found["MuscleActuatorPower"] - found["TendonPower"]
    return {
        "FiberForce": found["FiberForce"] + damped,
        "FiberPassivePower": along - found["FiberActivePower"],
    }


def _degroote(found: Tables, muscles: Sequence[Any]) -> Tables:
    """Fibers that point the other way have the angle of those that do not, which turns as if they did."""
    angle = np.minimum(found["PennationAngle"], np.pi - found["PennationAngle"])
    modes = [getattr(muscle, "tendon_compliance_dynamics_mode", "implicit") for muscle in muscles]
    rigid = [
        muscle.ignore_tendon_compliance or mode == "implicit"
        for muscle, mode in zip(muscles, modes, strict=True)
    ]
    return {"PennationAngle": angle} | _still(found, rigid)


def _rigid(found: Tables, muscles: Sequence[Any]) -> Tables:
    """The tendon has its slack length, also where the path is shorter."""
    slack = np.array([muscle.tendon_slack_length for muscle in muscles])
    nothing = np.zeros_like(found["Length"])
    return {
        "TendonLength": nothing + slack,
        "TendonPower": nothing,
        "PennationAngularVelocity": nothing + np.nan,
    }


def _old(found: Tables, muscles: Sequence[Any]) -> Tables:
    """Nobody computes these."""
    names = (
        "FiberForce",
        "PennationAngularVelocity",
        "FiberActivePower",
        "FiberPassivePower",
        "TendonPower",
        "MuscleActuatorPower",
    )
    return dict.fromkeys(names, np.full_like(found["Length"], np.nan))


CHECKED: dict[type[Muscle], Callable[[Tables, Sequence[Any]], Tables]] = {
    Millard2012AccelerationMuscle: _accelerated,
    Millard2012EquilibriumMuscle: _millard,
    Thelen2003Muscle: _thelen,
    DeGrooteFregly2016Muscle: _degroote,
    MeyerFregly2016Muscle: _degroote,
    RigidTendonMuscle: _rigid,
    Thelen2003Muscle_Deprecated: _old,
    Schutte1993Muscle_Deprecated: _old,
}
"""The classes whose results were held to OpenSim's, and what is otherwise in each."""
