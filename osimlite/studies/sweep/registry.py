"""Registry of measures and of initial states that users select by name.

Providers register functions, whose names users write. A measure is made of an engine and the
contacts of each foot (None: found from the structure of the model). So is a start: a function of
states (k, y), of the numbers of their engines (None: all those of the engine), and of a function
that initializes auxiliary states; it returns the initial states. Both raise OsimliteError for a
model that lacks what they need.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any, TypeVar

from osimlite.base.named_tuples import NamedTuple

if TYPE_CHECKING:
    from osimlite.studies.sweep.measures import RunMeasure
    from osimlite.studies.sweep.plan import Plan
    from osimlite.studies.sweep.variables import Floats

    StartFunction = Callable[[Floats, Floats | None, Callable[[Floats], Floats]], Floats]

T = TypeVar("T")
F = TypeVar("F", bound=Callable[..., Any])

PROVIDERS = ("osimlite.studies.sweep.measures", "osimlite.studies.gait.measures")
"""Modules that register something; each is imported only if those before it do not know a name."""


GRADIENTS_MODULE = "osimlite.studies.sweep.gradients"
"""Module with the class `Gradients`; it is imported only when a search needs derivatives."""


class RegisteredMeasure(NamedTuple):
    """Measure in the registry.

    Attributes:
        make: function of the engine and the feet that returns the measure.
        is_maximized: whether a search maximizes it by default.
    """

    make: Callable[[Any, Sequence[str] | None], RunMeasure]
    is_maximized: bool


MEASURES: dict[str, RegisteredMeasure] = {}
"""Measures by name."""
_STARTS: dict[str, Callable[[Any, Sequence[str] | None], StartFunction]] = {}
"""Initial states by name."""


def register_measure(*, is_maximized: bool = False) -> Callable[[F], F]:
    """Return a decorator that registers a function which makes a measure, under its name."""

    def register(make: F) -> F:
        MEASURES[make.__name__] = RegisteredMeasure(make, is_maximized)
        return make

    return register


def register_start(make: F) -> F:
    """Register a function that makes a start, under its name.

    Returns:
        The same function.
    """
    _STARTS[make.__name__] = make
    return make


def find_measure(name: str) -> RegisteredMeasure | None:
    """Return the measure of a name, or None."""
    # An expression or a path cannot be a registered name, and need not load any provider.
    return _load_provider(MEASURES, name) if name.isidentifier() else None


def make_gradients(plan: Plan) -> Any:
    """Return the derivatives of the first measure of a plan.

    The result has a method `evaluate(values, free)`.
    """
    return import_module(GRADIENTS_MODULE).Gradients(plan)


def find_start(name: str) -> Callable[[Any, Sequence[str] | None], StartFunction]:
    """Return the function that makes the start of a name."""
    result = _load_provider(_STARTS, name)
    assert result is not None
    return result


def list_measure_names() -> list[str]:
    """Return the names of all measures."""
    # An unknown name makes all providers load.
    _load_provider(MEASURES, "")
    return list(MEASURES)


def _load_provider(table: dict[str, T], name: str) -> T | None:
    """Return the entry of a name, or None; import modules until one of them registers the name."""
    for module in PROVIDERS:
        import_module(module)
        if name in table:
            break
    return table.get(name)
