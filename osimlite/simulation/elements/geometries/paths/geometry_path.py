"""A path through points in bodies, around surfaces.

The points are fixed, move along a coordinate, or come and go with one.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from math import inf
from typing import Any, ClassVar

import numpy as np

from osimlite.base.records import dataclass, replace
from osimlite.errors import ModelError
from osimlite.mechanics.kernels.cable_surfaces import CYLINDER, ELLIPSOID, SPHERE, TORUS
from osimlite.mechanics.kernels.geodesic_paths import slots_and_room
from osimlite.mechanics.kernels.layout import ITEM
from osimlite.mechanics.kernels.path_wraps import SURFACE_WORK
from osimlite.mechanics.kernels.paths import (
    CLAMPED,
    CONDITIONAL,
    FIXED,
    MOVING,
    NODE_WORK,
    ORDER,
    TANGENT,
)
from osimlite.mechanics.kernels.wrap_curves import MOST
from osimlite.mechanics.kernels.wrapping import AXIAL, HYBRID, MIDPOINT
from osimlite.mechanics.multibody.function_tables import table_of_one
from osimlite.mechanics.multibody.functions import Function
from osimlite.mechanics.multibody.links import Places
from osimlite.mechanics.multibody.spatial import Array, make_offset
from osimlite.schema.frames import PhysicalFrame
from osimlite.schema.paths import (
    AbstractPathPoint,
    ConditionalPathPoint,
    GeometryPath,
    MovingPathPoint,
    PathPoint,
)
from osimlite.schema.wrapping import WrapCylinder, WrapEllipsoid, WrapObject, WrapSphere, WrapTorus
from osimlite.simulation.elements.builder import ElementBuilder, kind_of
from osimlite.simulation.elements.force_records import ForceRecord
from osimlite.simulation.elements.registry import register_path

TOLERANCE = 1e-5
"""A conditional point counts so far outside its range, in OpenSim."""


@dataclass(frozen=True, eq=False)
class Node:
    """A point of a path."""

    body: int  # that it is in
    frame: Array  # (4, 4) in the body; the place is given there
    location: Array  # in the frame, m; what functions give comes on top
    kind: int = FIXED  # of the node
    coordinate: int = -1  # place in the mechanism of that which it depends on, or -1
    range: tuple[float, float] = (-inf, inf)  # of this coordinate
    functions: tuple[Function, ...] = ()  # of it, that give the place
    name: str = ""  # of the point, or of the surface that it is on

    def packed(
        self, places: Places, of: int, first: int, path: str, piece: int
    ) -> tuple[list[int], list[float]]:
        """Its integers and numbers; these begin at `first`, and `of` is what the node belongs to.

        Between two nodes in a row that are of one piece there is no line that pulls.
        """
        link, frame = places.placement(self.body)
        frame = frame @ self.frame
        value = places.locked_value(self.coordinate) if self.coordinate >= 0 else 0.0
        station = frame[:3, :3] @ self.location + frame[:3, 3]
        numbers = [*station.tolist(), value, *self.range, *frame[:3, :3].ravel().tolist()]
        tables = []
        for function in self.functions:
            tables.append(first + len(numbers))
            numbers += table_of_one(function, f"the place of a point of '{path}'")
        return [link, piece, self.kind, of, first, *(tables or (0, 0, 0))], numbers


@dataclass(frozen=True, eq=False)
class Surface:
    """What a path wraps around."""

    number: int  # tells it from other surfaces of the path
    tangent: Node  # a node at its middle, with its axes
    law: str  # name of the law of the surface; empty if the surface is not active
    curve: str  # name of the law that traces a path on it, which is no geodesic
    numbers: tuple[float, ...]  # what the law is given, or those of `geodesic_starts`
    first: int  # number of the first point between which and the last one the path may wrap
    last: int  # number of the last one
    begin: int = 0  # number of the first one of all pieces that the same PathWrap may bend


@dataclass(frozen=True)
class ThroughPoints:
    """A path from point to point, around surfaces."""

    path: str  # of its owner
    points: tuple[Node, ...]  # that it runs through
    # that it wraps around; along geodesics a surface for each point that a piece around it may
    # begin at
    surfaces: tuple[Surface, ...] = ()
    geodesic: bool = False  # whether it does so along geodesics

    coupled: ClassVar[bool] = True

    @property
    def trace(self) -> str:
        """Name of the law that traces it."""
        return "trace_geodesics" if self.geodesic and self.surfaces else "trace_path"

    @property
    def curves(self) -> tuple[str, ...]:
        """Names of the laws that trace it on its surfaces."""
        return () if self.geodesic else tuple(surface.curve for surface in self.surfaces)

    @property
    def corners(self) -> int:
        """The most corners that it is traced with."""
        return len(self.points) + len(self.surfaces) * (1 + int(MOST))

    @property
    def start(self) -> tuple[int, Array]:
        """The body that it starts in, and where there (3,)."""
        first = self.points[0]
        return first.body, first.frame[:3, :3] @ first.location + first.frame[:3, 3]

    def items(self, places: Places) -> list[ForceRecord]:
        """What pulls, the surfaces, and the path."""
        parts = [ForceRecord("pull_points", is_part=True)]
        wraps: list[int] = []
        behind = sum(bool(surface.law) for surface in self.surfaces)
        for surface in () if self.geodesic else self.surfaces:
            if surface.law:
                parts.append(
                    ForceRecord(surface.law, (), surface.numbers, room=SURFACE_WORK, is_part=True)
                )
                wraps.append(ITEM.OWN * (behind + 2 - len(parts)))
            else:
                wraps.append(0)
            wraps += surface.first, surface.last
        nodes = [(point, places.freedom(point.coordinate)) for point in self.points]
        nodes += [(surface.tangent, surface.number) for surface in self.surfaces for _ in range(2)]
        ints, numbers = [ITEM.OWN * len(parts), len(self.points), len(self.surfaces)], list[float]()
        for number, (node, of) in enumerate(nodes):
            # A geodesic path pulls along all lines, since a point may move in its body, but for
            # chords of surfaces.
            piece = (
                node.body if not self.geodesic else (-1 - of if node.kind == TANGENT else number)
            )
            own, more = node.packed(places, of, len(numbers), self.path, piece)
            ints += own
            numbers += more
        kernel, room = (
            "wrapped_path" if self.surfaces else "straight_path",
            ORDER + len(nodes) * (1 + NODE_WORK),
        )
        if self.geodesic and self.surfaces:
            for surface in self.surfaces:
                wraps += len(numbers), surface.first, surface.last, surface.begin
                numbers += surface.numbers
            most = max(Counter(surface.first for surface in self.surfaces).values())
            slots, room = slots_and_room(most, len(self.surfaces), room)
            kernel, wraps = "geodesic_path", wraps + slots
        return [
            *parts,
            ForceRecord(kernel, (*ints, *wraps), tuple(numbers), room=room, is_part=True),
        ]


@register_path(GeometryPath)
def read_path(builder: ElementBuilder, owner: Any) -> ThroughPoints:
    """The points of an owner's path, and the surfaces that it wraps around.

    Raises:
        UnsupportedError: there is a point or a surface of an unknown kind.
        ModelError: there are less than two points, or something makes no sense.
    """
    path = owner.geometry_path
    points = []
    for point in path.path_point_set.objects:
        if type(point) not in READERS:
            raise builder.unsupported(owner, f" with the {kind_of(point)} '{point.name}'")
        body, frame = builder.placement(
            builder.target(point, "socket_parent_frame", point.socket_parent_frame)
        )
        points.append(READERS[type(point)](builder, point, body, frame))
    if len(points) < 2:
        raise ModelError(
            f"the path of '{builder.path(owner)}' has {len(points)} points; give it at least two"
        )
    wraps = path.path_wrap_set.objects
    result = [builder.target(wrap, "wrap_object", wrap.wrap_object) for wrap in wraps]
    numbers = {id(surface): number for number, surface in enumerate(result)}
    alone = float(len(wraps) == 1)
    surfaces = []
    # Where a path runs through no point of a range, OpenSim does not look at the wraps that follow
    # in that pose either.
    may_leave = False
    for wrap, surface in zip(wraps, result, strict=True):
        if type(surface) not in LAWS:
            raise builder.unsupported(owner, f" around the {kind_of(surface)} '{surface.name}'")
        surfaces.append(_surface(builder, wrap, surface, numbers[id(surface)], alone, len(points)))
        first, last = surfaces[-1].first, surfaces[-1].last
        if surface.active and first > last and not builder.geodesic:
            # OpenSim goes no further: it does not even look at the wraps that follow.
            break
        if surface.active and first <= last and last >= len(points) and not may_leave:
            raise ModelError(
                f"the range of '{builder.path(wrap)}' ends at point {last + 1}; the path has {len(points)}"
            )
        may_leave |= surface.active and all(
            point.kind == CONDITIONAL for point in points[first : last + 1]
        )
    if builder.geodesic:
        points = [
            replace(point, kind=CLAMPED) if point.kind == MOVING else point for point in points
        ]
        end = len(points) - 1
        pieces = [
            (each, k)
            for each in surfaces
            if each.law
            for k in range(each.first, min(each.last, end))
        ]
        surfaces = [
            replace(surface, number=number, first=k, begin=surface.first)
            for number, (surface, k) in enumerate(pieces)
        ]
    return ThroughPoints(builder.path(owner), tuple(points), tuple(surfaces), builder.geodesic)


def _surface(
    builder: ElementBuilder, wrap: Any, surface: Any, number: int, alone: float, points: int
) -> Surface:
    law, curve, fields = LAWS[type(surface)]
    sizes = [float(size) for name in fields for size in np.atleast_1d(getattr(surface, name))]
    builder.check(surface, (*sizes, *surface.translation, *surface.xyz_body_rotation))
    side, method = SIDES.get(surface.quadrant.lower()), METHODS.get(wrap.method.lower())
    if side is None:
        raise ModelError(
            f"the quadrant of '{builder.path(surface)}' is '{surface.quadrant}'; take x, -y, all or such"
        )
    if method is None:
        raise ModelError(
            f"the method of '{builder.path(wrap)}' is '{wrap.method}'; take hybrid, midpoint or axial"
        )
    if min(sizes) < 0.0 or (min(sizes) == 0.0 and isinstance(surface, WrapEllipsoid | WrapTorus)):
        raise ModelError(
            f"'{builder.path(surface)}' has a size that is not positive; give it a positive one"
        )
    first, last = (
        end - 1 if end >= 1 else other
        for end, other in zip(wrap.range, (0, points - 1), strict=True)
    )
    frame = surface
    while not isinstance(frame, PhysicalFrame):
        frame = builder.tree.parent_of(frame)
    body, placed = builder.placement(frame)
    placed = placed @ make_offset(surface.translation, surface.xyz_body_rotation)
    tangent = Node(body, placed, np.zeros(3), TANGENT, name=surface.name)
    numbers = (*side, method, alone, *sizes)
    if builder.geodesic:
        numbers = (*side, *_geodesic(surface))
    is_none = not surface.active or (builder.geodesic and min(sizes) == 0.0)
    law, curve = ("", "") if is_none else (law, curve)
    return Surface(number, tangent, law, curve, numbers, first, last)


def _geodesic(surface: WrapObject) -> tuple[float, ...]:
    """Half the length of a surface, and its numbers in :mod:`osimlite.mechanics.kernels.cable_surfaces`."""
    if isinstance(surface, WrapCylinder):
        return surface.length / 2.0, CYLINDER, surface.radius, surface.radius**2, 1.0, 1.0, 0.0
    if isinstance(surface, WrapSphere):
        return inf, SPHERE, surface.radius, surface.radius**2, 1.0, 1.0, 1.0
    if isinstance(surface, WrapEllipsoid):
        return inf, ELLIPSOID, 1.0, 1.0, *(float(radius) ** -2 for radius in surface.dimensions)
    assert isinstance(surface, WrapTorus)
    return inf, TORUS, surface.outer_radius, surface.inner_radius, 0.0, 0.0, 0.0


def _fixed(builder: ElementBuilder, point: Any, body: int, frame: Array) -> Node:
    builder.check(point, point.location)
    return Node(body, frame, np.array(point.location), name=point.name)


def _conditional(builder: ElementBuilder, point: Any, body: int, frame: Array) -> Node:
    builder.check(point, (*point.location, *point.range))
    low, high = point.range
    coordinate = builder.coordinate(point, "socket_coordinate")
    within = low - TOLERANCE, high + TOLERANCE
    return Node(
        body, frame, np.array(point.location), CONDITIONAL, coordinate, within, name=point.name
    )


def _moving(builder: ElementBuilder, point: Any, body: int, frame: Array) -> Node:
    functions = [
        builder.function(point, getattr(point, f"{axis}_location"), f"{axis}_location")
        for axis in "xyz"
    ]
    coordinate, *others = (builder.coordinate(point, f"socket_{axis}_coordinate") for axis in "xyz")
    if others != [coordinate, coordinate]:
        raise ModelError(
            f"the three coordinates of '{builder.path(point)}' differ; name the same one in all sockets"
        )
    within = builder.mechanism.coordinates[coordinate].range
    return Node(body, frame, np.zeros(3), MOVING, coordinate, within, tuple(functions), point.name)


READERS: dict[type[AbstractPathPoint], Callable[[ElementBuilder, Any, int, Array], Node]] = {
    PathPoint: _fixed,
    ConditionalPathPoint: _conditional,
    MovingPathPoint: _moving,
}

LAWS: dict[type[WrapObject], tuple[str, str, tuple[str, ...]]] = {
    WrapCylinder: ("wrap_cylinder", "trace_cylinder", ("radius", "length")),
    WrapSphere: ("wrap_sphere", "trace_sphere", ("radius",)),
    WrapEllipsoid: ("wrap_ellipsoid", "trace_ellipsoid", ("dimensions",)),
    WrapTorus: ("wrap_torus", "trace_torus", ("inner_radius", "outer_radius")),
}
"""The law of each surface, that which traces a path on it, and the properties that are its sizes."""

SIGNS = {"": 1.0, "+": 1.0, "-": -1.0}
SIDES = {
    sign + name: (float(axis), side)
    for axis, name in enumerate("xyz")
    for sign, side in SIGNS.items()
}
SIDES |= {"all": (0.0, 0.0), "unassigned": (0.0, 0.0)}
"""Axis and sign of a quadrant."""

METHODS = {"hybrid": HYBRID, "midpoint": MIDPOINT, "axial": AXIAL, "unassigned": HYBRID}
