"""Drawable parts of a model (surfaces, lines and frames) for all kinds of view.

Each part is fixed to bodies. This module draws nothing: the page, pictures and animations are made
from a :class:`Scene` and coordinate values. Bodies have their indices in the mechanism; -1 is
ground.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from typing import Literal, cast

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.progress import watch_items
from osimlite.base.records import dataclass
from osimlite.io.meshes.surface import Surface
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.polylines import Polylines, TraceablePath

Color = tuple[float, float, float]
Layer = Literal["geometry", "contact", "wrap", "markers", "paths", "springs", "frames"]

LAYERS: tuple[Layer, ...] = ("geometry", "contact", "wrap", "markers", "paths", "springs", "frames")
"""Layers that can be shown or hidden."""

SCENERY_SIZE = 12.0
"""Size, relative to the median size of shapes, above which pictures may cut a shape off."""

MIN_FLOOR_COSINE = 0.5
"""Least cosine between the vertical and the normal of a half space that is a floor, not a wall."""

_MAX_EXACT_POINTS = 1500
"""Number of points of a surface up to which all are transformed; of others only a box is."""


@dataclass(frozen=True, eq=False)
class Item:
    """Surface in one colour, fixed to a body."""

    path: str  # absolute path of the component it shows
    layer: Layer  # layer with which it is shown or hidden
    body: int  # index of the body that carries it, -1 for ground
    surface: int  # index of the surface in the scene
    matrix: Array  # (4, 4) from the surface to the body's frame, m; it may scale and mirror
    color: Color  # red, green, blue, 0 to 1
    opacity: float = 1.0  # 0 to 1
    visible: bool = True  # whether the model shows it


class LinePoint(NamedTuple):
    """Corner of a line: index of its body, and position (3,) in the body's frame, m."""

    body: int
    location: Array


@dataclass(frozen=True, eq=False)
class Line:
    """Polyline: the path of a muscle, a spring, or a stick that shows a body without geometry."""

    path: str  # absolute path of the component it shows
    layer: Layer  # layer with which it is shown or hidden
    # Two or more corners that are fixed to bodies, or a path that computes its corners.
    route: tuple[LinePoint, ...] | TraceablePath
    color: Color  # red, green, blue, 0 to 1
    radius: float = 0.004  # radius of the drawn line, m
    visible: bool = True  # whether the model wants it shown
    wraps: tuple[str, ...] = ()  # paths of the wrap objects that it may bend around
    # radius of the drawn muscle fibers in their middle, m; 0 for lines without fibers
    fibers: float = 0.0
    tendon: float = 0.0  # tendon slack length, m; half of the tendon is drawn at each end

    @property
    def start(self) -> LinePoint:
        """First point of the line."""
        return self.route[0] if isinstance(self.route, tuple) else LinePoint(*self.route.start)

    @property
    def body(self) -> int | None:
        """Index of the body to which all corners are fixed; None for several bodies or a path."""
        bodies = {point.body for point in self.route} if isinstance(self.route, tuple) else set()
        return bodies.pop() if len(bodies) == 1 else None


@dataclass(frozen=True, eq=False)
class Axes:
    """Axes of a frame: component path, body, frame (4, 4) in the body, length of the axes (m)."""

    path: str
    body: int
    matrix: Array
    length: float = 0.1


@dataclass(frozen=True, eq=False)
class ForceAnchor:
    """Point where a contact force is shown: element, component path, body, labels of records.

    `near` (3,) is the middle of the contact surface in the body's frame, m; `surface` is its path.
    """

    element: str
    path: str
    body: int
    labels: tuple[str, ...]
    near: Array
    surface: str = ""


