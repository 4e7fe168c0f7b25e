"""Quantities of fibers and tendons that MuscleAnalysis writes, from the records of muscle laws."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.millard_muscles import (
    Millard2012AccelerationMuscle,
    Millard2012EquilibriumMuscle,
    RigidTendonMuscle,
)
from osimlite.schema.muscles import Muscle, Thelen2003Muscle
from osimlite.schema.old_muscles import (
    Schutte1993Muscle_Deprecated,
    Thelen2003Muscle_Deprecated,
)
from osimlite.schema.smooth_muscles import DeGrooteFregly2016Muscle, MeyerFregly2016Muscle
from osimlite.simulation.elements.muscle import SPRING

LAW_RECORDS = (
    "tension",
    "fiber_length",
    "cos_pennation",
    "active_fiber_force",
    "passive_fiber_force",
    "length",
    "rate",
    "fiber_velocity",
)
"""Records of muscle laws from which the quantities are computed."""

DYNAMIC_QUANTITIES = (
    "FiberVelocity",
    "NormFiberVelocity",
    "PennationAngularVelocity",
    "FiberActivePower",
    "FiberPassivePower",
    "TendonPower",
    "MuscleActuatorPower",
)
"""Quantities that are NaN for a model without mass, whose dynamics OpenSim does not compute."""

MuscleTables = dict[str, Array]
"""Rows (t, m) for m muscles, by the suffixes of MuscleAnalysis' files."""


def compute_quantities(records: Mapping[str, Array], muscles: Sequence[Any]) -> MuscleTables:
    """Return the tables of some muscles of one class.

    The formulas are those of OpenSim's base class; `CORRECTIONS` has those of other classes.

    Args:
        records: rows (t, m) of `LAW_RECORDS`, and of SPRING if the law records it.
        muscles: m muscles of one class, in the order of the columns.
    """
    length = records["fiber_length"]
    cos = records["cos_pennation"]
    speed = records["fiber_velocity"]
    active = records["active_fiber_force"]
    passive = records["passive_fiber_force"]
    tension = records["tension"]
    # OpenSim counts the power of damping as active, although its force counts as passive.
    spring = records.get(SPRING, passive)
    optimal = np.array([muscle.optimal_fiber_length for muscle in muscles])
    fastest = np.array([muscle.max_contraction_velocity for muscle in muscles])
    # Rounding may leave the cosine slightly beyond 1.
    angle = np.arccos(np.clip(cos, -1.0, 1.0))
    # The width of the muscle, across the tendon, is constant.
    pennation_rate = -speed / length * np.tan(angle)
    # Derivative of (fiber length * cos angle) by time.
    speed_along_tendon = speed * cos - length * np.sin(angle) * pennation_rate
    result = {
        "PennationAngle": angle,
        "Length": records["length"],
        "FiberLength": length,
        "TendonLength": records["length"] - length * cos,
        "NormalizedFiberLength": length / optimal,
        "FiberVelocity": speed,
        "NormFiberVelocity": speed / (optimal * fastest),
        "PennationAngularVelocity": pennation_rate,
        "TendonForce": tension,
        "FiberForce": active + passive,
        "ActiveFiberForce": active,
        "PassiveFiberForce": passive,
        "ActiveFiberForceAlongTendon": active * cos,
        "PassiveFiberForceAlongTendon": passive * cos,
        "FiberActivePower": -(active + (passive - spring)) * speed,
        "FiberPassivePower": -spring * speed,
        # A tension does work against lengthening, hence the minus signs of all powers.
        "TendonPower": -tension * (records["rate"] - speed_along_tendon),
        "MuscleActuatorPower": -tension * records["rate"],
    }
    return result | CORRECTIONS[type(muscles[0])](result, muscles)


def _correct_thelen(tables: MuscleTables, muscles: Sequence[Any]) -> MuscleTables:
    """Return the fiber force of Thelen2003Muscle: zero for a fiber at rest at its minimum length.

    OpenSim reports no fiber force there, although the fiber has a passive force.
    """
    is_at_rest = (tables["FiberVelocity"] == 0.0) & (tables["ActiveFiberForce"] == 0.0)
    return {"FiberForce": np.where(is_at_rest, 0.0, tables["FiberForce"])}


