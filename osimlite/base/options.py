"""Declarations of options, shared by the library, the command line and the manual."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Any

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import field


class OptionSpec(NamedTuple):
    """Option of a command.

    Attributes:
        name: keyword of the library; on the command line with - for _, unless `spelled` is given.
        type: type of the value.
        help: sentence for the help of the command.
        default: value if the option is absent; None if `default_text` says what the library then takes.
        unit: placeholder of the value in the help, in capitals, as SECONDS.
        default_text: default in words, where `default` does not say it.
        group: heading of the help under which the option is listed.
        spelled: spellings on the command line.
    """

    name: str
    type: Any
    help: str
    default: Any = None
    unit: str = ""
    default_text: str = ""
    group: str = ""
    spelled: tuple[str, ...] = ()


class OptionDescription(NamedTuple):
    """Description of an attribute of an options record.

    Attributes:
        help: sentence for the help of the command; an option without it exists in the library only.
        more: text for the library, after `help` or instead of it.
        unit: placeholder of the value in the help.
        default_text: default in words.
        type: type of the value on the command line, where the library accepts more.
    """

    help: str
    more: str
    unit: str
    default_text: str
    type: Any


def define_option(
    default: Any,
    help: str = "",
    *,
    more: str = "",
    unit: str = "",
    default_text: str = "",
    type: Any = None,
) -> Any:
    """Return the field of an options record; for the arguments see :class:`OptionDescription`."""
    return field(default=default, option=OptionDescription(help, more, unit, default_text, type))


def list_options(options: Any) -> Iterator[OptionSpec]:
    """Yield the options of a record that the command line offers."""
    for name, option_field in options.__record_fields__.items():
        description: OptionDescription = option_field.option
        if description.help:
            owner = next(item for item in options.__mro__ if name in item.__annotations__)
            kind = description.type or eval(
                owner.__annotations__[name], vars(sys.modules[owner.__module__])
            )
            spelled = (f"--{name.replace('_', '-')}",) if kind is bool else ()
            yield OptionSpec(
                name,
                kind,
                description.help,
                # The library can then tell that the user has not set the option.
                None if description.default_text else option_field.default,
                description.unit,
                description.default_text,
                "",
                spelled,
            )


def describe_options(options: Any) -> str:
    """Return the lines under *Attributes* in the docstring of an options record."""
    from textwrap import fill

    lines = [
        fill(
            f"{name}: {option_field.option.help} {option_field.option.more}".replace(
                "  ", " "
            ).strip(),
            112,
            subsequent_indent="    ",
        )
        for name, option_field in options.__record_fields__.items()
    ]
    return "\n".join(" " * 8 + line.replace("\n", "\n" + " " * 8) for line in lines)
