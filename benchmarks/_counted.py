"""Count the Python calls, modules and bytes that an action needs, which no machine changes.

cost.py starts this script once for each command, in a new Python process. The script imports almost
nothing: a module that it has loaded would be missing in the count of the action.

    python -S _counted.py RESULT PATH PACKAGE [WORD ...]

RESULT is the JSON file to write, PATH the import path, and PACKAGE the folder of osimlite. With
WORDs the action is the command ``osimlite WORD ...``. Without, all library calls of cost.py are
counted one after the other.
"""

from __future__ import annotations

import os
import sys
from _lsprof import Profiler

# The module `typing` is not imported: it would be missing in the count of the action.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

COMPREHENSIONS = frozenset(("<listcomp>", "<dictcomp>", "<setcomp>"))
"""Names of frames that do not count.

Python 3.11 calls comprehensions as functions, later versions inline them.
"""

IMPORT_MACHINERY = ("<frozen importlib", "<frozen zipimport")
"""Beginnings of file names that do not count.

To find a module, Python asks every folder of the import path, whose number depends on the machine.
"""

WRITE_FLAGS = 3
"""Bits of the flags of an opened file that say it is written (``O_WRONLY | O_RDWR``)."""

GENERATED_SUFFIXES = (".py", ".pyc", ".code")
"""Suffixes of files that are not data.

Byte code is counted by module, and machine code depends on the processor.
"""


class OpenedFiles:
    """Record of the files that are opened for reading while `recording` is true.

    Attributes:
        recording: whether opened files are recorded.
        names: names of the files, in the order of opening.
    """

    def __init__(self) -> None:
        self.recording = False
        self.names: list[str] = []
        sys.addaudithook(self)

    def __call__(self, event: str, arguments: tuple[Any, ...]) -> None:
        """Record a file; Python calls this audit hook at every event."""
        if not self.recording or event != "open" or not isinstance(arguments[0], str):
            return
        name, mode, flags = arguments
        if (flags or 0) & WRITE_FLAGS:
            return
        # `open` with an opener causes two events: its own, and one without mode by `os.open`.
        if mode is None and self.names[-1:] == [name]:
            return
        self.names.append(name)


class WorkCounter:
    """Counter of the work of actions, one after the other.

    Args:
        package: folder of the package whose functions, modules and files are counted separately
            from those of libraries.
    """

    def __init__(self, package: str) -> None:
        self.package = package + "/"
        self.opened = OpenedFiles()

    def count(self, work: Callable[[], object]) -> dict[str, dict[str, int]]:
        """Do the work and count it.

        Returns:
            For each kind of cost (the keys of ``KINDS`` in cost.py) the counts by function, module,
            file or library.
        """
        modules_before = set(sys.modules)
        profiler = Profiler(subcalls=False, builtins=False)
        self.opened.names = []
        self.opened.recording = True
        profiler.enable()
        try:
            work()
        finally:
            profiler.disable()
            self.opened.recording = False
        new_modules = [name for name in sys.modules if name not in modules_before]
        package_calls, library_calls = self._count_calls(profiler.getstats())
        package_modules = sorted(
            name for name in new_modules if _get_top_package(name) == "osimlite"
        )
        return {
            "calls": package_calls,
            "modules": dict.fromkeys(package_modules, 1),
            "data": self._measure_data(),
            "code": {name: _measure_byte_code(name) for name in package_modules},
            "library calls": library_calls,
            "library modules": _count_library_modules(new_modules),
        }

    def _count_calls(self, entries: list[Any]) -> tuple[dict[str, int], dict[str, int]]:
        """Return the calls of the package by function, and those of libraries by library."""
        package_calls: dict[str, int] = {}
        library_calls: dict[str, int] = {}
        for entry in entries:
            code = entry.code
            if isinstance(code, str):
                # A function of C.
                continue
            if code.co_name in COMPREHENSIONS or code.co_filename == __file__:
                continue
            file = code.co_filename.replace("\\", "/")
            if file.startswith(IMPORT_MACHINERY):
                continue
            if file.startswith(self.package):
                name = f"{file.removeprefix(self.package)}: {code.co_qualname}"
                counts = package_calls
            else:
                name = _find_library(file)
                counts = library_calls
            # The profiler counts recursive calls separately.
            counts[name] = counts.get(name, 0) + entry.callcount + entry.reccallcount
        return package_calls, library_calls

    def _measure_data(self) -> dict[str, int]:
        """Return the bytes that were read in the working folder and in the package, by file."""
        working_folder = os.getcwd().replace("\\", "/") + "/"
        sizes: dict[str, int] = {}
        for name in self.opened.names:
            file = os.path.abspath(name).replace("\\", "/")
            if not file.startswith((self.package, working_folder)):
                continue
            if file.endswith(GENERATED_SUFFIXES):
                continue
            label = file.removeprefix(self.package).removeprefix(working_folder)
            size = os.path.getsize(file) if os.path.exists(file) else 0
            sizes[label] = sizes.get(label, 0) + size
        return sizes


def _count_library_modules(modules: list[str]) -> dict[str, int]:
    """Return how many modules of each library are among these; those of Python are one library."""
    counts: dict[str, int] = {}
    for module in modules:
        library = _get_top_package(module)
        if library == "osimlite":
            continue
        if library in sys.stdlib_module_names:
            library = "python"
        counts[library] = counts.get(library, 0) + 1
    return counts


def _get_top_package(module: str) -> str:
    return module.partition(".")[0]


def _find_library(file: str) -> str:
    """Return the library of a source file: its folder in site-packages, or ``python``."""
    if file.startswith("<"):
        # Named tuples, dataclasses and attrs compile source text without a file.
        return "python"
    for word in ("/site-packages/", "/dist-packages/"):
        if word in file:
            return file.rpartition(word)[2].split("/")[0].removesuffix(".py")
    return "python"


def _measure_byte_code(module: str) -> int:
    """Return the size of the byte code of a module (bytes), 0 if it has no file."""
    spec = sys.modules[module].__spec__
    if spec is None or spec.cached is None or spec.origin is None:
        return 0
    if not os.path.exists(spec.cached):
        return 0
    # Byte code contains the path of its source once, whose length depends on the machine.
    return os.path.getsize(spec.cached) - len(os.fsencode(spec.origin))


def main() -> None:
    """Count what the command line asks for, and write the counts to a file."""
    import gc

    result, path, package, *words = sys.argv[1:]
    sys.path[:] = path.split(os.pathsep)
    # When the garbage collector runs, and what it calls, depends on everything that ran before.
    gc.disable()
    counter = WorkCounter(package)
    if words:

        def run_command() -> None:
            from osimlite.cli import main

            try:
                main(words)
            except SystemExit as end:
                # With exit code 1 a command has worked and found something.
                if end.code not in (None, 0, 1):
                    raise

        counts = {"": counter.count(run_command)}
    else:
        from cost import make_library_calls

        counts = {}
        for name, work in make_library_calls():
            # The second call is counted: the first one fills caches and imports modules.
            work()
            counts[name] = counter.count(work)
    import json

    with open(result, "w", encoding="utf-8") as file:
        json.dump(counts, file)


if __name__ == "__main__":
    main()
