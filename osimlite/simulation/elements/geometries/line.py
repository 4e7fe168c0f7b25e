"""The straight line between two points of bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.kernels.points import apply_force, station, velocity
from osimlite.mechanics.laws.vectors import dot, minus, norm, put, times, vector
from osimlite.mechanics.multibody.links import Places
from osimlite.simulation.elements.builder import ElementBuilder, Triple, triple
from osimlite.simulation.elements.geometries.geometry import Geometry


def line(model: Ints, data: Floats, g: Ints, gp: Floats, room: Floats) -> tuple[float, float]:
    """Length and rate; its direction and its ends go into the record."""
    one, two = station(model, data, g[0], vector(gp, 0)), station(model, data, g[1], vector(gp, 3))
    between = minus(two, one)
    length = norm(between)
    ahead = times(1.0 / length if length > 0.0 else 0.0, between)
    put(room, 0, ahead)
    put(room, 3, one)
    put(room, 6, two)
    return length, dot(
        minus(velocity(model, data, g[1], two), velocity(model, data, g[0], one)), ahead
    )


def pull_ends(model: Ints, data: Floats, g: Ints, gp: Floats, room: Floats, tension: float) -> None:
    """Pull at both ends; then the record has force and recorded point of either."""
    pull, back = times(tension, vector(room, 0)), times(-tension, vector(room, 0))
    apply_force(model, data, g[0], vector(room, 3), pull)
    apply_force(model, data, g[1], vector(room, 6), back)
    put(room, 0, pull)
    put(room, 3, station(model, data, g[0], vector(gp, 6)))
    put(room, 6, back)
    put(room, 9, station(model, data, g[1], vector(gp, 9)))


class Ends(NamedTuple):
    """The ends of a line.

    OpenSim takes the points as stations of the base bodies, also where a force names other frames;
    the points that it records are those of the frames.
    """

    frames: tuple[str, str]  # names of the frames in the record
    bodies: tuple[int, int]  # the two bodies
    points: tuple[Triple, Triple]  # stations in them, m
    recorded: tuple[Triple, Triple]  # stations in them that are recorded, m


@dataclass(frozen=True)
class BetweenPoints(Geometry):
    """A line: length (m) and rate (m/s); the output `tension` (N) pulls its ends together."""

    fields: tuple[str, str]  # that name the frames
    # whether the record names the frames as the force does, and not by their names
    as_written: bool = False

    inputs = ("length", "rate")
    before = ("length, rate = line(model, data, g, gp, room)",)
    after = ("pull_ends(model, data, g, gp, room, tension)",)
    calls = (line, pull_ends)

    def read(self, builder: ElementBuilder, force: Any) -> Ends:
        """The ends of a force's line."""
        builder.check(force, (*force.point1, *force.point2))
        words = [getattr(force, field) for field in self.fields]
        frames = [
            builder.target(force, field, word)
            for field, word in zip(self.fields, words, strict=True)
        ]
        points = triple(force.point1), triple(force.point2)
        (one, first), (two, second) = (builder.placement(frame) for frame in frames)
        names = [
            word if isinstance(word, str) and self.as_written else frame.name
            for word, frame in zip(words, frames, strict=True)
        ]
        first_point, second_point = (
            triple(frame[:3, :3] @ point + frame[:3, 3])
            for frame, point in zip((first, second), points, strict=True)
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
        return tuple(
            f"{force.name}.{frame}.{label}" for frame in force.place.frames for label in labels
        )
