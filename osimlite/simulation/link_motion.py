"""Where points of bodies are at many states, and how fast they move.

It is computed of what the kernels find for the links, to which bodies are fixed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from osimlite.multibody.parts import GROUND
from osimlite.simulation.kernels import layout

if TYPE_CHECKING:
    from osimlite.simulation.system import System

Floats = NDArray[np.float64]


Moments = Sequence[tuple[float, Sequence[float]]]
"""Times (s), and the states then."""


def moving(links: Floats, points: Floats) -> Floats:
    """Places (m) and velocities (m/s) in ground (..., 6) of points (..., 3) of links, as the kernels know these."""
    origin, turning = links[..., layout.ORIGIN : layout.ORIGIN + 3], links[..., layout.VELOCITY : layout.VELOCITY + 3]
    rotations = links[..., :9].reshape(*links.shape[:-1], 3, 3)
    arms = links[..., layout.POSITION : layout.POSITION + 3] - origin + (rotations @ points[..., None])[..., 0]
    velocities = links[..., layout.VELOCITY + 3 : layout.VELOCITY + 6] + np.cross(turning, arms)
    return np.concatenate([arms + origin, velocities], axis=-1)


def centers_of_mass(system: System, moments: Moments) -> Floats:
    """Place (m) and velocity (m/s) in ground of the mass centre of all bodies at some moments (k, 6)."""
    inertia, fixed = system.inertia, system.masses_in_ground
    total = inertia[:, 0] @ moving(system.links_at(moments), inertia[:, 1:4])
    total[:, :3] += sum((mass * center for mass, center in fixed), np.zeros(3))
    return total / (inertia[:, 0].sum() + sum(mass for mass, _ in fixed) or 1.0)


def stations(system: System, moments: Moments, body: int, location: Floats) -> Floats:
    """Place (m) and velocity (m/s) in ground of a point of a body (-1 for ground) at some moments (k, 6)."""
    link, frame = system.placements[body] if body != GROUND else (GROUND, np.eye(4))
    point = frame[:3, :3] @ location + frame[:3, 3]
    if link == GROUND:
        return np.tile(np.append(point, np.zeros(3)), (len(moments), 1))
    return moving(system.links_at(moments)[:, link], point)