def _correct_millard(tables: MuscleTables, muscles: Sequence[Any]) -> MuscleTables:
    """Return the tendon power of Millard2012EquilibriumMuscle: zero for a rigid tendon."""
    return _correct_tendon_power(tables, [muscle.ignore_tendon_compliance for muscle in muscles])


def _correct_tendon_power(tables: MuscleTables, is_rigid: Sequence[bool]) -> MuscleTables:
    """Return the tendon power, which is zero for muscles with a rigid tendon."""
    return {"TendonPower": np.where(is_rigid, 0.0, tables["TendonPower"])}


def _correct_acceleration_muscle(tables: MuscleTables, muscles: Sequence[Any]) -> MuscleTables:
    """Return the corrected fiber force and passive power of Millard2012AccelerationMuscle.

    The fiber force includes the damping. The passive power includes the power of the mass at the
    end of the fibers.
    """
    damping = [
        muscle.fiber_damping * muscle.max_isometric_force / muscle.optimal_fiber_length
        for muscle in muscles
    ]
    damping_force = tables["FiberVelocity"] * np.array(damping)
    fiber_power = tables["MuscleActuatorPower"] - tables["TendonPower"]
    return {
        "FiberForce": tables["FiberForce"] + damping_force,
        "FiberPassivePower": fiber_power - tables["FiberActivePower"],
    }


def _correct_degroote(tables: MuscleTables, muscles: Sequence[Any]) -> MuscleTables:
    """Return the pennation angle and tendon power as DeGrooteFregly2016Muscle computes them.

    A pennation angle beyond 90° counts as its supplement. Its angular velocity has the sign of the
    uncorrected angle. The power of a rigid tendon is zero.
    """
    angle = np.minimum(tables["PennationAngle"], np.pi - tables["PennationAngle"])
    modes = [getattr(muscle, "tendon_compliance_dynamics_mode", "implicit") for muscle in muscles]
    rigid = [
        muscle.ignore_tendon_compliance or mode == "implicit"
        for muscle, mode in zip(muscles, modes, strict=True)
    ]
    return {"PennationAngle": angle} | _correct_tendon_power(tables, rigid)


def _correct_rigid_tendon(tables: MuscleTables, muscles: Sequence[Any]) -> MuscleTables:
    """Return the quantities of the tendon as RigidTendonMuscle computes them.

    The tendon has its slack length, even if the path is shorter, and no power. The angular velocity
    of the pennation is NaN.
    """
    slack = np.array([muscle.tendon_slack_length for muscle in muscles])
    zeros = np.zeros_like(tables["Length"])
    return {
        "TendonLength": zeros + slack,
        "TendonPower": zeros,
        "PennationAngularVelocity": zeros + np.nan,
    }


def _correct_deprecated(tables: MuscleTables, muscles: Sequence[Any]) -> MuscleTables:
    """Return NaN for the quantities that OpenSim does not compute for deprecated classes."""
    names = (
        "FiberForce",
        "PennationAngularVelocity",
        "FiberActivePower",
        "FiberPassivePower",
        "TendonPower",
        "MuscleActuatorPower",
    )
    return dict.fromkeys(names, np.full_like(tables["Length"], np.nan))


CORRECTIONS: dict[type[Muscle], Callable[[MuscleTables, Sequence[Any]], MuscleTables]] = {
    Millard2012AccelerationMuscle: _correct_acceleration_muscle,
    Millard2012EquilibriumMuscle: _correct_millard,
    Thelen2003Muscle: _correct_thelen,
    DeGrooteFregly2016Muscle: _correct_degroote,
    MeyerFregly2016Muscle: _correct_degroote,
    RigidTendonMuscle: _correct_rigid_tendon,
    Thelen2003Muscle_Deprecated: _correct_deprecated,
    Schutte1993Muscle_Deprecated: _correct_deprecated,
}
"""Corrections by class; these classes are compared with OpenSim in the tests."""
