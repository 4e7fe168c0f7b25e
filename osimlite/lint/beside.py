"""What lies beside a file: documents, tables and folders, read once and again when they change."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import TypeVar

from osimlite.document.reader import read_document
from osimlite.document.source import Source
from osimlite.errors import OsimliteError
from osimlite.files import read_file, stamped
from osimlite.lint.suffixes import DOCUMENTS, begins_as_ours
from osimlite.lint.table import Table
from osimlite.schema.base import Object
from osimlite.schema.model import Model
from osimlite.schema.registry import forgotten_with_classes
from osimlite.schema.tree import Tree

T = TypeVar("T")

_LARGEST_NEIGHBOUR = 2_000_000


def while_unchanged(size: int) -> Callable[[Callable[[str], T]], Callable[[str], T | None]]:
    """Keep what was made of the last `size` files as long as these do not change; None of one that is not there."""

    def decorated(make: Callable[[str], T]) -> Callable[[str], T | None]:
        kept: dict[str, tuple[int, T]] = {}
        forgotten_with_classes(kept.clear)

        @wraps(make)
        def made(path: str) -> T | None:
            stamp = stamped(path)
            if stamp is None:
                return None
            known = kept.pop(path, None)
            kept[path] = known if known is not None and known[0] == stamp else (stamp, make(path))
            if len(kept) > size:
                del kept[next(iter(kept))]
            return kept[path][1]

        return made

    return decorated


@while_unchanged(256)
def top_at(path: str) -> Object | None:
    """The top of a document; None if it cannot be read."""
    try:
        return read_document(Source.of_file(path), of=Object).top
    except (OsimliteError, ValueError, RecursionError):
        return None


@while_unchanged(4)
def tree_at(path: str) -> Tree | None:
    """The component tree of a model; None if it cannot be read."""
    top = top_at(path)
    return Tree(top) if isinstance(top, Model) else None


@while_unchanged(8)
def table_at(path: str) -> Table | None:
    """A table; None if it cannot be read."""
    try:
        return Table(read_file(path), path)
    except (OSError, OsimliteError, ValueError):
        return None


def folders_in(folder: Path) -> list[Path]:
    """The folders in a folder."""
    try:
        with os.scandir(folder) as entries:
            return sorted(Path(entry.path) for entry in entries if entry.is_dir() and not entry.name.startswith("."))[
                :100
            ]
    except OSError:
        return []


@while_unchanged(256)
def documents_of(folder: str) -> list[str]:
    """The documents in a folder that may be OpenSim's, other than models."""
    try:
        with os.scandir(folder) as entries:
            return sorted(
                entry.path
                for entry in entries
                if entry.name.lower().endswith(DOCUMENTS)
                and entry.is_file()
                and entry.stat().st_size < _LARGEST_NEIGHBOUR
                and begins_as_ours(entry.path)
            )
    except OSError:
        return []


def beginning(file: str) -> bytes:
    """The first bytes of a file."""
    try:
        with open(file, "rb") as stream:
            return stream.read(2000)
    except OSError:
        return b""
