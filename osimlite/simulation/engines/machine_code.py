"""The entries of the compiled engine: machine code for the evaluation, the motion, and every law.

Each entry stands for itself and calls the others by their address: so what a model does not need is not compiled, and
nothing is compiled twice. The compiler is loaded for what is in no file yet.
"""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Sequence
from contextlib import ExitStack
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from osimlite.codegen.sources import compute_digest
from osimlite.simulation.elements.laws import law_of

if TYPE_CHECKING:
    from osimlite.simulation.engines.side_by_side import Made


_log = logging.getLogger(__name__)

_addresses: dict[str, int] = {}
"""Addresses of the machine code of the laws that are ready, by their names."""


SETTINGS = ("carrying.py", "compiler.py", "object_code.py", "tangents.py")
"""The modules that set the compiler."""


def digest_of(function: Any) -> str:
    """Return the digest of a function and of the modules that set the compiler."""
    return compute_digest(function, read_settings())


@cache
def read_settings() -> str:
    """Return a digest of the modules that set the compiler."""
    here = Path(__file__)
    return hashlib.sha256(b"\0".join((here.with_name(name)).read_bytes() for name in SETTINGS)).hexdigest()


def address_of(name: str) -> int:
    """Address of the code of a law, which is compiled if there is no file of it."""
    make_ready([name])
    return _addresses[name]


def make_ready(names: Sequence[str]) -> None:
    """Load the code of laws, and compile what is in no file, side by side if there is much."""
    missing = [name for name in names if not is_at_hand(name)]
    if not missing:
        return
    from osimlite.simulation.engines.side_by_side import Helper, compilers, made, shares, size_of

    whole, done = sum(map(size_of, missing)), 0

    def keep(law: Made) -> None:
        nonlocal done
        _keep(law)
        done += size_of(law.name)
        _log.info("compiled '%s'", law.name, extra={"part": done / whole})

    for name in missing:
        _log.info("compiling '%s'", name, extra={"part": 0.0})
    own, *others = shares(missing, compilers())
    with ExitStack() as stack:
        helpers = [stack.enter_context(Helper(share)) for share in others]
        for name in own:
            keep(made(name))
        for helper in helpers:
            for result in helper.found():
                keep(result)
    for name in missing:
        if name not in _addresses:
            keep(made(name))


def is_at_hand(name: str) -> bool:
    """Whether the code of a law is loaded, or in a file, from which it is loaded then."""
    if name in _addresses:
        return True
    from osimlite.simulation.engines.object_code import load

    result = load(name, digest_of(law_of(name)[0]))
    if result is not None:
        _addresses[name] = result
    return result is not None


def _keep(law: Made) -> None:
    from osimlite.simulation.engines.object_code import keep

    _addresses[law.name] = keep(law.name, law.digest, law.code, law.symbol)
