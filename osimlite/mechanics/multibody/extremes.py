"""Computation with extreme numbers of a model, without warnings and exceptions of numpy."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import wraps
from math import isfinite
from typing import Any, ParamSpec, TypeVar

import numpy as np

from osimlite.errors import ModelError, OsimliteError
from osimlite.schema.base import Component, Object
from osimlite.schema.model import Model

P = ParamSpec("P")
R = TypeVar("R")
C = TypeVar("C", bound=type)

_MIN_USUAL_SIZE = 1e-100
"""Smallest usual size of a number of a model that is not 0."""
_MAX_USUAL_SIZE = 1e25
"""Largest usual size of a number of a model; messages name numbers beyond these sizes."""


def any_numbers(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function that computes with any numbers of a model.

    Overflow gives infinite or undefined numbers without a warning; callers that need finite ones
    check for them. Where equations then have no solution, the function raises a ModelError, which
    names the most extreme number of a model among the arguments.
    """

    @wraps(function)
    def computing(*values: P.args, **named: P.kwargs) -> R:
        try:
            with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
                return function(*values, **named)
        except (ArithmeticError, ValueError) as fault:
            # Errors of osimlite have messages for users; others come from the arithmetic.
            is_expected = isinstance(fault, OsimliteError)
            is_numeric = (
                isinstance(fault, ArithmeticError | np.linalg.LinAlgError) or str(fault) in _OF_MATH
            )
            if is_expected or not is_numeric:
                raise
            models = [value for value in (*values, *named.values()) if isinstance(value, Model)]
            extreme_number = next(
                (text for model in models if (text := find_extreme_number(model))),
                "a number of the model",
            )
            raise ModelError(
                f"{extreme_number} is too large or too small to compute with; change this number"
            ) from None

    return computing


_OF_MATH = {"math domain error", "math range error", "cannot convert float NaN to integer"}


def methods_of_any_numbers(cls: C) -> C:
    """Wrap all public methods of a class by `any_numbers`.

    Returns:
        The same class.
    """
    for name, method in [*vars(cls).items()]:
        if callable(method) and not name.startswith("_"):
            setattr(cls, name, any_numbers(method))
    return cls


def find_extreme_number(model: Model) -> str:
    """Return the most extreme number of a model with its component, empty if all are usual."""
    tree = model.tree()
    result = [
        (size, f"{name} of '{tree.path_of(component)}', {number:g},")
        for component in tree.components
        for name, number in _list_numbers(component)
        if (size := _measure_excess(number))
    ]
    return max(result)[1] if result else ""


def _measure_excess(number: float) -> float:
    """Return the ratio by which a number is beyond the usual sizes, 0 for a usual one."""
    if not isfinite(number):
        return np.inf
    size = abs(number)
    return (
        size / _MAX_USUAL_SIZE
        if size > _MAX_USUAL_SIZE
        else _MIN_USUAL_SIZE / size
        if 0.0 < size < _MIN_USUAL_SIZE
        else 0.0
    )


def _list_numbers(component: Component) -> Iterator[tuple[str, float]]:
    """Yield the numbers of a component, and of its parts that are not components."""
    for name, info in type(component).model_fields.items():
        field_value: Any = getattr(component, name)
        # Some defaults are infinite, and correct.
        pending = [] if field_value == info.default else [field_value]
        while pending:
            value = pending.pop()
            if isinstance(value, float):
                yield name, value
            elif isinstance(value, list | tuple):
                pending += value
            elif isinstance(value, Object) and not isinstance(value, Component):
                pending += [getattr(value, field) for field in type(value).model_fields]
