"""What `sweep` and `optimize` have in common: the model, and what of it is varied."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from osimlite.sweep.plan import Plan

Source = Annotated[
    str, typer.Argument(help="A model file, or anything that 'osimlite build' makes one of.", show_default=False)
]
Vary = Annotated[
    list[str] | None,
    typer.Option(
        "--vary",
        metavar="NAME=LOW:HIGH[:COUNT]",
        help="A coordinate, COORDINATE/speed, /path/of/a/property, or a parameter of the model function.",
        show_default=False,
    ),
]
Parameters = Annotated[
    list[str] | None,
    typer.Option(
        "-p", "--parameter", metavar="NAME=VALUE", help="Set a parameter of the model function.", show_default=False
    ),
]
To = Annotated[float, typer.Option("--to", metavar="SECONDS", help="How long to simulate.")]
Engine = Annotated[str, typer.Option(help="What computes the accelerations: 'compiled' or 'bullet'.")]
Accuracy = Annotated[float | None, typer.Option(help="Of the integrator, as in OpenSim.", show_default="0.001")]
Below = Annotated[
    list[str] | None,
    typer.Option("--stop-below", metavar="COORDINATE=VALUE", help="End a run when it falls below.", show_default=False),
]
Above = Annotated[
    list[str] | None,
    typer.Option("--stop-above", metavar="COORDINATE=VALUE", help="End a run when it rises above.", show_default=False),
]
Workers = Annotated[
    int | None, typer.Option(min=1, help="How many work here.", show_default="one for each core of this machine")
]
Cluster = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="Work on the Dask cluster of this scheduler.", show_default=False),
]
SkipUnsupported = Annotated[bool, typer.Option("--skip-unsupported", help="Leave out forces that cannot be computed.")]


def make_plan(
    source: str,
    vary: Sequence[str] | None,
    parameter: Sequence[str] | None,
    below: Sequence[str] | None,
    above: Sequence[str] | None,
    **choices: Any,
) -> Plan:
    """The plan that the options describe.

    Raises:
        OsimliteError: they do not describe one.
    """
    from functools import partial

    from osimlite.document.reader import read
    from osimlite.errors import SettingError
    from osimlite.models.source import make_model, parameters_of
    from osimlite.sweep.plan import plan
    from osimlite.sweep.variables import parse

    ranges = parse(vary or [])
    if not ranges:
        raise SettingError("say what to vary, as in --vary RHip_rz=0.2:0.6")
    choices["stops"] = (*_stops(below, True), *_stops(above, False))
    if Path(source).suffix.lower() == ".osim":
        if parameter:
            raise SettingError(f"'{source}' is a file and takes no parameters; vary its properties by their paths")
        return plan(read(source), ranges, folder=str(Path(source).resolve().parent), **choices)
    given = _words(parameter or [], "-p")
    both = [name for name in ranges if name in given]
    if both:
        raise SettingError(f"the parameter '{both[0]}' is set and varied; do one of the two")
    known = {name: default for name, default in parameters_of(source).items() if name not in given}
    return plan(partial(_make, make_model, source, given), ranges, parameters=known, **choices)


def _make(make_model: Any, source: str, given: dict[str, str], parameters: dict[str, float]) -> Any:
    return make_model(source, {**given, **{name: repr(value) for name, value in parameters.items()}})


def _words(words: Sequence[str], option: str) -> dict[str, str]:
    from osimlite.errors import SettingError

    found = {}
    for word in words:
        name, equals, value = (part.strip() for part in word.partition("="))
        if not equals:
            raise SettingError(f"{option} takes NAME=VALUE, got '{word}'")
        found[name] = value
    return found


def _stops(words: Sequence[str] | None, is_below: bool) -> list[Any]:
    from osimlite.errors import SettingError
    from osimlite.quantity import quantity
    from osimlite.sweep.plan import Stop

    found = []
    option = "--stop-below" if is_below else "--stop-above"
    for name, text in _words(words or [], option).items():
        given = quantity(text)
        if given is None:
            raise SettingError(f"{option} takes COORDINATE=VALUE with a number such as 0.5 or 30deg, got '{text}'")
        found.append(Stop(name, given.value, is_below))
    return found
