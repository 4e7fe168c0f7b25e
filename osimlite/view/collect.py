"""Builder of the scene of a model: geometry, contact and wrap surfaces, markers and paths."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.files import MESH_FOLDER_HINT
from osimlite.base.text import add_article
from osimlite.errors import ModelError, OsimliteError, UnsupportedError
from osimlite.io.meshes import unit_shapes
from osimlite.io.meshes.folders import MeshFolders, read_surface
from osimlite.io.meshes.surface import Surface
from osimlite.mechanics.multibody.extremes import any_numbers
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array, make_offset, make_transform, rotation_about
from osimlite.schema import (
    actuators,
    contact,
    contact_forces,
    contact_types,
    geometry,
    geometry_types,
    springs,
    wrap_types,
    wrapping,
)
from osimlite.schema.base import Component
from osimlite.schema.forces import Force, HuntCrossleyForce
from osimlite.schema.frames import PhysicalFrame, TwoFrameLinker
from osimlite.schema.markers import Marker
from osimlite.schema.model import Model
from osimlite.schema.muscles import Muscle
from osimlite.schema.paths import AbstractGeometryPath, GeometryPath
from osimlite.schema.specs import get_field_specs
from osimlite.schema.tree import Use
from osimlite.simulation.elements.builder import OPENSIM, ElementBuilder
from osimlite.simulation.elements.geometries.path import PATH
from osimlite.simulation.polylines import TraceablePath
from osimlite.simulation.robot.visuals import frame_of
from osimlite.view.scene import (
    Axes,
    Color,
    ForceAnchor,
    Item,
    Layer,
    Line,
    LinePoint,
    Scene,
    draw_sticks,
)

WIDTH_OF_HALF_SPACE = 2.5
"""Edge of the square that shows a half space, as a multiple of the model's size."""

# Files show these surfaces as wireframes; a translucent surface also leaves the bodies visible.
CONTACT_OPACITY = 0.5
"""Factor of the opacity of contact surfaces."""

HALF_SPACE_OPACITY = 0.2
"""Factor of the opacity of contact half spaces."""

WRAP_OPACITY = 0.3
"""Factor of the opacity of wrap surfaces."""

SPRING: Color = (0.0, 0.62, 0.45)
"""Colour of springs between points, for which files have no colour."""

STICK: Color = (0.149, 0.196, 0.247)
"""Colour of the sticks that show bodies without geometry."""

_TO_Z = make_transform(rotation_about(np.array((1.0, 0.0, 0.0)), -np.pi / 2))
"""Rotation (4, 4) that turns a cylinder along Z into one along Y."""

_ENDLESS_LENGTH_M = 1.0
"""Drawn length of a contact cylinder, which is infinitely long, m."""

_MARKER_RADIUS = 0.008

SPECIFIC_TENSION_PA = 6e5
"""Specific tension (60 N/cm²) that gives the cross-section of drawn fibers, Pa."""

DRAWN_RADIUS_FRACTION = 0.4
"""Drawn radius relative to that of the cross-section, so that muscles do not hide the bones."""

MAX_RADIUS_M = 0.025
"""Largest radius of drawn fibers, m."""


@any_numbers
def build_scene(
    model: Model, mechanism: Mechanism, folders: MeshFolders | None = None, wrapping: str = OPENSIM
) -> Scene:
    """Return the scene of a model; each component that cannot be drawn becomes a remark.

    Args:
        model: model to draw.
        mechanism: mechanism of `model`.
        folders: folders with mesh files; by default those of the environment variable alone.
        wrapping: method of wrapping paths around surfaces, see
            :class:`osimlite.simulation.Options`.

    Raises:
        SettingError: there is no such wrapping.
    """
    return _SceneCollector(model, mechanism, folders or MeshFolders(), wrapping).collect_scene()


