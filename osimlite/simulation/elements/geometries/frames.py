"""Two frames that a bushing connects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from osimlite.forces.bushing import xyz_angles, xyz_moment, xyz_rates
from osimlite.multibody.spatial import Array
from osimlite.simulation.elements.gather import ElementBuilder, Triple, triple
from osimlite.simulation.elements.geometries.geometry import Geometry
from osimlite.simulation.elements.items import Places
from osimlite.simulation.kernels.pointers import Floats, Ints, at
from osimlite.simulation.kernels.points import angular_velocity, apply_force, apply_torque, direction, station, velocity

DEVIATIONS, LOADS, RATES, R1, R2, ROOM = 12, 18, 24, 30, 39, 48
"""Places in the record, after force and moment on the second frame and the origins of both."""


def deviate(s: Ints, w: Floats, g: Ints, gp: Floats, room: Floats) -> None:
    """Deviations of the second frame from the first, and their rates, which go into the record."""
    for k in range(3):
        a, b = at(room, R1 + k), at(room, R2 + k)
        a[0], a[3], a[6] = direction(s, w, g[0], gp[3 * k], gp[3 * k + 1], gp[3 * k + 2])
        b[0], b[3], b[6] = direction(s, w, g[1], gp[12 + 3 * k], gp[13 + 3 * k], gp[14 + 3 * k])
    r, z = at(room, R1), at(room, R2)
    ax, ay, az = station(s, w, g[0], gp[9], gp[10], gp[11])
    bx, by, bz = station(s, w, g[1], gp[21], gp[22], gp[23])
    room[6], room[7], room[8], room[9], room[10], room[11] = ax, ay, az, bx, by, bz
    d, rates = at(room, DEVIATIONS), at(room, RATES)
    d[0], d[1], d[2] = xyz_angles(
        r[0] * z[0] + r[3] * z[3] + r[6] * z[6],
        r[0] * z[1] + r[3] * z[4] + r[6] * z[7],
        r[0] * z[2] + r[3] * z[5] + r[6] * z[8],
        r[1] * z[0] + r[4] * z[3] + r[7] * z[6],
        r[1] * z[1] + r[4] * z[4] + r[7] * z[7],
        r[1] * z[2] + r[4] * z[5] + r[7] * z[8],
        r[2] * z[2] + r[5] * z[5] + r[8] * z[8],
    )
    vx, vy, vz = velocity(s, w, g[1], bx, by, bz)
    # The moving frame is carried around by the other.
    ux, uy, uz = velocity(s, w, g[0], bx, by, bz)
    dx, dy, dz, vx, vy, vz = bx - ax, by - ay, bz - az, vx - ux, vy - uy, vz - uz
    wx, wy, wz = angular_velocity(s, w, g[1])
    ux, uy, uz = angular_velocity(s, w, g[0])
    wx, wy, wz = wx - ux, wy - uy, wz - uz
    for k in range(3):
        d[3 + k] = r[k] * dx + r[3 + k] * dy + r[6 + k] * dz
        rates[3 + k] = r[k] * vx + r[3 + k] * vy + r[6 + k] * vz
    rates[0], rates[1], rates[2] = xyz_rates(
        d[1],
        d[2],
        z[0] * wx + z[3] * wy + z[6] * wz,
        z[1] * wx + z[4] * wy + z[7] * wz,
        z[2] * wx + z[5] * wy + z[8] * wz,
    )


def load_frames(s: Ints, w: Floats, g: Ints, room: Floats) -> None:
    """Apply the loads to both bodies; the record then has force and moment on the second frame."""
    r, z, loads, d = at(room, R1), at(room, R2), at(room, LOADS), at(room, DEVIATIONS)
    mx, my, mz = xyz_moment(d[1], d[2], loads[0], loads[1], loads[2])
    for k in range(3):
        room[k] = r[3 * k] * loads[3] + r[3 * k + 1] * loads[4] + r[3 * k + 2] * loads[5]
        room[3 + k] = z[3 * k] * mx + z[3 * k + 1] * my + z[3 * k + 2] * mz
    fx, fy, fz, tx, ty, tz = room[0], room[1], room[2], room[3], room[4], room[5]
    apply_force(s, w, g[1], room[9], room[10], room[11], fx, fy, fz)
    apply_force(s, w, g[0], room[9], room[10], room[11], -fx, -fy, -fz)
    apply_torque(s, w, g[1], tx, ty, tz)
    apply_torque(s, w, g[0], -tx, -ty, -tz)


def damped(rate: float, damping: float) -> float:
    """A rate, which may be infinite where nothing asks for it."""
    return rate if damping != 0.0 else 0.0


def damp(loads: Floats, rates: Floats, damping: Floats) -> None:
    """Turn what resists the deviations into loads, and add the damping."""
    for k in range(6):
        loads[k] = -loads[k] - damping[k] * damped(rates[k], damping[k])


class Frame(NamedTuple):
    """A frame of a bushing: its name, its body, and where it is in the body."""

    name: str
    body: int
    rotation: tuple[Triple, Triple, Triple]
    origin: Triple


@dataclass(frozen=True)
class BetweenFrames(Geometry):
    """Two frames: six deviations of the second from the first, angles (rad) before distances (m), and their rates.

    The law fills `loads`: moments (N.m) of the angles and forces (N) of the distances on the second frame.

    Attributes:
        about_bodies: whether the torques of the record are about the origins of the bodies instead of the frames.
    """

    about_bodies: bool = False

    inputs = ("deviations", "rates", "loads")
    before = (
        "deviate(s, w, g, gp, room)",
        f"deviations, rates, loads = at(room, {DEVIATIONS}), at(room, {RATES}), at(room, {LOADS})",
    )
    after = ("load_frames(s, w, g, room)",)
    calls = (deviate, load_frames)

    def read(self, builder: ElementBuilder, force: Any) -> tuple[Frame, ...]:
        """The two frames."""
        frames = []
        for field in ("socket_frame1", "socket_frame2"):
            frame = builder.target(force, field, getattr(force, field))
            body, placed = builder.placement(frame)
            rows = triple(placed[0, :3]), triple(placed[1, :3]), triple(placed[2, :3])
            frames.append(Frame(frame.name, body, rows, triple(placed[:3, 3])))
        return tuple(frames)

    def pack(self, place: tuple[Frame, ...], places: Places) -> tuple[Sequence[int], Sequence[float]]:
        """Links; rotation by columns and origin of each frame in its link."""
        links: list[int] = []
        numbers: list[float] = []
        for frame in place:
            link, origin = places.station(frame.body, frame.origin)
            rotation = places.placement(frame.body).frame[:3, :3] @ np.array(frame.rotation)
            links.append(link)
            numbers += [*rotation.T.ravel().tolist(), *origin]
        return links, numbers

    def room(self, place: Any) -> int:
        """See the places above."""
        return ROOM

    def columns(self, force: Any) -> tuple[str, ...]:
        """Force and torque on each of the frames."""
        labels = [f"{kind}.{axis}" for kind in ("force", "torque") for axis in "XYZ"]
        return tuple(f"{force.name}.{frame.name}.{label}" for frame in force.place for label in labels)

    def report(self, force: Any, record: Sequence[float], origins: Sequence[Sequence[float]]) -> list[float]:
        """Forces and torques in ground, about the origins of the frames or of their bodies."""
        push, moment, start, end = np.array(record[:12], dtype=float).reshape(4, 3)
        first, second = start, end
        if self.about_bodies:
            first, second = (np.array(origins[frame.body]) for frame in force.place)
        row: list[Array] = [-push, -moment - np.cross(end - first, push), push, moment + np.cross(end - second, push)]
        return [float(number) for part in row for number in part]
