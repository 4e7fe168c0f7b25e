"""From functions of :mod:`osimlite.kernels` to the intermediate language of LLVM, by numba.

The kernels know of no compiler. An entry is compiled with the functions that it calls within. It takes addresses of
arrays and numbers, holds no reference to any Python object, and runs without Python's lock. Numba would make machine
code of every function that it meets, and optimise each once more within each that calls it; here it only translates
them, and what an entry needs is optimised once, as a whole.

No other module knows what numba is like inside. These parts of it are promised to nobody: `TESTED` of
:mod:`osimlite.simulation.engines.object_code` says in which versions they were found so, and the tests of this module
fail where one of them has moved.
"""

from __future__ import annotations

import dis
import re
from collections.abc import Iterator
from functools import cache
from inspect import signature
from types import FunctionType, ModuleType
from typing import Any

from osimlite._require import require
from osimlite.errors import UnsupportedError
from osimlite.kernels import pointers
from osimlite.kernels.layout import Record
from osimlite.simulation.engines.object_code import machine

numba = require("numba", extra="sim", purpose="the compiled engine")

from llvmlite import binding as llvm  # type: ignore[import-untyped]  # noqa: E402
from llvmlite import ir  # noqa: E402
from numba.core import codegen, typed_passes, types, untyped_passes  # noqa: E402
from numba.core.compiler import CompilerBase  # noqa: E402
from numba.core.compiler_machinery import PassManager  # noqa: E402
from numba.extending import intrinsic  # noqa: E402

from osimlite.simulation.engines import tangents  # noqa: E402

if hasattr(numba.core.config, "_config_fname"):
    # numba reads `.numba_config.yaml` in the current folder again before each compilation; the folder may be a
    # stranger's, and the file decides what is compiled and where it is cached.
    numba.core.config._config_fname = ""

POINTERS: dict[str, Any] = {
    "Floats": types.CPointer(types.float64),  # type: ignore[no-untyped-call]
    "Ints": types.CPointer(types.int64),  # type: ignore[no-untyped-call]
}
NUMBERS: dict[str, Any] = {"float": types.float64, "int": types.int64}


@intrinsic
def _at(context: Any, vector: Any, place: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.gep(arguments[0], [arguments[1]])

    return vector(vector, types.int64), generate


@intrinsic
def _call(context: Any, address: Any, model: Any, reals: Any, data: Any, y: Any, f: Any, place: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        parts = [context.get_value_type(part) for part in signature.args[1:]]
        function = ir.FunctionType(context.get_value_type(types.int64), parts)
        return builder.call(builder.inttoptr(arguments[0], function.as_pointer()), arguments[1:])

    return types.int64(types.int64, model, reals, data, y, f, types.int64), generate


INSTRUCTIONS: dict[Any, Any] = {pointers.at: _at, pointers.call: _call, **tangents.INSTRUCTIONS}
"""What stands in the place of functions that Python has and machine code has not."""


class _Library(codegen.JITCodeLibrary):
    """A function as it was translated, and the libraries of those that it calls."""

    def _optimize_functions(self, module: Any) -> None:
        module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        return 0

    def modules(self) -> Iterator[Any]:
        """Copies of all that belongs together."""
        pending: list[Any] = [self]
        seen = set()
        while pending:
            library = pending.pop()
            if library in seen:
                continue
            seen.add(library)
            if isinstance(library, _Library):
                pending += library._linking_libraries
                yield library._final_module.clone()
            else:
                yield library._get_module_for_linking().clone()


class _Translator(codegen.JITCPUCodegen):
    _library_class = _Library

    def set_env(self, name: str, env: Any) -> None:
        """Nothing here needs an environment."""


@cache
def _own_parts() -> dict[str, Any]:
    """What the kernels do not share with other functions that numba compiles in this process."""
    translator: Any = _Translator
    return {"_internal_codegen": translator("osimlite"), "cached_internal_func": {}}


class _Pipeline(CompilerBase):
    """Those passes of numba's that scalar code without Python objects needs."""

    def __init__(self, typing: Any, target: Any, *rest: Any) -> None:
        super().__init__(typing, target.subtarget(**_own_parts()), *rest)  # type: ignore[no-untyped-call]

    def define_pipelines(self) -> list[Any]:
        passes: Any = PassManager("kernels")  # type: ignore[no-untyped-call]
        for step in (
            untyped_passes.TranslateByteCode,
            untyped_passes.FixupArgs,
            untyped_passes.IRProcessing,
            untyped_passes.ReconstructSSA,
            typed_passes.NopythonTypeInference,
            typed_passes.PreLowerStripPhis,
            typed_passes.IRLegalization,
            typed_passes.NativeLowering,
            typed_passes.NoPythonBackend,
        ):
            passes.add_pass(step, step.__name__)
        passes.finalize()
        return [passes]


LEAN = {"error_model": "numpy", "_nrt": False, "pipeline_class": _Pipeline}
"""No exceptions where a number is divided by zero; nothing is allocated."""


def compiled(function: Any, directions: int = 0) -> tuple[str, str]:
    """Text and symbol of an entry; with directions, of one whose vectors carry their derivatives along so many.

    Raises:
        UnsupportedError: there is no rule for the derivatives of something in it.
    """
    kinds = {**POINTERS, **NUMBERS}
    if directions:
        kinds["Floats"] = tangents.Duals(tangents.Dual(directions))  # type: ignore[no-untyped-call]
    parts = [kinds[part.annotation] for part in signature(function).parameters.values()]
    try:
        entry = numba.cfunc(types.int64(*parts), nopython=True, **LEAN)(_linked(function))
    except numba.TypingError as error:
        if not directions:
            raise
        told = re.sub(r"\x1b\[\d*m", "", str(error))
        lines = (line for line in told.splitlines() if line and "Failed in" not in line)
        raise UnsupportedError(f"'{function.__name__}' has no derivatives: {next(lines, '')}") from error
    whole = llvm.parse_assembly("")
    for module in entry._library.modules():
        whole.link_in(module)
    for part in whole.functions:
        if not part.is_declaration and part.name != entry.native_name:
            part.linkage = "internal"
    builder = llvm.create_pass_builder(machine(), llvm.create_pipeline_tuning_options(speed_level=3))
    builder.getModulePassManager().run(whole, builder)
    return str(whole), entry.native_name


@cache
def _within(function: Any) -> Any:
    """A function that is called by compiled ones."""
    return numba.njit(_linked(function), no_cpython_wrapper=True, no_cfunc_wrapper=True, **LEAN)


@cache
def _as_module(record: Record) -> ModuleType:
    """A record as what numba reads constants from."""
    module = ModuleType(record.__name__)
    vars(module).update(vars(record))
    return module


def _linked(function: Any) -> Any:
    """A function that calls the compiled ones of ours in their place."""
    scope = dict(function.__globals__)
    for called in {item.argval for item in dis.get_instructions(function) if item.opname == "LOAD_GLOBAL"}:
        value = scope.get(called)
        if isinstance(value, FunctionType) and value.__module__.startswith("osimlite."):
            scope[called] = INSTRUCTIONS.get(value) or _within(value)
        elif isinstance(value, Record):
            scope[called] = _as_module(value)
    copy = FunctionType(function.__code__, scope, function.__name__, function.__defaults__, None)
    copy.__qualname__, copy.__module__ = function.__qualname__, function.__module__
    return copy
