"""Kernels that numba compiles, where there is neither a compiled library nor a C++ compiler.

Only documented functions of numba are used: `njit`, `cfunc` and `intrinsic`. Numba caches compiled
functions in its own files.
"""

from __future__ import annotations

import dis
import inspect
from functools import cache
from importlib.util import find_spec
from inspect import signature
from types import FunctionType, ModuleType
from typing import Any

from osimlite.base.require import require
from osimlite.mechanics.codegen.sources import compute_digest
from osimlite.mechanics.codegen.toolchain import CompilationError
from osimlite.mechanics.kernels import pointers
from osimlite.mechanics.kernels.layout import Record
from osimlite.simulation.elements.laws import find_law

_entries: dict[str, Any] = {}
"""Compiled laws by name; their machine code is valid as long as these objects exist."""


@cache
def has_numba() -> bool:
    """Return whether numba is installed, without loading it."""
    try:
        return find_spec("numba") is not None
    except ValueError:
        return False


def compile_law(name: str) -> int:
    """Compile a kernel of floats.

    Args:
        name: name of the kernel.

    Returns:
        Address of the kernel.

    Raises:
        CompilationError: the kernel needs dual numbers, or numba cannot compile it.
    """
    function, directions = find_law(name)
    if directions:
        raise CompilationError("numba has no derivatives of kernels")
    if name not in _entries:
        tools = _load_tools()
        kinds = [tools.kinds[part.annotation] for part in signature(function).parameters.values()]
        linked = _link_callees(function, tools)
        # Numba's cache does not notice changes of called functions: the digest in the name does.
        linked.__qualname__ = f"{linked.__qualname__}_{compute_digest(function)}"
        sign = tools.numba.types.int64(*kinds)
        try:
            _entries[name] = tools.numba.cfunc(
                sign, nopython=True, cache=True, error_model="numpy"
            )(linked)
        except tools.numba.errors.NumbaError as error:
            raise CompilationError(f"numba cannot compile '{name}': {error}") from error
    address: int = _entries[name].address
    return address


class _Tools:
    """Functions and types of numba that the kernels need."""

    def __init__(self, numba: ModuleType) -> None:
        config: Any = getattr(numba.core, "config", None)
        if hasattr(config, "_config_fname"):
            # Numba reads `.numba_config.yaml` in the current folder before each compilation. That
            # folder may belong to others, and the file decides what is compiled and where it is
            # cached.
            config._config_fname = ""
        types: Any = numba.types
        intrinsic: Any = require(
            "numba.extending", extra="jit", purpose="the compiled engine"
        ).intrinsic
        ir: Any = require("llvmlite.ir", extra="jit", purpose="the compiled engine")
        self.numba: Any = numba
        self.kinds = {
            "Floats": types.CPointer(types.float64),
            "Ints": types.CPointer(types.int64),
            "float": types.float64,
            "int": types.int64,
        }

        # The kernels address parts of vectors and call functions by address, which Python and numba
        # cannot express. Two intrinsics generate the machine instructions.
        def offset_pointer(context: Any, vector: Any, index: Any) -> Any:
            def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                return builder.gep(arguments[0], [arguments[1]])

            return vector(vector, types.int64), generate

        def call_address(
            context: Any,
            address: Any,
            model: Any,
            reals: Any,
            data: Any,
            y: Any,
            f: Any,
            index: Any,
        ) -> Any:
            def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                parts = [context.get_value_type(part) for part in signature.args[1:]]
                function = ir.FunctionType(context.get_value_type(types.int64), parts)
                return builder.call(
                    builder.inttoptr(arguments[0], function.as_pointer()), arguments[1:]
                )

            return types.int64(types.int64, model, reals, data, y, f, types.int64), generate

        self.replacements: dict[Any, Any] = {
            pointers.at: intrinsic(offset_pointer),
            pointers.call: intrinsic(call_address),
        }


@cache
def _load_tools() -> _Tools:
    return _Tools(require("numba", extra="jit", purpose="the compiled engine"))


@cache
def _compile_callee(function: Any) -> Any:
    """Return a compiled function for calls from compiled functions."""
    tools = _load_tools()
    return tools.numba.njit(_link_callees(function, tools), error_model="numpy")


@cache
def _to_module(record: Record) -> ModuleType:
    """Return a record of constants as a module, from which numba reads constants."""
    module = ModuleType(record.__name__)
    vars(module).update(vars(record))
    return module


def _link_callees(function: Any, tools: _Tools) -> Any:
    """Return a copy of a function whose calls within this package lead to compiled functions.

    Args:
        function: the function.
        tools: numba's functions.
    """
    scope = dict(function.__globals__)
    for callee in {
        item.argval for item in dis.get_instructions(function) if item.opname == "LOAD_GLOBAL"
    }:
        value = scope.get(callee)
        if isinstance(value, FunctionType) and value.__module__.startswith("osimlite."):
            scope[callee] = tools.replacements.get(value) or _compile_callee(value)
        elif isinstance(value, Record):
            scope[callee] = _to_module(value)
    code = function.__code__
    if code.co_filename.startswith("<"):
        # Numba caches only functions that have a file; a generated kernel belongs to the module
        # that declares it.
        module = inspect.getsourcefile(__import__(function.__module__, fromlist=["_"]))
        code = code.replace(co_filename=module or code.co_filename)
    copy = FunctionType(code, scope, function.__name__, function.__defaults__, None)
    copy.__qualname__, copy.__module__ = function.__qualname__, function.__module__
    return copy
