"""Library of kernels as C++ text: functions for the types that they are called with.

It contains the structs and constants that these need, too.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.resources import files
from inspect import Parameter, signature
from types import FunctionType
from typing import Any

from osimlite.mechanics.codegen.cplusplus.inference import Specialisation
from osimlite.mechanics.codegen.cplusplus.operators import escape_name, write_number
from osimlite.mechanics.codegen.cplusplus.statements import FunctionWriter
from osimlite.mechanics.codegen.cplusplus.types import (
    BOOLEAN,
    FLOAT,
    INTEGER,
    Dual,
    Pointer,
    Scalar,
    Tuple,
    Type,
    dual,
    pointer_to,
    type_of_constant,
)
from osimlite.mechanics.codegen.reader import Kernel, TranslationError

HEADER = "kernel_runtime.h"
"""Name of the header that every text includes."""
PARAMETERS: dict[str, Callable[[Type], Type]] = {
    "Floats": pointer_to,
    "Ints": lambda number: pointer_to(INTEGER),
    "float": lambda number: number,
    "int": lambda number: INTEGER,
}
"""Type of a parameter of an exported function, by its annotation and the type of its numbers."""

Kernels = Mapping[str, tuple[Callable[..., Any], int]]
"""Exports of a library: function and number of derivatives of its numbers, by symbol."""


class Library:
    """Functions, structs and constants of one library.

    Attributes:
        structs: definitions of structs.
        constants: definitions of constants.
        functions: text of each function, by name.
        exports: text of each exported function, by symbol.
        callees: names of the functions that each function or exported symbol calls.
    """

    def __init__(self) -> None:
        self._specialisations: dict[tuple[FunctionType, tuple[Type, ...]], Specialisation] = {}
        self._open: set[tuple[FunctionType, tuple[Type, ...]]] = set()
        self._function_names: dict[Specialisation, str] = {}
        self._type_names: dict[Type, str] = {}
        self._constant_names: dict[tuple[str, str], str] = {}
        self._used_names: set[str] = set()
        self.structs: list[str] = []
        self.constants: list[str] = []
        self.functions: dict[str, str] = {}
        """Texts of the functions by name; called functions come before those that call them."""
        self.exports: dict[str, str] = {}
        self.callees: dict[str, set[str]] = {}
        """Names of the functions that each function or exported symbol calls."""
        self._writing: list[str] = []

    @property
    def specialisations(self) -> list[Specialisation]:
        """Functions whose types were inferred; some of them may not be called."""
        return [*self._specialisations.values()]

    # -------------------------------------------------------------------------------------------------- writing
    def export(self, symbol: str, function: Callable[..., Any], directions: int) -> None:
        """Write a function with all that it calls, and make it visible outside of the library.

        Args:
            symbol: name under which the library exports the function.
            function: kernel to export.
            directions: number of derivatives that each float of the function carries; 0 for plain
                floats.

        Raises:
            TranslationError: the function, or one that it calls, uses something that has no
                counterpart in C++.
        """
        number = dual(directions) if directions else FLOAT
        try:
            assert isinstance(function, FunctionType)
            kinds = [
                self._parameter(function, item, number)
                for item in signature(function).parameters.values()
            ]
            specialisation = self.specialise(function, kinds)
            self._writing.append(symbol)
            self.callees[symbol] = set()
            name = self.name_function(specialisation)
            self._writing.pop()
        except TranslationError as error:
            message = f"kernel '{symbol}': {error.message}"
            raise TranslationError(message, file=error.file, line=error.line) from None
        assert specialisation.result is not None
        parameters = ", ".join(
            f"{self.name_type(kind)} {escape_name(argument)}"
            for argument, kind in zip(specialisation.argument_names, kinds, strict=True)
        )
        call = f"{name}({', '.join(map(escape_name, specialisation.argument_names))})"
        # Callers read an integer of eight bytes, and a truth value would fill one of them.
        result = INTEGER if specialisation.result is BOOLEAN else specialisation.result
        head = f"OSIMLITE_EXPORT {self.name_type(result)} {symbol}({parameters})"
        self.exports[symbol] = f"{head} {{\n    return {call};\n}}"

    @staticmethod
    def _parameter(function: Callable[..., Any], parameter: Parameter, number: Type) -> Type:
        annotation = str(getattr(parameter.annotation, "__name__", parameter.annotation)).strip(
            "'\""
        )
        if annotation not in PARAMETERS:
            kernel = Kernel(function, "C++")
            reason = f"the parameter '{parameter.name}' of an exported function is Floats, Ints, float or int"
            raise kernel.refuse(kernel.tree.args, reason)
        return PARAMETERS[annotation](number)

    def specialise(self, function: FunctionType, kinds: Sequence[Type]) -> Specialisation:
        """Return a function for given types of its arguments.

        Args:
            function: the function.
            kinds: types of its arguments.

        Raises:
            TranslationError: the function calls itself, or uses something that has no counterpart
                in C++.
        """
        key = function, tuple(kinds)
        if key not in self._specialisations:
            # An open key is a function whose inference has led back to itself; its type would have
            # no end.
            if key in self._open:
                kernel = Kernel(function, "C++")
                raise kernel.refuse(kernel.tree.args, "the function calls itself")
            self._open.add(key)
            try:
                self._specialisations[key] = Specialisation(function, kinds, self.specialise)
            finally:
                self._open.discard(key)
        return self._specialisations[key]

    def _make_unique_name(self, name: str) -> str:
        unique_name = escape_name(name)
        number = 1
        while unique_name in self._used_names:
            number += 1
            unique_name = f"{name}_{number}"
        self._used_names.add(unique_name)
        return unique_name

    # ---------------------------------------------------------------------------------------------------- names
    def name_function(self, function: Specialisation) -> str:
        """Return the name of a function, after writing it if necessary.

        The call graph is noted, so that a text contains what its symbols need only.
        """
        if function not in self._function_names:
            # The name is registered before the text is written, so that it is free for no other
            # function.
            name = self._function_names[function] = self._make_unique_name(function.name)
            self.callees[name] = set()
            self._writing.append(name)
            text = FunctionWriter(function, self).write(name)
            self._writing.pop()
            self.functions[name] = f"{self._comment(function)}\n{text}"
        if self._writing:
            self.callees[self._writing[-1]].add(self._function_names[function])
        return self._function_names[function]

    @staticmethod
    def _comment(function: Specialisation) -> str:
        code = function.function
        return f"// {code.__module__}.{code.__qualname__}"

    def name_type(self, kind: Type) -> str:
        """Return the name of a type, after defining it if necessary."""
        if isinstance(kind, Scalar | Dual):
            return repr(kind)
        if isinstance(kind, Pointer):
            return f"{self.name_type(kind.element)}*"
        if kind not in self._type_names:
            assert isinstance(kind, Tuple)
            self._type_names[kind] = self._name_tuple(kind)
        return self._type_names[kind]

    def _name_tuple(self, kind: Tuple) -> str:
        parts = [self.name_type(part) for part in kind.parts]
        if kind.is_array:
            return f"Array<{parts[0]}, {len(parts)}>"
        if kind.record is not None:
            name = self._make_unique_name(kind.record.__name__)
            fields = [escape_name(field) for field in kind.record._fields]
        else:
            name = self._make_unique_name(
                "Tuple_" + "_".join(re.sub(r"\W+", "", part.replace("*", "s")) for part in parts)
            )
            fields = [f"item{index}" for index in range(len(parts))]
        lines = [f"    {part} {field};" for part, field in zip(parts, fields, strict=True)]
        self.structs.append("\n".join((f"struct {name} {{", *lines, "};")))
        return name

    def name_constant(self, name: str, value: tuple[Any, ...]) -> str:
        """Return the name of a constant tuple, and define it if it is not defined yet.

        Args:
            name: name in Python.
            value: the tuple.
        """
        kind = type_of_constant(value)
        assert isinstance(kind, Tuple)
        # One name may stand for different tuples in different modules.
        key = name, repr(value)
        if key not in self._constant_names:
            free = self._constant_names[key] = self._make_unique_name(name)
            self.constants.append(
                f"OSIMLITE_CONSTANT {self.name_type(kind)} {free} = {self._constant_text(value, kind)};"
            )
        return self._constant_names[key]

    def _constant_text(self, value: tuple[Any, ...], kind: Tuple) -> str:
        inner = ", ".join(
            self._constant_text(part, part_type)
            if isinstance(part_type, Tuple)
            else write_number(part)
            for part, part_type in zip(value, kind.parts, strict=True)
        )
        return f"{{{{{inner}}}}}" if kind.is_array else f"{{{inner}}}"

    # ----------------------------------------------------------------------------------------------------- text
    def text(self, symbols: Sequence[str]) -> str:
        """Return the text of some exported functions, with all that they call.

        Args:
            symbols: the names of the exported functions.
        """
        needed = self.reach(symbols)
        functions = [text for name, text in self.functions.items() if name in needed]
        parts = [
            f'#include "{HEADER}"',
            "namespace {",
            *self.structs,
            "\n".join(self.constants),
            *functions,
            "}",
            *(self.exports[symbol] for symbol in symbols),
        ]
        return "\n\n".join(part for part in parts if part) + "\n"

    def reach(self, symbols: Sequence[str]) -> set[str]:
        """Return the names of all functions that exported functions need."""
        pending = list(symbols)
        reached = set()
        while pending:
            for name in self.callees[pending.pop()]:
                if name not in reached:
                    reached.add(name)
                    pending.append(name)
        return reached


def write_library(kernels: Kernels) -> str:
    """Return kernels as the text of one C++ translation unit.

    Args:
        kernels: function and number of derivatives that each float carries (0 for plain floats), by
            the name of the exported symbol.

    Returns:
        The complete text but the header, which it includes as `kernel_runtime.h`.

    Raises:
        TranslationError: a kernel uses something that has no counterpart in C++.
    """
    return make_library(kernels).text([*kernels])


def write_units(kernels: Kernels, count: int) -> list[str]:
    """Return kernels as the texts of several translation units of about equal size.

    They can be compiled in parallel.

    Functions that kernels of two units call are repeated. Fewer units are returned where there are
    fewer kernels.

    Args:
        kernels: function and number of derivatives that each float carries (0 for plain floats), by
            the name of the exported symbol.
        count: the largest number of units.

    Returns:
        Texts, at most one per kernel.

    Raises:
        TranslationError: a kernel uses something that has no counterpart in C++.
    """
    library = make_library(kernels)
    sizes = {name: len(text) for name, text in library.functions.items()}
    reached = {symbol: library.reach([symbol]) for symbol in kernels}
    groups: list[tuple[set[str], list[str]]] = [(set(), []) for _ in range(count)]
    # Largest kernels first, each to the unit that stays smallest with it.
    for symbol in sorted(kernels, key=lambda symbol: -sum(sizes[name] for name in reached[symbol])):
        functions, symbols = min(
            groups, key=lambda group: sum(sizes[name] for name in group[0] | reached[symbol])
        )
        functions |= reached[symbol]
        symbols.append(symbol)
    return [library.text(symbols) for _, symbols in groups if symbols]


def make_library(kernels: Kernels) -> Library:
    """Return a library that exports kernels.

    Args:
        kernels: function and number of derivatives that each float carries (0 for plain floats), by
            the name of the exported symbol.
    """
    library = Library()
    for symbol, (function, directions) in kernels.items():
        library.export(symbol, function, directions)
    return library


@cache
def header_text() -> str:
    """Return the text of the header that every library includes."""
    return files(__package__).joinpath(HEADER).read_text(encoding="utf-8")
