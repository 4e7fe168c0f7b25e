"""The entries of the compiled engine: machine code for the evaluation, the motion, and every law.

Each entry stands for itself and calls the others by their address: so what a model does not need is not compiled, and
nothing is compiled twice. The compiler is loaded for what is in no file yet.
"""

from __future__ import annotations

import hashlib
import logging
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

from osimlite._require import require
from osimlite.simulation.kernels.table import law_function


def _compiler_version() -> str:
    """Of numba, which is not loaded for that."""
    try:
        if find_spec("numba") is not None:
            return version("numba")
    except ValueError:
        pass
    return str(require("numba", extra="sim", purpose="the compiled engine").__version__)


_log = logging.getLogger(__name__)

VERSION = f"numba {_compiler_version()}"


@cache
def address_of(name: str) -> int:
    """Address of the code of a law, which is compiled if there is no file of it."""
    from osimlite.simulation.engines.object_code import load, store

    found = load(name, _digest())
    if found is None:
        from osimlite.simulation.engines.compiler import compiled

        _log.info("compiling '%s'", name)
        found = store(name, _digest(), *compiled(law_function(name)))
    return found


@cache
def _digest() -> str:
    """What tells whether any source of the compiled code has changed."""
    package = Path(__file__).parents[2]
    sources = [*sorted(package.glob("forces/*.py")), *sorted(package.glob("simulation/kernels/*.py"))]
    simulation = package / "simulation"
    sources += [simulation / "integrators.py", simulation / "constrained.py", package / "multibody" / "linear.py"]
    sources.append(Path(__file__).with_name("compiler.py"))
    return hashlib.sha256(b"\0".join(path.read_bytes() for path in sources)).hexdigest()[:12]
