"""Mesh files of a model, converted for robot programs."""

from __future__ import annotations

from pathlib import Path

from osimlite.base.files import MESH_FOLDER_HINT, read_file
from osimlite.base.records import dataclass, field
from osimlite.errors import OsimliteError
from osimlite.io.meshes.folders import MeshFolders, read_surface
from osimlite.io.meshes.stl import format_binary_stl, is_binary, read_stl_corners
from osimlite.io.meshes.surface import Array, Surface
from osimlite.simulation.robot.names import legal

MESH_FOLDER = "meshes"
"""Folder of the mesh files, beside the robot's own file."""

_WRITTEN = {".obj": ".obj", ".stl": ".stl", ".vtp": ".obj"}
"""Suffix of the written file by the suffix of a mesh file that OpenSim reads."""

Signs = tuple[float, float, float]
"""Signs of the scale factors along the axes; negative ones mirror a mesh."""


class MeshProblem(Exception):
    """Error of a mesh that cannot be used; the message says what was done instead."""


@dataclass(frozen=True, slots=True)
class MeshCopy:
    """Mesh file of the robot.

    Attributes:
        file: path relative to the robot's own file.
        source: mesh file that the model refers to.
        converted: phrase that describes the conversion, or "".
        misspelt: whether the name of the file differs from that in the model in capitals or
            slashes.
    """

    file: str
    source: Path
    converted: str
    misspelt: bool


@dataclass
class MeshFiles:
    """Mesh files for a robot, each written once.

    Attributes:
        folders: folders in which the files are searched.
        files: contents by name relative to the robot's own file.
        corners: corners (t, 3, 3) of the t triangles of each file, m, by the same name.
    """

    folders: MeshFolders = field(default_factory=MeshFolders)
    files: dict[str, bytes] = field(default_factory=dict)
    corners: dict[str, Array] = field(default_factory=dict)
    _made: dict[tuple[object, ...], str] = field(default_factory=dict)

    def copy(self, name: str, signs: Signs = (1.0, 1.0, 1.0)) -> MeshCopy:
        """Convert a file that the model names.

        Args:
            name: name in the model.
            signs: signs of the scale factors; negative ones are applied to the file, because not
                every program accepts them.

        Returns:
            The copy.

        Raises:
            MeshProblem: the file does not exist, or cannot be converted.
        """
        kind = Path(name.replace("\\", "/")).suffix.lower()
        if kind not in _WRITTEN:
            raise MeshProblem(
                f"left out: osimlite, like OpenSim, does not read {kind or 'such'} files"
            )
        try:
            source = self.folders.find(name)
            if source is None:
                raise MeshProblem(
                    "left out: the file is neither beside the model, nor in its folder Geometry, nor in the folders "
                    f"named {MESH_FOLDER_HINT}"
                )
            content, corners, converted = _convert_mesh(source, kind, signs)
        except OsimliteError as error:
            raise MeshProblem(f"left out: {error}") from None
        file = self.add((str(source), signs), source.stem, _WRITTEN[kind], content, corners)
        # The file was found in another letter case.
        misspelt = not source.as_posix().endswith(Path(name).as_posix().removeprefix("./"))
        return MeshCopy(file, source, converted, misspelt)

    def name_of_stretched(self, name: str, shape: Surface, size: tuple[float, float, float]) -> str:
        """Return the name of the file of a unit shape that is stretched along its axes.

        Args:
            name: name of the shape.
            shape: surface of the unit shape.
            size: factors along the axes, m.

        Returns:
            Name relative to the robot's own file.
        """
        stretched = shape.stretch(size)
        return self.add(
            (name, *size), name, ".obj", stretched.obj().encode(), stretched.list_corners()
        )

    def add(
        self, key: tuple[object, ...], stem: str, kind: str, content: bytes, corners: Array
    ) -> str:
        """Return the name of a mesh file, and add the file if it is new.

        Args:
            key: properties that determine the content; equal keys share one file.
            stem: name without suffix.
            kind: suffix.
            content: content of the file.
            corners: corners (t, 3, 3) of its triangles, m.

        Returns:
            Name relative to the robot's own file. It differs from all others even where capitals do
            not count.
        """
        if key not in self._made:
            # Names that differ by case only are one file on Windows and macOS.
            used_names = {name.casefold() for name in self.files}
            base = f"{MESH_FOLDER}/{legal(stem)}"
            name = f"{base}{kind}"
            count = 1
            while name.casefold() in used_names:
                count += 1
                name = f"{base}_{count}{kind}"
            self._made[key] = name
            self.files[name] = content
            self.corners[name] = corners
        return self._made[key]


def _convert_mesh(source: Path, kind: str, signs: Signs) -> tuple[bytes, Array, str]:
    """Return the content of a converted mesh file.

    Args:
        source: mesh file to convert.
        kind: suffix of the file.
        signs: signs of the scale factors.

    Returns:
        Content, corners (t, 3, 3) of the triangles, and a phrase that says what was converted, or
        "".
    """
    if kind == ".stl":
        content = read_file(source)
        binary = format_binary_stl(content, source.name, signs)
        corners = read_stl_corners(binary, source.name)
        return binary, corners, "" if is_binary(content) else "written as a binary STL file"
    surface = read_surface(source)
    # Mirrored triangles must be turned around, which a scale in URDF does not do.
    if min(signs) < 0.0:
        surface = surface.stretch(signs)
    converted = "written as an OBJ file of triangles" if kind == ".vtp" else ""
    return surface.obj().encode(), surface.list_corners(), converted
