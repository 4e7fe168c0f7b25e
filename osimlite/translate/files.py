"""The files of a translation."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from osimlite.base.files import make_folder, write_atomically


def write_files(folder: Path, files: Mapping[str, str | bytes]) -> list[Path]:
    """Write files into a folder, which is made if it is not there; the first last, when all it needs is in place.

    Args:
        folder: where to.
        files: contents by name relative to the folder.

    Returns:
        The files written, in the order given.

    Raises:
        OsimliteError: a file cannot be written.
    """
    paths = {folder / name: content for name, content in files.items()}
    for parent in sorted({folder, *(path.parent for path in paths)}):
        make_folder(parent)
    for path, content in reversed(paths.items()):
        write_atomically(path, content)
    return list(paths)
