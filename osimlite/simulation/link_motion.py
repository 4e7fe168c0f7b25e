"""Motion of points and frames of bodies at many states.

It follows from the link records of the kernels, because each body is fixed to a link. A link record
has the rotation and position of the link in ground, and its spatial velocity and acceleration about
the point `ORIGIN`, along the axes of ground (Featherstone 2008, ch. 2).
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
"""Times (s) with the states at these times."""


def locate_points(links: Floats, points: Floats) -> Floats:
    """Return positions and velocities in ground of points of links.

    Args:
        links: link records of the kernels (..., n).
        points: points in the frames of the links (..., 3), m.

    Returns:
        Position (m) and velocity (m/s) of each point (..., 6).
    """
    origin = links[..., LINK_WORK.ORIGIN : LINK_WORK.ORIGIN + 3]
    turning = links[..., LINK_WORK.VELOCITY : LINK_WORK.VELOCITY + 3]
    rotations = links[..., :9].reshape(*links.shape[:-1], 3, 3)
    arms = (
        links[..., LINK_WORK.POSITION : LINK_WORK.POSITION + 3]
        - origin
        + (rotations @ points[..., None])[..., 0]
    )
    # The linear part of a spatial velocity is that of the point of the link at ORIGIN, hence v =
    # v_origin + ω × arm.
    velocities = links[..., LINK_WORK.VELOCITY + 3 : LINK_WORK.VELOCITY + 6] + np.cross(
        turning, arms
    )
    return np.concatenate([arms + origin, velocities], axis=-1)


def locate_mass_centers(system: System, moments: Moments) -> Floats:
    """Return position and velocity in ground of the mass centre of all bodies.

    Args:
        system: the evaluated system.
        moments: times (s) with states.

    Returns:
        Position (m) and velocity (m/s) at each time (k, 6). A model without mass has zeros.
    """
    inertia, fixed = system.inertia, system.masses_in_ground
    # Bodies that are fixed to ground have mass but no link.
    total = inertia[:, 0] @ locate_points(system.evaluate_all_links(moments), inertia[:, 1:4])
    total[:, :3] += sum((mass * center for mass, center in fixed), np.zeros(3))
    return total / (inertia[:, 0].sum() + sum(mass for mass, _ in fixed) or 1.0)


def locate_station(system: System, moments: Moments, body: int, location: Floats) -> Floats:
    """Return position and velocity in ground of a station.

    Args:
        system: the evaluated system.
        moments: times (s) with states.
        body: index of the body, -1 for ground.
        location: the station in the body's frame (3,), m.

    Returns:
        Position (m) and velocity (m/s) at each time (k, 6).
    """
    link, frame = system.placements[body] if body != GROUND else (GROUND, np.eye(4))
    point = frame[:3, :3] @ location + frame[:3, 3]
    if link == GROUND:
        return np.tile(np.append(point, np.zeros(3)), (len(moments), 1))
    return locate_points(system.evaluate_all_links(moments)[:, link], point)


@dataclass(frozen=True, eq=False)
class LinkMotion:
    """Motion of links at t states, and of the bodies that are fixed to them, along the axes of ground."""

    system: System  # the system with the links
    links: Floats  # link records of the kernels (t, l, n)

    @classmethod
    def compute(cls, system: System, moments: Floats, accelerations: Floats) -> LinkMotion:
        """Compute the motion of the links of a system.

        Args:
            system: the system.
            moments: times (s) and states (t, 1 + y).
            accelerations: derivatives of the generalized speeds (t, n), in the order of the state.

        Returns:
            The motion of all links at these times.

        Raises:
            SimulationError: the rates of coordinates are not defined at a state, or a force cannot
                be computed.
        """
        return cls(system, system.compute_accelerated_links(moments, accelerations))

    def locate_frame(self, body: int, frame: Floats) -> tuple[Floats, Floats]:
        """Return the motion of a frame of a body.

        Args:
            body: index of the body, -1 for ground.
            frame: transform of the frame in the body (4, 4).

        Returns:
            Rotations (t, 3, 3) and origins (t, 3), m, in ground.
        """
        link, body_in_link = self._get_link(body)
        frame = body_in_link @ frame
        if link is None:
            count = len(self.links)
            return np.tile(frame[:3, :3], (count, 1, 1)), np.tile(frame[:3, 3], (count, 1))
        rotation = link[:, :9].reshape(-1, 3, 3)
        return rotation @ frame[:3, :3], link[
            :, LINK_WORK.POSITION : LINK_WORK.POSITION + 3
        ] + rotation @ frame[:3, 3]

    def get_angular_motion(self, body: int) -> tuple[Floats, Floats]:
        """Return the angular motion of a body.

        Args:
            body: index of the body, -1 for ground.

        Returns:
            Angular velocities (rad/s) and accelerations (rad/s²) along the axes of ground, (t, 3)
            each.
        """
        link, _ = self._get_link(body)
        if link is None:
            return np.zeros((len(self.links), 3)), np.zeros((len(self.links), 3))
        w, alpha = (
            link[:, first : first + 3] for first in (LINK_WORK.VELOCITY, LINK_WORK.ACCELERATION)
        )
        return w, alpha

    def compute_point_motion(self, body: int, location: Floats) -> tuple[Floats, Floats, Floats]:
        """Compute the motion of a point of a body.

        Args:
            body: index of the body, -1 for ground.
            location: the point in the body's frame (3,), m.

        Returns:
            Positions (m), velocities (m/s) and accelerations (m/s²), (t, 3) each.
        """
        link, frame = self._get_link(body)
        point = frame[:3, :3] @ location + frame[:3, 3]
        if link is None:
            zeros = np.zeros((len(self.links), 3))
            return zeros + point, zeros, zeros
        position, velocity = np.split(locate_points(link, point), 2, axis=-1)
        w, alpha = self.get_angular_motion(body)
        # The kernels represent gravity by an upward acceleration of the base, about a fixed origin.
        origin_acceleration = (
            link[:, LINK_WORK.ACCELERATION + 3 : LINK_WORK.ACCELERATION + 6]
            + self.system.mechanism.gravity
        )
        arm = position - link[:, LINK_WORK.ORIGIN : LINK_WORK.ORIGIN + 3]
        return (
            position,
            velocity,
            origin_acceleration + np.cross(alpha, arm) + np.cross(w, velocity),
        )

    def _get_link(self, body: int) -> tuple[Floats | None, Floats]:
        """Return the records of a body's link, and the frame of the body in this link.

        Args:
            body: index of the body, -1 for ground.

        Returns:
            Link records (t, n), None for a body that is fixed to ground, and the body's frame in
            the link (4, 4).
        """
        link, frame = self.system.placements[body] if body != GROUND else (GROUND, np.eye(4))
        return None if link == GROUND else self.links[:, link], frame
