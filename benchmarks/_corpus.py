"""Location of the real models that benchmarks read, and functions that unpack them.

The models are in the folder ``shared`` beside the repository. Not every machine has it.
"""

from __future__ import annotations

import gzip
from pathlib import Path

CORPUS = Path(__file__).resolve().parents[2] / "shared" / "corpus" / "converted"
"""Folder of public models, compressed as ``m0954.osim.gz`` and the like."""


def unpack_file(source: Path, target: Path) -> Path:
    """Copy a file, and decompress it if its name ends with ``.gz``.

    Args:
        source: file to read.
        target: file to write; it is replaced if it exists.

    Returns:
        `target`.
    """
    # The corpus has compressed files, users give plain ones.
    content = source.read_bytes()
    if source.suffix == ".gz":
        content = gzip.decompress(content)
    target.write_bytes(content)
    return target


def unpack_models(folder: Path, target_folder: Path) -> list[Path]:
    """Copy all model files of a folder into another folder, without compression.

    Args:
        folder: folder with files ``*.osim`` and ``*.osim.gz``.
        target_folder: existing folder for the copies.

    Returns:
        The copies, sorted by the names of their sources.
    """
    return [
        unpack_file(source, target_folder / source.name.removesuffix(".gz"))
        for source in sorted(folder.glob("*.osim*"))
    ]
