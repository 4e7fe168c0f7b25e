"""Results that processes keep for later ones in a file that only the user can write to."""

from __future__ import annotations

import atexit
import hashlib
import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from osimlite.errors import OsimliteError
from osimlite.simulation.engines.private_files import read_private, write_private

CACHE_VARIABLE = "NUMBA_CACHE_DIR"
"""Environment variable that names the only folder for compiled files; numba uses it for its own files."""


class ResultCache:
    """Cache of results by name, with a key that describes everything on which they depend.

    Args:
        owner: text that distinguishes the file from those of other installations.
        key: description of what the results depend on; results with another key are discarded.
    """

    def __init__(self, owner: str, key: str) -> None:
        self._name = f"results-{_hash_text(owner)}.json"
        self._key = _hash_text(key)
        self._folders = list(cache_folders())
        self._results = self._read()
        self._has_changed = False

    def get(self, name: str) -> Any:
        """Return a result; None if it is not known."""
        return self._results.get(name)

    def keep(self, name: str, result: Any) -> None:
        """Store a result, which must be JSON data, for this process and later ones."""
        if not self._has_changed:
            # One process computes many results, and writes them together.
            atexit.register(self.save)
            self._has_changed = True
        self._results[name] = result

    def save(self) -> None:
        """Write the results into the first folder that allows it; do nothing without one."""
        content = json.dumps({"key": self._key, "results": self._results}).encode()
        for folder in self._folders:
            try:
                write_private(folder / self._name, content)
            except OsimliteError:
                continue
            return

    def _read(self) -> dict[str, Any]:
        for folder in self._folders:
            content = read_private(folder / self._name)
            if content is None:
                continue
            try:
                document = json.loads(content)
                if document["key"] == self._key:
                    return dict(document["results"])
            except (ValueError, TypeError, LookupError):
                continue
        return {}


def cache_folders() -> Iterator[Path]:
    """Yield the folders for compiled files, the preferred one first."""
    if os.environ.get(CACHE_VARIABLE):
        yield Path(os.environ[CACHE_VARIABLE])
        return
    yield Path(__file__).parents[2] / "mechanics" / "kernels" / "__pycache__"
    home: str | Path | None = os.environ.get("LOCALAPPDATA") or os.environ.get("XDG_CACHE_HOME")
    # A relative path would depend on the current folder.
    if not home or not os.path.isabs(home):
        try:
            home = Path.home() / ".cache"
        except RuntimeError:
            # Some containers have no home folder for the user.
            return
    yield Path(home) / "osimlite"


def _hash_text(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]
