"""Pictures of a scene in a pose, rendered in software for files and animations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, field
from osimlite.base.require import require
from osimlite.errors import OsimliteError
from osimlite.io.meshes import unit_shapes
from osimlite.io.meshes.surface import Surface
from osimlite.mechanics.multibody.spatial import Array
from osimlite.view.canvas import Canvas
from osimlite.view.scene import Bodies, Color, Scene
from osimlite.view.tubes import TENDON, build_tube

SKY = (0.965, 0.973, 0.984)
"""Colour of the background."""

INK = (0.149, 0.196, 0.247)
"""Colour of text."""

FLOOR = (0.80, 0.83, 0.87)
"""Colour of floor lines."""

EARTH = (0.91, 0.89, 0.85)
"""Colour of the region below ground."""

FORCE = (0.835, 0.369, 0.0)
"""Colour of force arrows: vermilion of Okabe and Ito, which colour-blind people distinguish."""

LOADED_CONTACT = (0.969, 0.71, 0.22)
"""Colour of loaded contact surfaces."""

# Axes of both vectors: to the right, up, and towards the viewer.
_KEY = np.array((-0.45, 0.75, 0.6)) / np.linalg.norm((-0.45, 0.75, 0.6))
"""Unit vector towards the key light, as seen by the viewer."""

_FILL = np.array((0.7, 0.1, 0.7)) / np.linalg.norm((0.7, 0.1, 0.7))
"""Unit vector towards the fill light, as seen by the viewer."""

_AMBIENT, _FROM_KEY, _FROM_FILL = 0.42, 0.46, 0.22

_IN_GROUND = np.eye(4)
"""Matrix (4, 4) of surfaces whose points are in ground."""

_FROM_THE_EDGE = 0.02
"""Sine of the angle between view and plane below which a half space is drawn as a line."""

_SUPERSAMPLING = 2
"""Number of rendered pixels per pixel of the picture, along each axis, for smooth edges."""


class Camera(NamedTuple):
    """Camera with parallel projection."""

    right: Array  # unit vector (3,) in ground that points to the right in the picture
    up: Array  # unit vector (3,) in ground that points up in the picture
    center: Array  # point (3,) in ground in the middle of the picture, m
    half: tuple[float, float]  # half the width and half the height of the visible region, m

    @property
    def towards(self) -> Array:
        """Unit vector (3,) towards the viewer."""
        return np.cross(self.right, self.up)

    def project_points(self, points: Array, width: int, height: int) -> Array:
        """Return pixels (right, down) and depth towards the viewer (m) of points (..., 3)."""
        away = points - self.center
        x = (away @ self.right / self.half[0] + 1.0) * (0.5 * width)
        y = (1.0 - away @ self.up / self.half[1]) * (0.5 * height)
        return np.stack((x, y, away @ self.towards), axis=-1)

    @classmethod
    def from_points(
        cls, points: Array, up: Array, direction: Array, aspect: float, margin: float = 1.12
    ) -> Camera:
        """Return the camera that sees all points (k, 3).

        Args:
            points: points (k, 3) in ground that the picture shows, m.
            up: vector (3,) in ground that points up in the picture.
            direction: vector (3,) in ground from the model to the viewer, of any length.
            aspect: width of the picture divided by its height.
            margin: extent of the picture relative to that of the points.
        """
        # `back` points from the model to the viewer.
        back = direction / np.linalg.norm(direction)
        right = np.cross(up, back)
        if np.linalg.norm(right) < 1e-9:
            # The view is along the vertical: any direction serves as up.
            right = np.cross(np.roll(up, 1), back)
        right = right / np.linalg.norm(right)
        upward = np.cross(back, right)
        in_picture = points @ np.array((right, upward)).T
        middle = 0.5 * (in_picture.min(axis=0) + in_picture.max(axis=0))
        half_width, half_height = np.maximum(
            margin * 0.5 * np.ptp(in_picture, axis=0), 1e-3
        ).tolist()
        # The shape of the picture decides which of the two extents counts.
        half_size = max(half_width, half_height * aspect), max(half_height, half_width / aspect)
        depth = float((points @ back).mean())
        return cls(right, upward, middle[0] * right + middle[1] * upward + depth * back, half_size)


class ForceArrow(NamedTuple):
    """Arrow of a force: its origin (3,) and its vector (3,), both in ground, in m."""

    point: Array
    vector: Array


@dataclass(frozen=True)
class Style:
    """Floor height (m, None for no floor), paths of loaded surfaces, colours of lines by path."""

    floor: float | None = None
    loaded: frozenset[str] = frozenset()
    colors: Mapping[str, Color] = field(default_factory=dict)


def draw_scene(
    scene: Scene,
    q: Array,
    camera: Camera,
    size: tuple[int, int],
    arrows: Sequence[ForceArrow] = (),
    style: Style | None = None,
) -> Any:
    """Return a drawing of a scene in a pose as a pillow image.

    Args:
        scene: scene to draw.
        q: coordinate values (n,), rad or m.
        camera: direction of view and visible region.
        size: width and height in pixels.
        arrows: forces to draw as arrows.
        style: floor, loaded surfaces and colours of lines; by default no floor and the scene's
            colours.

    Raises:
        MissingDependency: pillow is not installed.
        OsimliteError: the picture is not 16 to 8000 pixels wide and high.
    """
    image = require("PIL.Image", extra="view", purpose="a picture")
    # Larger pictures would need gigabytes of memory at this fineness.
    if min(size) < 16 or max(size) > 8000:
        raise OsimliteError(
            f"a picture is 16 to 8000 pixels wide and high, not {size[0]} × {size[1]}"
        )
    width, height = _SUPERSAMPLING * size[0], _SUPERSAMPLING * size[1]
    canvas = Canvas(width, height, np.array(SKY))
    triangles = _TriangleList(camera, width, height)
    _fill_background(triangles, scene, scene.compute_poses(q), arrows, style or Style())
    triangles.draw_on(canvas)
    return image.fromarray(canvas.to_pixels(_SUPERSAMPLING))


def _fill_background(
    triangles: _TriangleList,
    scene: Scene,
    bodies: Bodies,
    arrows: Iterable[ForceArrow],
    style: Style,
) -> None:
    if style.floor is not None:
        _lay_floor(triangles, scene, style.floor)
    for drawn_item in scene.iterate_visible_items():
        if drawn_item.path in scene.half_spaces:
            _cut_half_space(triangles, bodies.transform_frame(drawn_item.body, drawn_item.matrix))
        loaded = drawn_item.path in style.loaded
        color, opacity = (
            (LOADED_CONTACT, max(drawn_item.opacity, 0.75))
            if loaded
            else (drawn_item.color, drawn_item.opacity)
        )
        triangles.add_surface(
            scene.surfaces[drawn_item.surface],
            bodies.transform_frame(drawn_item.body, drawn_item.matrix),
            color,
            opacity,
        )
    for line, corners in zip(scene.lines, bodies.lines, strict=True):
        # A path that cannot be traced in this pose has no corners.
        if line.visible and line.layer in scene.visible_layers and len(corners):
            surface, is_tendon = build_tube(line, corners)
            color = style.colors.get(line.path, line.color)
            triangles.add_surface(surface, _IN_GROUND, np.where(is_tendon[:, None], TENDON, color))
    if "frames" in scene.visible_layers:
        for axes in scene.axes:
            transform = bodies.transform_frame(axes.body, axes.matrix)
            for axis in range(3):
                end = transform[:3, 3] + axes.length * transform[:3, axis]
                triangles.add_surface(
                    unit_shapes.make_cylinder(8),
                    _make_cylinder(transform[:3, 3], end, 0.002),
                    tuple(np.eye(3)[axis].tolist()),
                )
    thickness = 0.012 * triangles.camera.half[1]
    for arrow in arrows:
        length = float(np.linalg.norm(arrow.vector))
        # An arrow shorter than its head would be a blot.
        if length < 2.0 * thickness:
            continue
        tip = arrow.point + arrow.vector
        end = arrow.point + arrow.vector * max(0.0, 1.0 - 5.0 * thickness / length)
        triangles.add_surface(
            unit_shapes.make_cylinder(),
            _make_cylinder(arrow.point, end, thickness),
            FORCE,
            in_front=True,
        )
        tip_matrix = _make_cylinder(end, tip, 2.6 * thickness)
        tip_matrix[:3, 3] = end
        triangles.add_surface(unit_shapes.make_cone(), tip_matrix, FORCE, in_front=True)


def _lay_floor(triangles: _TriangleList, scene: Scene, height: float) -> None:
    """Add the lines of a level floor at a height above ground's origin, m."""
    up = scene.up
    half_size = max(triangles.camera.half)
    first_axis = np.cross(up, (0.0, 0.0, 1.0) if abs(up[2]) < 0.9 else (1.0, 0.0, 0.0))
    first_axis /= np.linalg.norm(first_axis)
    second_axis = np.cross(first_axis, up)
    # Lines are 0.5 m apart, in wider views a power of ten.
    step = 0.5 if half_size < 4.0 else 10.0 ** np.ceil(np.log10(half_size / 8.0))
    floor_extent = step * np.ceil(1.2 * half_size / step)
    center = triangles.camera.center
    # Lines are at multiples of the step, so that the floor stands still when the camera moves.
    first_center, second_center = (
        step * np.round(center @ axis / step) for axis in (first_axis, second_axis)
    )
    for k in np.arange(-floor_extent, floor_extent + 0.5 * step, step):
        line_along_first = (
            (first_center - floor_extent, second_center + k),
            (first_center + floor_extent, second_center + k),
        )
        line_along_second = (
            (first_center + k, second_center - floor_extent),
            (first_center + k, second_center + floor_extent),
        )
        for end_coordinates in (line_along_first, line_along_second):
            start, end = (
                x * first_axis + z * second_axis + height * up for x, z in end_coordinates
            )
            triangles.add_surface(
                unit_shapes.make_cylinder(4),
                _make_cylinder(start, end, 0.0012 * half_size),
                FLOOR,
                is_lit=False,
            )


