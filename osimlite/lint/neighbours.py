"""Documents, tables and folders beside a file, cached until they change."""

from __future__ import annotations

import os
from pathlib import Path

from osimlite.base.files import read_at_most, read_file
from osimlite.errors import OsimliteError
from osimlite.io.document.cache import cache_by_file, get_object
from osimlite.lint.project_files import DOCUMENTS, is_opensim_file
from osimlite.lint.table import Table
from osimlite.schema.model import Model
from osimlite.schema.tree import Tree

_LARGEST_NEIGHBOUR = 2_000_000


@cache_by_file(4)
def read_tree(path: str) -> Tree | None:
    """Return the component tree of a model file; None if it cannot be read."""
    top = get_object(path)
    return Tree(top) if isinstance(top, Model) else None


@cache_by_file(8)
def read_table(path: str) -> Table | None:
    """Return the table in a file; None if it cannot be read."""
    try:
        return Table(read_file(path), path)
    except (OSError, OsimliteError, ValueError):
        return None


def list_folders(folder: Path) -> list[Path]:
    """Return the folders in a folder, sorted, at most 100 and without hidden ones."""
    try:
        with os.scandir(folder) as entries:
            return sorted(
                Path(entry.path)
                for entry in entries
                if entry.is_dir() and not entry.name.startswith(".")
            )[:100]
    except OSError:
        return []


@cache_by_file(256)
def list_documents(folder: str) -> list[str]:
    """Return the documents in a folder, other than models, that seem to be OpenSim's."""
    try:
        with os.scandir(folder) as entries:
            return sorted(
                entry.path
                for entry in entries
                if entry.name.lower().endswith(DOCUMENTS)
                and entry.is_file()
                and entry.stat().st_size < _LARGEST_NEIGHBOUR
                and is_opensim_file(entry.path)
            )
    except OSError:
        return []


def read_beginning(file: str) -> bytes:
    """Return the first bytes of a file; empty if it cannot be read."""
    try:
        return read_at_most(file, 2000)
    except OsimliteError:
        return b""
