"""What a command takes, as its function declares it: read by typer, or here, which is quicker.

Typer makes the help, the completion and the messages about what is wrong. Words of which nothing is
wrong need none of it, and loading it takes longer than most commands do.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from types import UnionType
from typing import TYPE_CHECKING, Any, NamedTuple, get_args, get_origin

if TYPE_CHECKING:
    from osimlite.base.options import OptionSpec

_NUMBERS = {
    int: re.compile(r"[0-9]+", re.ASCII),
    float: re.compile(r"[0-9]*\.?[0-9]+(e[-+]?[0-9]+)?", re.ASCII),
}
"""Texts of numbers that mean the same to everybody."""


class Declared:
    """What stands in the annotation of a parameter of a command.

    Attributes:
        maker: "Option" or "Argument" of typer.
        names: under which an option is given; else the parameter's own.
        told: the keyword arguments of typer's function.
        bare_value: the value of an option that stands without one; None if it needs a value.
    """

    __slots__ = "bare_value", "maker", "names", "told"

    def __init__(
        self, maker: str, names: Sequence[str], told: dict[str, Any], bare_value: str | None = None
    ) -> None:
        self.maker, self.names, self.told, self.bare_value = maker, names, told, bare_value


def Option(*names: str, bare_value: str | None = None, **told: Any) -> Declared:
    """Declare an option, with what ``typer.Option`` takes.

    Args:
        names: under which it is given; the parameter's own name by default.
        bare_value: the value if another option, or nothing, follows it; None if it needs a value.
        told: keyword arguments of ``typer.Option``.
    """
    return Declared("Option", names, told, bare_value)


def Argument(**told: Any) -> Declared:
    """An argument, with what ``typer.Argument`` takes."""
    return Declared("Argument", (), told)


class _Parameter(NamedTuple):
    name: str
    type: Any
    declared: Declared
    default: Any

    @property
    def spellings(self) -> dict[str, Any]:
        """What may stand on the command line for it, and what that says of a switch."""
        names = self.declared.names
        if not any(name.startswith("--") for name in names):
            names = (*names, f"--{self.name.replace('_', '-')}")
            if self.type is bool:
                names = (*names[:-1], f"{names[-1]}/--no-{names[-1][2:]}")
        result = {}
        for name in names:
            yes, _, no = name.partition("/")
            result[yes] = True
            if no:
                result[no] = False
        return result

    def scalar(self) -> tuple[Any, bool]:
        """The type of one value, and whether there may be several."""
        kinds = [kind for kind in get_args(self.type) if kind is not type(None)]
        kind = kinds[0] if get_origin(self.type) is UnionType else self.type
        return (get_args(kind)[0], True) if get_origin(kind) is list else (kind, False)

    def value(self, kind: Any, word: str) -> Any:
        """What a word means; None where typer has to say."""
        if kind is str or kind is Path:
            return kind(word)
        if kind not in _NUMBERS or not _NUMBERS[kind].fullmatch(word):
            return None
        value = kind(word)
        told = self.declared.told
        return value if told.get("min", value) <= value <= told.get("max", value) else None


class Command:
    """A function that is a command.

    Args:
        function: whose parameters have a :class:`Declared` each.
        more: what it takes besides, as keyword arguments.
    """

    def __init__(
        self, function: Callable[..., None], more: Callable[[], Iterable[OptionSpec]] = tuple
    ) -> None:
        self.function, self._more = function, more
        self.__name__, self.__doc__, self.__module__ = (
            function.__name__,
            function.__doc__,
            function.__module__,
        )
        self._parameters: list[_Parameter] | None = None

    def __call__(self, *values: Any, **named: Any) -> None:
        self.function(*values, **{each.name: each.default for each in self._more()} | named)

    def parameters(self) -> list[_Parameter]:
        """Return what the command takes, in the order of its help."""
        if self._parameters is None:
            self._parameters = self._read_parameters()
        return self._parameters

    def _read_parameters(self) -> list[_Parameter]:
        function: Any = self.function
        defaults = dict(
            zip(reversed([*_names(function)]), reversed(function.__defaults__ or ()), strict=False)
        )
        result = []
        for name in _names(function):
            annotation = eval(function.__annotations__[name], function.__globals__)
            kind, declared = annotation.__origin__, annotation.__metadata__[0]
            result.append(_Parameter(name, kind, declared, defaults.get(name, ...)))
        return result + [
            _Parameter(each.name, each.type, _declared(each), each.default) for each in self._more()
        ]

    @property
    def __annotations__(self) -> dict[str, Any]:  # type: ignore[override]
        return {each.name: each.type for each in self.parameters()}

    @property
    def __signature__(self) -> Any:
        """What typer reads."""
        from inspect import Parameter, Signature
        from typing import Annotated

        import typer

        made = []
        for name, kind, declared, default in self.parameters():
            info = getattr(typer, declared.maker)(*declared.names, **declared.told)
            made.append(
                Parameter(
                    name,
                    Parameter.POSITIONAL_OR_KEYWORD,
                    default=Parameter.empty if default is ... else default,
                    annotation=Annotated[kind, info],
                )
            )
        return Signature(made)

    def complete(self, words: Sequence[str]) -> list[str]:
        """Return the words of a command line, with a value after each option that may stand without one."""
        # Most command lines have no option that could lack a value, and need no look at the
        # parameters here.
        if not any(
            word[:2] == "--" and following[0:1] == "-"
            for word, following in pairwise([*words, "-"])
        ):
            return [*words]
        bare_values = {
            spelling: each.declared.bare_value
            for each in self.parameters()
            if each.declared.bare_value is not None
            for spelling in each.spellings
        }
        result: list[str] = []
        for word, following in pairwise([*words, "-"]):
            result.append(word)
            if word in bare_values and following.startswith("-"):
                result.append(bare_values[word])
        return result

    def read(self, words: Sequence[str]) -> dict[str, Any] | None:
        """The values that words give the parameters; None if typer has to read them."""
        parameters = self.parameters()
        given: dict[str, Any] = {each.name: each.default for each in parameters}
        options = {
            spelling: (each, says)
            for each in parameters
            if each.declared.maker == "Option"
            for spelling, says in each.spellings.items()
        }
        places = [each for each in parameters if each.declared.maker == "Argument"]
        seen: set[str] = set()
        rest = iter(words)
        for word in rest:
            if word == "-" or not word.startswith("-"):
                if not places:
                    return None
                parameter, says = places[0], True
                kind, several = parameter.scalar()
                if not several:
                    places.pop(0)
            else:
                spelling, equals, word = word.partition("=")
                if spelling not in options or (equals and not spelling.startswith("--")):
                    return None
                parameter, says = options[spelling]
                kind, several = parameter.scalar()
                if not equals and kind is not bool:
                    word = next(rest, "-")
                if word.startswith("-") or (equals and kind is bool):
                    return None
            value = says if kind is bool else parameter.value(kind, word)
            if value is None or (parameter.name in seen and not several):
                return None
            if several:
                given[parameter.name] = [
                    *(given[parameter.name] if parameter.name in seen else ()),
                    value,
                ]
            else:
                given[parameter.name] = value
            seen.add(parameter.name)
        return None if any(value is ... for value in given.values()) else given


def _names(function: Any) -> tuple[str, ...]:
    code = function.__code__
    return code.co_varnames[: code.co_argcount]


def _declared(choice: OptionSpec) -> Declared:
    shown: Any = choice.shown or (choice.default is not None and choice.type is not bool)
    told = {
        "help": choice.help,
        "metavar": choice.unit,
        "show_default": shown,
        "rich_help_panel": choice.group,
    }
    return Option(*choice.spelled, **{word: value for word, value in told.items() if value != ""})


def command(function: Callable[..., None]) -> Command:
    """Make a command of a function."""
    return Command(function)


def command_with(
    more: Callable[[], Iterable[OptionSpec]],
) -> Callable[[Callable[..., None]], Command]:
    """Make a command of a function that takes these options too, as keyword arguments."""
    return lambda function: Command(function, more)
