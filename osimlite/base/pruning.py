"""Removal of old entries of the user's cache.

Every entry is a file `.json` in the tree of the cache folder. Its time of change is the time of its
last use, see :func:`mark_used`, because many file systems record no times of access.
"""

from __future__ import annotations

import os
import stat
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from osimlite.base.named_tuples import NamedTuple

DAY_S = 86_400.0
UNUSED_DAYS = 90.0
"""Number of days without use after which an entry is removed."""

MAX_CACHE_BYTES = 512 * 2**20
"""Largest size of the cache (bytes); a larger one is reduced to 80 % of this, oldest entries first."""

MARKER = ".pruned"
"""File in the cache folder whose time of change is that of the last removal."""


class _Entry(NamedTuple):
    """Entry of a cache: time of last use (s), size (bytes), folder and name."""

    used: float
    size: int
    folder: str
    name: str


def mark_used(path: Path) -> None:
    """Set the time of last use of an entry unless it is of today; links are not followed."""
    with suppress(OSError, NotImplementedError):
        info = os.lstat(path)
        if stat.S_ISREG(info.st_mode) and time.time() - info.st_mtime > DAY_S:
            os.utime(path, follow_symlinks=os.utime not in os.supports_follow_symlinks)


def is_due(folder: Path, now: float) -> bool:
    """Return whether the last removal is more than a day ago or unknown.

    Args:
        folder: folder of the cache.
        now: present time, s since the epoch.
    """
    try:
        return not 0.0 <= now - os.lstat(folder / MARKER).st_mtime < DAY_S
    except OSError:
        return True


def prune_cache(folder: Path, now: float, *, max_bytes: int = MAX_CACHE_BYTES) -> int:
    """Remove old entries of a cache, then the oldest of too large a cache; return the number removed.

    Several processes can do this at once while others write: entries that are gone are ignored.
    Links are neither followed nor removed.

    Args:
        folder: cache folder of the user.
        now: present time, in seconds since the epoch.
        max_bytes: largest size of all entries together, bytes.

    Returns:
        Number of entries that were removed.
    """
    entries = sorted(find_entries(os.path.realpath(folder)))
    total = sum(entry.size for entry in entries)
    # Remove a little more than necessary, so that not every run has to remove entries.
    target_bytes = total if total <= max_bytes else 0.8 * max_bytes
    removed = 0
    for entry in entries:
        if now - entry.used <= UNUSED_DAYS * DAY_S and total <= target_bytes:
            break
        removed += _remove_entry(entry)
        total -= entry.size
    return removed


def find_entries(folder: str) -> Iterator[_Entry]:
    """Yield all entries in the tree of a folder."""
    for parent, folders, names in os.walk(folder, followlinks=False):
        # On Windows Python does not see that a junction is a link.
        folders[:] = [name for name in folders if not _is_link(parent, name)]
        for name in names:
            if not name.endswith(".json"):
                continue
            with suppress(OSError):
                info = os.lstat(os.path.join(parent, name))
                if stat.S_ISREG(info.st_mode):
                    yield _Entry(info.st_mtime, info.st_size, parent, name)


def _is_link(parent: str, name: str) -> bool:
    """Return whether a folder is a link or a junction."""
    path = os.path.join(parent, name)
    return os.path.realpath(path) != os.path.join(os.path.realpath(parent), name)


def _remove_entry(entry: _Entry) -> bool:
    """Remove an entry unless its folder has become a link meanwhile; return whether it was removed.

    Returns:
        Whether the entry was removed.
    """
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
        OSError: the folder is gone, or a part of the path is a link.
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
