"""Linking of packed models: machine code where it is available, else the kernels as Python."""

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
from osimlite.simulation.engines.dual_numbers import DualVector, make_dual
from osimlite.simulation.interrupts import defer_sigint
from osimlite.simulation.pack import PackedModel

KERNEL = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * 5, ctypes.c_int64)
"""C type of a kernel: the vectors of the model, a state, its derivative, and the offset of an item."""


def describe_version() -> str:
    """Return the source of the kernels in a few words, for summaries."""
    return machine_code.describe_source()


class Code(ABC):
    """Backend that runs the kernels: `MACHINE_CODE`, `PYTHON_CODE`, or `READY_CODE`, which selects one of them.

    Args:
        name: name in messages.
    """

    def __init__(self, name: str) -> None:
        self.name = name

    def select_for(self, functions: Sequence[str], later: Sequence[str] = ()) -> Code:
        """Return the backend that runs the given functions: this one, or the one to which it delegates.

        Args:
            functions: names of the functions.
            later: names of functions that may be needed later.
        """
        return self

    @abstractmethod
    def make_ready(self, functions: Sequence[str]) -> None:
        """Compile functions together, if the backend compiles.

        Args:
            functions: names of the functions.

        Raises:
            CompilationError: a function cannot be compiled here.
        """

    @abstractmethod
    def get_address(self, function: str) -> int:
        """Return the address of a function, or the number that stands for it."""

    @abstractmethod
    def get_entry(self, function: str) -> Callable[..., int]:
        """Return a function that is called with contiguous arrays and integers."""

    @abstractmethod
    def bind_entry(self, function: str, *arrays: Any) -> Callable[[int], int]:
        """Return a function with its arrays bound, which is called with one integer.

        Args:
            function: name of the function.
            arrays: contiguous arrays, which the caller must keep.
        """

    @abstractmethod
    def make_callback(self, python: Callable[..., int], sizes: Sequence[int]) -> tuple[int, Any]:
        """Return a Python function in the form of a kernel.

        Args:
            python: function of the five arrays and an integer.
            sizes: lengths of the arrays.

        Returns:
            The address of the kernel, and an object that the caller has to keep.
        """


class _MachineCode(Code):
    """Backend of machine code; see :class:`Code`."""

    _suffix = ""
    """Suffix of the names of compiled functions behind those of the kernels."""

    def select_for(self, functions: Sequence[str], later: Sequence[str] = ()) -> Code:
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
        """Return the backend to use where kernels cannot be compiled."""
        return PYTHON_CODE

    def make_ready(self, functions: Sequence[str]) -> None:
        machine_code.prepare_laws(functions)

    def get_address(self, function: str) -> int:
        return machine_code.get_address(function)

    @cache  # noqa: B019 - there is one object
    def get_entry(self, function: str) -> Callable[..., int]:
        code = self._make_function(function)
        return lambda *parts: code(
            *(part.ctypes.data if isinstance(part, np.ndarray) else part for part in parts)
        )

    def bind_entry(self, function: str, *arrays: Any) -> Callable[[int], int]:
        code = self._make_function(function)
        addresses = [item.ctypes.data for item in arrays]
        return lambda number: code(*addresses, number)

    def _make_function(self, function: str) -> Callable[..., int]:
        parts = signature(find_function(function)).parameters.values()
        kinds = [
            ctypes.c_void_p if part.annotation in ("Floats", "Ints") else ctypes.c_int64
            for part in parts
        ]
        # ctypes releases Python's global lock during the call.
        return ctypes.CFUNCTYPE(ctypes.c_int64, *kinds)(self.get_address(function))

    def make_callback(self, python: Callable[..., int], sizes: Sequence[int]) -> tuple[int, Any]:
        kinds = ctypes.c_int64, *[ctypes.c_double] * 4

        def call_python(*parts: int) -> int:
            return python(*map(self._view_values, parts, kinds, sizes), parts[5])

        callback = KERNEL(call_python)
        return int(ctypes.cast(callback, ctypes.c_void_p).value or 0), callback

    def _view_values(self, address: int, kind: Any, count: int) -> Any:
        """Return the numbers at an address as an array for Python."""
        return _view_array(address, kind, count)


class Tangents(_MachineCode):
    """Machine code with dual numbers along several directions.

    Arrays of floats have a row for each number: its value and its derivatives. Python functions get
    the values alone.

    Args:
        directions: number of directions.
    """

    def __init__(self, directions: int) -> None:
        super().__init__(f"machine code along {directions} directions")
        self._width = 1 + directions
        self._suffix = f"{ALONG}{directions}"

    def _fall_back_to_python(self) -> Code:
        """Return the Python backend with dual numbers."""
        return PythonTangents(self._width - 1)

    def make_ready(self, functions: Sequence[str]) -> None:
        """Compile functions of dual numbers together.

        Args:
            functions: names of the functions.
        """
        super().make_ready([name + self._suffix for name in functions])

    def get_address(self, function: str) -> int:
        """Return the address of a function of dual numbers."""
        return super().get_address(function + self._suffix)

    def _view_values(self, address: int, kind: Any, count: int) -> Any:
        if kind is not ctypes.c_double:
            return _view_array(address, kind, count)
        return _view_array(address, kind, self._width * count).reshape(count, self._width)[:, 0]


