"""From a packed model to something that runs: machine code where there is some, else the kernels as Python."""

from __future__ import annotations

import ctypes
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from functools import cache, lru_cache
from inspect import signature
from typing import Any

import numpy as np

from osimlite.mechanics.codegen.toolchain import CompilationError
from osimlite.mechanics.kernels import pointers
from osimlite.mechanics.kernels.layout import MODEL, OUTCOME
from osimlite.mechanics.kernels.pointers import Ints
from osimlite.mechanics.kernels.table import LAW_NUMBERS
from osimlite.simulation.elements.laws import ALONG, RESPONSE, find_function
from osimlite.simulation.engines import machine_code
from osimlite.simulation.engines.dual_numbers import DualVector, carried_by
from osimlite.simulation.interrupts import defer_sigint
from osimlite.simulation.pack import Packed

KERNEL = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * 5, ctypes.c_int64)
"""A kernel: takes the three vectors, a state, room for its derivative, and the place of an item."""


def version() -> str:
    """Return what runs the kernels, for summaries."""
    return machine_code.describe_source()


class Code(ABC):
    """What runs the kernels: `COMPILED` and `PYTHON`, and `AT_HAND`, which is one of them.

    Args:
        name: for people.
    """

    def __init__(self, name: str) -> None:
        self.name = name

    def chosen_for(self, functions: Sequence[str], later: Sequence[str] = ()) -> Code:
        """Return what runs functions of the kernels: this, unless it leaves that to others.

        Args:
            functions: names of the functions.
            later: of those that may be asked for afterwards.
        """
        return self

    @abstractmethod
    def make_ready(self, functions: Sequence[str]) -> None:
        """Compile functions of the kernels together, if that is to be done."""

    @abstractmethod
    def address(self, function: str) -> int:
        """What stands for the address of a function of the kernels."""

    @abstractmethod
    def entry(self, function: str) -> Callable[..., int]:
        """A function of the kernels, called with contiguous arrays and integers."""

    @abstractmethod
    def bound(self, function: str, *arrays: Any) -> Callable[[int], int]:
        """The same with its arrays, which the caller keeps; what is left is one integer."""

    @abstractmethod
    def callback(self, python: Callable[..., int], sizes: Sequence[int]) -> tuple[int, Any]:
        """What stands for the address of a kernel in Python, and what the caller has to keep for it.

        Args:
            python: takes the five arrays and an integer.
            sizes: of the arrays.
        """


class _Compiled(Code):
    def chosen_for(self, functions: Sequence[str], later: Sequence[str] = ()) -> Code:
        if not machine_code.can_prepare((*functions, *later)):
            warn_of_python()
            return self._fall_back_to_python()
        try:
            self.make_ready(functions)
        except CompilationError as error:
            warn_of_python(str(error))
            return self._fall_back_to_python()
        return self

    def _fall_back_to_python(self) -> Code:
        """Return the code to use where kernels cannot be compiled."""
        return PYTHON

    def make_ready(self, functions: Sequence[str]) -> None:
        machine_code.make_ready(functions)

    def address(self, function: str) -> int:
        return machine_code.address_of(function)

    @cache  # noqa: B019 - there is one object
    def entry(self, function: str) -> Callable[..., int]:
        code = self._function(function)
        return lambda *parts: code(
            *(part.ctypes.data if isinstance(part, np.ndarray) else part for part in parts)
        )

    def bound(self, function: str, *arrays: Any) -> Callable[[int], int]:
        code, addresses = self._function(function), [item.ctypes.data for item in arrays]
        return lambda number: code(*addresses, number)

    def _function(self, function: str) -> Callable[..., int]:
        parts = signature(find_function(function)).parameters.values()
        kinds = [
            ctypes.c_void_p if part.annotation in ("Floats", "Ints") else ctypes.c_int64
            for part in parts
        ]
        # It runs without Python's lock.
        return ctypes.CFUNCTYPE(ctypes.c_int64, *kinds)(self.address(function))

    def callback(self, python: Callable[..., int], sizes: Sequence[int]) -> tuple[int, Any]:
        kinds = ctypes.c_int64, *[ctypes.c_double] * 4

        def called(*parts: int) -> int:
            return python(*map(self._seen, parts, kinds, sizes), parts[5])

        callback = KERNEL(called)
        return int(ctypes.cast(callback, ctypes.c_void_p).value or 0), callback

    def _seen(self, address: int, kind: Any, count: int) -> Any:
        """The numbers at an address, as Python is given them."""
        return _view(address, kind, count)


