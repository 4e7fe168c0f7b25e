"""Paths: the lines along which muscles, springs and cables pull.

The property that holds a path is called ``path`` in a file. In Python it is `geometry_path`, because `path` is where
a component stands in the tree; the word ``path`` is understood when a component is made or a path is assigned.
"""

from typing import Annotated

from osimlite.schema.base import ModelComponent, Object, made, none
from osimlite.schema.fields import LegacyMany, Many, Optional, Unnamed, Value, Vec3, reals, vec3, word
from osimlite.schema.functions import Constant, Function
from osimlite.schema.geometry import Appearance
from osimlite.schema.markers import Point, Station
from osimlite.schema.references import (
    CoordinatePaths,
    CoordinateSocket,
    PhysicalFrameSocket,
    WrapObjectName,
)
from osimlite.schema.sets import ObjectGroup


class AbstractPathPoint(Point, abstract=True):
    """A point that a path runs through."""

    socket_parent_frame: PhysicalFrameSocket = ""


class PathPoint(AbstractPathPoint):
    """A point fixed in a frame."""

    internal = (("station", Station),)

    location: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)


class ConditionalPathPoint(PathPoint):
    """A point that belongs to the path only while a coordinate is within `range`."""

    socket_coordinate: CoordinateSocket = ""
    range: Annotated[tuple[float, float], reals("rad (rotational)", least=2, most=2)] = (0.0, 0.0)


class MovingPathPoint(AbstractPathPoint):
    """A point whose place in its frame follows a coordinate; the three sockets must name the same one."""

    socket_x_coordinate: CoordinateSocket = ""
    socket_y_coordinate: CoordinateSocket = ""
    socket_z_coordinate: CoordinateSocket = ""
    x_location: Optional[Function] = made(Constant)
    y_location: Optional[Function] = made(Constant)
    z_location: Optional[Function] = made(Constant)


class PathPointSet(Object):
    """The points of a path, in order."""

    objects: LegacyMany[AbstractPathPoint] = none()
    groups: LegacyMany[ObjectGroup] = none()


class PathWrapPoint(AbstractPathPoint, abstract=True):
    """Where a path touches a wrap surface; OpenSim computes it, and no file holds one."""


class PathWrap(ModelComponent):
    """Says that a path wraps around a surface; `range` counts the points between which it may, from 1.

    A number below 1 means the first or the last point. `method` matters for ellipsoids only.
    """

    internal = (("pwpt1", PathWrapPoint), ("pwpt2", PathWrapPoint))

    wrap_object: WrapObjectName = ""
    method: Annotated[str, word("hybrid", "midpoint", "axial", "Unassigned")] = "hybrid"
    range: Annotated[tuple[int, int], Value("int", "list", least=2, most=2)] = (-1, -1)


class PathWrapSet(Object):
    """The surfaces a path wraps around."""

    objects: LegacyMany[PathWrap] = none()
    groups: LegacyMany[ObjectGroup] = none()


class AbstractGeometryPath(ModelComponent, abstract=True):
    """A path, and what it looks like."""

    appearance: Unnamed[Appearance] = made(Appearance, color=(0.5, 0.5, 0.5))


class GeometryPath(AbstractGeometryPath):
    """A path through points in frames, bent around wrap surfaces."""

    path_point_set: Unnamed[PathPointSet] = made(PathPointSet)
    path_wrap_set: Unnamed[PathWrapSet] = made(PathWrapSet)


class FunctionBasedPath(AbstractGeometryPath):
    """A path of which only length, lengthening speed and moment arms are known, as functions of coordinates."""

    coordinate_paths: CoordinatePaths = ()
    length_function: Optional[Function] = None
    moment_arm_functions: Many[Function] = none()
    lengthening_speed_function: Optional[Function] = None
