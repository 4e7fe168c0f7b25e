"""What a piece of work takes, in numbers that no machine changes: calls of Python functions, modules, bytes.

This runs in a Python that has just begun, and imports next to nothing: what it loads, the work need
not load any more.

    python -S _counted.py RESULT PATH PACKAGE [WORD ...]    a command, or without WORDs the calls of cost.py
"""

from __future__ import annotations

import os
import sys
from _lsprof import Profiler

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

INLINED = frozenset(("<listcomp>", "<dictcomp>", "<setcomp>"))
"""Calls of Python 3.11 alone: later ones inline comprehensions."""
IMPORTING = ("<frozen importlib", "<frozen zipimport")
"""What finds a module asks every folder of the path, which are more on one machine than on another."""


class Opened:
    """The files that are opened to be read while this is on."""

    def __init__(self) -> None:
        self.on = False
        self.names: list[str] = []
        sys.addaudithook(self)

    def __call__(self, event: str, given: tuple[Any, ...]) -> None:
        """Take note, as Python's audit hook."""
        if not self.on or event != "open" or not isinstance(given[0], str):
            return
        name, mode, flags = given
        # Of the flags, 1 and 2 are about writing. What `open` has an opener of ours open is told
        # twice.
        if not (flags or 0) & 3 and not (mode is None and self.names[-1:] == [name]):
            self.names.append(name)


class Counter:
    """Counts work, one piece after the other.

    Args: package: the folder of the package whose own functions, modules and files are told from
        those of others.
    """

    def __init__(self, package: str) -> None:
        self.package = package + "/"
        self.opened = Opened()

    def count(self, work: Callable[[], object]) -> dict[str, dict[str, int]]:
        """Do the work, and say what it took."""
        before, profiler = set(sys.modules), Profiler(subcalls=False, builtins=False)
        self.opened.names = []
        self.opened.on = True
        profiler.enable()
        try:
            work()
        finally:
            profiler.disable()
            self.opened.on = False
        return self._told(profiler.getstats(), [name for name in sys.modules if name not in before])

    def _told(self, entries: list[Any], modules: list[str]) -> dict[str, dict[str, int]]:
        own: dict[str, int] = {}
        libraries: dict[str, int] = {}
        for entry in entries:
            code = entry.code
            if isinstance(code, str) or code.co_name in INLINED or code.co_filename == __file__:
                continue
            file = code.co_filename.replace("\\", "/")
            if file.startswith(IMPORTING):
                continue
            ours = file.startswith(self.package)
            name = (
                f"{file.removeprefix(self.package)}: {code.co_qualname}" if ours else _library(file)
            )
            counts = own if ours else libraries
            counts[name] = counts.get(name, 0) + entry.callcount + entry.reccallcount
        loaded = sorted(name for name in modules if _top(name) == "osimlite")
        others: dict[str, int] = {}
        for name in modules:
            if name not in loaded:
                top = "python" if _top(name) in sys.stdlib_module_names else _top(name)
                others[top] = others.get(top, 0) + 1
        return {
            "calls": own,
            "modules": dict.fromkeys(loaded, 1),
            "data": self._data(),
            "code": {name: _size_of_code(name) for name in loaded},
            "library calls": libraries,
            "library modules": others,
        }

    def _data(self) -> dict[str, int]:
        """Bytes of what was read in the working folder and in that of the package, by file."""
        here = os.getcwd().replace("\\", "/") + "/"
        found: dict[str, int] = {}
        for name in self.opened.names:
            file = os.path.abspath(name).replace("\\", "/")
            # Byte code is counted by the module; machine code is another for each processor.
            if file.startswith((self.package, here)) and not file.endswith(
                (".py", ".pyc", ".code")
            ):
                told = file.removeprefix(self.package).removeprefix(here)
                found[told] = found.get(told, 0) + (
                    os.path.getsize(file) if os.path.exists(file) else 0
                )
        return found


def _top(module: str) -> str:
    return module.partition(".")[0]


def _library(file: str) -> str:
    """The package that a file is of: the first folder in site-packages, or Python itself."""
    if file.startswith("<"):
        # Made by a program: named tuples, dataclasses, attrs.
        return "python"
    for word in ("/site-packages/", "/dist-packages/"):
        if word in file:
            return file.rpartition(word)[2].split("/")[0].removesuffix(".py")
    return "python"


def _size_of_code(module: str) -> int:
    """Bytes of a module's byte code, without the path of its file, which it holds once."""
    spec = sys.modules[module].__spec__
    if (
        spec is None
        or spec.cached is None
        or spec.origin is None
        or not os.path.exists(spec.cached)
    ):
        return 0
    return os.path.getsize(spec.cached) - len(os.fsencode(spec.origin))


def main() -> None:
    """Count, and write the result to a file."""
    import gc

    result, path, package, *words = sys.argv[1:]
    sys.path[:] = path.split(os.pathsep)
    # When the collector comes, and what that calls, depends on all that went before.
    gc.disable()
    counter = Counter(package)
    if words:

        def command() -> None:
            from osimlite.cli import main

            try:
                main(words)
            except SystemExit as end:
                # 1 is an answer, too.
                if end.code not in (None, 0, 1):
                    raise

        counts = {"": counter.count(command)}
    else:
        from cost import calls

        counts = {}
        for name, work in calls():
            work()
            counts[name] = counter.count(work)
    import json

    with open(result, "w", encoding="utf-8") as file:
        json.dump(counts, file)


if __name__ == "__main__":
    main()
