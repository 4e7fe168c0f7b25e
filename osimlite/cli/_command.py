"""Declaration and fast parsing of command options.

Typer provides the help, the completion and the messages for invalid options. Importing it takes
longer than most commands run, so valid command lines are parsed here without it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from types import UnionType
from typing import TYPE_CHECKING, Any, get_args, get_origin

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later

if TYPE_CHECKING:
    from osimlite.base.options import OptionSpec

_NUMBERS = {
    int: compile_later(r"[0-9]+", re.ASCII),
    float: compile_later(r"[0-9]*\.?[0-9]+(e[-+]?[0-9]+)?", re.ASCII),
}
"""Number formats that typer and this parser read alike; other words are left to typer."""


class ParameterSpec:
    """Declaration of a command's parameter, used as metadata of its annotation.

    Attributes:
        maker: "Option" or "Argument", the function of typer that is called.
        names: spellings of an option; by default that of the parameter.
        settings: keyword arguments of typer's function.
        bare_value: value of an option that is given without one; None if it requires a value.
    """

    # No dataclass: every command imports this module, and pays for what it imports.
    __slots__ = "bare_value", "maker", "names", "settings"

    def __init__(
        self,
        maker: str,
        names: Sequence[str],
        settings: dict[str, Any],
        bare_value: str | None = None,
    ) -> None:
        self.maker, self.names, self.settings, self.bare_value = maker, names, settings, bare_value


def Option(*names: str, bare_value: str | None = None, **settings: Any) -> ParameterSpec:
    """Return the declaration of an option.

    Args:
        names: spellings; by default that of the parameter.
        bare_value: value if the option is given without one; None if it requires a value.
        settings: keyword arguments of ``typer.Option``.
    """
    return ParameterSpec("Option", names, settings, bare_value)


def Argument(**settings: Any) -> ParameterSpec:
    """Return the declaration of a positional argument.

    Args:
        settings: keyword arguments of ``typer.Argument``.
    """
    return ParameterSpec("Argument", (), settings)


class _BoundParameter(NamedTuple):
    name: str
    type: Any
    declared: ParameterSpec
    default: Any

    @property
    def spellings(self) -> dict[str, Any]:
        """Spellings of the option on the command line.

        Returns:
            Value that a switch has, by its spelling.
        """
        names = self.declared.names
        # Typer derives the spelling from the name of the parameter in the same way.
        if not any(name.startswith("--") for name in names):
            names = (*names, f"--{self.name.replace('_', '-')}")
            if self.type is bool:
                # A switch has a spelling that turns it off.
                names = (*names[:-1], f"{names[-1]}/--no-{names[-1][2:]}")
        result = {}
        for name in names:
            on_spelling, _, off_spelling = name.partition("/")
            result[on_spelling] = True
            if off_spelling:
                result[off_spelling] = False
        return result

    def scalar(self) -> tuple[Any, bool]:
        """Return the type of one value, and whether the parameter is a list.

        Returns:
            The type, for example float, and True for a list of such values.
        """
        value_types = [
            value_type for value_type in get_args(self.type) if value_type is not type(None)
        ]
        value_type = value_types[0] if get_origin(self.type) is UnionType else self.type
        return (
            (get_args(value_type)[0], True)
            if get_origin(value_type) is list
            else (value_type, False)
        )

    def value(self, value_type: Any, word: str) -> Any:
        """Return the value of a word; None if typer has to convert it or to report the error.

        Args:
            value_type: type of the value.
            word: word of the command line.
        """
        if value_type is str or value_type is Path:
            return value_type(word)
        if value_type not in _NUMBERS or not _NUMBERS[value_type].fullmatch(word):
            return None
        # Numbers outside of their limits are left to typer, which words the error.
        value = value_type(word)
        settings = self.declared.settings
        return value if settings.get("min", value) <= value <= settings.get("max", value) else None


class Command:
    """Function that is a command.

    Args:
        function: function of the command, whose parameters are annotated with
            :class:`ParameterSpec`.
        list_further_options: function that returns further options, which the function takes as
            keyword arguments.
        groups: names of parameters by the heading under which the help lists them.
    """

    def __init__(
        self,
        function: Callable[..., None],
        list_further_options: Callable[[], Iterable[OptionSpec]] = tuple,
        groups: Mapping[str, Sequence[str]] | None = None,
    ) -> None:
        self.function, self._more = function, list_further_options
        self.groups = groups or {}
        self.__name__, self.__doc__, self.__module__ = (
            function.__name__,
            function.__doc__,
            function.__module__,
        )
        self._parameters: list[_BoundParameter] | None = None

    def __call__(self, *values: Any, **named_values: Any) -> None:
        self.function(
            *values, **{option.name: option.default for option in self._more()} | named_values
        )

    def parameters(self) -> list[_BoundParameter]:
        """Return the parameters of the command in the order of its help."""
        if self._parameters is None:
            self._parameters = self._read_parameters()
        return self._parameters

    def _read_parameters(self) -> list[_BoundParameter]:
        function: Any = self.function
        defaults = dict(
            zip(
                # Defaults belong to the last parameters.
                reversed([*_list_argument_names(function)]),
                reversed(function.__defaults__ or ()),
                strict=False,
            )
        )
        result = []
        for name in _list_argument_names(function):
            # Annotations are texts (`from __future__ import annotations`) that are evaluated when a
            # command is read.
            annotation = eval(function.__annotations__[name], function.__globals__)
            value_type = annotation.__origin__
            declared = annotation.__metadata__[0]
            result.append(_BoundParameter(name, value_type, declared, defaults.get(name, ...)))
        return result + [
            _BoundParameter(option.name, option.type, _make_spec(option), option.default)
            for option in self._more()
        ]

    @property
    def __annotations__(self) -> dict[str, Any]:  # type: ignore[override]
        return {parameter.name: parameter.type for parameter in self.parameters()}

    @property
    def __signature__(self) -> Any:
        """Signature that typer inspects."""
        from inspect import Parameter, Signature
        from typing import Annotated

        import typer

        parameters = []
        for name, value_type, declared, default in self.parameters():
            typer_parameter = getattr(typer, declared.maker)(*declared.names, **declared.settings)
            parameters.append(
                Parameter(
                    name,
                    Parameter.POSITIONAL_OR_KEYWORD,
                    default=Parameter.empty if default is ... else default,
                    annotation=Annotated[value_type, typer_parameter],
                )
            )
        return Signature(parameters)

    def complete(self, words: Sequence[str]) -> list[str]:
        """Return the words of a command line with the values of options that are given without one."""
        # Most command lines need no completion, and reading the parameters imports their modules.
        if not any(
            word[:2] == "--" and following[0:1] == "-"
            for word, following in pairwise([*words, "-"])
        ):
            return [*words]
        bare_values = {
            spelling: parameter.declared.bare_value
            for parameter in self.parameters()
            if parameter.declared.bare_value is not None
            for spelling in parameter.spellings
        }
        result: list[str] = []
        # The added "-" makes the last word a word with a successor.
        for word, following in pairwise([*words, "-"]):
            result.append(word)
            if word in bare_values and following.startswith("-"):
                result.append(bare_values[word])
        return result

    def read(self, words: Sequence[str]) -> dict[str, Any] | None:
        """Parse the words of a command line.

        Returns:
            Values by parameter; None if typer has to parse the words, in particular if they are invalid.
        """
        parameters = self.parameters()
        values: dict[str, Any] = {
            bound_parameter.name: bound_parameter.default for bound_parameter in parameters
        }
        options = {
            # Switches and options by spelling, each with the value that a switch has.
            spelling: (bound_parameter, flag)
            for bound_parameter in parameters
            if bound_parameter.declared.maker == "Option"
            for spelling, flag in bound_parameter.spellings.items()
        }
        arguments = [
            bound_parameter
            for bound_parameter in parameters
            if bound_parameter.declared.maker == "Argument"
        ]
        names_with_value: set[str] = set()
        remaining = iter(words)
        for word in remaining:
            # "-" alone means standard input, and is no option.
            if word == "-" or not word.startswith("-"):
                if not arguments:
                    return None
                parameter = arguments[0]
                flag = True
                value_type, is_list = parameter.scalar()
                if not is_list:
                    arguments.pop(0)
            else:
                # Short options with "=" are left to typer.
                spelling, equals, word = word.partition("=")
                if spelling not in options or (equals and not spelling.startswith("--")):
                    return None
                parameter, flag = options[spelling]
                value_type, is_list = parameter.scalar()
                if not equals and value_type is not bool:
                    word = next(remaining, "-")
                # A value that starts with "-" may be a negative number or a forgotten value; typer decides.
                if word.startswith("-") or (equals and value_type is bool):
                    return None
            # Typer refuses an option that is given twice, unless it is a list.
            value = flag if value_type is bool else parameter.value(value_type, word)
            if value is None or (parameter.name in names_with_value and not is_list):
                return None
            if is_list:
                values[parameter.name] = [
                    *(values[parameter.name] if parameter.name in names_with_value else ()),
                    value,
                ]
            else:
                values[parameter.name] = value
            names_with_value.add(parameter.name)
        # A parameter without a value is required, and typer words the error.
        return None if any(value is ... for value in values.values()) else values


def _list_argument_names(function: Any) -> tuple[str, ...]:
    code = function.__code__
    return code.co_varnames[: code.co_argcount]


def _make_spec(option: OptionSpec) -> ParameterSpec:
    show_default: Any = option.default_text or (
        option.default is not None and option.type is not bool
    )
    settings = {
        "help": option.help,
        "metavar": option.unit,
        "show_default": show_default,
        "rich_help_panel": option.group,
    }
    return Option(
        *option.spelled, **{name: value for name, value in settings.items() if value != ""}
    )


def command(function: Callable[..., None]) -> Command:
    """Decorate a function as a command.

    Returns:
        Command that calls the function.
    """
    return Command(function)


def command_with(
    list_further_options: Callable[[], Iterable[OptionSpec]],
    groups: Mapping[str, Sequence[str]] | None = None,
) -> Callable[[Callable[..., None]], Command]:
    """Decorate a function as a command with further options.

    Args:
        list_further_options: function that returns further options, which the function takes as
            keyword arguments.
        groups: names of parameters by the heading under which the help lists them.

    Returns:
        Decorator that makes a command of a function.
    """
    return lambda function: Command(function, list_further_options, groups)
