"""OpenSim's Kinematics: values of coordinates, their speeds, and the derivatives of these."""

from __future__ import annotations

import numpy as np

from osimlite.io.tables.old_storage import UNITS
from osimlite.schema.tools.analyses import Kinematics
from osimlite.tools.motion import Motion, Tables


def compute(analysis: Kinematics, motion: Motion, tables: Tables) -> None:
    """Write values, speeds and accelerations, the last by the model's own forces."""
    infos = motion.mechanism.coordinates
    names = [info.name for info in infos]
    places = motion.chosen(analysis.coordinates, names, f"coordinates of '{analysis.name}'")
    turns = [analysis.in_degrees and infos[place].motion_type == "rotational" for place in places]
    for suffix, name, rows in (
        ("q", "Coordinates", motion.values),
        ("u", "Speeds", motion.speeds),
        ("dudt", "Accelerations", motion.accelerations),
    ):
        chosen = rows[:, places]
        tables.add(
            suffix,
            name,
            [names[place] for place in places],
            np.where(turns, np.degrees(chosen), chosen),
            in_degrees=analysis.in_degrees,
            description=f"\n{UNITS}",
        )
