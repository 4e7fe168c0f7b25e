"""Tests of all kernels as C++: equal bits from every compiler and optimization level, and no undefined behaviour."""

from __future__ import annotations

import ast
import json
import os
import shlex
import shutil
import subprocess
import sys
from array import array
from copy import deepcopy

import pytest

from osimlite.mechanics.codegen.cplusplus import write_library
from osimlite.mechanics.codegen.reader import find_tree
from osimlite.mechanics.codegen.sources import collect_functions
from osimlite.simulation.elements.laws import get_symbol, list_library_laws
from tests.conftest import ROOT
from tests.mechanics.codegen import motions, pure_functions
from tests.mechanics.codegen.compiled import (
    are_same_bits,
    build_library,
    compile_text,
    needs_compiler,
)

pytestmark = [pytest.mark.full, pytest.mark.timeout(3600)]

STRICT = "-fno-fast-math", "-fno-math-errno", "-fno-trapping-math", "-fno-tree-slp-vectorize", "-w"
CALLS = 100
"""Number of calls of each pure function."""
MOTIONS, TANGENTS = 40, 20
"""Numbers of models, without those of the shared folder, whose motions and whose derivatives are compared."""


def compilers():
    """Return the compilers that are installed."""
    return [name for name in ("g++", "clang++") if shutil.which(name)]


@pytest.fixture(scope="module")
def wrapped():
    """Return the kernels that call pure functions, by function."""
    return pure_functions.wrap_functions()


@pytest.fixture(scope="module")
def text(wrapped):
    """Translate all of these kernels to C++."""
    return write_library({kernel.__name__: (kernel, 0) for kernel in wrapped.values()})


def raise_by_products(base, exponent):
    """Compute a power as compiled code does: by products if the exponent is an integer."""
    if not isinstance(base, float) or not isinstance(exponent, int) or abs(exponent) > 0x10000:
        return base**exponent
    result, rest = 1.0, abs(exponent)
    while rest:
        if rest & 1:
            result *= base
        rest >>= 1
        base *= base
    return 1.0 / result if exponent < 0 else result


class PowersAsCalls(ast.NodeTransformer):
    """Transformer of syntax trees that replaces powers by calls of `raise_by_products`."""

    changed = False

    def visit_BinOp(self, node):
        self.generic_visit(node)
        if not isinstance(node.op, ast.Pow):
            return node
        self.changed = True
        function = ast.Name(raise_by_products.__name__, ast.Load())
        return ast.copy_location(ast.Call(function, [node.left, node.right], []), node)


@pytest.fixture
def powers_by_products(wrapped, monkeypatch):
    """Make the functions compute integer powers by products when they run as Python.

    Python rounds such a power once, compiled code after each product. Iterative searches amplify
    this difference in the last bit beyond any tolerance.
    """
    functions = {part for function in wrapped for part in collect_functions(function)}
    for function in functions:
        transformer = PowersAsCalls()
        tree = transformer.visit(deepcopy(find_tree(function)))
        if transformer.changed:
            module = ast.fix_missing_locations(ast.Module([tree], []))
            scope = dict(function.__globals__)
            exec(compile(module, function.__code__.co_filename, "exec"), scope)
            monkeypatch.setitem(function.__globals__, raise_by_products.__name__, raise_by_products)
            monkeypatch.setattr(function, "__code__", scope[function.__name__].__code__)


@needs_compiler
def test_functions_of_numbers_are_those_of_python(wrapped, text, tmp_path, powers_by_products):
    library = compile_text(tmp_path, text, "-O2", *STRICT)
    compared = 0
    for function, kernel in wrapped.items():
        for number in range(CALLS):
            ints, floats = pure_functions.make_arguments(
                kernel.__name__, number, 0.3 * (number % 2)
            )
            out = array("d", [0.0] * pure_functions.SIZE)
            try:
                kernel(memoryview(ints), memoryview(floats), memoryview(out), 0)
            except (ArithmeticError, ValueError, IndexError, TypeError):
                continue
            result = pure_functions.call_compiled(library, kernel.__name__, ints, floats)
            compared += 1
            assert are_same_bits(result, out.tolist()), (function.__qualname__, number)
    assert len(wrapped) > 150
    assert compared > 0.5 * CALLS * len(wrapped)