def _cut_half_space(triangles: _TriangleList, transform: Array) -> None:
    """Add a half space seen from its edge: a line, and the region below it as background."""
    camera = triangles.camera
    inward = transform[:3, 0] / np.linalg.norm(transform[:3, 0])
    # Seen from above or below, the square of the half space is enough.
    if abs(float(inward @ camera.towards)) > _FROM_THE_EDGE:
        return
    edge_direction = np.cross(inward, camera.towards)
    edge_direction /= np.linalg.norm(edge_direction)
    distance = 4.0 * max(camera.half)
    start = transform[:3, 3] + edge_direction * float(
        edge_direction @ (camera.center - transform[:3, 3])
    )
    triangles.add_surface(
        unit_shapes.make_cylinder(4),
        _make_cylinder(
            start - distance * edge_direction,
            start + distance * edge_direction,
            0.004 * camera.half[1],
        ),
        INK,
        is_lit=False,
    )
    square_matrix = np.eye(4)
    square_matrix[:3, :3] = np.column_stack(
        (camera.towards, distance * inward, 2.0 * distance * edge_direction)
    )
    square_matrix[:3, 3] = start + 0.5 * distance * inward - 1e3 * camera.towards
    triangles.add_surface(unit_shapes.make_square(), square_matrix, EARTH, is_lit=False)


