"""Where the mesh files of a model are: the folders that OpenSim looks into, and names in other capitals."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from osimlite.files import named_mesh_folders


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
