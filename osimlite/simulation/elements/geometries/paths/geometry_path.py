"""A path through points in bodies: fixed ones, ones that move along a coordinate, ones that come and go with it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from osimlite.errors import ModelError
from osimlite.multibody.functions import Function
from osimlite.multibody.spatial import Array
from osimlite.schema.paths import AbstractPathPoint, ConditionalPathPoint, MovingPathPoint, PathPoint
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.items import Item, Places
from osimlite.simulation.kernels.functions import table_of_one
from osimlite.simulation.kernels.layout import OWN
from osimlite.simulation.kernels.paths import CONDITIONAL, FIXED, MOVING, NODE_WORK, ORDER

TOLERANCE = 1e-5
"""A conditional point counts so far outside its range, in OpenSim."""


@dataclass(frozen=True, eq=False)
class Node:
    """A point of a path.

    Attributes:
        body: that it is in.
        frame: (4, 4) in the body; the place is given there.
        location: in the frame, m; what functions give comes on top.
        kind: of the node.
        coordinate: place in the mechanism of that which it depends on, or -1.
        range: of this coordinate.
        functions: of it, that give the place.
    """

    body: int
    frame: Array
    location: Array
    kind: int = FIXED
    coordinate: int = -1
    range: tuple[float, float] = (-inf, inf)
    functions: tuple[Function, ...] = ()

    def packed(self, places: Places, first: int, path: str) -> tuple[list[int], list[float]]:
        """Its integers and numbers; these begin at `first`."""
        link, frame = places.placement(self.body)
        frame = frame @ self.frame
        numbers = (frame[:3, :3] @ self.location + frame[:3, 3]).tolist()
        if self.kind == FIXED:
            return [link, self.body, FIXED, -1, first, 0, 0, 0], numbers
        numbers += [places.locked_value(self.coordinate), *self.range, *frame[:3, :3].ravel().tolist()]
        tables = []
        for function in self.functions:
            tables.append(first + len(numbers))
            numbers += table_of_one(function, f"the place of a point of '{path}'")
        freedom = places.freedom(self.coordinate)
        return [link, self.body, self.kind, freedom, first, *(tables or (0, 0, 0))], numbers


@dataclass(frozen=True)
class ThroughPoints:
    """A path from point to point.

    Attributes:
        path: of its owner.
        nodes: the points.
    """

    path: str
    nodes: tuple[Node, ...]

    def items(self, places: Places) -> list[Item]:
        """What pulls, and the path."""
        ints, numbers = [len(self.nodes), 0], list[float]()
        for node in self.nodes:
            own, more = node.packed(places, len(numbers), self.path)
            ints += own
            numbers += more
        pull = Item("pull_points", is_part=True)
        room = ORDER + len(self.nodes) * (1 + NODE_WORK)
        path = Item("straight_path", (OWN, *ints), tuple(numbers), room=room, is_part=True)
        return [pull, path]


def read(builder: ElementBuilder, owner: Any) -> ThroughPoints:
    """The points of an owner's path.

    Raises:
        UnsupportedError: there is a point of an unknown kind, or the path wraps around a surface.
        ModelError: there are less than two points, or one makes no sense.
    """
    path = owner.geometry_path
    if path.path_wrap_set.objects:
        raise builder.unsupported(owner, " that wraps around a surface")
    found = []
    for point in path.path_point_set.objects:
        if type(point) not in READERS:
            raise builder.unsupported(owner, f" with the {type(point).__name__} '{point.name}'")
        body, frame = builder.placement(builder.target(point, "socket_parent_frame", point.socket_parent_frame))
        found.append(READERS[type(point)](builder, point, body, frame))
    if len(found) < 2:
        raise ModelError(f"the path of '{builder.path(owner)}' has {len(found)} points; give it at least two")
    return ThroughPoints(builder.path(owner), tuple(found))


def _fixed(builder: ElementBuilder, point: Any, body: int, frame: Array) -> Node:
    builder.check(point, point.location)
    return Node(body, frame, np.array(point.location))


def _conditional(builder: ElementBuilder, point: Any, body: int, frame: Array) -> Node:
    builder.check(point, (*point.location, *point.range))
    low, high = point.range
    coordinate = builder.coordinate(point, "socket_coordinate")
    return Node(body, frame, np.array(point.location), CONDITIONAL, coordinate, (low - TOLERANCE, high + TOLERANCE))


def _moving(builder: ElementBuilder, point: Any, body: int, frame: Array) -> Node:
    functions = [builder.function(point, getattr(point, f"{axis}_location"), f"{axis}_location") for axis in "xyz"]
    coordinate, *others = (builder.coordinate(point, f"socket_{axis}_coordinate") for axis in "xyz")
    if others != [coordinate, coordinate]:
        raise ModelError(f"the three coordinates of '{builder.path(point)}' differ; name the same one in all sockets")
    within = builder.mechanism.coordinates[coordinate].range
    return Node(body, frame, np.zeros(3), MOVING, coordinate, within, tuple(functions))


READERS: dict[type[AbstractPathPoint], Callable[[ElementBuilder, Any, int, Array], Node]] = {
    PathPoint: _fixed,
    ConditionalPathPoint: _conditional,
    MovingPathPoint: _moving,
}