class _SceneCollector:
    def __init__(
        self, model: Model, mechanism: Mechanism, folders: MeshFolders, wrapping: str
    ) -> None:
        self.model, self.mechanism, self.folders = model, mechanism, folders
        self.builder = ElementBuilder(model, mechanism, Path(), wrapping=wrapping)
        self.tree = self.builder.tree
        self.surfaces: list[Surface] = []
        self.surface_indices: dict[int, int] = {}
        self.meshes: dict[Path, Surface] = {}
        self.items: list[Item] = []
        self.lines: list[Line] = []
        self.axes: list[Axes] = []
        self.force_anchors: list[ForceAnchor] = []
        self.remarks: list[tuple[str, str]] = []
        # Bodies with a visible shape need no stick.
        self.drawn: set[int] = set()
        self.half_spaces: list[int] = []

    def collect_scene(self) -> Scene:
        for component in self.tree.components:
            path = self.tree.path_of(component) or ""
            with self._remark_failure(path):
                # Continue after a component that cannot be drawn.
                self._add_component(component, path)
        # Draw sticks from bodies without any shape to the bodies that they carry.
        undrawn = [k for k, _ in enumerate(self.mechanism.bodies) if k not in self.drawn]
        for body, ends in draw_sticks(self.mechanism, undrawn):
            self.lines.append(
                Line(self.mechanism.bodies[body].path, "geometry", ends, STICK, 0.008)
            )
        hints = self.model.model_visual_preferences.model_display_hints
        layers: dict[Layer, bool] = {
            "geometry": True,
            "contact": hints.show_contact_geometry,
            "wrap": hints.show_wrap_geometry,
            "markers": hints.show_markers,
            "paths": hints.show_path_geometry,
            "springs": hints.show_path_geometry,
            "frames": hints.show_frames,
        }
        scene = Scene(
            self.mechanism,
            self.surfaces,
            self.items,
            self.lines,
            self.axes,
            self.force_anchors,
            frozenset(layer for layer, is_shown in layers.items() if is_shown),
            frozenset(self.items[index].path for index in self.half_spaces),
            self.remarks,
        )
        # Half spaces are scaled last, when the size of the model is known.
        return self._widen_half_spaces(scene)

    # ------------------------------------------------------------------------------------- kinds of components
    def _add_component(self, component: Component, path: str) -> None:
        """Add the visible parts of a component to the scene, if it has any."""
        match component:
            # The axes of a frame belong to the layer "frames", which has its own switch.
            case geometry.FrameGeometry():
                pass
            case geometry.Geometry():
                self._add_geometry(component, path)
            case contact.ContactGeometry():
                self._add_contact_geometry(component, path)
            case wrapping.WrapObject():
                self._add_wrap_object(component, path)
            case Marker():
                body, point = self.mechanism.stations[path]
                color = self.model.model_visual_preferences.model_display_hints.marker_color
                self._add_item(
                    path,
                    "markers",
                    body,
                    unit_shapes.make_ball(),
                    _make_stretch((_MARKER_RADIUS,) * 3, point),
                    color,
                )
            case AbstractGeometryPath():
                self._add_path(component, path)
            case Force():
                self._add_force(component, path)
            # Only frames that are fixed to a body have a position in the mechanism.
            case PhysicalFrame() if path in self.mechanism.frames:
                self.axes.append(Axes(path, *self.mechanism.frames[path]))

    def _add_geometry(self, shape: geometry.Geometry, path: str) -> None:
        """Add a mesh, analytical shape or line that is attached to a frame, in its own colour.

        Raises:
            UnsupportedError: the shape is in a frame that is not fixed to a body, or is not
                supported.
        """
        frame = frame_of(self.tree, shape)
        if frame is None or frame not in self.mechanism.frames:
            raise UnsupportedError("is in a frame that is not fixed to a body")
        appearance = shape.appearance
        scale = np.array(shape.scale_factors, dtype=float)
        # 0 is OpenSim's number for hidden shapes.
        visible = appearance.visible and appearance.surface_properties.representation != 0
        body, frame_in_body = self.mechanism.frames[frame]
        if isinstance(shape, geometry_types.LineGeometry):
            ends = np.array((shape.start_point, shape.end_point), dtype=float) * scale
            self._add_line(path, "geometry", body, frame_in_body, ends, appearance.color, visible)
            return
        surface_index, size = self._make_shape(shape)
        self._add_item(
            path,
            "geometry",
            body,
            surface_index,
            frame_in_body @ _make_stretch(scale) @ size,
            appearance.color,
            appearance.opacity,
            visible,
        )

    def _add_contact_geometry(self, surface: contact.ContactGeometry, path: str) -> None:
        """Add a contact surface, translucent, and note half spaces, whose size depends on the rest of the scene."""
        body, frame_in_body = self._find_placement(surface, "socket_frame")
        transform = frame_in_body @ make_offset(surface.location, surface.orientation)
        appearance = surface.appearance
        opacity = CONTACT_OPACITY * appearance.opacity
        visible = appearance.visible and appearance.surface_properties.representation != 0
        if isinstance(surface, contact_types.ContactHalfSpace):
            self.half_spaces.append(len(self.items))
            opacity = HALF_SPACE_OPACITY * appearance.opacity
        surface_index, size = self._make_shape(surface)
        self._add_item(
            path,
            "contact",
            body,
            surface_index,
            transform @ size,
            appearance.color,
            opacity,
            visible,
        )

    def _add_wrap_object(self, surface: wrapping.WrapObject, path: str) -> None:
        """Add the translucent surface of a wrap object.

        Raises:
            UnsupportedError: the wrap object is not attached to a frame, or its shape is not
                supported.
        """
        # A wrap object belongs to a set of its body.
        frame = self.tree.parent_of(surface)
        while frame is not None and not isinstance(frame, PhysicalFrame):
            frame = self.tree.parent_of(frame)
        if frame is None:
            raise UnsupportedError("is not attached to a frame")
        body, frame_in_body = self.mechanism.frames[self.tree.path_of(frame) or ""]
        transform = frame_in_body @ make_offset(surface.translation, surface.xyz_body_rotation)
        surface_index, size = self._make_shape(surface)
        appearance = surface.appearance
        visible = (
            appearance.visible
            and appearance.surface_properties.representation != 0
            and surface.active
        )
        self._add_item(
            path,
            "wrap",
            body,
            surface_index,
            transform @ size,
            appearance.color,
            WRAP_OPACITY * appearance.opacity,
            visible,
        )

    def _make_shape(self, shape: Component) -> tuple[Surface, Array]:
        """Return a unit shape, and the matrix (4, 4) that scales it to the shape.

        Raises:
            UnsupportedError: osimlite does not draw shapes of this class, or the radius of a torus
                is not positive.
        """
        match shape:
            case geometry_types.Brick():
                return unit_shapes.make_cube(), _make_stretch(2.0 * np.array(shape.half_lengths))
            case geometry_types.Sphere() | contact_types.ContactSphere() | wrap_types.WrapSphere():
                return unit_shapes.make_ball(), _make_stretch((shape.radius,) * 3)
            case geometry_types.Ellipsoid() | contact_types.ContactEllipsoid():
                return unit_shapes.make_ball(), _make_stretch(shape.radii)
            case wrap_types.WrapEllipsoid():
                return unit_shapes.make_ball(), _make_stretch(shape.dimensions)
            case geometry_types.Cylinder():
                return unit_shapes.make_cylinder(), _TO_Z @ _make_stretch(
                    (shape.radius, shape.radius, 2.0 * shape.half_height)
                )
            case contact_types.ContactCylinder() | wrap_types.WrapCylinder():
                length = getattr(shape, "length", _ENDLESS_LENGTH_M)
                return unit_shapes.make_cylinder(), _make_stretch(
                    (shape.radius, shape.radius, length)
                )
            case contact_types.ContactTorus() if shape.torus_radius > 0.0:
                # A unit torus has the major radius 1, and is scaled by it.
                return unit_shapes.make_torus(
                    shape.tube_radius / shape.torus_radius
                ), _make_stretch((shape.torus_radius,) * 3)
            case wrap_types.WrapTorus() if shape.outer_radius > 0.0:
                # OpenSim's names mislead: inner_radius is the radius of the tube, outer_radius that
                # of the circle in its middle.
                return unit_shapes.make_torus(
                    shape.inner_radius / shape.outer_radius
                ), _make_stretch((shape.outer_radius,) * 3)
            case geometry.Mesh() | contact_types.ContactMesh():
                return self._read_mesh(
                    shape.mesh_file if isinstance(shape, geometry.Mesh) else shape.filename
                ), np.eye(4)
            case contact_types.ContactHalfSpace():
                return unit_shapes.make_square(), np.eye(4)
        raise UnsupportedError(
            f"is {add_article(type(shape).__name__)}, which osimlite does not draw"
        )

    def _add_path(self, path: AbstractGeometryPath, name: str) -> None:
        owner = self.tree.parent_of(path)
        traced_path = PATH.read(self.builder, owner)
        if not isinstance(traced_path, TraceablePath):
            raise UnsupportedError(
                f"is {add_article(type(path).__name__)}, which has a length but no points in space; "
                "OpenSim does not draw it either"
            )
        owner_path = (self.tree.path_of(owner) if owner is not None else None) or name
        # Hide the paths of disabled forces, which would look as if they pulled.
        visible = path.appearance.visible and getattr(owner, "appliesForce", True)
        result: list[Component | None] = []
        if isinstance(path, GeometryPath):
            result = [
                self.tree.target(wrap, "wrap_object", wrap.wrap_object)
                for wrap in path.path_wrap_set.objects
            ]
        wraps = tuple(self.tree.path_of(surface) or "" for surface in result if surface is not None)
        belly, tendon = _measure_fibers(owner) if isinstance(owner, Muscle) else (0.0, 0.0)
        self.lines.append(
            Line(
                owner_path,
                "paths",
                traced_path,
                path.appearance.color,
                0.0035,
                visible,
                wraps,
                belly,
                tendon,
            )
        )

    def _add_force(self, force: Force, path: str) -> None:
        """Add the line of a force between two points, and the anchor of a contact force."""
        match force:
            case springs.PointToPointSpring():
                self._add_line_between(
                    path, force, ("socket_body1", force.point1), ("socket_body2", force.point2)
                )
            case springs.ExpressionBasedPointToPointForce():
                self._add_line_between(
                    path, force, ("body1", force.point1), ("body2", force.point2)
                )
            case actuators.PointToPointActuator():
                self._add_line_between(
                    path, force, ("bodyA", force.pointA), ("bodyB", force.pointB)
                )
            case TwoFrameLinker():
                self._add_line_between(
                    path, force, ("socket_frame1", (0, 0, 0)), ("socket_frame2", (0, 0, 0))
                )
            case HuntCrossleyForce() | contact_forces.ElasticFoundationForce():
                spec = get_field_specs(type(force).ContactParameters)["geometry"]
                for parameters in force.contact_parameters.objects:
                    for index, geometry_name in enumerate(parameters.geometry):
                        # A HuntCrossleyForce names several surfaces.
                        result = self.tree.resolve(
                            Use(parameters, force, spec, geometry_name, index)
                        ).target
                        self._add_force_anchor(force.name, path, result, None)
            case contact_forces.SmoothSphereHalfSpaceForce():
                sphere = self.tree.target(force, "socket_sphere", force.socket_sphere)
                # Only the load on the sphere is shown; the half space has its opposite.
                self._add_force_anchor(force.name, path, sphere, "Sphere")

    def _add_line_between(self, path: str, force: Any, *ends: tuple[str, Any]) -> None:
        points = []
        for name, point in ends:
            body, frame_in_body = self._find_placement(force, name)
            points.append(
                LinePoint(
                    body,
                    frame_in_body[:3, :3] @ np.array(point, dtype=float) + frame_in_body[:3, 3],
                )
            )
        self.lines.append(
            Line(path, "springs", tuple(points), SPRING, 0.005, bool(force.appliesForce))
        )

    def _add_force_anchor(
        self, element: str, path: str, surface: Component | None, label: str | None
    ) -> None:
        if not isinstance(surface, contact.ContactGeometry) or isinstance(
            surface, contact_types.ContactHalfSpace
        ):
            return
        frame = self.tree.target(surface, "socket_frame", surface.socket_frame)
        body, frame_in_body = self.mechanism.placement(self.tree.path_of(frame) or "")
        # OpenSim's records are labelled by the frame, its body, or the surface.
        base = self.mechanism.bodies[body].name if body >= 0 else "ground"
        labels = (label,) if label else (frame.name, base, surface.name)
        surface_center = (frame_in_body @ make_offset(surface.location, surface.orientation))[:3, 3]
        self.force_anchors.append(
            ForceAnchor(
                element, path, body, labels, surface_center, self.tree.path_of(surface) or ""
            )
        )

    # ----------------------------------------------------------------------------------------------- helpers
    @contextmanager
    def _remark_failure(self, path: str) -> Iterator[None]:
        """Turn an error about one component into a remark."""
        try:
            yield
        except OsimliteError as error:
            self.remarks.append((path, error.message))

    def _add_item(
        self,
        path: str,
        layer: Layer,
        body: int,
        surface: Surface,
        matrix: Array,
        color: Color,
        opacity: float = 1.0,
        visible: bool = True,
    ) -> None:
        """Add a surface to the scene in the frame of a body.

        Args:
            path: path of the component that it shows.
            layer: layer that the viewer can switch off.
            body: index of the body that carries it, -1 for ground.
            surface: surface in its own frame, m.
            matrix: affine matrix (4, 4) from that frame to the body, m.
            color: red, green and blue, 0 to 1.
            opacity: 0 to 1; clipped.
            visible: whether the viewer shows it at first.

        Raises:
            ModelError: the matrix has a number that is not finite.
        """
        # NaN in a matrix would spoil the picture and the page.
        if not np.isfinite(matrix).all():
            raise ModelError("has a size or position that is not a finite number")
        # Unit shapes are shared by all components that use them.
        if id(surface) not in self.surface_indices:
            self.surface_indices[id(surface)] = len(self.surfaces)
            self.surfaces.append(surface)
        opacity = min(max(float(opacity), 0.0), 1.0)
        self.items.append(
            Item(
                path,
                layer,
                body,
                self.surface_indices[id(surface)],
                matrix,
                color,
                opacity,
                visible,
            )
        )
        if layer == "geometry" and visible:
            self.drawn.add(body)

    def _add_line(
        self,
        path: str,
        layer: Layer,
        body: int,
        frame_in_body: Array,
        ends: Array,
        color: Color,
        visible: bool,
    ) -> None:
        points = tuple(
            LinePoint(body, frame_in_body[:3, :3] @ end + frame_in_body[:3, 3]) for end in ends
        )
        self.lines.append(Line(path, layer, points, color, 0.003, visible))

    def _read_mesh(self, name: str) -> Surface:
        """Return the mesh in a file; one object for each file.

        Raises:
            ModelError: no folder has the mesh file.
        """
        result = self.folders.find(name)
        if result is None:
            raise ModelError(
                f"the mesh file {name} was not found; name its folder {MESH_FOLDER_HINT}"
            )
        if result not in self.meshes:
            self.meshes[result] = read_surface(result)
        return self.meshes[result]

    def _find_placement(self, owner: Component, socket: str) -> tuple[int, Array]:
        value = getattr(owner, socket)
        if not value:
            raise ModelError(f"names no frame as {socket}")
        frame = self.tree.target(owner, socket, value)
        return self.mechanism.placement(self.tree.path_of(frame) or "")

    def _find_coordinate(self, owner: Component, socket: str) -> int:
        result = self.tree.target(owner, socket, getattr(owner, socket))
        return self.mechanism.coordinate_index(self.tree.path_of(result) or "")

    def _widen_half_spaces(self, scene: Scene) -> Scene:
        """Scale the half spaces of a scene to the size of the model, in place.

        Returns:
            The same scene.
        """
        if self.half_spaces:
            lowest, highest = scene.compute_box(scene.mechanism.values({}))
            width = max(1.0, WIDTH_OF_HALF_SPACE * float(np.linalg.norm(highest - lowest)))
            for index in self.half_spaces:
                matrix = self.items[index].matrix
                # Move the surface inwards: a floor mesh in the same plane would flicker through it
                # (z-fighting).
                matrix[:3, 3] += 0.002 * width * matrix[:3, 0]
                matrix[:3, :3] *= width
        return scene


def _measure_fibers(muscle: Muscle) -> tuple[float, float]:
    """Return the drawn radius of the fibers in their middle and the tendon slack length, both in m."""
    force, tendon = abs(float(muscle.max_isometric_force)), abs(float(muscle.tendon_slack_length))
    # The cross-section A = F / stress gives the radius of a circle.
    radius = (
        DRAWN_RADIUS_FRACTION * math.sqrt(force / (math.pi * SPECIFIC_TENSION_PA))
        if math.isfinite(force)
        else MAX_RADIUS_M
    )
    return min(max(radius, 0.0035), MAX_RADIUS_M), tendon if math.isfinite(tendon) else 0.0


def _make_stretch(size: Any, translation: Any = (0.0, 0.0, 0.0)) -> Array:
    """Return the matrix (4, 4) that scales along the axes and then translates."""
    matrix = np.diag((*np.asarray(size, dtype=float).tolist(), 1.0))
    matrix[:3, 3] = translation
    return matrix