class ReadyCode(_MachineCode):
    """Machine code if all of it is in the library or in files, else Python."""

    def select_for(self, functions: Sequence[str], later: Sequence[str] = ()) -> Code:
        """Return machine code or Python for the given functions."""
        return MACHINE_CODE if all(map(machine_code.is_ready, functions)) else PYTHON_CODE


class PythonCode(Code):
    """Backend that interprets the kernels; see :class:`Code`."""

    def make_ready(self, functions: Sequence[str]) -> None:
        """Do nothing, since Python needs no compilation."""

    def get_address(self, function: str) -> int:
        """Return the number under which a law, or its response, is registered."""
        law = find_function(function)
        return pointers.register_law(make_dual(law) if function.endswith(RESPONSE) else law)

    def get_entry(self, function: str) -> Callable[..., int]:
        """Return a kernel that takes arrays of any shape."""
        kernel = find_function(function)
        return lambda *parts: kernel(
            *(part.reshape(-1) if isinstance(part, np.ndarray) else part for part in parts)
        )

    def bind_entry(self, function: str, *arrays: Any) -> Callable[[int], int]:
        """Return a kernel with all arguments but its last."""
        kernel = find_function(function)
        return lambda number: kernel(*arrays, number)

    def make_callback(self, python: Callable[..., int], sizes: Sequence[int]) -> tuple[int, Any]:
        """Register a function.

        Returns:
            Its number, and None, since nothing must be kept alive.
        """
        return pointers.register_law(python), None


class PythonTangents(PythonCode):
    """Kernels as Python with dual numbers; the arrays are those of :class:`Tangents`.

    Args:
        directions: number of directions.
    """

    def __init__(self, directions: int) -> None:
        super().__init__(f"Python along {directions} directions")

    def get_address(self, function: str) -> int:
        """Return the number that stands for the address of a function."""
        return pointers.register_law(make_dual(find_function(function)))

    def get_entry(self, function: str) -> Callable[..., int]:
        """Return a function that is called with contiguous arrays and integers."""
        kernel = make_dual(find_function(function))
        return lambda *parts: kernel(*map(_to_duals, parts))

    def bind_entry(self, function: str, *arrays: Any) -> Callable[[int], int]:
        """Return a function with its arrays bound, which is called with one integer.

        Args:
            function: name of the function.
            arrays: arrays of floats with derivatives, and arrays of integers.
        """
        kernel = make_dual(find_function(function))
        vectors = [_to_duals(item) for item in arrays]
        return lambda number: kernel(*vectors, number)

    def make_callback(self, python: Callable[..., int], sizes: Sequence[int]) -> tuple[int, Any]:
        """Return a Python function as a kernel; it gets the values alone.

        Args:
            python: function of the five arrays and an integer.
            sizes: lengths of the arrays.

        Returns:
            The number that stands for the address of the kernel, and None.
        """

        def call_with_values(*parts: Any) -> int:
            return python(
                *(part.values if isinstance(part, DualVector) else part for part in parts)
            )

        return pointers.register_law(call_with_values), None


def _to_duals(part: Any) -> Any:
    """Return an array of floats with derivatives as a vector of dual numbers; anything else unchanged."""
    is_rows = isinstance(part, np.ndarray) and part.dtype == np.float64
    return DualVector(part) if is_rows else part


MACHINE_CODE = _MachineCode("machine code")
"""Backend that compiles kernels or loads compiled ones."""

PYTHON_CODE = PythonCode("Python")
"""Backend that interprets the kernels as Python."""

READY_CODE = ReadyCode("machine code that is in files, or Python")
"""Backend for few evaluations: Python is finished before a compiler would be."""


def select_code() -> Code:
    """Return machine code where it is available, else Python."""
    if machine_code.has_machine_code():
        return MACHINE_CODE
    warn_of_python()
    return PYTHON_CODE


@cache
def warn_of_python(reason: str = "") -> None:
    """Warn that kernels run as Python, once for each reason."""
    if machine_code.is_allowed(machine_code.LIBRARY) or reason:
        # The import takes five milliseconds, and warnings are rare.
        import logging

        logging.getLogger(__name__).warning(
            "%s (%s)", machine_code.PYTHON_COST, reason or "; ".join(machine_code.explain_source())
        )


