"""Numba's internals are as `compiler.py` takes them: a new numba in which they have moved fails here."""

from __future__ import annotations

import ctypes
import tomllib

import pytest

pytest.importorskip("numba", reason="needs numba (extra 'sim')")

import numba
from llvmlite import binding as llvm  # type: ignore[import-untyped]
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

from osimlite.errors import OsimliteError
from osimlite.kernels.pointers import Floats, Ints, at
from osimlite.simulation.elements.laws import law_function
from osimlite.simulation.engines import compiler, object_code, side_by_side

MOVED = "numba {} is not as osimlite/simulation/engines/compiler.py takes it: {}"


def twice(x: float) -> float:
    return 2.0 * x


twice.__module__ = "osimlite.canary"


def canary(s: Ints, x: Floats, count: int) -> int:
    """Reads and writes, moves a pointer, calls a function of ours, divides by zero."""
    for number in range(count):
        at(x, s[0])[number] = twice(x[number]) / x[count - 1]
    return count


def test_this_numba_is_one_of_those_that_are_asked_for(repo):
    assert numba.__version__ in SpecifierSet(object_code.TESTED), (
        f"numba {numba.__version__} is newer than what was tried: run this module and tests/simulation with it, then "
        "set TESTED in object_code.py and the range in pyproject.toml"
    )
    extras = tomllib.loads((repo / "pyproject.toml").read_text())["project"]["optional-dependencies"]["sim"]
    ranges = {
        str(asked.specifier)
        for asked in map(Requirement, extras)
        if asked.name == "numba" and "==" not in str(asked.specifier)
    }
    assert ranges == {str(SpecifierSet(object_code.TESTED))}
    assert object_code.numba_version() == numba.__version__


@pytest.mark.parametrize(
    ("owner", "names"),
    [
        ("codegen.JITCodeLibrary", "_optimize_functions finalize get_pointer_to_function _get_module_for_linking"),
        ("codegen.JITCPUCodegen", "_library_class set_env"),
        ("CompilerBase", "define_pipelines"),
        ("PassManager", "add_pass finalize"),
        ("untyped_passes", "TranslateByteCode FixupArgs IRProcessing ReconstructSSA"),
        ("typed_passes", "NopythonTypeInference PreLowerStripPhis IRLegalization NativeLowering NoPythonBackend"),
    ],
)
def test_what_is_replaced_or_called_is_there(owner, names):
    part = compiler
    for word in owner.split("."):
        part = getattr(part, word)
    missing = [name for name in names.split() if not hasattr(part, name)]
    assert not missing, MOVED.format(numba.__version__, f"{owner} has no {', '.join(missing)}")


def test_the_fields_of_libraries_and_contexts_are_there():
    library = compiler._Translator("canary").create_library("canary")
    context = numba.core.registry.cpu_target.target_context
    for part, names in (
        (library, "_codegen _finalized _linking_libraries _final_module"),
        (library._codegen, "_data_layout"),
        (context, "_internal_codegen cached_internal_func"),
    ):
        missing = [name for name in names.split() if not hasattr(part, name)]
        assert not missing, MOVED.format(numba.__version__, f"{type(part).__name__} has no {', '.join(missing)}")


def test_an_entry_is_one_module_without_python_and_runs():
    text, symbol = compiler.compiled(canary)
    module = llvm.parse_assembly(text)
    assert [part.name for part in module.functions if not part.is_declaration and part.linkage.name == "external"] == [
        symbol
    ]
    code = object_code.translated(text)
    address = object_code._link(code, symbol)
    run = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64)(address)
    s, x = (ctypes.c_int64 * 1)(2), (ctypes.c_double * 4)(1.0, 0.0, 0.0, 0.0)
    assert run(ctypes.addressof(s), ctypes.addressof(x), 2) == 2
    # An index past a pointer, the call, and a division by zero that raises nothing.
    assert x[2] == float("inf") and x[3] != x[3]


def test_the_largest_kernel_needs_nothing_of_numba_to_run():
    text, _ = compiler.compiled(law_function("merson"))
    wanted = {part.name for part in llvm.parse_assembly(text).functions if part.is_declaration}
    own = {name for name in wanted if not name.startswith(("llvm.", "numba_"))}
    assert all(llvm.address_of_symbol(name) for name in own), own
    assert b"numba_" not in object_code.translated(text)


def test_a_numba_that_is_otherwise_inside_is_told_in_a_sentence(monkeypatch):
    def moved(function, directions):
        raise AttributeError("'Library' object has no attribute '_final_module'")

    monkeypatch.setattr(compiler, "compiled", moved)
    with pytest.raises(OsimliteError, match=r"numba .* cannot compile .*_final_module.*pip install 'numba>="):
        side_by_side.made("merson")
