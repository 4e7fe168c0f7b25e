"""What can be chosen: declared once, for the command line, the library and the manual."""

from __future__ import annotations

from typing import Any, NamedTuple


class Choice(NamedTuple):
    """An option.

    Attributes:
        name: the keyword of the library; on the command line with - for _, unless `spelled` says otherwise.
        type: of its value.
        help: one sentence.
        default: if it is left out.
        unit: what the value is, in capitals, as SECONDS.
        shown: the default in words, where `default` does not tell it.
        group: under which heading of the help it stands.
        spelled: on the command line.
    """

    name: str
    type: Any
    help: str
    default: Any = None
    unit: str = ""
    shown: str = ""
    group: str = ""
    spelled: tuple[str, ...] = ()
