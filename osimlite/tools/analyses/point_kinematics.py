"""OpenSim's PointKinematics: place, velocity and acceleration of a point that is fixed in a body."""

from __future__ import annotations

import numpy as np

from osimlite.multibody.spatial import cross
from osimlite.schema.tools.analyses import PointKinematics
from osimlite.tools.motion import Motion, Tables
from osimlite.tools.not_runnable import NotRunnable


def compute(analysis: PointKinematics, motion: Motion, tables: Tables) -> None:
    """Write the three, in ground."""
    beside = str(analysis.relative_to_body_name)
    if beside not in ("", "none", "ground", "/ground"):
        raise NotRunnable(
            f"'{analysis.name}' asks for a point relative to '{beside}', which is not done yet",
            file=str(tables.job.file),
        )
    frame = motion.mechanism.placement(str(analysis.body_name))
    station = frame.transform[:3, :3] @ np.array(analysis.point) + frame.transform[:3, 3]
    rows = np.empty((3, len(motion.times), 3))
    for k, state in enumerate(motion.kinematics):
        moved = state.accelerations(motion.accelerations[k])[frame.body]
        arm, w = state.rotations[frame.body] @ station, state.velocities[frame.body][:3]
        rows[:, k] = (
            state.point(frame.body, station),
            state.point_velocity(frame.body, station),
            moved[3:] + cross(moved[:3], arm) + cross(w, cross(w, arm)),
        )
    labels = [f"state_{axis}" for axis in range(3)]
    for kind, (suffix, title) in enumerate((("pos", "Position"), ("vel", "Velocity"), ("acc", "Acceleration"))):
        tables.add(
            suffix, f"Point{title}", labels, rows[kind], description="No description.", of=f"_{analysis.point_name}"
        )
