"""The straight line between two points of bodies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any, NamedTuple

from osimlite.simulation.elements.gather import ElementBuilder, Triple, triple
from osimlite.simulation.elements.geometries.geometry import Geometry
from osimlite.simulation.elements.items import Places
from osimlite.simulation.kernels.pointers import Floats, Ints
from osimlite.simulation.kernels.points import apply_force, station, velocity


def line(s: Ints, w: Floats, g: Ints, gp: Floats, room: Floats) -> tuple[float, float]:
    """Length and rate; its direction and its ends go into the record."""
    ax, ay, az = station(s, w, g[0], gp[0], gp[1], gp[2])
    bx, by, bz = station(s, w, g[1], gp[3], gp[4], gp[5])
    dx, dy, dz = bx - ax, by - ay, bz - az
    length = sqrt(dx * dx + dy * dy + dz * dz)
    inverse = 1.0 / length if length > 0.0 else 0.0
    dx, dy, dz = inverse * dx, inverse * dy, inverse * dz
    ux, uy, uz = velocity(s, w, g[0], ax, ay, az)
    vx, vy, vz = velocity(s, w, g[1], bx, by, bz)
    room[0], room[1], room[2], room[3], room[4], room[5] = dx, dy, dz, ax, ay, az
    room[6], room[7], room[8] = bx, by, bz
    return length, (vx - ux) * dx + (vy - uy) * dy + (vz - uz) * dz


def pull_ends(s: Ints, w: Floats, g: Ints, gp: Floats, room: Floats, tension: float) -> None:
    """Pull at both ends; then the record has force and recorded point of either."""
    fx, fy, fz = tension * room[0], tension * room[1], tension * room[2]
    apply_force(s, w, g[0], room[3], room[4], room[5], fx, fy, fz)
    apply_force(s, w, g[1], room[6], room[7], room[8], -fx, -fy, -fz)
    room[0], room[1], room[2] = fx, fy, fz
    room[3], room[4], room[5] = station(s, w, g[0], gp[6], gp[7], gp[8])
    room[6], room[7], room[8] = -fx, -fy, -fz
    room[9], room[10], room[11] = station(s, w, g[1], gp[9], gp[10], gp[11])


class Ends(NamedTuple):
    """The ends of a line.

    OpenSim takes the points as stations of the base bodies, also where a force names other frames; the points that it
    records are those of the frames.

    Attributes:
        frames: names of the frames in the record.
        bodies: the two bodies.
        points: stations in them, m.
        recorded: stations in them that are recorded, m.
    """

    frames: tuple[str, str]
    bodies: tuple[int, int]
    points: tuple[Triple, Triple]
    recorded: tuple[Triple, Triple]


@dataclass(frozen=True)
class BetweenPoints(Geometry):
    """A line: length (m) and rate (m/s); the output `tension` (N) pulls its ends together.

    Attributes:
        fields: that name the frames.
        as_written: whether the record names the frames as the force does, and not by their names.
    """

    fields: tuple[str, str]
    as_written: bool = False

    inputs = ("length", "rate")
    before = ("length, rate = line(s, w, g, gp, room)",)
    after = ("pull_ends(s, w, g, gp, room, tension)",)
    calls = (line, pull_ends)

    def read(self, builder: ElementBuilder, force: Any) -> Ends:
        """The ends of a force's line."""
        builder.check(force, (*force.point1, *force.point2))
        words = [getattr(force, field) for field in self.fields]
        frames = [builder.target(force, field, word) for field, word in zip(self.fields, words, strict=True)]
        points = triple(force.point1), triple(force.point2)
        (one, first), (two, second) = (builder.placement(frame) for frame in frames)
        names = [
            word if isinstance(word, str) and self.as_written else frame.name
            for word, frame in zip(words, frames, strict=True)
        ]
        first_point, second_point = (
            triple(frame[:3, :3] @ point + frame[:3, 3]) for frame, point in zip((first, second), points, strict=True)
        )
        return Ends((names[0], names[1]), (one, two), points, (first_point, second_point))

    def pack(self, place: Ends, places: Places) -> tuple[Sequence[int], Sequence[float]]:
        """The links; points and recorded points in them."""
        stations = [
            places.station(body, point)
            for points in (place.points, place.recorded)
            for body, point in zip(place.bodies, points, strict=True)
        ]
        return [link for link, _ in stations[:2]], [x for _, point in stations for x in point]

    def room(self, place: Ends) -> int:
        """Force and point of either end."""
        return 12

    def columns(self, force: Any) -> tuple[str, ...]:
        """Force and point in ground, for each of the frames."""
        labels = [f"{what}.{axis}" for what in ("force", "point") for axis in "XYZ"]
        return tuple(f"{force.name}.{frame}.{label}" for frame in force.place.frames for label in labels)

    def report(self, force: Any, record: Sequence[float], origins: Sequence[Sequence[float]]) -> list[float]:
        """All of it."""
        return list(record[:12])