@pytest.mark.skipif(len(compilers()) < 1, reason="needs g++ or clang++ on the PATH")
def test_every_build_of_functions_gives_the_same_bits(wrapped, text, tmp_path):
    levels = ["-O0"], ["-O2"], ["-O3"], ["-O3", "-march=native"]
    builds = [
        compile_text(tmp_path, text, *level, *STRICT, compiler=name, name=f"{name}{number}")
        for name in compilers()
        for number, level in enumerate(levels)
    ]
    for kernel in wrapped.values():
        for number in range(CALLS // 4):
            given = pure_functions.make_arguments(kernel.__name__, number, 0.3 * (number % 2))
            first, *others = (
                pure_functions.call_compiled(build, kernel.__name__, *given) for build in builds
            )
            assert all(are_same_bits(first, other) for other in others), (kernel.__name__, number)


SANITIZERS = {
    "undefined": "-fsanitize=undefined,float-cast-overflow,bounds -fno-sanitize-recover=all",
    "address": "-fsanitize=address",
}


def environment(compiler, name):
    """Return environment variables with which a process can load a library that was built with a sanitizer.

    Args:
        compiler: command of the compiler.
        name: "undefined" or "address".
    """
    library = {"undefined": "libubsan.so", "address": "libasan.so"}[name]
    path = subprocess.run(
        [compiler, f"-print-file-name={library}"], capture_output=True, text=True, check=True
    ).stdout.strip()
    if not os.path.isabs(path):
        pytest.skip(f"needs {library} of {compiler}")
    options = {
        "ASAN_OPTIONS": "detect_leaks=0:detect_stack_use_after_return=1",
        "UBSAN_OPTIONS": "print_stacktrace=1",
    }
    return {**os.environ, **options, "LD_PRELOAD": path, "PYTHONPATH": str(ROOT)}


def run_module(module, *arguments, env=None):
    """Run a module of these tests in a separate process, and return its output."""
    command = [sys.executable, "-m", module, *map(str, arguments)]
    result = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, env=env)
    assert result.returncode == 0, result.stderr[-3000:]
    return result.stdout


@pytest.mark.skipif(not shutil.which("g++"), reason="needs g++ on the PATH")
@pytest.mark.parametrize("name", SANITIZERS)
def test_functions_have_no_undefined_behaviour(wrapped, text, tmp_path, name):
    flags = shlex.split(SANITIZERS[name])
    library = build_library(tmp_path, text, "-O1", "-g", *flags, *STRICT, compiler="g++")
    symbols = [kernel.__name__ for kernel in wrapped.values()]
    calls = run_module(
        pure_functions.__name__,
        library,
        CALLS // 4,
        *symbols,
        env=environment("g++", name),
    )
    assert int(calls) == CALLS // 4 * len(wrapped)


# ------------------------------------------------------------------------------------------- complete models
@pytest.fixture(scope="module")
def kernels(tmp_path_factory):
    """Translate all kernels, for floats and for numbers with derivatives.

    Returns:
        C++ text, and symbols by name.
    """
    names = [*list_library_laws(0), *list_library_laws(16)]
    text = write_library(pure_functions.all_kernels(0) | pure_functions.all_kernels(16))
    return text, {name: get_symbol(name) for name in names}


def build_kernels(kernels, folder, compiler, *flags):
    """Compile all kernels for the program `motions`, and return the path of the library."""
    text, symbols = kernels
    name = f"{compiler}{''.join(flags[:1])}"
    library = build_library(folder, text, *flags, *STRICT, compiler=compiler, name=name)
    library.with_suffix(".json").write_text(json.dumps(symbols))
    return library


@pytest.mark.skipif(len(compilers()) < 1, reason="needs g++ or clang++ on the PATH")
def test_motions_and_tangents_are_the_same_bits(kernels, tmp_path):
    results = {}
    for compiler in compilers():
        for level in ("-O2", "-O3"):
            library = build_kernels(kernels, tmp_path, compiler, level)
            results[compiler, level] = json.loads(
                run_module(motions.__name__, library, MOTIONS, TANGENTS)
            )
    first, *others = results.values()
    # All of these models exist in every clone: none may be left out.
    assert [*first["motions"]][:MOTIONS] == [*motions.list_models()][:MOTIONS]
    assert [*first["tangents"]][:TANGENTS] == [*motions.list_models()][:TANGENTS]
    assert all(other == first for other in others), results


@pytest.mark.skipif(len(compilers()) < 1, reason="needs g++ or clang++ on the PATH")
def test_motions_are_those_of_numba(kernels, tmp_path):
    pytest.importorskip("numba", reason="needs numba (extra 'jit')")
    library = build_kernels(kernels, tmp_path, compilers()[0], "-O2")
    # With numba, kernels have no derivatives.
    compiled = json.loads(run_module(motions.__name__, library, MOTIONS, 0))["motions"]
    variables = {"OSIMLITE_KERNELS": "numba", "NUMBA_CACHE_DIR": str(tmp_path)}
    by_numba = run_module(motions.__name__, "-", MOTIONS, 0, env={**os.environ, **variables})
    assert len(compiled) >= MOTIONS
    assert json.loads(by_numba)["motions"] == compiled


@pytest.mark.skipif(not shutil.which("g++"), reason="needs g++ on the PATH")
@pytest.mark.parametrize("name", SANITIZERS)
def test_motions_have_no_undefined_behaviour(kernels, tmp_path, name):
    library = build_kernels(kernels, tmp_path, "g++", "-O1", *shlex.split(SANITIZERS[name]))
    found = json.loads(run_module(motions.__name__, library, 6, 3, env=environment("g++", name)))
    assert len(found["motions"]) >= 3