class Program:
    """Structure of a packed model with the addresses of all functions that it calls.

    It is valid in this process only.

    Args:
        packed: the packed model.
        code: backend that runs the kernels.
        entries: names of the functions that are called from outside; they are prepared with the
            rest.

    Attributes:
        ints: the structure with addresses.
        failures: exceptions of Python functions that machine code called.
    """

    def __init__(self, packed: PackedModel, code: Code, entries: Sequence[str] = ()) -> None:
        # Addresses of functions are written into the copy: each program has its own.
        self.ints: Ints = packed.structure.copy()
        kernels = [kernel for kernel in packed.kernels.values() if isinstance(kernel, str)]
        # Batched kernels do not support dual numbers.
        runs = {} if isinstance(code, Tangents) else packed.runs
        functions = tuple(dict.fromkeys((*entries, *packed.laws, *kernels, *runs.values())))
        self._equilibria, self.responses = packed.equilibria, packed.responses
        later = *packed.equilibria.values(), *packed.responses.values()
        self.code = code = code.select_for(functions, () if isinstance(code, Tangents) else later)
        # Batched kernels are faster as machine code only.
        runs = runs if code is MACHINE_CODE else {}
        self.failures: list[Exception] = []
        self._callbacks: list[Any] = []
        code.make_ready(functions)
        # Kernels call each other by addresses that they read here, so that one kernel serves all
        # models.
        for name in packed.laws:
            self.ints[MODEL.LAWS + LAW_NUMBERS[name]] = code.get_address(name)
        self._count = len(packed.numbers)
        for offset, kernel in [*packed.kernels.items(), *runs.items()]:
            self._link_kernel(offset, kernel)

    def set_controls(self, structure: Ints, kernel: str | Callable[..., None]) -> None:
        """Replace the record of the controls, the last one, by that of another structure.

        Args:
            structure: the new structure without addresses.
            kernel: kernel of the controls: a name, or a Python function.
        """
        offset = int(structure[MODEL.CONTROLS])
        # The controls are the last record; what lies before it keeps its addresses.
        self.ints = np.concatenate((self.ints[:offset], structure[offset:]))
        if isinstance(kernel, str):
            self.code.make_ready((kernel,))
        self._link_kernel(offset, kernel)

    def _link_kernel(self, offset: int, kernel: str | Callable[..., None]) -> None:
        """Write the address of a kernel at an offset of the structure."""
        if isinstance(kernel, str):
            self.ints[offset] = self.code.get_address(kernel)
            return
        size = int(self.ints[MODEL.STATE_SIZE])
        sizes = len(self.ints), self._count, int(self.ints[MODEL.WORK_SIZE]), size, size
        self.ints[offset], callback = self.code.make_callback(self._catch_errors(kernel), sizes)
        # ctypes frees a callback that Python does not refer to, while the kernels still call it.
        self._callbacks.append(callback)

    def link_responses(self, method: str) -> None:
        """Prepare an implicit method and the derivatives that it needs.

        Args:
            method: name of the integrator.
        """
        self.code.make_ready((method, *dict.fromkeys(self.responses.values())))
        for offset, kernel in self.responses.items():
            # An address other than 0: the response is linked already.
            if not self.ints[offset]:
                self._link_kernel(offset, kernel)

    def link_equilibria(self) -> None:
        """Prepare the kernels that bring states into equilibrium."""
        self.code.make_ready(("equilibrate", *dict.fromkeys(self._equilibria.values())))
        for offset, kernel in self._equilibria.items():
            self._link_kernel(offset, kernel)

    def run(self, function: Callable[..., int], *parts: Any) -> int:
        """Call a kernel.

        If the model calls Python functions, Ctrl-C is deferred to the end of the call, because
        exceptions cannot pass through machine code.

        Args:
            function: kernel to call.
            parts: arguments of the kernel.

        Returns:
            Outcome of the kernel.
        """
        # Without Python kernels no signal handler can run inside the call.
        if not any(self._callbacks):
            return function(*parts)
        with defer_sigint():
            return function(*parts)

    def _catch_errors(self, python: Callable[..., None]) -> Callable[..., int]:
        """Return a function that stores exceptions in `failures`.

        They cannot pass through machine code; the caller raises them afterwards.

        Args:
            python: function of the five arrays and an integer.
        """

        def kernel(*parts: Any) -> int:
            try:
                python(*parts)
            except Exception as error:
                self.failures.append(error)
                return OUTCOME.FAILED
            return OUTCOME.OK

        return kernel


@lru_cache(maxsize=128)
def _view_array(address: int, kind: Any, count: int) -> Any:
    """Return the numbers at an address as an array.

    The result is cached, because machine code asks for the same arrays repeatedly.

    Args:
        address: address of the first number.
        kind: C type of a number.
        count: number of numbers.
    """
    return np.ctypeslib.as_array((kind * count).from_address(address))
