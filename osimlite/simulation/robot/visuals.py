"""Shapes of bodies for drawing, from the geometry attached to the frames of a model."""

from __future__ import annotations

from collections.abc import Sequence
from math import copysign
from typing import Protocol

import numpy as np

from osimlite.base.records import dataclass, field
from osimlite.io.meshes.unit_shapes import make_ball, make_cylinder
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array, make_transform, rotation_about
from osimlite.schema.frames import Frame
from osimlite.schema.geometry import FrameGeometry, Geometry, Mesh
from osimlite.schema.geometry_types import Brick, Cylinder, Ellipsoid, Sphere
from osimlite.schema.model import Model
from osimlite.schema.tree import Tree
from osimlite.simulation.robot.mesh_files import MeshFiles, MeshProblem
from osimlite.simulation.robot.robot import Ball, Box, MeshFile, Shape, Tube, Visual

_Y_TO_Z = make_transform(rotation_about(np.array((1.0, 0.0, 0.0)), -np.pi / 2))
"""Frame in OpenSim's cylinder frame, whose cylinders are along Y, in which the cylinder is along Z."""
# The cosine of a right angle rounds to 6e-17, which would be written into files.
_Y_TO_Z[np.abs(_Y_TO_Z) < 1e-15] = 0.0

MAX_SIZE_M = 3e38
"""Largest size, m: programs draw in numbers of single precision."""


class NoteWriter(Protocol):
    """Function that records what a shape cannot express.

    `osimlite.translate.fidelity.Fidelity.add` is one.
    """

    def __call__(
        self, kind: str, component: str, cannot_say: str, done: str, detail: str = ""
    ) -> None:
        """Record a loss; the arguments are those of a record of the translation.

        Args:
            kind: kind of the loss.
            component: path of the component.
            cannot_say: property that the format cannot express.
            done: replacement of this property in the output.
            detail: details.
        """


def _ignore_note(kind: str, component: str, cannot_say: str, done: str, detail: str = "") -> None:
    """Ignore a note; the default of :func:`collect_visuals`."""


@dataclass
class Visuals:
    """Shapes of a model, and the mesh files that they need.

    Attributes:
        by_body: shapes by absolute path of the body (or ``"/ground"``).
        files: mesh files by relative name.
    """

    by_body: dict[str, list[Visual]] = field(default_factory=dict)
    files: dict[str, bytes] = field(default_factory=dict)


def collect_visuals(
    model: Model,
    mechanism: Mechanism,
    note: NoteWriter = _ignore_note,
    mesh_files: MeshFiles | None = None,
) -> Visuals:
    """Collect the shapes of a model, each placed in the frame of the body that carries it.

    Args:
        model: model with the shapes.
        mechanism: mechanism of the same model.
        note: function that is called for each shape that cannot be drawn.
        mesh_files: converter of mesh files, with the folders to search; if None, no mesh file is
            found.

    Returns:
        Shapes and mesh files.
    """
    return _Collector(model, mechanism, note, mesh_files or MeshFiles()).collect()


