"""OpenSim's PointKinematics: place, velocity and acceleration of a point that is fixed in a body."""

from __future__ import annotations

import numpy as np

from osimlite.schema.tools.analyses import PointKinematics
from osimlite.tools.motion import Motion, Tables


def compute(analysis: PointKinematics, motion: Motion, tables: Tables) -> None:
    """Write the three: in ground, or the place in the frame of another body, and the rates of ground along its axes."""
    mechanism, own, beside = (
        motion.mechanism,
        str(analysis.body_name),
        str(analysis.relative_to_body_name),
    )
    body, placed = mechanism.placement(motion.frame(own, *_FOUND) or own)
    result = np.array(
        motion.links.point(body, placed[:3, :3] @ np.array(analysis.point) + placed[:3, 3])
    )
    path = motion.frame(beside, *_FOUND)
    if path is not None:
        rotation, origin = motion.links.placed(*mechanism.placement(path))
        result[0] -= origin
        result = (result[..., None, :] @ rotation)[..., 0, :]
    elif beside not in ("", "none"):
        tables.outcome.tell(
            analysis.name, f"there is no frame '{beside}': results are in ground, as in OpenSim"
        )
    labels = [f"state_{axis}" for axis in range(3)]
    for rows, (suffix, title) in zip(result, _KINDS, strict=True):
        tables.add(
            suffix,
            f"Point{title}",
            labels,
            rows,
            description="No description.",
            of=f"_{analysis.point_name}",
        )


_FOUND = "PhysicalFrame", "/bodyset"
_KINDS = ("pos", "Position"), ("vel", "Velocity"), ("acc", "Acceleration")
