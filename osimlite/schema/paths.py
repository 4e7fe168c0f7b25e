"""Paths: the lines along which muscles, springs and cables pull.

The property that holds a path is called ``path`` in a file. In Python it is `geometry_path`,
because `path` is where a component stands in the tree; the word ``path`` is understood when a
component is made or a path is assigned.
"""

from typing import TYPE_CHECKING, Annotated

from osimlite.schema.base import ModelComponent, make_default, make_empty_list
from osimlite.schema.facts import Facts
from osimlite.schema.fields import (
    LegacyMany,
    Many,
    Optional,
    Unnamed,
    Value,
    Vec3,
    reals,
    vec3,
    word,
)
from osimlite.schema.functions import Constant, Function
from osimlite.schema.geometry import Appearance
from osimlite.schema.markers import Point, Station
from osimlite.schema.references import (
    CoordinatePaths,
    CoordinateSocket,
    PhysicalFrameSocket,
    WrapObjectName,
)
from osimlite.schema.sets import Set

if TYPE_CHECKING:
    from osimlite.schema.frames import PhysicalFrame
    from osimlite.schema.wrapping import WrapObject


class AbstractPathPoint(Point, abstract=True):
    """A point that a path runs through."""

    socket_parent_frame: PhysicalFrameSocket = ""
    """Frame in which the location is given."""


class PathPoint(AbstractPathPoint):
    """A point fixed in a frame."""

    facts = Facts(
        outputs="acceleration:Vec3 location:Vec3 velocity:Vec3",
        scales={"location": "socket_parent_frame"},
    )

    internal = (("station", Station),)

    location: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Position of the point in its parent frame."""


class ConditionalPathPoint(PathPoint):
    """A point that belongs to the path only while a coordinate is within `range`."""

    socket_coordinate: CoordinateSocket = ""
    """The coordinate that decides whether the path runs through the point."""
    # OpenSim adds a tolerance of 1e-5 at both ends. Where the point appears, the length of the path
    # usually jumps, by up to 2 cm in public models.
    range: Annotated[tuple[float, float], reals("rad (rotational)", least=2, most=2)] = (0.0, 0.0)
    """Lowest and highest value of the coordinate at which the point is in the path, inclusive."""


class MovingPathPoint(AbstractPathPoint):
    """Point whose position follows a coordinate; the three sockets must name the same one."""

    facts = Facts(
        outputs="acceleration:Vec3 location:Vec3 velocity:Vec3",
        scales={f"{axis}_location": f"socket_parent_frame {axis}" for axis in "xyz"},
    )

    socket_x_coordinate: CoordinateSocket = ""
    """The argument of `x_location`."""
    socket_y_coordinate: CoordinateSocket = ""
    """The argument of `y_location`."""
    socket_z_coordinate: CoordinateSocket = ""
    """The argument of `z_location`."""
    # OpenSim clamps the coordinate to its range in the location but not in the velocity: outside of
    # the range the length stands still, while speed and force continue.
    x_location: Optional[Function] = make_default(Constant)
    """x of the point in its parent frame, as a function of the coordinate."""
    y_location: Optional[Function] = make_default(Constant)
    """y of the point in its parent frame, as a function of the coordinate."""
    z_location: Optional[Function] = make_default(Constant)
    """z of the point in its parent frame, as a function of the coordinate."""


class PathPointSet(Set):
    """The points of a path, in order."""

    objects: LegacyMany[AbstractPathPoint] = make_empty_list()
    """The points, in the order in which the path runs through them; the ends are the attachments."""


class PathWrapPoint(AbstractPathPoint, abstract=True):
    """Point at which a path touches a wrap surface; OpenSim computes it, and no file has one."""


class PathWrap(ModelComponent):
    """Entry for a surface around which a path wraps, with the range of points."""

    # The two tangent points are components in OpenSim, so that their names are taken and their
    # paths exist, although no file holds them.
    internal = (("pwpt1", PathWrapPoint), ("pwpt2", PathWrapPoint))

    wrap_object: WrapObjectName = ""
    """Name of the surface; the physical frames of the model are searched for it."""
    # The methods differ in the plane in which the path crosses the ellipsoid, and in its length.
    method: Annotated[str, word("hybrid", "midpoint", "axial", "Unassigned")] = "hybrid"
    """Method for the wrap over an ellipsoid; it does not matter for other surfaces."""
    range: Annotated[tuple[int, int], Value("int", "list", least=2, most=2)] = (-1, -1)
    """First and last point, counted from 1, between which the path may wrap; below 1 there is no such limit."""


class PathWrapSet(Set):
    """The surfaces a path wraps around."""

    objects: LegacyMany[PathWrap] = make_empty_list()
    """The surfaces that the path may wrap around, with an entry for each."""


class AbstractGeometryPath(ModelComponent, abstract=True):
    """Base class of paths, with their appearance."""

    facts = Facts(outputs="length lengthening_speed")

    appearance: Unnamed[Appearance] = make_default(Appearance, color=(0.5, 0.5, 0.5))
    """Appearance of the path in viewers."""


class GeometryPath(AbstractGeometryPath):
    """A path through points in frames, bent around wrap surfaces."""

    path_point_set: Unnamed[PathPointSet] = make_default(PathPointSet)
    """The points that the path runs through, from one attachment to the other."""
    path_wrap_set: Unnamed[PathWrapSet] = make_default(PathWrapSet)
    """The surfaces that the path may wrap around."""

    def add_point(
        self,
        frame: "PhysicalFrame | str",
        location: tuple[float, float, float] = (0.0, 0.0, 0.0),
        *,
        name: str = "",
    ) -> PathPoint:
        """Add a fixed point at the end of the path, as OpenSim's ``appendNewPathPoint`` does.

        Args:
            frame: body or other frame in which the point is fixed, or its path.
            location: position in the frame, m.
            name: name of the point; by default ``<path>-P<number>``, as in OpenSim's models.

        Returns:
            New point of the path.
        """
        points = self.path_point_set.objects
        name = name or f"{self.name}-P{len(points) + 1}"
        point = PathPoint(name=name, socket_parent_frame=frame, location=location)
        points.append(point)
        return point

    def add_wrap(self, surface: "WrapObject | str", *, method: str = "hybrid") -> PathWrap:
        """Let the path wrap around a surface, as OpenSim's ``addPathWrap`` does.

        Args:
            surface: wrap object of a frame of the model, or its name.
            method: method for wrapping over an ellipsoid: hybrid, midpoint or axial.

        Returns:
            The entry for the surface.
        """
        name = surface if isinstance(surface, str) else surface.name
        wraps = self.path_wrap_set.objects
        wrap = PathWrap(name=f"{self.name}-wrap{len(wraps) + 1}", wrap_object=name, method=method)
        wraps.append(wrap)
        return wrap


class FunctionBasedPath(AbstractGeometryPath):
    """Path given by length, lengthening speed and moment arms as functions of coordinates, without points."""

    coordinate_paths: CoordinatePaths = ()
    """Paths of the coordinates that are the arguments of all functions, in this order."""
    length_function: Optional[Function] = None
    """Length of the path (m) as a function of the coordinates."""
    moment_arm_functions: Many[Function] = make_empty_list()
    """Moment arm for each coordinate; left out, the derivative of the length times -1."""
    lengthening_speed_function: Optional[Function] = None
    """Speed as a function of all values, then all speeds; left out, it follows from the length."""