class _Collector:
    """Collector of the shapes of one model; for the arguments see :func:`collect_visuals`."""

    def __init__(
        self, model: Model, mechanism: Mechanism, note: NoteWriter, mesh_files: MeshFiles
    ) -> None:
        self.tree = model.tree()
        self.mechanism = mechanism
        self.note = note
        self.mesh_files = mesh_files
        self.visuals = Visuals(files=mesh_files.files)

    def collect(self) -> Visuals:
        # Axes of frames are no shapes of bodies.
        for component in self.tree.components:
            if isinstance(component, Geometry) and not isinstance(component, FrameGeometry):
                self._add(component, self.tree.path_of(component) or component.name)
        return self.visuals

    def _add(self, geometry: Geometry, path: str) -> None:
        note = self.note
        frame = frame_of(self.tree, geometry)
        if frame is None or frame not in self.mechanism.frames:
            note("visual", path, "a shape in a frame that is not fixed to a body", "left out")
            return
        appearance = geometry.appearance
        if not appearance.visible:
            note("hidden-visual", path, "a hidden shape", "left out")
            return
        shape_and_frame = self._shape(geometry, path)
        if shape_and_frame is None:
            return
        shape, shape_frame = shape_and_frame
        surface = appearance.surface_properties
        # 3 is OpenSim's number for filled surfaces.
        if surface.representation != 3 or surface.texture:
            note(
                "appearance",
                path,
                "a shape drawn as points or lines, or with a texture",
                "filled, in its colour",
            )
        body, where = self.mechanism.frames[frame]
        owner = "/ground" if body < 0 else self.mechanism.bodies[body].path
        # Colours outside of 0 to 1 are refused by some programs.
        red, green, blue, opacity = (
            min(max(part, 0.0), 1.0) for part in (*appearance.color, appearance.opacity)
        )
        visual = Visual(shape, where @ shape_frame, (red, green, blue, opacity), path)
        self.visuals.by_body.setdefault(owner, []).append(visual)

    def _shape(self, geometry: Geometry, path: str) -> tuple[Shape, Array] | None:
        """Return the shape of a geometry, and its frame in the frame of the geometry.

        Args:
            geometry: the geometry.
            path: path of the geometry in the model.

        Returns:
            Shape and frame (4, 4); None if it cannot be drawn, which is noted.
        """
        note = self.note
        identity = np.eye(4)
        # The sign of a scale mirrors, which matters for meshes only.
        scale = tuple(abs(factor) for factor in geometry.scale_factors)
        match geometry:
            case Brick():
                x, y, z = sizes = tuple(
                    2.0 * half * by for half, by in zip(geometry.half_lengths, scale, strict=True)
                )
                return (Box((x, y, z)), identity) if self._is_drawable(path, sizes) else None
            case Sphere() | Ellipsoid():
                radii = (geometry.radius,) * 3 if isinstance(geometry, Sphere) else geometry.radii
                a, b, c = sizes = tuple(
                    radius * factor for radius, factor in zip(radii, scale, strict=True)
                )
                if not self._is_drawable(path, sizes):
                    return None
                if a == b == c:
                    return Ball(a), identity
                file = self.mesh_files.name_of_stretched("ellipsoid", make_ball(), (a, b, c))
                note(
                    "ellipsoid",
                    path,
                    "an ellipsoid",
                    "written as a mesh file",
                    f"{file}, half axes {sizes} m",
                )
                return MeshFile(file), identity
            case Cylinder():
                # OpenSim's X, Y, Z are the X, Z, -Y of a frame in which the cylinder lies along Z.
                a, b, length = sizes = (
                    geometry.radius * scale[0],
                    geometry.radius * scale[2],
                    2 * geometry.half_height * scale[1],
                )
                if not self._is_drawable(path, sizes):
                    return None
                if a == b:
                    return Tube(a, length), _Y_TO_Z
                file = self.mesh_files.name_of_stretched(
                    "elliptic_cylinder", make_cylinder(), (a, b, length)
                )
                note(
                    "elliptic-cylinder",
                    path,
                    "a cylinder whose cross section is not a circle",
                    "written as a mesh file",
                    file,
                )
                return MeshFile(file), _Y_TO_Z
            case Mesh():
                return self._mesh(geometry, path)
        note("visual", path, f"a shape of class {type(geometry).__name__}", "left out")
        return None

    def _is_drawable(self, path: str, sizes: Sequence[float]) -> bool:
        """Return whether programs can draw a shape of these sizes; note it otherwise.

        Args:
            path: path of the geometry.
            sizes: sizes of the shape, m.
        """
        if all(0.0 < size < MAX_SIZE_M for size in sizes):
            return True
        size_text = " ".join(f"{size:g}" for size in sizes)
        self.note(
            "visual",
            path,
            "a shape whose size is not a positive number",
            "left out",
            f"{size_text} m",
        )
        return False

    def _mesh(self, geometry: Mesh, path: str) -> tuple[Shape, Array] | None:
        shape = mesh_shape(
            geometry.mesh_file, path, self.mesh_files, self.note, geometry.scale_factors
        )
        return None if shape is None else (shape, np.eye(4))


def frame_of(tree: Tree, geometry: Geometry) -> str | None:
    """Return the path of the frame that a shape is in.

    It is the frame that its socket names, else the component above it if that is a frame.

    Args:
        tree: component tree of the model.
        geometry: the shape.

    Returns:
        The path; None if there is no frame.

    Raises:
        ModelError: the socket names no component.
    """
    # ".." is the default: the frame around the geometry.
    socket = geometry.socket_frame
    if socket and not (isinstance(socket, str) and socket.strip() == ".."):
        return tree.path_of(tree.target(geometry, "socket_frame", socket))
    above = tree.parent_of(geometry)
    return tree.path_of(above) if isinstance(above, Frame) else None


def mesh_shape(
    name: str,
    path: str,
    mesh_files: MeshFiles,
    note: NoteWriter,
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0),
) -> MeshFile | None:
    """Return a mesh file of the model as a shape.

    Args:
        name: name of the file in the model.
        path: absolute path of the component that names it.
        mesh_files: converter of mesh files, with the folders to search.
        note: function that is called for each change and for a file that cannot be used.
        scale: factors along the axes; negative ones mirror the surface.

    Returns:
        The shape; None if the file cannot be used, which is noted.
    """
    signs = (copysign(1.0, scale[0]), copysign(1.0, scale[1]), copysign(1.0, scale[2]))
    try:
        copy = mesh_files.copy(name, signs)
    except MeshProblem as problem:
        note("mesh", path, "a mesh whose file cannot be used", str(problem), name)
        return None
    if copy.converted:
        form = (
            "VTK's format"
            if copy.source.suffix.lower() == ".vtp"
            else "a file format that not every program reads"
        )
        note("mesh-format", path, f"a mesh in {form}", copy.converted, f"{name} as {copy.file}")
    if copy.misspelt:
        note(
            "mesh-name",
            path,
            "a file name that differs from the file's real name in capitals or slashes",
            "the file with the real name used",
            f"{name} as {copy.source.name}",
        )
    x, y, z = (abs(factor) for factor in scale)
    return MeshFile(copy.file, (x, y, z))