class Tangents(_Compiled):
    """Machine code whose numbers carry derivatives, along several directions at once.

    All arrays of floats have a row for each number: the number, and its derivatives. Python is
    given the numbers alone.

    Args:
        directions: how many.
    """

    def __init__(self, directions: int) -> None:
        super().__init__(f"machine code along {directions} directions")
        self._width, self._suffix = 1 + directions, f"{ALONG}{directions}"

    def chosen_for(self, functions: Sequence[str], later: Sequence[str] = ()) -> Code:
        """Return this, or Python where the functions cannot be compiled."""
        if not machine_code.can_prepare([name + self._suffix for name in (*functions, *later)]):
            warn_of_python()
            return self._fall_back_to_python()
        try:
            self.make_ready(functions)
        except CompilationError as error:
            warn_of_python(str(error))
            return self._fall_back_to_python()
        return self

    def _fall_back_to_python(self) -> Code:
        """Return Python code whose numbers carry derivatives."""
        return PythonTangents(self._width - 1)

    def make_ready(self, functions: Sequence[str]) -> None:
        """Compile functions of the kernels together."""
        super().make_ready([name + self._suffix for name in functions])

    def address(self, function: str) -> int:
        """Of a function of the kernels."""
        return super().address(function + self._suffix)

    def _seen(self, address: int, kind: Any, count: int) -> Any:
        if kind is not ctypes.c_double:
            return _view(address, kind, count)
        return _view(address, kind, self._width * count).reshape(count, self._width)[:, 0]


class AtHand(_Compiled):
    """Machine code if all of it is in the library or in files, else Python."""

    def chosen_for(self, functions: Sequence[str], later: Sequence[str] = ()) -> Code:
        """Return the one or the other."""
        return COMPILED if all(map(machine_code.is_at_hand, functions)) else PYTHON


class _Python(Code):
    def make_ready(self, functions: Sequence[str]) -> None:
        pass

    def address(self, function: str) -> int:
        law = find_function(function)
        return pointers.register_law(carried_by(law) if function.endswith(RESPONSE) else law)

    def entry(self, function: str) -> Callable[..., int]:
        kernel = find_function(function)
        return lambda *parts: kernel(
            *(part.reshape(-1) if isinstance(part, np.ndarray) else part for part in parts)
        )

    def bound(self, function: str, *arrays: Any) -> Callable[[int], int]:
        kernel = find_function(function)
        return lambda number: kernel(*arrays, number)

    def callback(self, python: Callable[..., int], sizes: Sequence[int]) -> tuple[int, Any]:
        return pointers.register_law(python), None


class PythonTangents(_Python):
    """Kernels as Python whose numbers carry derivatives; the arrays are those of :class:`Tangents`.

    Args:
        directions: number of directions.
    """

    def __init__(self, directions: int) -> None:
        super().__init__(f"Python along {directions} directions")

    def address(self, function: str) -> int:
        """Return what stands for the address of a function of the kernels."""
        return pointers.register_law(carried_by(find_function(function)))

    def entry(self, function: str) -> Callable[..., int]:
        """Return a function of the kernels, called with contiguous arrays and integers."""
        kernel = carried_by(find_function(function))
        return lambda *parts: kernel(*map(_to_duals, parts))

    def bound(self, function: str, *arrays: Any) -> Callable[[int], int]:
        """Return a function of the kernels with its arrays, called with one integer."""
        kernel, vectors = carried_by(find_function(function)), [_to_duals(item) for item in arrays]
        return lambda number: kernel(*vectors, number)

    def callback(self, python: Callable[..., int], sizes: Sequence[int]) -> tuple[int, Any]:
        """Return what stands for the address of a kernel in Python, which is given the numbers alone."""

        def called(*parts: Any) -> int:
            return python(
                *(part.values if isinstance(part, DualVector) else part for part in parts)
            )

        return pointers.register_law(called), None


def _to_duals(part: Any) -> Any:
    """Return an array of floats and their derivatives as a vector of numbers; anything else as it is."""
    is_rows = isinstance(part, np.ndarray) and part.dtype == np.float64
    return DualVector(part) if is_rows else part


COMPILED, PYTHON = _Compiled("machine code"), _Python("Python")
AT_HAND = AtHand("machine code that is in files, or Python")
"""For those who evaluate so little that Python is sooner done than a compiler."""


