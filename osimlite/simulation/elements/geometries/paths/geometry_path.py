"""Paths through points in bodies and around surfaces.

A point is fixed in its body, moves with a coordinate, or is active in a range of a coordinate.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from math import inf
from typing import Any, ClassVar

import numpy as np

from osimlite.base.records import dataclass, replace
from osimlite.base.text import format_count
from osimlite.errors import ModelError
from osimlite.mechanics.kernels.cable_surfaces import SURFACE_TYPE
from osimlite.mechanics.kernels.geodesic_paths import layout_slots
from osimlite.mechanics.kernels.layout import ITEM
from osimlite.mechanics.kernels.path_wraps import SURFACE_WORK
from osimlite.mechanics.kernels.paths import NODE_TYPE, NODE_WORK, PATH_WORK
from osimlite.mechanics.kernels.wrap_curves import MAX_SEGMENTS
from osimlite.mechanics.kernels.wrapping import ELLIPSOID_METHOD
from osimlite.mechanics.multibody.function_tables import table_of_one
from osimlite.mechanics.multibody.functions import SmoothFunction
from osimlite.mechanics.multibody.links import LinkMap
from osimlite.mechanics.multibody.spatial import Array, make_offset
from osimlite.schema.frames import PhysicalFrame
from osimlite.schema.paths import (
    AbstractPathPoint,
    ConditionalPathPoint,
    GeometryPath,
    MovingPathPoint,
    PathPoint,
)
from osimlite.schema.resolution import is_a
from osimlite.simulation.elements.builder import ElementBuilder, get_class_name
from osimlite.simulation.elements.force_records import ForceRecord
from osimlite.simulation.elements.registry import register_path

TOLERANCE = 1e-5
"""Distance beyond its range up to which a conditional point is active, as in OpenSim, rad or m."""


@dataclass(frozen=True, eq=False)
class Node:
    """Point of a path.

    Attributes:
        body: index of the body in which the point is.
        frame: frame (4, 4) of the location in the body.
        location: position in the frame, m, to which `functions` are added.
        kind: type of the node, see `NODE_TYPE`.
        coordinate: index in the mechanism of the coordinate that the point depends on, or -1.
        range: range of this coordinate, rad or m.
        functions: functions of the coordinate for a moving location.
        name: name of the point, or of the surface on which it is.
    """

    body: int
    frame: Array
    location: Array
    kind: int = NODE_TYPE.FIXED
    coordinate: int = -1
    range: tuple[float, float] = (-inf, inf)
    functions: tuple[SmoothFunction, ...] = ()
    name: str = ""

    def pack(
        self, link_map: LinkMap, of: int, first: int, path: str, piece: int
    ) -> tuple[list[int], list[float]]:
        """Return the integers and numbers of the node.

        No line pulls between two consecutive nodes of the same piece.

        Args:
            link_map: placement of the bodies in the links of the tree.
            of: index of the degree of freedom, or number of the surface, that the node belongs to.
            first: offset of the numbers of the node.
            path: owner of the path, for messages.
            piece: piece of the node.

        Returns:
            Integers and numbers of the node.
        """
        # The frame of the point in its link.
        link, frame = link_map.placement(self.body)
        frame = frame @ self.frame
        # A locked coordinate has no number in the state, so its value goes into the record.
        value = link_map.get_locked_value(self.coordinate) if self.coordinate >= 0 else 0.0
        station = frame[:3, :3] @ self.location + frame[:3, 3]
        numbers = [*station.tolist(), value, *self.range, *frame[:3, :3].ravel().tolist()]
        tables = []
        for function in self.functions:
            tables.append(first + len(numbers))
            numbers += table_of_one(function, f"the location of a point of '{path}'")
        return [link, piece, self.kind, of, first, *(tables or (0, 0, 0))], numbers


@dataclass(frozen=True, eq=False)
class Surface:
    """Surface that a path wraps around.

    Attributes:
        number: number of the surface among those of the path.
        tangent: node at the centre of the surface, with the axes of the surface.
        law: name of the kernel of the surface; empty if the surface is not active.
        curve: name of the kernel that traces a path on the surface, unless the path is a geodesic.
        numbers: parameters of the kernel, or those of `geodesic_starts`.
        first: index of the first point of the range in which the path may wrap.
        last: index of the last point of the range.
        begin: index of the first point of the complete range of the PathWrap.
    """

    number: int
    tangent: Node
    law: str
    curve: str
    numbers: tuple[float, ...]
    first: int
    last: int
    begin: int = 0


@dataclass(frozen=True)
class ThroughPoints:
    """Path from point to point, around surfaces.

    Attributes:
        path: component path of its owner.
        points: points in their order.
        surfaces: surfaces that it wraps around; with geodesics, one entry for each point at which a
            segment around the surface may begin.
        geodesic: whether it wraps along geodesics.
    """

    path: str
    points: tuple[Node, ...]
    surfaces: tuple[Surface, ...] = ()
    geodesic: bool = False

    coupled: ClassVar[bool] = True

    @property
    def trace(self) -> str:
        """Name of the law that traces the path."""
        return "trace_geodesics" if self.geodesic and self.surfaces else "trace_path"

    @property
    def curves(self) -> tuple[str, ...]:
        """Names of the laws that trace the path on its surfaces.

        Returns:
            One name for each surface; none for geodesics.
        """
        return () if self.geodesic else tuple(surface.curve for surface in self.surfaces)

    @property
    def corners(self) -> int:
        """Maximum number of corners of its polyline."""
        return len(self.points) + len(self.surfaces) * (1 + int(MAX_SEGMENTS))

    @property
    def start(self) -> tuple[int, Array]:
        """Start of the path.

        Returns:
            The body of the first point, and the point's position in it (3,), m.
        """
        first = self.points[0]
        return first.body, first.frame[:3, :3] @ first.location + first.frame[:3, 3]

    def make_records(self, link_map: LinkMap) -> list[ForceRecord]:
        """Return the records of the path.

        Args:
            link_map: placement of the bodies in the links of the tree.

        Returns:
            The record that pulls at the points, those of the surfaces, and last that of the path.
        """
        parts = [ForceRecord("pull_points", is_part=True)]
        wraps: list[int] = []
        # Records of surfaces come before that of the path: offsets to them are negative.
        behind = sum(bool(surface.law) for surface in self.surfaces)
        # OpenSim solves one surface after the other, each by a kernel of its own. Geodesics are
        # solved together by the kernel of the path.
        for surface in () if self.geodesic else self.surfaces:
            if surface.law:
                parts.append(
                    ForceRecord(
                        surface.law,
                        (),
                        surface.numbers,
                        record_size=SURFACE_WORK.SIZE,
                        is_part=True,
                    )
                )
                wraps.append(ITEM.DETAILS * (behind + 2 - len(parts)))
            else:
                wraps.append(0)
            wraps += surface.first, surface.last
        nodes = [(point, link_map.freedom(point.coordinate)) for point in self.points]
        # Each surface has two tangent points.
        nodes += [(surface.tangent, surface.number) for surface in self.surfaces for _ in range(2)]
        ints = [ITEM.DETAILS * len(parts), len(self.points), len(self.surfaces)]
        numbers = list[float]()
        for number, (node, of) in enumerate(nodes):
            # With geodesics all lines pull except chords of surfaces, because points may move in
            # their bodies.
            piece = (
                node.body
                if not self.geodesic
                else (-1 - of if node.kind == NODE_TYPE.TANGENT else number)
            )
            node_ints, node_numbers = node.pack(link_map, of, len(numbers), self.path, piece)
            ints += node_ints
            numbers += node_numbers
        kernel = "wrapped_path" if self.surfaces else "straight_path"
        work = PATH_WORK.ORDER + len(nodes) * (1 + NODE_WORK.SIZE)
        if self.geodesic and self.surfaces:
            for surface in self.surfaces:
                wraps += len(numbers), surface.first, surface.last, surface.begin
                numbers += surface.numbers
            # The most surfaces on one segment decide how much work memory a search needs.
            most = max(Counter(surface.first for surface in self.surfaces).values())
            slots, work = layout_slots(most, len(self.surfaces), work)
            kernel = "geodesic_path"
            wraps += slots
        return [
            *parts,
            ForceRecord(kernel, (*ints, *wraps), tuple(numbers), record_size=work, is_part=True),
        ]


@register_path(GeometryPath)
def read_path(builder: ElementBuilder, owner: Any) -> ThroughPoints:
    """Return the points of an owner's path, and the surfaces that it wraps around.

    Args:
        builder: builder of the model's elements.
        owner: component with the path.

    Raises:
        UnsupportedError: a point or a surface has an unknown class.
        ModelError: there are fewer than two points, or something has no meaning.
    """
    path = owner.geometry_path
    points = []
    # Points of unknown classes have no reader.
    for point in path.path_point_set.objects:
        if type(point) not in READERS:
            raise builder.make_unsupported_error(
                owner, f" with the {get_class_name(point)} '{point.name}'"
            )
        body, frame = builder.find_placement(
            builder.resolve_target(point, "socket_parent_frame", point.socket_parent_frame)
        )
        points.append(READERS[type(point)](builder, point, body, frame))
    if len(points) < 2:
        raise ModelError(
            f"the path of '{builder.path(owner)}' has {format_count(len(points), 'point')}; give it at least two"
        )
    wraps = path.path_wrap_set.objects
    result = [builder.resolve_target(wrap, "wrap_object", wrap.wrap_object) for wrap in wraps]
    # A surface that several wraps name is one surface.
    numbers = {id(surface): number for number, surface in enumerate(result)}
    alone = float(len(wraps) == 1)
    surfaces = []
    # In a pose without an active point in the range of a wrap, OpenSim ignores the following wraps.
    may_leave = False
    for wrap, surface in zip(wraps, result, strict=True):
        if type(surface).__name__ not in LAWS:
            raise builder.make_unsupported_error(
                owner, f" around the {get_class_name(surface)} '{surface.name}'"
            )
        surfaces.append(
            _read_surface(builder, wrap, surface, numbers[id(surface)], alone, len(points))
        )
        first, last = surfaces[-1].first, surfaces[-1].last
        if surface.active and first > last and not builder.geodesic:
            # OpenSim stops here: it ignores the following wraps.
            break
        if surface.active and first <= last and last >= len(points) and not may_leave:
            raise ModelError(
                f"the range of '{builder.path(wrap)}' ends at point {last + 1}; the path has {len(points)}"
            )
        may_leave |= surface.active and all(
            point.kind == NODE_TYPE.CONDITIONAL for point in points[first : last + 1]
        )
    # Geodesics need points that move continuously.
    if builder.geodesic:
        points = [
            replace(point, kind=NODE_TYPE.CLAMPED) if point.kind == NODE_TYPE.MOVING else point
            for point in points
        ]
        # Each segment within the range of a wrap may go around the surface.
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


def _read_surface(
    builder: ElementBuilder, wrap: Any, surface: Any, number: int, alone: float, points: int
) -> Surface:
    law, curve, fields = LAWS[type(surface).__name__]
    sizes = [float(size) for name in fields for size in np.atleast_1d(getattr(surface, name))]
    builder.check_finite(surface, (*sizes, *surface.translation, *surface.xyz_body_rotation))
    side, method = SIDES.get(surface.quadrant.lower()), METHODS.get(wrap.method.lower())
    if side is None:
        raise ModelError(
            f"the quadrant of '{builder.path(surface)}' is '{surface.quadrant}'; "
            "use x, y or z, with or without a minus sign, or all"
        )
    if method is None:
        raise ModelError(
            f"the method of '{builder.path(wrap)}' is '{wrap.method}'; use hybrid, midpoint or axial"
        )
    may_be_zero = is_a(surface, "WrapCylinder") or is_a(surface, "WrapSphere")
    if min(sizes) < 0.0 or (min(sizes) == 0.0 and not may_be_zero):
        raise ModelError(
            f"'{builder.path(surface)}' has a size that is not positive; give a positive size"
        )
    # Ranges count from 1; values below 1 stand for the ends.
    first, last = (
        end - 1 if end >= 1 else other
        for end, other in zip(wrap.range, (0, points - 1), strict=True)
    )
    # A wrap object stands in a set of its body.
    frame = surface
    while not isinstance(frame, PhysicalFrame):
        frame = builder.tree.parent_of(frame)
    body, frame_in_body = builder.find_placement(frame)
    frame_in_body = frame_in_body @ make_offset(surface.translation, surface.xyz_body_rotation)
    tangent = Node(body, frame_in_body, np.zeros(3), NODE_TYPE.TANGENT, name=surface.name)
    numbers = (*side, method, alone, *sizes)
    if builder.geodesic:
        numbers = (*side, *_list_geodesic_numbers(surface))
    # A surface that is inactive, or a point, does not touch.
    is_none = not surface.active or (builder.geodesic and min(sizes) == 0.0)
    law, curve = ("", "") if is_none else (law, curve)
    return Surface(number, tangent, law, curve, numbers, first, last)


def _list_geodesic_numbers(surface: Any) -> tuple[float, ...]:
    """Return the numbers of a surface for geodesics.

    Args:
        surface: the surface.

    Returns:
        Half its length (m, infinite for closed surfaces), and its numbers in
        :mod:`osimlite.mechanics.kernels.cable_surfaces`.
    """
    if is_a(surface, "WrapCylinder"):
        return (
            surface.length / 2.0,
            SURFACE_TYPE.CYLINDER,
            surface.radius,
            surface.radius**2,
            1.0,
            1.0,
            0.0,
        )
    if is_a(surface, "WrapSphere"):
        return inf, SURFACE_TYPE.SPHERE, surface.radius, surface.radius**2, 1.0, 1.0, 1.0
    if is_a(surface, "WrapEllipsoid"):
        return (
            inf,
            SURFACE_TYPE.ELLIPSOID,
            1.0,
            1.0,
            *(float(radius) ** -2 for radius in surface.dimensions),
        )
    return inf, SURFACE_TYPE.TORUS, surface.outer_radius, surface.inner_radius, 0.0, 0.0, 0.0


def _read_fixed_point(builder: ElementBuilder, point: Any, body: int, frame: Array) -> Node:
    builder.check_finite(point, point.location)
    return Node(body, frame, np.array(point.location), name=point.name)


def _read_conditional_point(builder: ElementBuilder, point: Any, body: int, frame: Array) -> Node:
    builder.check_finite(point, (*point.location, *point.range))
    low, high = point.range
    coordinate = builder.find_coordinate(point, "socket_coordinate")
    # The tolerance keeps points active at a range that is given with few digits.
    active_range = low - TOLERANCE, high + TOLERANCE
    return Node(
        body,
        frame,
        np.array(point.location),
        NODE_TYPE.CONDITIONAL,
        coordinate,
        active_range,
        name=point.name,
    )


def _read_moving_point(builder: ElementBuilder, point: Any, body: int, frame: Array) -> Node:
    functions = [
        builder.read_function(point, getattr(point, f"{axis}_location"), f"{axis}_location")
        for axis in "xyz"
    ]
    coordinate, *others = (
        builder.find_coordinate(point, f"socket_{axis}_coordinate") for axis in "xyz"
    )
    if others != [coordinate, coordinate]:
        raise ModelError(
            f"the three coordinates of '{builder.path(point)}' differ; name the same one in all sockets"
        )
    coordinate_range = builder.mechanism.coordinates[coordinate].range
    return Node(
        body,
        frame,
        np.zeros(3),
        NODE_TYPE.MOVING,
        coordinate,
        coordinate_range,
        tuple(functions),
        point.name,
    )


READERS: dict[type[AbstractPathPoint], Callable[[ElementBuilder, Any, int, Array], Node]] = {
    PathPoint: _read_fixed_point,
    ConditionalPathPoint: _read_conditional_point,
    MovingPathPoint: _read_moving_point,
}
"""Function that reads the points of each class."""

LAWS: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "WrapCylinder": ("wrap_cylinder", "trace_cylinder", ("radius", "length")),
    "WrapSphere": ("wrap_sphere", "trace_sphere", ("radius",)),
    "WrapEllipsoid": ("wrap_ellipsoid", "trace_ellipsoid", ("dimensions",)),
    "WrapTorus": ("wrap_torus", "trace_torus", ("inner_radius", "outer_radius")),
}
"""Kernel of each class of surfaces, kernel that traces a path on it, and properties with the sizes."""

SIGNS = {"": 1.0, "+": 1.0, "-": -1.0}
"""Sign of a quadrant by its text."""
SIDES = {
    sign + name: (float(axis), side)
    for axis, name in enumerate("xyz")
    for sign, side in SIGNS.items()
}
SIDES |= {"all": (0.0, 0.0), "unassigned": (0.0, 0.0)}
"""Axis and sign of a quadrant."""

METHODS = {
    "hybrid": ELLIPSOID_METHOD.HYBRID,
    "midpoint": ELLIPSOID_METHOD.MIDPOINT,
    "axial": ELLIPSOID_METHOD.AXIAL,
    "unassigned": ELLIPSOID_METHOD.HYBRID,
}
"""Number of a wrap method in the kernels, by the text in the file."""
