"""Regular expressions that are compiled when they are first used."""

from __future__ import annotations

import re
from typing import Any, AnyStr, cast


def compile_later(expression: AnyStr, flags: int = 0) -> re.Pattern[AnyStr]:
    """Return a pattern that is compiled when one of its methods or attributes is first used.

    Python takes 0.1 to 1 ms to compile a pattern, and a command imports about a hundred, most of
    which only faulty or rare input needs. Functions of `re` do not accept the result; use its methods.

    Args:
        expression: regular expression, a text or bytes.
        flags: flags of `re`.
    """
    return cast("re.Pattern[AnyStr]", _LazyPattern(expression, flags))


class _LazyPattern:
    """Pattern that takes over the methods of the compiled one as they are used."""

    def __init__(self, expression: str | bytes, flags: int) -> None:
        self._arguments = expression, flags

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        if name == "_compiled":
            value: Any = re.compile(*self._arguments)
        else:
            value = getattr(self._compiled, name)
        # From now on Python finds it in the object, as fast as in a compiled pattern.
        setattr(self, name, value)
        return value

    def __repr__(self) -> str:
        return f"compile_later({', '.join(map(repr, self._arguments))})"