def best() -> Code:
    """Return machine code where there is any, else Python."""
    if machine_code.has_machine_code():
        return COMPILED
    warn_of_python()
    return PYTHON


@cache
def warn_of_python(reason: str = "") -> None:
    """Warn that kernels run as Python, once for each reason."""
    if machine_code.allows(machine_code.LIBRARY) or reason:
        # Imported here, since it takes five milliseconds and hardly anybody is warned.
        import logging

        logging.getLogger(__name__).warning(
            "%s (%s)", machine_code.PYTHON_COST, reason or "; ".join(machine_code.explain_source())
        )


class Program:
    """The structure of a packed model with the addresses of all that it calls, good in this process only.

    Args: packed: the model. code: what runs it. entries: names of the functions that will be called
        from outside, which are made ready with the rest.

    Attributes:
        ints: the structure and the addresses.
        failures: what the parts in Python have raised.
    """

    def __init__(self, packed: Packed, code: Code, entries: Sequence[str] = ()) -> None:
        self.ints: Ints = packed.structure.copy()
        kernels = [kernel for kernel in packed.kernels.values() if isinstance(kernel, str)]
        # Searches side by side know nothing of derivatives.
        runs = {} if isinstance(code, Tangents) else packed.runs
        functions = tuple(dict.fromkeys((*entries, *packed.laws, *kernels, *runs.values())))
        self._equilibria, self.responses = packed.equilibria, packed.responses
        later = *packed.equilibria.values(), *packed.responses.values()
        self.code = code = code.chosen_for(functions, () if isinstance(code, Tangents) else later)
        runs = runs if code is COMPILED else {}
        self.failures: list[Exception] = []
        self._kept: list[Any] = []
        code.make_ready(functions)
        for name in packed.laws:
            self.ints[MODEL.LAWS + LAW_NUMBERS[name]] = code.address(name)
        self._count = len(packed.numbers)
        for place, kernel in [*packed.kernels.items(), *runs.items()]:
            self._link(place, kernel)

    def drive(self, structure: Ints, kernel: str | Callable[..., None]) -> None:
        """Take the record of the controls, behind which there is nothing, from another structure."""
        place = int(structure[MODEL.CONTROLS])
        self.ints = np.concatenate((self.ints[:place], structure[place:]))
        if isinstance(kernel, str):
            self.code.make_ready((kernel,))
        self._link(place, kernel)

    def _link(self, place: int, kernel: str | Callable[..., None]) -> None:
        """Put the address of a kernel at a place."""
        if isinstance(kernel, str):
            self.ints[place] = self.code.address(kernel)
            return
        size = int(self.ints[MODEL.STATE_SIZE])
        sizes = len(self.ints), self._count, int(self.ints[MODEL.WORK_SIZE]), size, size
        self.ints[place], kept = self.code.callback(self._guarded(kernel), sizes)
        self._kept.append(kept)

    def link_responses(self, method: str) -> None:
        """Make ready an implicit method and the derivatives that it needs, which not everybody asks for."""
        self.code.make_ready((method, *dict.fromkeys(self.responses.values())))
        for place, kernel in self.responses.items():
            if not self.ints[place]:
                self._link(place, kernel)

    def link_equilibria(self) -> None:
        """Make ready what brings states into equilibrium, which not everybody asks for."""
        self.code.make_ready(("equilibrate", *dict.fromkeys(self._equilibria.values())))
        for place, kernel in self._equilibria.items():
            self._link(place, kernel)

    def run(self, function: Callable[..., int], *parts: Any) -> int:
        """Call a function of the kernels.

        Ctrl-C in a part in Python is heard after it: no exception passes through machine code.
        """
        if not any(self._kept):
            return function(*parts)
        with defer_sigint():
            return function(*parts)

    def _guarded(self, python: Callable[..., None]) -> Callable[..., int]:
        """A part in Python whose errors do not pass through machine code: who asked for an evaluation raises them."""

        def kernel(*parts: Any) -> int:
            try:
                python(*parts)
            except Exception as error:
                self.failures.append(error)
                return OUTCOME.FAILED
            return OUTCOME.OK

        return kernel


@lru_cache(maxsize=128)
def _view(address: int, kind: Any, count: int) -> Any:
    """The numbers at an address as an array; machine code asks for the same again and again."""
    return np.ctypeslib.as_array((kind * count).from_address(address))
