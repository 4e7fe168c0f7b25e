"""Two frames that a bushing connects."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.points import (
    angular_velocity,
    apply_force,
    apply_torque,
    direction,
    station,
    velocity,
)
from osimlite.mechanics.laws.bushing import xyz_angles, xyz_moment, xyz_rates
from osimlite.mechanics.laws.vectors import minus, put, times, turned, turned_back, vector
from osimlite.mechanics.multibody.links import Places
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.geometries.geometry import Geometry

DEVIATIONS, LOADS, RATES, AXES, ROOM = 12, 18, 24, 30, 48
"""Places in the record, after force and moment on the second frame and the origins of both; the axes are of both."""


def deviate(model: Ints, data: Floats, g: Ints, gp: Floats, room: Floats) -> None:
    """Deviations of the second frame from the first, and their rates, which go into the record."""
    d, rates = at(room, DEVIATIONS), at(room, RATES)
    for k in range(3):
        put(room, AXES + 3 * k, direction(model, data, g[0], vector(gp, 3 * k)))
        put(room, AXES + 9 + 3 * k, direction(model, data, g[1], vector(gp, 12 + 3 * k)))
    one, two = at(room, AXES), at(room, AXES + 9)
    start, end = (
        station(model, data, g[0], vector(gp, 9)),
        station(model, data, g[1], vector(gp, 21)),
    )
    put(room, 6, start)
    put(room, 9, end)
    x, y, z = turned(one, vector(two, 0)), turned(one, vector(two, 3)), turned(one, vector(two, 6))
    put(d, 0, xyz_angles(x[0], y[0], z[0], x[1], y[1], z[1], z[2]))
    put(d, 3, turned(one, minus(end, start)))
    # The moving frame is carried around by the other.
    put(
        rates,
        3,
        turned(one, minus(velocity(model, data, g[1], end), velocity(model, data, g[0], end))),
    )
    wx, wy, wz = turned(
        two, minus(angular_velocity(model, data, g[1]), angular_velocity(model, data, g[0]))
    )
    put(rates, 0, xyz_rates(d[1], d[2], wx, wy, wz))


def load_frames(model: Ints, data: Floats, g: Ints, room: Floats) -> None:
    """Apply the loads to both bodies; the record then has force and moment on the second frame."""
    loads, d = at(room, LOADS), at(room, DEVIATIONS)
    force = turned_back(at(room, AXES), vector(loads, 3))
    moment = turned_back(at(room, AXES + 9), xyz_moment(d[1], d[2], loads[0], loads[1], loads[2]))
    put(room, 0, force)
    put(room, 3, moment)
    apply_force(model, data, g[1], vector(room, 9), force)
    apply_force(model, data, g[0], vector(room, 9), times(-1.0, force))
    apply_torque(model, data, g[1], moment)
    apply_torque(model, data, g[0], times(-1.0, moment))


def damped(rate: float, damping: float) -> float:
    """A rate, which may be infinite where nothing asks for it."""
    return rate if damping != 0.0 else 0.0


def damp(loads: Floats, rates: Floats, damping: Floats) -> None:
    """Turn what resists the deviations into loads, and add the damping."""
    for k in range(6):
        loads[k] = -loads[k] - damping[k] * damped(rates[k], damping[k])


class Frame(NamedTuple):
    """A frame of a bushing: its name, its body, and where it is in the body (4, 4)."""

    name: str
    body: int
    placed: Array


@dataclass(frozen=True)
class BetweenFrames(Geometry):
    """Two frames: six deviations of the second from the first, angles (rad) before distances (m), and their rates.

    The law fills `loads`: moments (N.m) of the angles and forces (N) of the distances on the second
    frame.
    """

    # whether the torques of the record are about the origins of the bodies instead of the frames
    about_bodies: bool = False

    inputs = ("deviations", "rates", "loads")
    before = (
        "deviate(model, data, g, gp, room)",
        f"deviations, rates, loads = at(room, {DEVIATIONS}), at(room, {RATES}), at(room, {LOADS})",
    )
    after = ("load_frames(model, data, g, room)",)
    calls = (deviate, load_frames)

    def read(self, builder: ElementBuilder, force: Any) -> tuple[Frame, ...]:
        """The two frames."""
        frames = []
        for field in ("socket_frame1", "socket_frame2"):
            frame = builder.target(force, field, getattr(force, field))
            frames.append(Frame(frame.name, *builder.placement(frame)))
        return tuple(frames)

    def pack(
        self, place: tuple[Frame, ...], places: Places
    ) -> tuple[Sequence[int], Sequence[float]]:
        """Links; axes and origin of each frame in its link."""
        (one, first), (two, second) = (places.frame(frame.body, frame.placed) for frame in place)
        return (one, two), (*first, *second)

    def room(self, place: Any) -> int:
        """See the places above."""
        return ROOM

    def columns(self, force: Any) -> tuple[str, ...]:
        """Force and torque on each of the frames."""
        labels = [f"{kind}.{axis}" for kind in ("force", "torque") for axis in "XYZ"]
        return tuple(
            f"{force.name}.{frame.name}.{label}" for frame in force.place for label in labels
        )

    def report(
        self, force: Any, record: Sequence[float], origins: Sequence[Sequence[float]]
    ) -> list[float]:
        """Forces and torques in ground, about the origins of the frames or of their bodies."""
        push, moment, start, end = np.array(record[:12], dtype=float).reshape(4, 3)
        first, second = start, end
        if self.about_bodies:
            first, second = (np.array(origins[frame.body]) for frame in force.place)
        row: list[Array] = [
            -push,
            -moment - np.cross(end - first, push),
            push,
            moment + np.cross(end - second, push),
        ]
        return [float(number) for part in row for number in part]
