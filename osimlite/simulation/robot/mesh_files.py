"""The mesh files that a model names, made readable for robot programs."""

from __future__ import annotations

from pathlib import Path

from osimlite.base.files import MESH_FOLDER_HINT, read_file
from osimlite.base.records import dataclass, field
from osimlite.errors import OsimliteError
from osimlite.io.meshes.folders import MeshFolders, read_surface
from osimlite.io.meshes.stl import format_binary_stl, is_binary
from osimlite.io.meshes.surface import Surface
from osimlite.simulation.robot.names import legal

MESH_FOLDER = "meshes"
"""Folder of the mesh files, beside the robot's own file."""

_WRITTEN = {".obj": ".obj", ".stl": ".stl", ".vtp": ".obj"}
"""Kinds of mesh files that OpenSim reads, and what they become."""

Signs = tuple[float, float, float]


class MeshProblem(Exception):
    """Why a mesh cannot be had, as what was done about it."""


@dataclass(frozen=True, slots=True)
class MeshCopy:
    """A mesh file of the robot."""

    file: str  # relative to the robot's own file
    source: Path  # where it was found
    converted: str  # what was done to it, or ""
    misspelt: bool  # whether its name has other capitals or slashes than the model says


@dataclass
class MeshFiles:
    """Mesh files for a robot, each once, and each written from what was read of it."""

    folders: MeshFolders = field(default_factory=MeshFolders)  # where files may be
    # contents by name relative to the robot's own file
    files: dict[str, bytes] = field(default_factory=dict)
    _made: dict[tuple[object, ...], str] = field(default_factory=dict)

    def copy(self, name: str, signs: Signs = (1.0, 1.0, 1.0)) -> MeshCopy:
        """Take over a file that the model names.

        Args:
            name: as in the model.
            signs: of the scale factors; negative ones are put into the file.

        Raises:
            MeshProblem: it is not there, or nothing can be made of it.
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
            content, converted = _written(source, kind, signs)
        except OsimliteError as error:
            raise MeshProblem(f"left out: {error}") from None
        file = self.add((str(source), signs), source.stem, _WRITTEN[kind], content)
        misspelt = not source.as_posix().endswith(Path(name).as_posix().removeprefix("./"))
        return MeshCopy(file, source, converted, misspelt)

    def name_of_stretched(self, name: str, shape: Surface, size: tuple[float, float, float]) -> str:
        """Relative name of the file of a unit shape that is stretched along its axes."""
        return self.add((name, *size), name, ".obj", shape.stretch(size).obj().encode())

    def add(self, key: tuple[object, ...], stem: str, kind: str, content: bytes) -> str:
        """Relative name of a mesh file, the same for the same key and unlike any other, whatever the capitals."""
        if key not in self._made:
            taken = {name.casefold() for name in self.files}
            base = f"{MESH_FOLDER}/{legal(stem)}"
            name, count = f"{base}{kind}", 1
            while name.casefold() in taken:
                count += 1
                name = f"{base}_{count}{kind}"
            self._made[key] = name
            self.files[name] = content
        return self._made[key]


def _written(source: Path, kind: str, signs: Signs) -> tuple[bytes, str]:
    """What is written of a file, and what was done to it."""
    if kind == ".stl":
        content = read_file(source)
        binary = format_binary_stl(content, source.name, signs)
        return binary, "" if is_binary(content) else "written as a binary STL file"
    surface = read_surface(source)
    text = (surface.stretch(signs) if min(signs) < 0.0 else surface).obj().encode()
    return text, "written as an OBJ file of triangles" if kind == ".vtp" else ""
