"""OpenSim's MuscleAnalysis: lengths, velocities, forces and powers of muscles, their moment arms and moments."""

from __future__ import annotations

import numpy as np

from osimlite.io.tables.old_storage import UNITS
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.muscles import Muscle
from osimlite.schema.tools.analyses import MuscleAnalysis
from osimlite.simulation.elements.muscle import SPRING
from osimlite.simulation.paths import Paths
from osimlite.tools.motion import Motion, Tables
from osimlite.tools.muscle_quantities import CHECKED, KNOWN, OF_DYNAMICS, quantities

_DESCRIPTION = (
    "\nThis analysis gathers basic information about muscles during a simulation "
    f"(e.g., forces, tendon lengths, moment arms, etc).\n{UNITS}"
)


def compute(analysis: MuscleAnalysis, motion: Motion, tables: Tables) -> None:
    """Write a table for each quantity, and two for each coordinate."""
    every = list(motion.model.components(Muscle))
    chosen = motion.chosen(
        analysis.muscle_list, [muscle.name for muscle in every], f"muscles of '{analysis.name}'"
    )
    muscles = [every[place] for place in chosen]
    for muscle in muscles:
        why = "which it cannot analyse yet" if type(muscle) not in CHECKED else ""
        why = why or ("" if muscle.appliesForce else "which applies no force")
        if why:
            raise tables.job.unable(
                f"'{analysis.name}' asks for '{muscle.name}', a {type(muscle).__name__}, {why}"
            )
    names = [muscle.name for muscle in muscles]
    result = _of_all(motion, muscles)
    if not motion.mechanism.total_mass > np.finfo(float).eps:
        result |= {suffix: np.full_like(result[suffix], np.nan) for suffix in OF_DYNAMICS}
    for suffix, rows in result.items():
        tables.add(suffix, suffix, names, rows, description=_DESCRIPTION)
    if analysis.compute_moments:
        _add_moments(analysis, motion, tables, muscles, result["TendonForce"])


def _of_all(motion: Motion, muscles: list[Muscle]) -> dict[str, Array]:
    """The tables (t, m) of muscles of whatever classes."""
    result: dict[str, Array] = {}
    tree = motion.model.tree()
    for cls in dict.fromkeys(map(type, muscles)):
        own = [place for place, muscle in enumerate(muscles) if type(muscle) is cls]
        paths = [tree.path_of(muscles[place]) or "" for place in own]
        names = KNOWN if not motion.system.knows(paths[0], SPRING) else (*KNOWN, SPRING)
        with np.errstate(invalid="ignore", divide="ignore"):
            of_class = quantities(motion.known(paths, *names), [muscles[place] for place in own])
        for suffix, rows in of_class.items():
            result.setdefault(suffix, np.empty((len(motion.times), len(muscles))))[:, own] = rows
    return result


def _add_moments(
    analysis: MuscleAnalysis, motion: Motion, tables: Tables, muscles: list[Muscle], tension: Array
) -> None:
    infos, tree = motion.mechanism.coordinates, motion.model.tree()
    paths = Paths(motion.model)
    rows = [paths.names.index(tree.path_of(muscle) or "") for muscle in muscles]
    arms = paths.all_moment_arms(motion.values)[:, rows]
    asked = [
        "all" if str(name).lower() == "all" else name
        for name in analysis.moment_arm_coordinate_list
    ]
    for place in motion.chosen(
        asked, [info.name for info in infos], f"coordinates of '{analysis.name}'"
    ):
        names, own = [muscle.name for muscle in muscles], arms[:, :, place]
        for what, result in (("MomentArm", own), ("Moment", own * tension)):
            title = f"{what}_{infos[place].name}"
            tables.add(title, title, names, result, description=_DESCRIPTION)
