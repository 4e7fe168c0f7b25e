"""What can be chosen: declared once, for the library, the command line and the manual."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Any, NamedTuple

from osimlite.base.records import field


class Choice(NamedTuple):
    """An option."""

    # the keyword of the library; on the command line with - for _, unless `spelled` says otherwise
    name: str
    type: Any  # of its value
    help: str  # one sentence
    default: Any = None  # if it is left out
    unit: str = ""  # what the value is, in capitals, as SECONDS
    shown: str = ""  # the default in words, where `default` does not tell it
    group: str = ""  # under which heading of the help it stands
    spelled: tuple[str, ...] = ()  # on the command line


class Said(NamedTuple):
    """What is said of an attribute of a record that is an option of a function."""

    help: str  # one sentence for the command line; an option without one is not there
    more: str  # for the library, after that or instead of it
    unit: str  # as of `Choice`, so too `shown`
    shown: str
    type: Any  # of what is written on the command line, where that is less than the library takes


def option(
    default: Any,
    help: str = "",
    *,
    more: str = "",
    unit: str = "",
    shown: str = "",
    type: Any = None,
) -> Any:
    """An attribute of a record of options; see :class:`Said`."""
    return field(default=default, choice=Said(help, more, unit, shown, type))


def choices(options: Any) -> Iterator[Choice]:
    """What the command line can say of a record of options."""
    for name, each in options.__record_fields__.items():
        said: Said = each.choice
        if said.help:
            kind = said.type or eval(
                options.__annotations__[name], vars(sys.modules[options.__module__])
            )
            spelled = (f"--{name.replace('_', '-')}",) if kind is bool else ()
            yield Choice(name, kind, said.help, each.default, said.unit, said.shown, "", spelled)


def described(options: Any) -> str:
    """What stands under *Attributes* in the docstring of a record of options."""
    from textwrap import fill

    lines = [
        fill(
            f"{name}: {each.choice.help} {each.choice.more}".replace("  ", " ").strip(),
            112,
            subsequent_indent="    ",
        )
        for name, each in options.__record_fields__.items()
    ]
    return "\n".join(" " * 8 + line.replace("\n", "\n" + " " * 8) for line in lines)
