"""Find files by patterns such as ``subjects/*/ik.xml`` or ``**/*.xml``."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterable, Iterator
from fnmatch import fnmatch
from glob import has_magic

from osimlite.errors import OsimliteError

MAX_ENTRIES = 1_000_000
"""Number of folder entries that the search for one pattern may read."""


def find_files(pattern: str) -> list[str]:
    """Return the files that match a pattern, sorted and without repetition.

    ``*``, ``?`` and ``[...]`` match within a name, ``**`` matches any number of folders. Names that
    begin with a dot match only if the pattern has the dot. The search follows links to folders, but
    visits every folder once: two links to ``.`` would otherwise have 2^40 paths below them.

    Raises:
        OsimliteError: the search would read more than `MAX_ENTRIES` entries.
    """
    drive, path_pattern = os.path.splitdrive(pattern)
    is_absolute = path_pattern.startswith(("/", os.sep))
    name_patterns = [
        name_pattern
        for name_pattern in path_pattern.replace(os.sep, "/").split("/")
        if name_pattern
    ]
    search = _FileSearch(pattern)
    paths = [drive + os.sep if is_absolute else drive]
    for name_pattern in name_patterns:
        paths = list(dict.fromkeys(search.match_part(paths, name_pattern)))
    return sorted(filter(os.path.isfile, paths))


class _FileSearch:
    """Search for files that reads a limited number of entries."""

    def __init__(self, pattern: str) -> None:
        self.pattern, self.left = pattern, MAX_ENTRIES

    def match_part(self, folders: Iterable[str], name_pattern: str) -> Iterator[str]:
        """Yield the paths that match one part of a pattern.

        Args:
            folders: folders in which to match.
            name_pattern: name or pattern between two slashes.
        """
        if name_pattern == "**":
            yield from self._walk_folders(folders)
            return
        for folder in folders:
            # A plain name needs no listing of the folder.
            if not has_magic(name_pattern):
                path = os.path.join(folder, name_pattern)
                if os.path.lexists(path):
                    yield path
                continue
            for entry in self._list_entries(folder):
                is_shown = not entry.name.startswith(".") or name_pattern.startswith(".")
                if is_shown and fnmatch(entry.name, name_pattern):
                    yield os.path.join(folder, entry.name)

    def _walk_folders(self, folders: Iterable[str]) -> Iterator[str]:
        """Yield some folders and all folders below them, each once."""
        visited: set[str] = set()
        # Folders behind links come last, so that results have the real names of folders.
        waiting = deque(folders)
        behind_links = deque[str]()
        while waiting or behind_links:
            folder = (waiting or behind_links).popleft()
            real = os.path.realpath(folder or ".")
            if real in visited or not os.path.isdir(real):
                continue
            visited.add(real)
            yield folder
            for entry in self._list_entries(folder):
                if not entry.name.startswith(".") and entry.is_dir():
                    queue = behind_links if entry.is_symlink() else waiting
                    queue.append(os.path.join(folder, entry.name))

    def _list_entries(self, folder: str) -> list[os.DirEntry[str]]:
        """Return the sorted entries of a folder; none if it cannot be read.

        Raises:
            OsimliteError: the search has visited more than `MAX_ENTRIES` files.
        """
        try:
            with os.scandir(folder or ".") as entries:
                result = sorted(entries, key=lambda entry: entry.name)
        except OSError:
            return []
        self.left -= len(result)
        if self.left < 0:
            raise OsimliteError(
                f"the search for '{self.pattern}' visits more than {MAX_ENTRIES} files; write the names of the "
                "folders into the pattern"
            )
        return result
