"""Addresses of kernels as machine code, from any source.

A kernel comes from the library that was compiled at installation. An edited kernel, or one of a
user's own force type, is compiled alone by the C++ compiler of the machine, else by numba. The
environment variable OSIMLITE_KERNELS restricts the sources to one: library, compiler, numba or
python.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Iterable, Mapping, Sequence

from osimlite.base.text import format_count, suggest_or_list
from osimlite.errors import OsimliteError
from osimlite.mechanics.codegen.toolchain import CompilationError, find_compiler
from osimlite.simulation.elements.laws import find_law
from osimlite.simulation.engines import kernel_library

VARIABLE = "OSIMLITE_KERNELS"
"""Environment variable that names the only source of machine code."""

LIBRARY = "library"
"""Source of kernels: the library compiled at installation."""
COMPILER = "compiler"
"""Source of kernels: a C++ compiler on this machine, one kernel at a time."""
NUMBA = "numba"
"""Source of kernels: numba, one kernel at a time."""
PYTHON = "python"
"""Source of kernels: their Python text, interpreted."""
SOURCES = LIBRARY, COMPILER, NUMBA, PYTHON
"""All sources in the order in which they are tried."""

law_addresses: dict[str, int] = {}
"""Addresses of the laws that are ready, by name."""


def is_allowed(source: str) -> bool:
    """Return whether a source of machine code may be used.

    Raises:
        OsimliteError: the environment variable names an unknown source.
    """
    only = os.environ.get(VARIABLE, "")
    # A single source makes results reproducible, for example in tests.
    if only and only not in SOURCES:
        raise OsimliteError(
            f"{VARIABLE} is '{only}', which is not a source of kernels{suggest_or_list(only, SOURCES)}"
        )
    return only in ("", source)


def get_address(name: str) -> int:
    """Return the address of a law, after compiling it if necessary.

    Raises:
        CompilationError: the law cannot be compiled here.
    """
    prepare_laws([name])
    return law_addresses[name]


def use_addresses(addresses: Mapping[str, int]) -> None:
    """Take laws from a library that the caller has loaded, in place of those found here.

    Args:
        addresses: address of each law's function by name of the law.
    """
    law_addresses.update(addresses)


def is_ready(name: str) -> bool:
    """Return whether a kernel can be used without compiling it, and load it then.

    Args:
        name: name of the kernel. It may be loaded already, in the library, or in a file.
    """
    if name in law_addresses:
        return True
    address = None
    # The sources are tried in the order of their speed.
    if is_allowed(LIBRARY) and (library := kernel_library.load_library()) is not None:
        address = library.get_address(name)
    if address is None and is_allowed(COMPILER):
        from osimlite.simulation.engines import compiled_laws

        address = compiled_laws.load_law(name)
    if address is not None:
        law_addresses[name] = address
    return address is not None


def prepare_laws(names: Sequence[str]) -> None:
    """Load kernels, and compile those that no library or file has.

    Args:
        names: names of the kernels.

    Raises:
        CompilationError: a kernel cannot be compiled here.
    """
    missing = [name for name in dict.fromkeys(names) if not is_ready(name)]
    if not missing:
        return
    reason: CompilationError | None = None
    if is_allowed(COMPILER) and find_compiler() is not None:
        from osimlite.simulation.engines import compiled_laws

        try:
            law_addresses.update(compiled_laws.compile_laws(missing))
            return
        except CompilationError as error:
            # The compiler may lack what a law needs; numba may still work.
            reason = error
    # Numba compiles without derivatives, so it comes last.
    if is_allowed(NUMBA) and _has_numba():
        from osimlite.simulation.engines import numba_laws

        for name in missing:
            law_addresses[name] = numba_laws.compile_law(name)
        return
    message = f"'{missing[0]}' is in no library, and there is neither a C++ compiler nor numba to compile it"
    # The error of the compiler says more than a general one.
    raise reason or CompilationError(message)


def can_prepare(names: Iterable[str]) -> bool:
    """Return whether all laws are ready, or can be compiled."""
    # The compiler is searched last, because asking for its version takes longer than a short
    # simulation.
    missing = [name for name in names if not is_ready(name)]
    if not missing:
        return True
    if is_allowed(COMPILER) and find_compiler() is not None:
        return True
    # Laws with dual numbers need the compiler.
    has_duals = any(find_law(name)[1] for name in missing)
    return not has_duals and is_allowed(NUMBA) and _has_numba()


def has_machine_code() -> bool:
    """Return whether laws run as machine code here, as long as none is edited."""
    has_library = is_allowed(LIBRARY) and kernel_library.load_library() is not None
    return has_library or can_compile()


def can_compile() -> bool:
    """Return whether there is a C++ compiler or numba."""
    has_compiler = is_allowed(COMPILER) and find_compiler() is not None
    return has_compiler or (is_allowed(NUMBA) and _has_numba())


def _has_numba() -> bool:
    from osimlite.simulation.engines.numba_laws import has_numba

    return has_numba()


def describe_source() -> str:
    """Return the source of the kernels in a few words, for summaries."""
    library = kernel_library.load_library() if is_allowed(LIBRARY) else None
    if library is not None:
        return f"compiled library ({library.table['target']})"
    if is_allowed(COMPILER) and find_compiler() is not None:
        return "C++ compiler"
    if is_allowed(NUMBA) and _has_numba():
        return "numba"
    return f"Python {platform.python_version()}"


def explain_source() -> list[str]:
    """Return sentences on the source of the kernels, and the reason for it."""
    sentences = []
    library = kernel_library.load_library() if is_allowed(LIBRARY) else None
    compiler = find_compiler() if is_allowed(COMPILER) else None
    if os.environ.get(VARIABLE):
        sentences.append(f"{VARIABLE}={os.environ[VARIABLE]} names the only source of machine code")
    if library is not None:
        sentences.append(
            f"kernels run from the compiled library {library.path} (target {library.table['target']}, "
            f"compiled by {library.table['compiler']})"
        )
        if library.changed_files:
            count = len(library.changed_files)
            sentences.append(
                f"{format_count(count, 'source file')} changed after the library was compiled: edited kernels are compiled "
                "again at their first use; 'pip install -e .' compiles a new library"
            )
    elif is_allowed(LIBRARY):
        sentences.append(kernel_library.explain_absence())
    alone = "a kernel that is not in the library is" if library is not None else "each kernel is"
    if compiler is not None:
        sentences.append(f"{alone} compiled at its first use by {compiler.name}")
    elif is_allowed(NUMBA) and _has_numba():
        sentences.append(
            f"no C++ compiler was found: {alone} compiled at its first use by numba, without derivatives"
        )
    elif library is None:
        sentences.append(f"no C++ compiler was found, numba is not installed: {PYTHON_COST}")
    else:
        sentences.append(
            f"no C++ compiler was found, numba is not installed: with an edited kernel {PYTHON_COST}"
        )
    return sentences


PYTHON_COST = "the kernels run as Python, about a thousand times slower"
"""Consequence of missing machine code, for messages."""
