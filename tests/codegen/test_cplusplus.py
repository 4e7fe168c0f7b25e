"""Kernels become C++ that computes what they compute in Python."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess

import pytest

from osimlite.codegen.cplusplus import HEADER, header_text, write_library, write_units
from osimlite.codegen.reader import TranslationError

COMPILER = os.environ.get("CXX") or next(filter(None, map(shutil.which, ("g++", "clang++"))), None)
FLAGS = "-std=c++17 -O1 -fPIC -shared -fvisibility=hidden -ffp-contract=off -Wall -Wextra -Wpedantic -Werror"
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="needs a C++ compiler on the PATH, or in CXX")


def compile_text(folder, text):
    """Return the library of some C++ text."""
    (folder / HEADER).write_text(header_text())
    source, library = folder / "kernels.cpp", folder / "kernels.so"
    source.write_text(text)
    command = [COMPILER, *FLAGS.split(), "-Wno-unused", str(source), "-o", str(library)]
    result = subprocess.run(command, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return ctypes.CDLL(str(library))


def branch(a: float, b: float) -> float:
    """Every kind of expression."""
    low, high = (a, b) if a <= b else (b, a)
    if not 0.0 < low < 10.0 or high == 7.0:
        return -low // 2 + low % 0.75 + 4.0 % -high + (high - 1.0) ** 2 / 4
    elif low != high and (a > 1.0 or b > 1.0):
        low, high = high, low
        return abs(low) + max(low, 3.0 * high) - min(low, high, 0.5)
    return float(int(high * 3.7))


@needs_compiler
def test_functions_give_the_same(tmp_path):
    library = compile_text(tmp_path, write_library({"branch": (branch, 0)}))
    library.branch.restype = ctypes.c_double
    library.branch.argtypes = [ctypes.c_double] * 2
    for a in (-1.5, 0.5, 2.0, 12.0):
        for b in (0.5, 1.0, 7.0, 9.25):
            assert library.branch(a, b) == branch(a, b)


def list_numbers(count: int) -> float:
    """A construct that kernels do not use."""
    numbers = [0.0] * count
    return numbers[0]


def test_what_cannot_be_translated_is_named():
    with pytest.raises(TranslationError, match=r"kernel 'numbers': .*list_numbers.* \[0\.0\]") as caught:
        write_library({"numbers": (list_numbers, 0)})
    assert caught.value.file == __file__
    assert caught.value.line == list_numbers.__code__.co_firstlineno + 2


def twice(a: float) -> float:
    """A kernel that shares nothing with another."""
    return 2.0 * a


def test_units_share_the_kernels():
    units = write_units({"one": (branch, 0), "two": (twice, 4)}, 3)
    assert [unit.count("OSIMLITE_EXPORT") for unit in units] == [1, 1]
    assert "Dual<4> two(Dual<4> a)" in units[1]
