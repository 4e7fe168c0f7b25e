"""What is asked for by name: measures, and ways to place a model at the start of a run.

Who has some registers them with `measure` and `start`, as :mod:`osimlite.sweep.measures` does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeVar

if TYPE_CHECKING:
    from osimlite.sweep.measures import Measure
    from osimlite.sweep.variables import Floats

T = TypeVar("T")

PROVIDERS = ("osimlite.sweep.measures", "osimlite.gait.measures")
"""Modules that register something, by name: a sweep imports none of the others."""


class MeasureMaker(Protocol):
    """Makes a measure for the models of an engine."""

    def __call__(self, engine: Any, feet: Sequence[str] | None) -> Measure:
        """Make it; raises OsimliteError if the model has nothing of the kind."""


class Place(Protocol):
    """Gives the states (k, y) at which runs start from those that were asked for, for all `numbers` of engines."""

    def __call__(self, states: Floats, numbers: Floats | None, started: Callable[[Floats], Floats]) -> Floats:
        """Place them; `started` gives auxiliary states their start."""


StartMaker = Callable[[Any, Sequence[str] | None], Place]
"""Makes a place of an engine and the contacts of each foot; OsimliteError if the model has nothing of the kind."""


class Known(NamedTuple):
    """What makes a measure, and whether a search looks for more of it."""

    make: MeasureMaker
    is_maximized: bool


_MEASURES: dict[str, Known] = {}
_STARTS: dict[str, StartMaker] = {}


def measure(*, is_maximized: bool = False) -> Callable[[MeasureMaker], MeasureMaker]:
    """Register a measure by the name of the function that makes it; whether a search looks for more of it."""

    def register(make: Any) -> Any:
        _MEASURES[make.__name__] = Known(make, is_maximized)
        return make

    return register


def start(make: StartMaker) -> StartMaker:
    """Register a way to start by the name of the function that makes it."""
    _STARTS[getattr(make, "__name__", "")] = make
    return make


def measure_named(name: str) -> Known | None:
    """The measure of a name; None if nobody has one."""
    return _found(_MEASURES, name) if name.isidentifier() else None


def start_named(name: str) -> StartMaker:
    """The way to start of a name."""
    found = _found(_STARTS, name)
    assert found is not None
    return found


def measure_names() -> list[str]:
    """The names of all measures."""
    _found(_MEASURES, "")
    return list(_MEASURES)


def _found(table: dict[str, T], name: str) -> T | None:
    for module in PROVIDERS:
        import_module(module)
        if name in table:
            break
    return table.get(name)
