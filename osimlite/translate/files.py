"""Output files of a translation."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from osimlite.base.files import make_folder, write_atomically


def write_files(folder: Path, files: Mapping[str, str | bytes]) -> list[Path]:
    """Write files into a folder, the first one last.

    The first file then appears when all files that it needs exist.

    Args:
        folder: output folder; created if necessary.
        files: contents by name relative to the folder.

    Returns:
        Paths of the files, in the given order.

    Raises:
        OsimliteError: a file cannot be written.
    """
    paths = {folder / name: content for name, content in files.items()}
    for parent in sorted({folder, *(path.parent for path in paths)}):
        make_folder(parent)
    for path, content in reversed(paths.items()):
        write_atomically(path, content)
    return list(paths)
