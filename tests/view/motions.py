"""Motions from formulas, for pictures."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.models.dynamic_walker import dynamic_walker


@dataclass
class Recorded:
    times: Array
    coordinates: tuple[str, ...]
    values: Array
    speeds: Array
    forces: dict[str, Array] = field(default_factory=dict)
    auxiliary: dict[str, Array] = field(default_factory=dict)


def stroll(count: int = 51) -> Recorded:
    """Return a motion of the walker along its platform for half a second, with a load on the right foot."""
    mechanism = build_mechanism(dynamic_walker())
    q, u = mechanism.default_state()
    times = np.linspace(0.0, 0.5, count)
    along = np.array(mechanism.coordinate_names) == "Pelvis_tx"
    values, speeds = q + np.outer(times, along), np.tile(u + along, (count, 1))
    load = np.where((times > 0.1) & (times < 0.3), 100.0, 0.0)
    forces = {}
    for element, body, factor in (
        ("RFootForce", "RightShank", 1.0),
        ("LFootForce", "LeftShank", 0.0),
    ):
        for frame, sign in ((body, 1.0), ("Platform", -1.0)):
            for axis, part in zip("XYZ", (0.6, 0.8, 0.0), strict=True):
                forces[f"{element}.{frame}.force.{axis}"] = sign * factor * part * load
                forces[f"{element}.{frame}.torque.{axis}"] = 0.0 * load
    forces["RKneeLimitTorque"] = 2.0 * times
    forces["LKneeLimitTorque"] = 0.0 * times
    forces["PotentialEnergy"] = times
    return Recorded(times, mechanism.coordinate_names, values, speeds, forces)
