"""The mesh files that a model names: found where OpenSim looks for them, and made readable for robot programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from osimlite.errors import OsimliteError
from osimlite.files import GEOMETRY_VARIABLE, named_mesh_folders
from osimlite.translate.passes.names import legal
from osimlite.translate.stl import binary_stl
from osimlite.translate.vtp import read_vtp

MESH_FOLDER = "meshes"
"""Folder of the mesh files, beside the robot's own file."""

_WRITTEN = {".obj": ".obj", ".stl": ".stl", ".vtp": ".obj"}
"""Kinds of mesh files that OpenSim reads, and what they become."""

Signs = tuple[float, float, float]


def geometry_folders(beside: Path | None, more: Sequence[Path] = ()) -> tuple[Path, ...]:
    """Folders of mesh files in the order of the search.

    OpenSim's order: the model's folder, its folder ``Geometry``, then those that the user adds.

    Args:
        beside: the folder of the model's file; None if it has none.
        more: folders that the user names; those in the environment variable follow them.
    """
    own = () if beside is None else (beside, beside / "Geometry")
    return (*own, *more, *named_mesh_folders())


def find_file(name: str, folders: Sequence[Path]) -> Path | None:
    """The first file of this name, in any of the folders; failing that, one spelled with other capitals or slashes.

    Args:
        name: relative to a folder, or absolute.
        folders: looked into in this order.
    """
    if Path(name).is_absolute():
        return Path(name) if _is_file(Path(name)) else None
    exact = next((folder / name for folder in folders if _is_file(folder / name)), None)
    if exact is not None:
        return exact
    parts = Path(name.replace("\\", "/")).parts
    return next((found for folder in folders for found in [_descend(folder, parts)] if found is not None), None)


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        # A name that is too long, or has a character that no file name has.
        return False


def _descend(folder: Path, parts: Sequence[str]) -> Path | None:
    """The file below a folder whose path has these parts, in any capitals."""
    if not parts:
        return folder if _is_file(folder) else None
    try:
        entries = sorted(folder.iterdir())
    except OSError:
        return None
    near = [entry for entry in entries if entry.name.casefold() == parts[0].casefold()]
    near = near or [folder / part for part in parts[:1] if part == ".."]
    return next((found for entry in near for found in [_descend(entry, parts[1:])] if found is not None), None)


class MeshProblem(Exception):
    """Why a mesh cannot be had, as what was done about it."""


@dataclass(frozen=True, slots=True)
class MeshCopy:
    """A mesh file of the robot.

    Attributes:
        file: relative to the robot's own file.
        source: where it was found.
        converted: what was done to it, or "".
        mirrored: whether the negative signs asked for are in the file.
        misspelt: whether its name has other capitals or slashes than the model says.
    """

    file: str
    source: Path
    converted: str
    mirrored: bool
    misspelt: bool


@dataclass
class MeshFiles:
    """Mesh files for a robot, each once.

    Attributes:
        folders: where files are looked for.
        files: contents by name relative to the robot's own file.
    """

    folders: Sequence[Path] = ()
    files: dict[str, bytes] = field(default_factory=dict)
    _made: dict[tuple[object, ...], str] = field(default_factory=dict)

    def copy(self, name: str, signs: Signs = (1.0, 1.0, 1.0)) -> MeshCopy:
        """Take over a file that the model names.

        Args:
            name: as in the model.
            signs: of the scale factors, to be put into the file if it has to be written anew anyway.

        Raises:
            MeshProblem: it is not there, or nothing can be made of it.
        """
        kind = Path(name.replace("\\", "/")).suffix.lower()
        if kind not in _WRITTEN:
            raise MeshProblem(f"left out: osimlite, like OpenSim, does not read {kind or 'such'} files")
        source = find_file(name, self.folders)
        if source is None:
            raise MeshProblem(
                "left out: the file is neither beside the model, nor in its folder Geometry, nor in the folders "
                f"named by --geometry or {GEOMETRY_VARIABLE}"
            )
        try:
            content, converted = source.read_bytes(), ""
            if kind == ".vtp":
                content, converted = _obj(content, source.name, signs), "written as an OBJ file of triangles"
            elif kind == ".stl":
                binary = binary_stl(content, source.name, signs)
                content, converted = binary, "" if binary is content else "written as a binary STL file"
        except OSError as error:
            raise MeshProblem(f"left out: {error.strerror}") from None
        except OsimliteError as error:
            raise MeshProblem(f"left out: {error}") from None
        as_it_is = kind == ".obj"
        file = self.add((str(source), () if as_it_is else signs), source.stem, _WRITTEN[kind], content)
        misspelt = not source.as_posix().endswith(Path(name).as_posix().removeprefix("./"))
        return MeshCopy(file, source, converted, mirrored=not as_it_is, misspelt=misspelt)

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


def _obj(content: bytes, name: str, signs: Signs) -> bytes:
    surface = read_vtp(content, name)
    return (surface.mirrored(signs) if min(signs) < 0.0 else surface).obj().encode()
