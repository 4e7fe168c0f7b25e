"""OpenSim's MuscleAnalysis: lengths, velocities, forces and powers of muscles, their moment arms and moments."""

from __future__ import annotations

from typing import Any

import numpy as np

from osimlite.multibody.spatial import Array
from osimlite.schema.muscles import Muscle
from osimlite.schema.tools.analyses import MuscleAnalysis
from osimlite.simulation.files.old_storage import UNITS
from osimlite.simulation.kernels import layout
from osimlite.simulation.paths import Paths
from osimlite.tools.motion import Motion, Tables
from osimlite.tools.not_runnable import NotRunnable

CHECKED = ("Millard2012EquilibriumMuscle", "Thelen2003Muscle")
"""The classes whose results were held to OpenSim's."""
_DESCRIPTION = (
    "\nThis analysis gathers basic information about muscles during a simulation "
    f"(e.g., forces, tendon lengths, moment arms, etc).\n{UNITS}"
)


def compute(analysis: MuscleAnalysis, motion: Motion, tables: Tables) -> None:
    """Write a table for each quantity, and two for each coordinate."""
    every = list(motion.model.components(Muscle))
    chosen = motion.chosen(analysis.muscle_list, [muscle.name for muscle in every], f"muscles of '{analysis.name}'")
    muscles = [every[place] for place in chosen]
    for muscle in muscles:
        if type(muscle).__name__ not in CHECKED:
            raise NotRunnable(
                f"'{analysis.name}' asks for '{muscle.name}', a {type(muscle).__name__}, which it cannot analyse yet",
                file=str(tables.job.file),
            )
    names = [muscle.name for muscle in muscles]
    tree = motion.model.tree()
    places = [tree.path_of(muscle) or "" for muscle in muscles]
    known = _recorded(motion, places)
    for suffix, rows in _quantities(known, muscles).items():
        tables.add(suffix, suffix, names, rows, description=_DESCRIPTION)
    arms = Paths(motion.model)
    infos = motion.mechanism.coordinates
    asked = motion.chosen(
        ["all" if str(name).lower() == "all" else name for name in analysis.moment_arm_coordinate_list],
        [info.name for info in infos],
        f"coordinates of '{analysis.name}'",
    )
    found = np.zeros((len(asked), len(motion.times), len(muscles)))
    for k, q in enumerate(motion.values):
        own = arms.moment_arms(q)
        for row, place in enumerate(asked):
            found[row, k] = [own[path].get(infos[place].path, 0.0) for path in places]
    for row, place in enumerate(asked):
        name = infos[place].name
        tables.add(f"MomentArm_{name}", f"MomentArm_{name}", names, found[row], description=_DESCRIPTION)
        if analysis.compute_moments:
            moments = found[row] * known["tension"]
            tables.add(f"Moment_{name}", f"Moment_{name}", names, moments, description=_DESCRIPTION)


def _recorded(motion: Motion, places: list[str]) -> dict[str, Array]:
    """What the laws of the muscles find (t, m), by its name."""
    engine = motion.system
    elements: dict[str, Any] = {element.path: element for element in engine.forces.elements}
    columns = [(path, elements[path].kind.recorded) for path in places]
    names = ("tension", "fiber_length", "cos_pennation", "active_fiber_force", "passive_fiber_force", "length", "rate",
             "fiber_velocity")  # fmt: skip
    found = {name: np.empty((len(motion.times), len(places))) for name in names}
    for k, (t, y) in enumerate(motion.moments):
        status = engine.realize(t, y, layout.FORCE_STAGE)
        if status != layout.OK:
            raise engine.refusal(status, t, y)
        for name in names:
            found[name][k] = [engine.recorded(path, record[name]) for path, record in columns]
    return found


def _quantities(known: dict[str, Array], muscles: list[Muscle]) -> dict[str, Array]:
    """The tables (t, m) by the ends of their files' names."""
    length, cos, speed = known["fiber_length"], known["cos_pennation"], known["fiber_velocity"]
    active, passive, tension = known["active_fiber_force"], known["passive_fiber_force"], known["tension"]
    optimal = np.array([muscle.optimal_fiber_length for muscle in muscles])
    fastest = np.array([muscle.max_contraction_velocity for muscle in muscles])
    # OpenSim counts the power of damping, which is part of the passive force, to the active power.
    damping = np.array([getattr(muscle, "fiber_damping", 0.0) * muscle.max_isometric_force for muscle in muscles])
    damped = damping * speed / (optimal * fastest)
    angle = np.arccos(np.clip(cos, -1.0, 1.0))
    # The fibers keep their distance across the tendon.
    turning = -speed / length * np.tan(angle)
    along = speed * cos - length * np.sin(angle) * turning
    return {
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
        "FiberActivePower": -(active + damped) * speed,
        "FiberPassivePower": -(passive - damped) * speed,
        "TendonPower": -tension * (known["rate"] - along),
        "MuscleActuatorPower": -tension * known["rate"],
    }
