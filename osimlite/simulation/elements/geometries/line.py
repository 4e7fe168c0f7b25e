"""Geometry of a force along the line between two points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.kernels.points import apply_force, station, velocity
from osimlite.mechanics.laws.vectors import dot, minus, norm, store_vector, times, vector
from osimlite.mechanics.multibody.links import LinkMap
from osimlite.simulation.elements.builder import ElementBuilder, Triple, to_triple
from osimlite.simulation.elements.geometries.geometry import ForceGeometry


def measure_line(
    model: Ints, data: Floats, g: Ints, gp: Floats, work: Floats
) -> tuple[float, float]:
    """Compute length and rate of the line between two points.

    Args:
        model: integers of the model.
        data: work vector.
        g: links of both ends.
        gp: ends in their links (6,), m.
        work: receives the direction from the first to the second end, and both ends in ground (9,).

    Returns:
        Length (m) and rate (m/s).
    """
    one, two = station(model, data, g[0], vector(gp, 0)), station(model, data, g[1], vector(gp, 3))
    between = minus(two, one)
    length = norm(between)
    # Ends on each other have no direction, so that the tension pulls nowhere.
    ahead = times(1.0 / length if length > 0.0 else 0.0, between)
    store_vector(work, 0, ahead)
    store_vector(work, 3, one)
    store_vector(work, 6, two)
    return length, dot(
        minus(velocity(model, data, g[1], two), velocity(model, data, g[0], one)), ahead
    )


def pull_ends(model: Ints, data: Floats, g: Ints, gp: Floats, work: Floats, tension: float) -> None:
    """Apply the tension at both ends.

    Args:
        model: integers of the model.
        data: work vector.
        g: links of both ends.
        gp: ends, and points that OpenSim reports, in their links (12,), m.
        work: direction and ends in ground; receives force and reported point of each end (12,).
        tension: tension, N; positive tensions pull the ends together.
    """
    pull, back = times(tension, vector(work, 0)), times(-tension, vector(work, 0))
    apply_force(model, data, g[0], vector(work, 3), pull)
    # The law reads the direction before; now the record becomes the report.
    apply_force(model, data, g[1], vector(work, 6), back)
    store_vector(work, 0, pull)
    # OpenSim reports these points in the frames that the force names, and acts at others: see
    # `EndPoints`.
    store_vector(work, 3, station(model, data, g[0], vector(gp, 6)))
    store_vector(work, 6, back)
    store_vector(work, 9, station(model, data, g[1], vector(gp, 9)))


class EndPoints(NamedTuple):
    """Ends of a line.

    OpenSim uses the points as stations of the base bodies, even where a force names other frames;
    the points that it reports are those of the frames.

    Attributes:
        frames: names of the frames in the record.
        bodies: bodies of the ends.
        points: stations of the ends in the bodies, m.
        recorded: stations that OpenSim reports, m.
    """

    frames: tuple[str, str]
    bodies: tuple[int, int]
    points: tuple[Triple, Triple]
    recorded: tuple[Triple, Triple]


@dataclass(frozen=True)
class BetweenPoints(ForceGeometry):
    """Line between two points, with length (m) and rate (m/s) as inputs of the law.

    The output `tension` (N) pulls the ends together.

    Attributes:
        fields: properties that name the frames.
        as_written: whether labels contain the text by which the force names the frames, instead of
            their names.
    """

    fields: tuple[str, str]  # properties that name the frames
    # whether labels contain the text by which the force names the frames, instead of their names
    as_written: bool = False

    inputs = ("length", "rate")
    setup_code = ("length, rate = measure_line(model, data, g, gp, work)",)
    apply_code = ("pull_ends(model, data, g, gp, work, tension)",)
    called_functions = (measure_line, pull_ends)

    def read(self, builder: ElementBuilder, force: Any) -> EndPoints:
        """Return the ends of a force's line."""
        builder.check_finite(force, (*force.point1, *force.point2))
        words = [getattr(force, field) for field in self.fields]
        frames = [
            builder.resolve_target(force, field, word)
            for field, word in zip(self.fields, words, strict=True)
        ]
        points = to_triple(force.point1), to_triple(force.point2)
        (one, first), (two, second) = (builder.find_placement(frame) for frame in frames)
        names = [
            word if isinstance(word, str) and self.as_written else frame.name
            for word, frame in zip(words, frames, strict=True)
        ]
        first_point, second_point = (
            to_triple(frame[:3, :3] @ point + frame[:3, 3])
            for frame, point in zip((first, second), points, strict=True)
        )
        return EndPoints((names[0], names[1]), (one, two), points, (first_point, second_point))

    def pack(self, location: EndPoints, link_map: LinkMap) -> tuple[Sequence[int], Sequence[float]]:
        """Return the links of the ends, and points and reported points in them.

        Returns:
            Integers and numbers of the geometry.
        """
        stations = [
            link_map.station(body, point)
            for points in (location.points, location.recorded)
            for body, point in zip(location.bodies, points, strict=True)
        ]
        return [link for link, _ in stations[:2]], [x for _, point in stations for x in point]

    def record_size(self, location: EndPoints) -> int:
        """Return the size of force and point of both ends."""
        return 12

    def list_columns(self, force: Any) -> tuple[str, ...]:
        """Return the labels of force and point in ground, for each of the frames.

        Returns:
            Labels of the columns.
        """
        labels = [f"{what}.{axis}" for what in ("force", "point") for axis in "XYZ"]
        return tuple(
            f"{force.name}.{frame}.{label}" for frame in force.location.frames for label in labels
        )
