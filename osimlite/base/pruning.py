"""Removal of entries of the user's cache that nothing has used for a long time.

Every entry is a file `.json` in the tree of the cache folder. Its time of change says when it was
written or last used, see :func:`mark_used`: file systems often keep no times of access.
"""

from __future__ import annotations

import os
import stat
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

DAY_S = 86_400.0
UNUSED_DAYS = 90.0
"""After as many days without use an entry is removed."""

MAX_CACHE_BYTES = 512 * 2**20
"""A larger cache loses the entries that were used longest ago, until a fifth of this is free."""

MARKER = ".pruned"
"""File in the cache folder whose time says when the cache was last looked through."""


class _Entry(NamedTuple):
    """One entry of a cache: when it was last used (s), its size (bytes), the folder that holds it, its name."""

    used: float
    size: int
    folder: str
    name: str


def mark_used(path: Path) -> None:
    """Note that an entry was used today, unless that is noted; a link is never followed."""
    with suppress(OSError, NotImplementedError):
        info = os.lstat(path)
        if stat.S_ISREG(info.st_mode) and time.time() - info.st_mtime > DAY_S:
            os.utime(path, follow_symlinks=os.utime not in os.supports_follow_symlinks)


def is_due(folder: Path, now: float) -> bool:
    """Return whether a cache was not looked through in the last day, or nobody knows when."""
    try:
        return not 0.0 <= now - os.lstat(folder / MARKER).st_mtime < DAY_S
    except OSError:
        return True


def prune_cache(folder: Path, now: float, *, max_bytes: int = MAX_CACHE_BYTES) -> int:
    """Remove the entries of a cache that are old, then those that are too many, and return how many.

    Several processes may do so at once, and others may write: what is gone already is passed over.
    Links are neither followed nor removed.

    Args:
        folder: the user's cache folder.
        now: seconds since the epoch.
        max_bytes: largest size of all entries together.
    """
    entries = sorted(_find_entries(os.path.realpath(folder)))
    total = sum(entry.size for entry in entries)
    # A little more than necessary goes, so that not every run has to remove something.
    least = total if total <= max_bytes else 0.8 * max_bytes
    removed = 0
    for entry in entries:
        if now - entry.used <= UNUSED_DAYS * DAY_S and total <= least:
            break
        removed += _remove(entry)
        total -= entry.size
    return removed


def _find_entries(folder: str) -> Iterator[_Entry]:
    for place, folders, names in os.walk(folder, followlinks=False):
        # On Windows a junction is a folder that leads elsewhere, and is no link to Python.
        folders[:] = [name for name in folders if not _leads_elsewhere(place, name)]
        for name in names:
            if not name.endswith(".json"):
                continue
            with suppress(OSError):
                info = os.lstat(os.path.join(place, name))
                if stat.S_ISREG(info.st_mode):
                    yield _Entry(info.st_mtime, info.st_size, place, name)


def _leads_elsewhere(place: str, name: str) -> bool:
    path = os.path.join(place, name)
    return os.path.realpath(path) != os.path.join(os.path.realpath(place), name)


def _remove(entry: _Entry) -> bool:
    """Remove an entry, unless its folder has become a link since it was found."""
    try:
        if os.unlink not in os.supports_dir_fd:
            if os.path.realpath(entry.folder) != entry.folder:
                return False
            os.unlink(os.path.join(entry.folder, entry.name))
            return True
        handle = _open_folder(entry.folder)
        try:
            os.unlink(entry.name, dir_fd=handle)
        finally:
            os.close(handle)
    except OSError:
        return False
    return True


def _open_folder(folder: str) -> int:
    """Return a handle of a folder to which no part of the path is a link.

    Raises:
        OSError: it is gone, or a part of the path is a link.
    """
    flags = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW
    handle = os.open(os.sep, flags)
    for part in Path(folder).parts[1:]:
        try:
            inner = os.open(part, flags, dir_fd=handle)
        finally:
            os.close(handle)
        handle = inner
    return handle
