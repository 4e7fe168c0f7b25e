"""Kernels that a C++ compiler compiles one by one: edited ones, and those of a user's own force types.

Each becomes a small shared library in a folder that only the user can write to. The file name
contains the digest of the kernel's sources. A checksum detects damage; the permissions of the
folder guarantee who wrote a file.
"""

from __future__ import annotations

import ctypes
import hashlib
import logging
import os
import sys
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path
from typing import Any

from osimlite.base.cores import count_cores
from osimlite.errors import OsimliteError
from osimlite.mechanics.codegen import cplusplus, reader
from osimlite.mechanics.codegen.processor import machine_name, processor_features
from osimlite.mechanics.codegen.reader import TranslationError
from osimlite.mechanics.codegen.sources import compute_digest
from osimlite.mechanics.codegen.toolchain import (
    NATIVE,
    CompilationError,
    find_compiler,
    library_suffix,
)
from osimlite.simulation.elements.laws import find_law, get_symbol
from osimlite.simulation.engines.private_files import read_private, write_private
from osimlite.simulation.engines.result_cache import cache_folders

_log = logging.getLogger(__name__)

_libraries: list[ctypes.CDLL] = []
"""Loaded libraries; their machine code is valid as long as these objects exist."""


Function = Callable[..., Any]


def load_function(symbol: str, function: Function, directions: int) -> int | None:
    """Return the address of a function that was compiled earlier.

    Args:
        symbol: name of the function in the library.
        function: the function it was compiled from.
        directions: number of derivatives of its dual numbers; 0 for floats.

    Returns:
        The address; None if no trusted file has the function.
    """
    file = _file_name(symbol, function, directions)
    for folder in cache_folders():
        code = read_private(folder / file)
        checksum = read_private(folder / f"{file}.sha256")
        if (
            code is not None
            and checksum is not None
            and hashlib.sha256(code).hexdigest().encode() == checksum
        ):
            try:
                return _load_library(folder / file, symbol)
            except (OSError, AttributeError):
                continue
    return None


def load_law(name: str) -> int | None:
    """Return the address of a law that was compiled earlier; None if no trusted file has it."""
    return load_function(get_symbol(name), *find_law(name))


def compile_laws(names: Sequence[str]) -> dict[str, int]:
    """Compile laws on all cores.

    Args:
        names: names of the laws.

    Returns:
        Addresses by name.

    Raises:
        CompilationError: there is no compiler, it failed, or a law cannot be translated.
    """
    find_compiler()
    _log.info("compiling %d kernel%s", len(names), "s"[: len(names) > 1])
    with ThreadPoolExecutor(max(1, min(count_cores(), len(names)))) as pool:
        addresses = pool.map(
            lambda name: compile_function(get_symbol(name), *find_law(name)), names
        )
        result = dict(zip(names, addresses, strict=True))
    _log.info("compiled %d kernel%s", len(names), "s"[: len(names) > 1])
    return result


def compile_function(symbol: str, function: Function, directions: int) -> int:
    """Compile a function, and save it if a folder allows that.

    Args:
        symbol: name of the function in the library.
        function: a function in the restricted Python of kernels.
        directions: number of derivatives of its dual numbers; 0 for floats.

    Returns:
        The address of the function.

    Raises:
        CompilationError: there is no compiler, it failed, or the function cannot be translated.
    """
    compiler = find_compiler()
    if compiler is None:
        raise CompilationError("no C++ compiler is installed")
    try:
        text = cplusplus.write_library({symbol: (function, directions)})
    except (TranslationError, OSError) as error:
        # Python raises OSError for a function without source text.
        raise CompilationError(f"'{symbol}' cannot be compiled: {error}") from error
    with tempfile.TemporaryDirectory() as work:
        folder = Path(work)
        (folder / cplusplus.HEADER).write_text(cplusplus.header_text(), encoding="utf-8")
        (folder / "law.cpp").write_text(text, encoding="utf-8")
        result = folder / _file_name(symbol, function, directions)
        compiler.compile(folder / "law.cpp", folder / "law.o", NATIVE)
        compiler.link([folder / "law.o"], result)
        saved_library = _save_library(result)
        if saved_library is not None:
            return _load_library(saved_library, symbol)
        # A loaded library can be deleted, except on Windows.
        if os.name != "nt":
            return _load_library(result, symbol)
        # Windows locks loaded libraries, so this one must outlive the temporary folder.
        lasting = Path(tempfile.mkdtemp()) / result.name
        result.rename(lasting)
        return _load_library(lasting, symbol)


def _save_library(library: Path) -> Path | None:
    """Copy a library into the first folder that only the user can write to.

    Args:
        library: path of the library.

    Returns:
        Path of the copy; None if there is no such folder.
    """
    code = library.read_bytes()
    refusals = []
    for folder in cache_folders():
        path = folder / library.name
        try:
            checksum = hashlib.sha256(code).hexdigest().encode()
            write_private(path, code)
            write_private(path.with_name(f"{path.name}.sha256"), checksum)
            return path
        except OsimliteError as error:
            refusals.append(str(error))
    warn_first_time(
        f"machine code is compiled again in every run, because it cannot be saved: {'; '.join(refusals)}"
    )
    return None


@cache
def warn_first_time(sentence: str) -> None:
    """Log a warning, the first time that the process meets this sentence."""
    _log.warning(sentence)


def _load_library(path: Path, symbol: str) -> int:
    """Return the address of a function of a library, which remains loaded."""
    library = ctypes.CDLL(os.path.realpath(path))
    address = ctypes.cast(library[symbol], ctypes.c_void_p).value
    _libraries.append(library)
    assert address is not None
    return address


def _file_name(symbol: str, function: Function, directions: int) -> str:
    """Return the file name of a function, which depends on its sources and on the processor."""
    parts = compute_digest(function, _digest_translator()), directions, describe_machine()
    return f"{symbol}-{hashlib.sha256(repr(parts).encode()).hexdigest()[:16]}{library_suffix()}"


@cache
def _digest_translator() -> str:
    """Return a digest of the translator from laws to C++."""
    folder = Path(cplusplus.__file__).parent
    files = sorted(path for path in folder.rglob("*") if path.suffix in (".py", ".h"))
    files.append(Path(reader.__file__))
    return hashlib.sha256(b"\0".join(path.read_bytes() for path in files)).hexdigest()


@cache
def describe_machine() -> tuple[str, ...]:
    """Describe the machine for which code is compiled.

    Returns:
        Operating system, architecture, and the features of the processor.
    """
    return sys.platform, machine_name(), *sorted(processor_features())
