"""Where points of bodies are at many states, and how fast they move.

It is computed of what the kernels find for the links, to which bodies are fixed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.layout import LINK_WORK
from osimlite.mechanics.multibody.parts import GROUND

if TYPE_CHECKING:
    from osimlite.simulation.system import System

Floats = NDArray[np.float64]


Moments = Sequence[tuple[float, Sequence[float]]]
"""Times (s), and the states then."""


def moving(links: Floats, points: Floats) -> Floats:
    """Places (m) and velocities (m/s) in ground (..., 6) of points (..., 3) of links, as the kernels know these."""
    origin, turning = (
        links[..., LINK_WORK.ORIGIN : LINK_WORK.ORIGIN + 3],
        links[..., LINK_WORK.VELOCITY : LINK_WORK.VELOCITY + 3],
    )
    rotations = links[..., :9].reshape(*links.shape[:-1], 3, 3)
    arms = (
        links[..., LINK_WORK.POSITION : LINK_WORK.POSITION + 3]
        - origin
        + (rotations @ points[..., None])[..., 0]
    )
    velocities = links[..., LINK_WORK.VELOCITY + 3 : LINK_WORK.VELOCITY + 6] + np.cross(
        turning, arms
    )
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


@dataclass(frozen=True, eq=False)
class LinkMotion:
    """The motion of links at t moments, and of the bodies that are fixed to them; all along the axes of ground."""

    system: System  # whose links
    links: Floats  # what the kernels find of them in motion (t, l, n)

    @classmethod
    def of(cls, system: System, moments: Floats, accelerations: Floats) -> LinkMotion:
        """The motion of the links of a system at some times with their states (t, 1 + y), and rates (t, n) of speeds.

        Raises: SimulationError: the rates of coordinates are not defined there, or a force cannot
            be computed.
        """
        return cls(system, system.links_in_motion(moments, accelerations))

    def placed(self, body: int, frame: Floats) -> tuple[Floats, Floats]:
        """Rotation (t, 3, 3) and origin (t, 3), m, of a frame (4, 4) of a body (-1 for ground)."""
        link, placed = self._own(body)
        frame = placed @ frame
        if link is None:
            count = len(self.links)
            return np.tile(frame[:3, :3], (count, 1, 1)), np.tile(frame[:3, 3], (count, 1))
        rotation = link[:, :9].reshape(-1, 3, 3)
        return rotation @ frame[:3, :3], link[
            :, LINK_WORK.POSITION : LINK_WORK.POSITION + 3
        ] + rotation @ frame[:3, 3]

    def turning(self, body: int) -> tuple[Floats, Floats]:
        """Angular velocity (rad/s) and acceleration (rad/s²) of a body, (t, 3) each."""
        link, _ = self._own(body)
        if link is None:
            return np.zeros((len(self.links), 3)), np.zeros((len(self.links), 3))
        w, alpha = (
            link[:, first : first + 3] for first in (LINK_WORK.VELOCITY, LINK_WORK.ACCELERATION)
        )
        return w, alpha

    def point(self, body: int, location: Floats) -> tuple[Floats, Floats, Floats]:
        """Place (m), velocity (m/s) and acceleration (m/s²) of a point (3,) of a body, (t, 3) each."""
        link, frame = self._own(body)
        point = frame[:3, :3] @ location + frame[:3, 3]
        if link is None:
            still = np.zeros((len(self.links), 3))
            return still + point, still, still
        place, velocity = np.split(moving(link, point), 2, axis=-1)
        w, alpha = self.turning(body)
        # The kernels accelerate everything upwards in place of gravity, about an origin that stays.
        free = (
            link[:, LINK_WORK.ACCELERATION + 3 : LINK_WORK.ACCELERATION + 6]
            + self.system.mechanism.gravity
        )
        arm = place - link[:, LINK_WORK.ORIGIN : LINK_WORK.ORIGIN + 3]
        return place, velocity, free + np.cross(alpha, arm) + np.cross(w, velocity)

    def _own(self, body: int) -> tuple[Floats | None, Floats]:
        """The link (t, n) of a body, None for ground, and the body's frame in it."""
        link, frame = self.system.placements[body] if body != GROUND else (GROUND, np.eye(4))
        return None if link == GROUND else self.links[:, link], frame
