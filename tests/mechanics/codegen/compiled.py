"""Compile and call C++ kernels, and call the same kernels as Python on the same vectors."""

from __future__ import annotations

import ctypes
import math
import os
import shlex
import shutil
import struct
import subprocess
from array import array

import pytest

from osimlite.mechanics.codegen.cplusplus import HEADER, header_text

# Command of the compiler, or None without a compiler.
COMPILER = os.environ.get("CXX") or next(
    filter(None, map(shutil.which, ("clang++", "g++", "c++"))), None
)
needs_compiler = pytest.mark.skipif(
    COMPILER is None, reason="needs a C++ compiler on the PATH, or in CXX"
)

# Functions that only tests use may contain unused variables.
WARNINGS = "-Wall -Wextra -Wpedantic -Werror -Wno-unused -Wno-unused-parameter"
FLAGS = "-std=c++17 -fPIC -shared -fvisibility=hidden -ffp-contract=off -fno-exceptions"
SIZE = 40
"""Length of the vector of results."""


def compile_text(folder, text, *flags, compiler=COMPILER, name="kernels"):
    """Compile C++ text without a warning, and return the loaded library.

    The arguments are those of `build_library`.
    """
    library = build_library(folder, text, *flags, compiler=compiler, name=name)
    return ctypes.CDLL(str(library))


def build_library(folder, text, *flags, compiler=COMPILER, name="kernels"):
    """Compile C++ text without a warning, and return the path of the library.

    A library with a sanitizer must not be loaded here: it ends a process that did not start with
    it.

    Args:
        folder: folder of the files.
        text: text of one translation unit.
        flags: options of the compiler; `-O1` by default.
        compiler: command of the compiler.
        name: name of the files without suffix.
    """
    (folder / HEADER).write_text(header_text())
    source, library = folder / f"{name}.cpp", folder / f"{name}.so"
    source.write_text(text)
    command = [*shlex.split(compiler), *FLAGS.split(), *WARNINGS.split(), *(flags or ["-O1"])]
    result = subprocess.run(
        [*command, source.name, "-o", library.name], cwd=folder, capture_output=True, text=True
    )
    assert result.returncode == 0, result.stderr[:5000]
    return library


def call_library(library, symbol, ints, floats, count):
    """Call an exported kernel with integers, floats, a vector of results and a count.

    Args:
        library: loaded library.
        symbol: exported name.
        ints: integers.
        floats: floats.
        count: count.

    Returns:
        Return value of the kernel, and the three vectors after the call.
    """
    kernel = getattr(library, symbol)
    kernel.restype = ctypes.c_int64
    kernel.argtypes = [*[ctypes.c_void_p] * 3, ctypes.c_int64]
    vectors = array("q", ints), array("d", floats), array("d", [0.0] * SIZE)
    result = kernel(*(vector.buffer_info()[0] for vector in vectors), count)
    return [result, *(vector.tolist() for vector in vectors)]


def call_python(function, ints, floats, count):
    """Call a kernel as Python; arguments and results are those of `call_library`."""
    vectors = array("q", ints), array("d", floats), array("d", [0.0] * SIZE)
    result = function(*map(memoryview, vectors), count)
    return [int(result), *(vector.tolist() for vector in vectors)]


def are_same_bits(one, two):
    """Return whether two results have the same bits; all NaN count as equal."""
    if isinstance(one, list):
        return len(one) == len(two) and all(map(are_same_bits, one, two))
    if isinstance(one, float) and isinstance(two, float):
        return struct.pack("d", one) == struct.pack("d", two) or (
            math.isnan(one) and math.isnan(two)
        )
    return one == two