@dataclass(frozen=True, eq=False)
class Bodies:
    """Pose of a scene: positions of its bodies and corners of its lines."""

    scene: Scene  # scene in this pose
    q: Array  # coordinate values (n,)
    rotations: Array  # rotations of the bodies to ground (b + 1, 3, 3); the last is ground itself
    origins: Array  # origins of the bodies in ground (b + 1, 3), m

    @cached_property
    def lines(self) -> list[Array]:
        """Corners (k, 3) in ground of each line of the scene."""
        # Paths are traced together, in the order of the lines.
        paths = iter(self.scene.polylines.trace(self.q, self.rotations[:-1], self.origins[:-1]))
        return [
            np.concatenate(
                [self.transform_points(point.body, point.location[None]) for point in line.route]
            )
            if isinstance(line.route, tuple)
            else next(paths)
            for line in self.scene.lines
        ]

    def transform_points(self, body: int, points: Array) -> Array:
        """Return the positions (k, 3) in ground, m, of points (k, 3) in a body's frame."""
        return cast("Array", points @ self.rotations[body].T + self.origins[body])

    def transform_frame(self, body: int, transform: Array) -> Array:
        """Return a transform (4, 4) from a body's frame to ground; it may contain a scale."""
        result = transform.copy()
        # The rotation of the body keeps the scale in the upper part of the transform.
        result[:3, :3] = self.rotations[body] @ transform[:3, :3]
        result[:3, 3] = self.transform_points(body, transform[None, :3, 3])[0]
        return result


