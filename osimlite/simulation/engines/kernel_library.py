"""Library of kernels that was compiled at installation.

A wheel has one library for each level of processors, an editable installation one for the processor
that compiled it. Each library contains a table: the digest of every kernel, and the files from
which they were compiled.
"""

from __future__ import annotations

import ctypes
import json
import os
from functools import cache, cached_property
from pathlib import Path
from typing import Any
from zlib import crc32

from osimlite.mechanics.codegen.processor import processor_features, supports_v3
from osimlite.mechanics.codegen.sources import compute_digest
from osimlite.mechanics.codegen.toolchain import BASELINE, NATIVE, X86_64_V3, library_suffix
from osimlite.simulation.elements.laws import find_law, get_symbol
from osimlite.simulation.engines.result_cache import ResultCache

PACKAGE = Path(__file__).parents[2]
"""Folder of the package."""
LIBRARY_FOLDER = PACKAGE / "native"
"""Folder in which the build puts the libraries."""

TABLE_SYMBOL = "osimlite_kernel_table"
"""Symbol of the table in a library."""


class KernelLibrary:
    """Loaded library of kernels.

    Args:
        path: path of the shared library.

    Attributes:
        path: path of the shared library.
        table: description that the library contains: "version", "target", "compiler", "sources" and
            "laws"; for a native library also "features" and "times".

    Raises:
        OSError: the library cannot be loaded.
        ValueError: the library has no table.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._library = ctypes.CDLL(str(path))
        address = ctypes.addressof(ctypes.c_char.in_dll(self._library, TABLE_SYMBOL))
        self.table: dict[str, Any] = json.loads(ctypes.string_at(address))

    def get_address(self, name: str) -> int | None:
        """Return the address of a kernel.

        Args:
            name: name of the kernel.

        Returns:
            The address; None if the library lacks the kernel, or has it from other sources.
        """
        digest = self.table["laws"].get(name)
        if digest is None or not self._is_current(name, digest):
            return None
        return ctypes.cast(self._library[get_symbol(name)], ctypes.c_void_p).value

    @cached_property
    def changed_files(self) -> list[str]:
        """Names of the source files that have changed since the library was compiled."""
        times = self.table.get("times", {})
        # An installed wheel has no times of its sources: there the size must suffice.
        doubtful = [
            name
            for name, (size, _) in self.table["sources"].items()
            if (state := self._states[name])[0] != size or state[1] != times.get(name, state[1])
        ]
        if not doubtful:
            return []
        changed: list[str] | None = self.result_cache.get("changed files")
        if changed is None:
            changed = [name for name in doubtful if self.has_changed(name)]
            self.result_cache.keep("changed files", changed)
        return changed

    @cached_property
    def _states(self) -> dict[str, tuple[int, int]]:
        """Size (bytes) and time of change (ns) of each source file; -1 for a missing file."""
        states = {}
        for name in self.table["sources"]:
            try:
                info = os.stat(PACKAGE / name)
                states[name] = info.st_size, info.st_mtime_ns
            except OSError:
                states[name] = -1, -1
        return states

    @cached_property
    def result_cache(self) -> ResultCache:
        """Cached results about the sources in their present state.

        Without them, every process after an edit, or after `git pull`, computes the digests of the
        laws of its model, which takes up to a quarter of a second.
        """
        library = os.stat(self.path)
        key = self._states, library.st_size, library.st_mtime_ns
        return ResultCache(f"{PACKAGE} {self.path}", repr(key))

    def has_changed(self, name: str) -> bool:
        """Return whether the content of a source file differs from that in the library."""
        try:
            content = (PACKAGE / name).read_bytes()
        except OSError:
            return True
        return [len(content), crc32(content)] != self.table["sources"][name]

    def _is_current(self, name: str, digest: str) -> bool:
        """Return whether the sources of a law are those from which the library was compiled."""
        if not self.changed_files:
            return True
        if any(file.startswith("mechanics/codegen/") for file in self.changed_files):
            # With another translator the same law gives other code.
            return False
        present: str | None = self.result_cache.get(name)
        if present is None:
            present = compute_digest(find_law(name)[0])
            self.result_cache.keep(name, present)
        return present == digest


@cache
def load_library() -> KernelLibrary | None:
    """Load the best library for this processor.

    Returns:
        The library; None if no library fits.
    """
    for target in (NATIVE, X86_64_V3, BASELINE):
        path = LIBRARY_FOLDER / f"kernels-{target}{library_suffix()}"
        if path.exists() and (target != X86_64_V3 or supports_v3()):
            try:
                library = KernelLibrary(path)
            except (OSError, ValueError) as error:
                loading_problems.append(f"{path.name} cannot be loaded: {error}")
                continue
            # A native library of another machine may use instructions that this processor lacks.
            if set(library.table.get("features", ())) <= processor_features():
                return library
            loading_problems.append(f"{path.name} was compiled for another processor")
    return None


loading_problems: list[str] = []
"""Reasons why existing libraries are not used."""


def explain_absence() -> str:
    """Return the reason why there is no library; empty if there is one."""
    if load_library() is not None:
        return ""
    if loading_problems:
        return "; ".join(loading_problems)
    return "osimlite was installed without a library of kernels"
