"""Build the library of kernels: their C++ text, object files, and a shared library with a table of its contents.

    python packaging/kernel_library.py text FOLDER [PART]      writes the C++ text, or one of its parts
    python packaging/kernel_library.py library [--target T]    builds osimlite/native in this source tree

The build hook of a wheel calls this file in an environment that has neither numpy nor lxml.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.machinery
import json
import os
import shutil
import subprocess
import sys
import tempfile
import types
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from zlib import crc32

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from osimlite.mechanics.codegen import toolchain  # noqa: E402
from osimlite.mechanics.codegen.processor import processor_features  # noqa: E402

PARTS = ("double", "dual")
"""The texts: kernels of floats, and kernels of floats that carry derivatives."""

SOURCES = (
    "mechanics/codegen/cplusplus",
    "mechanics/codegen/reader.py",
    "mechanics/laws",
    "mechanics/kernels",
    "simulation/elements",
)
"""Folders and files of the package that decide what the kernels are."""

EXPORT = """#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif
"""

UNUSED = ("lxml", "lxml.etree", "numpy", "numpy.typing", "rich", "rapidfuzz", "scipy", "typer")
"""Packages that modules with kernels import, and that writing the kernels never calls."""


class StandIn(types.ModuleType):
    """Substitute for a module that is not installed; every attribute is another substitute."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.__path__: list[str] = []
        self.__spec__ = importlib.machinery.ModuleSpec(name, None)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        value = StandIn(f"{self.__name__}.{name}")
        setattr(self, name, value)
        return value

    def __call__(self, *_: Any, **__: Any) -> StandIn:
        """Return the stand-in."""
        return self

    def __getitem__(self, _: Any) -> StandIn:
        return self

    def __or__(self, _: Any) -> StandIn:
        return self

    __ror__ = __or__


# ------------------------------------------------------------------------------------------------- texts
def write_text(folder: Path, part: str) -> None:
    """Write one part of the C++ text, and with the first one the header and the contents of the table.

    Args:
        folder: of the files.
        part: one of `PARTS`.
    """
    for name in UNUSED:
        sys.modules.setdefault(name, StandIn(name))
    from osimlite import __version__
    from osimlite.mechanics.codegen.cplusplus import HEADER, header_text, write_library
    from osimlite.mechanics.codegen.sources import compute_digest
    from osimlite.simulation.elements.laws import (
        DIRECTIONS,
        find_law,
        get_symbol,
        list_library_laws,
    )

    laws = list_library_laws(0 if part == PARTS[0] else DIRECTIONS)
    text = write_library({get_symbol(law): find_law(law) for law in laws})
    write_file(folder / f"kernels_{part}.cpp", text)
    if part == PARTS[0]:
        write_file(folder / HEADER, header_text())
        digests = {law: compute_digest(find_law(law)[0]) for law in laws}
        digests |= {law: digests[law.partition("~")[0]] for law in list_library_laws(DIRECTIONS)}
        table = {
            "version": __version__,
            "sources": describe_sources(ROOT / "osimlite"),
            "laws": digests,
        }
        write_file(folder / "table.json", json.dumps(table, indent=1) + "\n")


def write_texts(folder: Path) -> None:
    """Write the whole C++ text, each part by a process of its own."""
    folder.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, __file__, "text", str(folder)]
    # Types and texts are the same in every run, whatever the order of sets.
    processes = [subprocess.Popen([*command, part]) for part in PARTS]
    if any([process.wait() for process in processes]):
        raise toolchain.CompilationError("the C++ text of the kernels cannot be written")


def write_file(path: Path, text: str) -> None:
    """Write a text with the same bytes on every system."""
    path.write_bytes(text.encode())


def source_files(package: Path) -> Iterator[tuple[str, Path]]:
    """Yield the files that decide what the kernels are, with their names within the package, in a fixed order."""
    for source in map(package.joinpath, SOURCES):
        for path in sorted(source.rglob("*")) if source.is_dir() else [source]:
            if path.suffix in (".py", ".h"):
                yield path.relative_to(package).as_posix(), path


def describe_sources(package: Path) -> dict[str, list[int]]:
    """Return size and CRC of each file that decides what the kernels are."""
    contents = ((name, path.read_bytes()) for name, path in source_files(package))
    return {name: [len(content), crc32(content)] for name, content in contents}


# ----------------------------------------------------------------------------------------------- library
def library_name(target: str, system: str = sys.platform) -> str:
    """Return the file name of the library for a target."""
    return f"kernels-{target}{toolchain.library_suffix(system)}"


