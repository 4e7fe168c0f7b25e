"""Location of the models and setups that benchmarks read, and functions that unpack them.

Most are in the folder ``shared`` beside the repository. Not every machine has it.
"""

from __future__ import annotations

import gzip
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
"""Folder of the repository."""

FIXTURES = ROOT / "fixtures"

WALKER = FIXTURES / "walker" / "DynamicWalkerModel.osim"
"""File of OpenSim's Dynamic Walker."""

CORPUS = ROOT.parent / "shared" / "corpus" / "converted"
"""Folder of public models, compressed as ``m0954.osim.gz`` and the like."""

REFERENCE = ROOT.parent / "shared" / "oracle" / "tools" / "reference"
"""Folder of setups and results of OpenSim's tools; many files are compressed."""

MOCO = ROOT.parent / "shared" / "oracle" / "moco"
"""Folder of studies, with the solutions of Moco."""


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


def unpack_files(sources: Iterable[Path], target_folder: Path) -> list[Path]:
    """Copy files into a folder, without compression.

    Args:
        sources: files to read; the suffix ``.gz`` is removed from the names of their copies.
        target_folder: existing folder for the copies.

    Returns:
        The copies, sorted by the names of their sources.
    """
    return [
        unpack_file(source, target_folder / source.name.removesuffix(".gz"))
        for source in sorted(sources)
    ]


def unpack_models(folder: Path, target_folder: Path) -> list[Path]:
    """Copy all model files of a folder into another folder, without compression.

    Args:
        folder: folder with files ``*.osim`` and ``*.osim.gz``.
        target_folder: existing folder for the copies.

    Returns:
        The copies, sorted by the names of their sources.
    """
    return unpack_files(folder.glob("*.osim*"), target_folder)
