"""Search for the mesh files of a model as OpenSim does, and reading of their surfaces."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from osimlite.base.files import MESH_FOLDER_HINT, list_mesh_folders, read_file
from osimlite.base.records import dataclass
from osimlite.errors import OsimliteError

if TYPE_CHECKING:
    from osimlite.io.meshes.surface import Surface


class OutsideError(OsimliteError):
    """Error for a mesh file outside of the folders that a model may use."""


@dataclass(frozen=True)
class MeshFolders:
    """Folders in which the mesh files of a model are searched."""

    model_folder: Path | None = None  # folder of the model file; None for a model without one
    # Folders that the user names; those in the environment variable follow them.
    named: Sequence[str | Path] = ()

    @property
    def searched(self) -> tuple[Path, ...]:
        """Folders in OpenSim's order: that of the model, its folder ``Geometry``, those of the user.

        Returns:
            The folders in the order of the search.
        """
        model_folders = (
            () if self.model_folder is None else (self.model_folder, self.model_folder / "Geometry")
        )
        return (*model_folders, *self._user_folders)

    @property
    def _user_folders(self) -> tuple[Path, ...]:
        return (*map(Path, self.named), *list_mesh_folders())

    def find(self, name: str) -> Path | None:
        """Return the first file with a name, otherwise one that differs in letter case or slashes; None without any.

        A downloaded model must not reveal other files of the machine: wherever an absolute name, ``..`` or
        a link leads, the file itself must be in the model's folder or in one that the user names.

        Args:
            name: path relative to a folder, or absolute.

        Raises:
            OutsideError: the file exists, but elsewhere.
        """
        untrusted_path = None
        for path in _list_candidates(name, self.searched):
            if self._is_trusted(path):
                return path
            untrusted_path = untrusted_path or path
        if untrusted_path is not None:
            raise OutsideError(
                f"the file '{name}' is in '{untrusted_path.resolve().parent}', outside the model's folder; if you trust the "
                f"model, name that folder {MESH_FOLDER_HINT}"
            )
        return None

    def _is_trusted(self, path: Path) -> bool:
        roots = (
            self._user_folders
            if self.model_folder is None
            else (self.model_folder, *self._user_folders)
        )
        return any(path.resolve().is_relative_to(root.resolve()) for root in roots)


def _list_candidates(name: str, folders: Sequence[Path]) -> Iterator[Path]:
    if Path(name).is_absolute():
        folders = (Path(),)
    yield from (folder / name for folder in folders if _is_file(folder / name))
    if not Path(name).is_absolute():
        parts = Path(name.replace("\\", "/")).parts
        yield from (result for folder in folders for result in _find_any_case(folder, parts))


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        # The name is too long, or has a character that file names cannot have.
        return False


def _find_any_case(folder: Path, parts: Sequence[str]) -> Iterator[Path]:
    """Yield the files below a folder whose path has these parts, in any letter case."""
    if not parts:
        if _is_file(folder):
            yield folder
        return
    if parts[0] == "..":
        yield from _find_any_case(folder / "..", parts[1:])
        return
    try:
        entries = sorted(folder.iterdir())
    except OSError:
        return
    for entry in entries:
        if entry.name.casefold() == parts[0].casefold():
            yield from _find_any_case(entry, parts[1:])


def read_surface(path: Path) -> Surface:
    """Return the surface in a file (.vtp, .stl or .obj).

    Raises:
        OsimliteError: the file cannot be read, or has no surface.
    """
    # Imported here, because a check searches meshes without reading them.
    import numpy as np

    from osimlite.io.meshes.obj import read_obj
    from osimlite.io.meshes.stl import read_stl_corners
    from osimlite.io.meshes.surface import Surface
    from osimlite.io.meshes.vtp import read_vtp

    content = read_file(path)
    match path.suffix.lower():
        case ".vtp":
            return read_vtp(content, path.name)
        case ".stl":
            points = read_stl_corners(content, path.name).reshape(-1, 3)
            return Surface(points, np.arange(len(points)).reshape(-1, 3))
        case ".obj":
            return read_obj(content, path.name)
    raise OsimliteError(f"osimlite does not read {path.suffix or 'such'} files", file=path.name)
