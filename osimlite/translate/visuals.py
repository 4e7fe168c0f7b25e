"""What bodies look like, taken from the geometry attached to the frames of a model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from osimlite.multibody.mechanism import Mechanism
from osimlite.multibody.spatial import Array, rotation_about, transform
from osimlite.schema.frames import Frame
from osimlite.schema.geometry import Brick, Cylinder, Ellipsoid, FrameGeometry, Geometry, Mesh, Sphere
from osimlite.schema.model import Model
from osimlite.translate import meshes
from osimlite.translate.fidelity import Fidelity
from osimlite.translate.shapes import Ball, Box, MeshFile, Shape, Tube, Visual

MESH_FOLDER = "meshes"
"""Folder of the mesh files, beside the robot's own file."""

READABLE = (".obj", ".stl")
"""Kinds of mesh files that robot programs read as they are."""

_Y_TO_Z = transform(rotation_about(np.array((1.0, 0.0, 0.0)), -np.pi / 2))
"""The frame, in OpenSim's cylinder frame, in which the cylinder lies along Z."""
_Y_TO_Z[np.abs(_Y_TO_Z) < 1e-15] = 0.0


@dataclass
class Visuals:
    """Shapes by absolute path of the body (or ``"/ground"``), and the mesh files they need, by relative name."""

    by_body: dict[str, list[Visual]] = field(default_factory=dict)
    files: dict[str, bytes] = field(default_factory=dict)


def collect_visuals(
    model: Model, mechanism: Mechanism, fidelity: Fidelity | None = None, folders: Sequence[Path] = ()
) -> Visuals:
    """Gather the shapes of a model, each placed in the frame of the body that carries it.

    Args:
        model: where the geometry is.
        mechanism: of the same model; knows where frames are.
        fidelity: is told of what cannot be drawn.
        folders: where mesh files are looked for.
    """
    account = Fidelity(model.name, "picture") if fidelity is None else fidelity
    return _Collector(model, mechanism, account, folders).collect()


class _Collector:
    def __init__(self, model: Model, mechanism: Mechanism, fidelity: Fidelity, folders: Sequence[Path]) -> None:
        self.tree = model.tree()
        self.mechanism = mechanism
        self.fidelity = fidelity
        self.folders = folders
        self.found = Visuals()
        self._made: dict[tuple[object, ...], str] = {}

    def collect(self) -> Visuals:
        for component in self.tree.components:
            if isinstance(component, Geometry) and not isinstance(component, FrameGeometry):
                self._add(component, self.tree.path_of(component) or component.name)
        return self.found

    def _add(self, geometry: Geometry, path: str) -> None:
        note = self.fidelity.add
        frame = self._frame(geometry)
        if frame is None or frame not in self.mechanism.frames:
            note("visual", path, "a shape in a frame that is not fixed to a body", "left out")
            return
        appearance = geometry.appearance
        if not appearance.visible:
            note("hidden-visual", path, "a shape that is there but not shown", "left out")
            return
        made = self._shape(geometry, path)
        if made is None:
            return
        shape, placed = made
        surface = appearance.surface_properties
        if surface.representation != 3 or surface.texture:
            note("appearance", path, "a shape drawn as points or lines, or with a texture", "filled, in its colour")
        body, where = self.mechanism.frames[frame]
        owner = "/ground" if body < 0 else self.mechanism.bodies[body].path
        visual = Visual(shape, where @ placed, (*appearance.color, appearance.opacity), path)
        self.found.by_body.setdefault(owner, []).append(visual)

    def _frame(self, geometry: Geometry) -> str | None:
        """Path of the frame a shape is in: the one its socket names, else the component above that is a frame."""
        socket = geometry.socket_frame
        if socket and not (isinstance(socket, str) and socket.strip() == ".."):
            return self.tree.path_of(self.tree.target(geometry, "socket_frame", socket))
        above = self.tree.parent_of(geometry)
        return self.tree.path_of(above) if isinstance(above, Frame) else None

    def _shape(self, geometry: Geometry, path: str) -> tuple[Shape, Array] | None:
        """The shape, and its frame in the frame of the geometry."""
        note, here = self.fidelity.add, np.eye(4)
        scale = tuple(abs(factor) for factor in geometry.scale_factors)
        match geometry:
            case Brick():
                x, y, z = (2.0 * half * factor for half, factor in zip(geometry.half_lengths, scale, strict=True))
                return Box((x, y, z)), here
            case Sphere() | Ellipsoid():
                own = (geometry.radius,) * 3 if isinstance(geometry, Sphere) else geometry.radii
                radii = tuple(radius * factor for radius, factor in zip(own, scale, strict=True))
                if radii[0] == radii[1] == radii[2]:
                    return Ball(radii[0]), here
                file = self._mesh_file("ellipsoid", radii, meshes.ellipsoid(radii))
                note("ellipsoid", path, "an ellipsoid", "written as a mesh file", f"{file}, half axes {radii} m")
                return MeshFile(file), here
            case Cylinder():
                # OpenSim's X, Y, Z are the X, Z, -Y of a frame in which the cylinder lies along Z.
                a, b, length = (
                    geometry.radius * scale[0],
                    geometry.radius * scale[2],
                    2 * geometry.half_height * scale[1],
                )
                if a == b:
                    return Tube(a, length), _Y_TO_Z
                file = self._mesh_file("elliptic_cylinder", (a, b, length), meshes.elliptic_cylinder((a, b), length))
                note("elliptic-cylinder", path, "a cylinder that is not round", "written as a mesh file", file)
                return MeshFile(file), _Y_TO_Z
            case Mesh():
                return self._mesh(geometry, path)
        note("visual", path, f"a shape of class {type(geometry).__name__}", "left out")
        return None

    def _mesh(self, geometry: Mesh, path: str) -> tuple[Shape, Array] | None:
        name = geometry.mesh_file
        missing, note = f"a mesh in the file {name}", self.fidelity.add
        kind = Path(name).suffix.lower()
        if kind not in READABLE:
            note("mesh", path, missing, f"left out: robot programs do not read {kind or 'such'} files")
            return None
        source = next((folder / name for folder in self.folders if (folder / name).is_file()), None)
        if source is None:
            note("mesh", path, missing, "left out: the file is not beside the model, nor in its Geometry folder")
            return None
        try:
            content = source.read_bytes()
        except OSError as error:
            note("mesh", path, missing, f"left out: {error.strerror}")
            return None
        if min(geometry.scale_factors) < 0.0:
            note("mesh", path, "a mirrored mesh", "a negative scale, which not every program understands")
        file = self._named((str(source),), Path(name).stem, kind, content)
        return MeshFile(file, geometry.scale_factors), np.eye(4)

    def _mesh_file(self, name: str, key: tuple[float, ...], content: str) -> str:
        return self._named((name, *key), name, ".obj", content.encode())

    def _named(self, key: tuple[object, ...], stem: str, kind: str, content: bytes) -> str:
        """Relative name of a mesh file, the same for the same key and unlike any other."""
        if key not in self._made:
            name, count = f"{MESH_FOLDER}/{stem}{kind}", 1
            while name in self.found.files:
                count += 1
                name = f"{MESH_FOLDER}/{stem}_{count}{kind}"
            self._made[key] = name
            self.found.files[name] = content
        return self._made[key]