def compile_libraries(
    texts: Path, results: Path, compiler: toolchain.Compiler, targets: Sequence[str]
) -> list[Path]:
    """Compile the texts for each target, on as many cores as there are.

    Args:
        texts: folder of the C++ text.
        results: folder of the libraries.
        compiler: that makes them.
        targets: of `toolchain`.

    Returns:
        The libraries, in the order of the targets.

    Raises:
        CompilationError: the compiler failed.
    """
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        jobs = []
        for target in targets:
            folder = work / target
            shutil.copytree(texts, folder)
            write_file(folder / "table.cpp", table_text(texts, compiler, target))
            # The longest first.
            jobs += [(folder, part, target) for part in ("kernels_dual", "kernels_double", "table")]

        def compile_part(job: tuple[Path, str, str]) -> None:
            folder, part, target = job
            compiler.compile(folder / f"{part}.cpp", folder / f"{part}.o", target)

        with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
            list(pool.map(compile_part, jobs))
        results.mkdir(parents=True, exist_ok=True)
        made = []
        for target in targets:
            folder, library = work / target, results / library_name(target, compiler.system)
            objects = [folder / f"{part}.o" for part in ("kernels_double", "kernels_dual", "table")]
            linked = folder / library.name
            compiler.link(objects, linked)
            replace_file(linked, library)
            made.append(library)
        return made


def table_text(texts: Path, compiler: toolchain.Compiler, target: str) -> str:
    """Return the C++ text of the table that the library carries.

    It names every kernel with the digest of its sources, so that an edited one is noticed, and what
    the library was made by and for.
    """
    table = json.loads((texts / "table.json").read_text("utf-8"))
    table |= {"target": target, "compiler": compiler.version, "recipe": recipe()}
    if target == toolchain.NATIVE:
        # This library runs on processors like this one, and beside the files that it was made of.
        table["features"] = sorted(processor_features())
        package = ROOT / "osimlite"
        table["times"] = {name: path.stat().st_mtime_ns for name, path in source_files(package)}
    # Compilers limit the length of a string, but not that of a list.
    characters = ",".join(str(byte) for byte in json.dumps(table, separators=(",", ":")).encode())
    return f'{EXPORT}extern "C" EXPORT const char osimlite_kernel_table[] = {{{characters},0}};\n'


def replace_file(source: Path, target: Path) -> None:
    """Replace a file that a process may have loaded."""
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=target.name)
    os.close(handle)
    shutil.copyfile(source, name)
    os.chmod(name, 0o755)
    os.replace(name, target)


def is_current(library: Path, compiler: toolchain.Compiler) -> bool:
    """Return whether a native library was made of the present sources by this compiler for this processor."""
    try:
        content = library.read_bytes()
        # The table is the only JSON in the file, and ends with a zero.
        start = content.index(b'{"version":')
        table = json.loads(content[start : content.index(b"\0", start)])
    except (OSError, ValueError):
        return False
    return bool(
        table.get("compiler") == compiler.version
        and table.get("features") == sorted(processor_features())
        and table.get("sources") == describe_sources(ROOT / "osimlite")
        and table.get("recipe") == recipe()
    )


def recipe() -> str:
    """Return a digest of this file and of the compilers' options, which decide how the library is made."""
    contents = (Path(path).read_bytes() for path in (__file__, toolchain.__file__))
    return hashlib.sha256(b"".join(contents)).hexdigest()[:16]


def build_in_place(target: str = toolchain.NATIVE) -> str:
    """Build the library inside this source tree, unless it is current.

    Returns:
        One sentence about what was done.
    """
    compiler = toolchain.find_compiler()
    if compiler is None:
        return NO_COMPILER
    folder = ROOT / "osimlite" / "native"
    if target == toolchain.NATIVE and is_current(folder / library_name(target), compiler):
        return f"the library of kernels is up to date ({compiler.version})"
    with tempfile.TemporaryDirectory() as name:
        texts = Path(name) / "texts"
        write_texts(texts)
        compile_libraries(texts, folder, compiler, [target])
    return f"compiled the library of kernels ({compiler.version})"


NO_COMPILER = "no C++ compiler was found: osimlite computes by numba where that is installed, else in Python, much slower"
"""What the build says where there is no library."""


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    text = commands.add_parser("text", help="write the C++ text")
    text.add_argument("folder", type=Path)
    text.add_argument("part", nargs="?", choices=PARTS)
    library = commands.add_parser("library", help="build osimlite/native in this source tree")
    library.add_argument("--target", default=toolchain.NATIVE)
    options = parser.parse_args()
    if options.command == "library":
        print(build_in_place(options.target))
    elif options.part is None:
        write_texts(options.folder)
    else:
        options.folder.mkdir(parents=True, exist_ok=True)
        write_text(options.folder, options.part)


if __name__ == "__main__":
    main()