@dataclass(frozen=True, eq=False)
class Scene:
    """Drawable parts of a model."""

    mechanism: Mechanism  # mechanism that poses the bodies
    surfaces: Sequence[Surface]  # surfaces of the items, which may share one
    items: Sequence[Item]  # all surfaces with their bodies, frames and colours
    lines: Sequence[Line]  # all paths, springs and sticks
    axes: Sequence[Axes]  # all frames
    force_anchors: Sequence[ForceAnchor] = ()  # points where contact forces are shown
    # Layers that the model shows at first.
    visible_layers: frozenset[Layer] = frozenset(LAYERS)
    # Paths of the half spaces, whose items are squares of limited size.
    half_spaces: frozenset[str] = frozenset()
    remarks: Sequence[tuple[str, str]] = ()  # path and reason of components that are not shown

    def compute_poses(self, q: Array) -> Bodies:
        """Return the poses of all bodies at coordinate values q (n,)."""
        state = self.mechanism.at(q)
        return Bodies(self, state.q, state.rotations, state.origins)

    def compute_all_poses(self, rows: Array) -> list[Bodies]:
        """Return the poses of all bodies and lines along a motion, and report the progress.

        Args:
            rows: coordinate values of t poses (t, n).
        """
        poses = []
        for row in watch_items("posing the model", rows):
            bodies = self.compute_poses(row)
            # Trace the paths here: they take most of the time, and later there would be no progress
            # report.
            _ = bodies.lines
            poses.append(bodies)
        return poses

    @cached_property
    def polylines(self) -> Polylines:
        """Paths among the lines, to be traced together."""
        return Polylines(
            self.mechanism,
            [line.route for line in self.lines if not isinstance(line.route, tuple)],
        )

    @cached_property
    def up(self) -> Array:
        """Unit vector (3,) against gravity; ground's Y axis without gravity."""
        gravity = self.mechanism.gravity
        size = float(np.linalg.norm(gravity))
        return -gravity / size if size > 0.0 else np.array((0.0, 1.0, 0.0))

    def iterate_visible_items(self) -> Iterator[Item]:
        """Return an iterator over the items that the model and its layers show."""
        return (
            drawn_item
            for drawn_item in self.items
            if drawn_item.visible and drawn_item.layer in self.visible_layers
        )

    @cached_property
    def large(self) -> frozenset[int]:
        """Indices of the scenery: half spaces, and items far larger than most."""
        sizes = np.array(
            [
                float(np.linalg.norm(np.ptp(corners, axis=0)))
                for corners in map(self.compute_corners, self.items)
            ]
        )
        is_geometry = np.array(
            [drawn_item.visible and drawn_item.layer == "geometry" for drawn_item in self.items],
            dtype=bool,
        )
        # The median is the usual size, which a few large shapes do not change.
        limit = SCENERY_SIZE * float(np.median(sizes[is_geometry])) if is_geometry.any() else np.inf
        return frozenset(
            k
            for k, drawn_item in enumerate(self.items)
            if drawn_item.path in self.half_spaces or sizes[k] > limit
        )

    def compute_corners(self, drawn_item: Item) -> Array:
        """Return points (k, 3) that bound an item in the body's frame: all, or corners of a box."""
        points = self.surfaces[drawn_item.surface].points
        # Eight corners of a box instead of all points: an outline is enough here.
        if len(points) > _MAX_EXACT_POINTS:
            points = _box_corners(points.min(axis=0), points.max(axis=0))
        in_body: Array = points @ drawn_item.matrix[:3, :3].T + drawn_item.matrix[:3, 3]
        return in_body

    def iterate_extents(self, bodies: Bodies) -> Iterator[tuple[int, Array]]:
        """Yield body and points (k, 3) in ground of each visible item or line, without scenery.

        A line that is not fixed to one body has the body -2.
        """
        # Lines between several bodies belong to none of them.
        for index, drawn_item in enumerate(self.items):
            if (
                drawn_item.visible
                and drawn_item.layer in self.visible_layers
                and index not in self.large
            ):
                yield (
                    drawn_item.body,
                    bodies.transform_points(drawn_item.body, self.compute_corners(drawn_item)),
                )
        for line, corners in zip(self.lines, bodies.lines, strict=True):
            if line.visible and line.layer in self.visible_layers:
                yield -2 if line.body is None else line.body, corners

    def compute_box(self, q: Array) -> tuple[Array, Array]:
        """Compute the bounding box in ground of the drawn objects without scenery.

        Returns:
            Least and greatest coordinates (3,), m, widened if the box is a point.
        """
        return self.compute_box_of(self.compute_poses(q))

    def compute_box_of(self, bodies: Bodies) -> tuple[Array, Array]:
        """Compute the bounding box of known poses of the bodies, as `compute_box` does.

        Returns:
            Least and greatest coordinates (3,), m, widened if the box is a point.
        """
        result: list[Array] = [points for _, points in self.iterate_extents(bodies) if len(points)]
        points = np.concatenate(result or [bodies.origins])
        lowest, highest = points.min(axis=0), points.max(axis=0)
        margin = (
            # A point gets a box of some size, so that nothing is divided by zero.
            0.05 * max(1.0, float(np.abs(points).max()))
            if float((highest - lowest).max()) < 1e-6
            else 0.0
        )
        return lowest - margin, highest + margin

    def find_floor_height(self, q: Array) -> float:
        """Return the floor's height above ground's origin, m: 0, or the lowest point if much lower."""
        box_minimum, box_maximum = self.compute_box(q)
        lowest = float((_box_corners(box_minimum, box_maximum) @ self.up).min())
        size = float(np.linalg.norm(box_maximum - box_minimum))
        # Shapes that reach slightly below 0 sink into the floor.
        return 0.0 if lowest >= -0.05 * size else lowest


def _box_corners(lower: Array, upper: Array) -> Array:
    return np.array(
        [
            (x, y, z)
            for x in (lower[0], upper[0])
            for y in (lower[1], upper[1])
            for z in (lower[2], upper[2])
        ]
    )


def draw_sticks(
    mechanism: Mechanism, bodies: Iterable[int]
) -> Iterator[tuple[int, tuple[LinePoint, LinePoint]]]:
    """Yield body and ends of sticks that show bodies without geometry.

    A stick runs from the body's own joint to each joint of a body that it carries, or to its mass
    centre if it carries none.
    """
    all_bodies = mechanism.bodies

    def find_joint(index: int) -> LinePoint:
        mobilizer = all_bodies[index].mobilizer
        return LinePoint(
            index, (mobilizer.parent_frame if mobilizer.reversed else mobilizer.child_frame)[:3, 3]
        )

    # A body that carries several others has a stick to each joint.
    for index in bodies:
        ends = [
            find_joint(child_index)
            for child_index, child in enumerate(all_bodies)
            if child.parent == index
        ]
        for end in ends or [LinePoint(index, all_bodies[index].mass_properties.center)]:
            yield index, (find_joint(index), end)