class _TriangleList:
    """Lit triangles in the projection of a camera, collected to be drawn at once."""

    def __init__(self, camera: Camera, width: int, height: int) -> None:
        self.camera, self.width, self.height = camera, width, height
        self._solid: list[tuple[Array, Array]] = []
        self._glassy: list[tuple[Array, Array, Array]] = []
        self._axes = np.array((camera.right, camera.up, camera.towards))

    def add_surface(
        self,
        surface: Surface,
        matrix: Array,
        color: Color | tuple[float, ...] | Array,
        opacity: float = 1.0,
        *,
        is_lit: bool = True,
        in_front: bool = False,
    ) -> None:
        """Add a surface to the list.

        Args:
            surface: surface to draw.
            matrix: affine matrix (4, 4) from the surface to ground, m.
            color: red, green and blue (3,), or those of each point of the surface (n, 3), 0 to 1.
            opacity: opacity from 0 to 1.
            is_lit: whether brightness depends on the direction of the surface.
            in_front: whether the surface is moved 1 km towards the viewer, to be in front of
                everything.
        """
        points = surface.points @ matrix[:3, :3].T + matrix[:3, 3]
        vertices = self.camera.project_points(points, self.width, self.height)
        if in_front:
            # 1 km towards the viewer.
            vertices[:, 2] += 1e3
        shades = np.array(np.broadcast_to(np.asarray(color, dtype=float), points.shape))
        if is_lit:
            # Normals transform with the cofactors of the matrix, which also exist if it is
            # singular.
            linear_part = matrix[:3, :3]
            cofactors = np.cross(linear_part[[1, 2, 0]], linear_part[[2, 0, 1]])
            normals = unit_shapes.compute_normals(surface) @ cofactors.T @ self._axes.T
            lengths = np.linalg.norm(normals, axis=1, keepdims=True)
            normals = normals / np.where(lengths > 0.0, lengths, 1.0)
            # Both sides of a triangle are lit as if they faced the viewer.
            normals *= np.where(normals[:, 2:] < 0.0, -1.0, 1.0)
            light = (
                _AMBIENT
                + _FROM_KEY * (normals @ _KEY).clip(0.0)
                + _FROM_FILL * (normals @ _FILL).clip(0.0)
            )
            shades *= light[:, None]
        corners, colors = vertices[surface.triangles], shades[surface.triangles]
        # Triangles that face away are left out if the surface is closed and opaque, where they are
        # hidden, and in translucent surfaces. A sheet of one or two triangles keeps both sides.
        is_hidden = surface.is_closed and np.linalg.det(matrix[:3, :3]) > 0.0
        if is_hidden or (opacity < 1.0 and len(corners) > 2):
            (ax, ay), (bx, by), (cx, cy) = (corners[:, index, :2].T for index in range(3))
            # The sign of the area tells the side; the y axis of pictures points down.
            faces_viewer = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) < 0.0
            corners, colors = corners[faces_viewer], colors[faces_viewer]
        if opacity >= 1.0:
            self._solid.append((corners, colors))
        elif opacity > 0.0:
            self._glassy.append((corners, colors, np.full(len(corners), opacity)))

    def draw_on(self, canvas: Canvas) -> None:
        """Draw all triangles on a canvas, translucent ones after the opaque ones."""
        if self._solid:
            canvas.draw_opaque(
                *(np.concatenate(column) for column in zip(*self._solid, strict=True))
            )
        if self._glassy:
            canvas.draw_translucent(
                *(np.concatenate(column) for column in zip(*self._glassy, strict=True))
            )


def _make_cylinder(start: Array, end: Array, radius: float) -> Array:
    """Return the matrix (4, 4) that places a unit cylinder (along Z) between two points."""
    axis = end - start
    length = float(np.linalg.norm(axis))
    z = axis / length if length > 0.0 else np.array((0.0, 0.0, 1.0))
    # Cross z with the coordinate axis that is farthest from parallel to it.
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack((radius * x, radius * np.cross(z, x), length * z))
    matrix[:3, 3] = 0.5 * (start + end)
    return matrix
