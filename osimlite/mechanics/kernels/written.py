"""Kernels that are written: functions of Python made of text."""

from __future__ import annotations

import linecache
from collections.abc import Callable
from typing import Any

from osimlite.mechanics.kernels import pointers
from osimlite.mechanics.kernels.layout import ITEM, MODEL, OUTCOME, RUN, WORK

RECORDS = {record.__name__: record for record in (MODEL, ITEM, RUN, WORK, OUTCOME)}
"""What the code of kernels uses of the layout."""
GIVEN = 'model: "Ints", reals: "Floats", data: "Floats", y: "Floats", f: "Floats"'
"""What every kernel is called with, before what it computes."""


def written(name: str, module: str, source: str, **scope: Any) -> Callable[..., int]:
    """A kernel that was written.

    Args:
        name: of it.
        module: that it belongs to.
        source: its text.
        scope: what this uses, besides the layout.
    """
    known = {**RECORDS, "at": pointers.at, "__name__": module, **scope}
    file = f"<kernel {name}>"
    exec(compile(source, file, "exec", dont_inherit=True), known)
    # Tracebacks and `inspect.getsource` show it as they show a file.
    linecache.cache[file] = (len(source), None, source.splitlines(keepends=True), file)
    return known[name]
