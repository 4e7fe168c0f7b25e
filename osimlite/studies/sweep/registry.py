"""What is asked for by name: measures, and ways to start. Who has some registers them, by the names of the functions.

A measure is made of an engine and the contacts of each foot (None: found by the structure of the
model). So is a start: a function of states (k, y), the numbers of their engines (None: all those of
the engine), and what gives auxiliary states their start; it returns the states at which the runs
begin. Both raise OsimliteError of a model that has nothing of the kind.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

if TYPE_CHECKING:
    from osimlite.studies.sweep.measures import Measure
    from osimlite.studies.sweep.plan import Plan
    from osimlite.studies.sweep.variables import Floats

    Place = Callable[[Floats, Floats | None, Callable[[Floats], Floats]], Floats]

T = TypeVar("T")
F = TypeVar("F", bound=Callable[..., Any])

PROVIDERS = ("osimlite.studies.sweep.measures", "osimlite.studies.gait.measures")
"""Modules that register something; one is loaded when those before it have nothing of a name."""


GRADIENTS = "osimlite.studies.sweep.gradients"
"""Module that finds derivatives of measures, by its class `Gradients`; it is loaded when a search asks for them."""


class Known(NamedTuple):
    """What makes a measure, and whether a search looks for more of it."""

    make: Callable[[Any, Sequence[str] | None], Measure]
    is_maximized: bool


_MEASURES: dict[str, Known] = {}
_STARTS: dict[str, Callable[[Any, Sequence[str] | None], Place]] = {}


def measure(*, is_maximized: bool = False) -> Callable[[F], F]:
    """Register what makes a measure."""

    def register(make: F) -> F:
        _MEASURES[make.__name__] = Known(make, is_maximized)
        return make

    return register


def start(make: F) -> F:
    """Register what makes a start."""
    _STARTS[make.__name__] = make
    return make


def measure_named(name: str) -> Known | None:
    """The measure of a name; None if nobody has one."""
    return _load_provider(_MEASURES, name) if name.isidentifier() else None


def gradients(plan: Plan) -> Any:
    """What finds the derivatives of the first measure of a plan: ``at(values, free)``."""
    return import_module(GRADIENTS).Gradients(plan)


def start_named(name: str) -> Callable[[Any, Sequence[str] | None], Place]:
    """What makes the start of a name."""
    result = _load_provider(_STARTS, name)
    assert result is not None
    return result


def measure_names() -> list[str]:
    """The names of all measures."""
    _load_provider(_MEASURES, "")
    return list(_MEASURES)


def _load_provider(table: dict[str, T], name: str) -> T | None:
    for module in PROVIDERS:
        import_module(module)
        if name in table:
            break
    return table.get(name)
