"""Numbers that no computation is meant for: nothing that they lead to is a warning or an error of numpy's."""

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

_LEAST, _MOST = 1e-100, 1e25
"""Sizes of numbers that models have; what is beyond is named where something cannot be computed."""


def any_numbers(function: Callable[P, R]) -> Callable[P, R]:
    """Let a function compute with whatever numbers a model has.

    What overflows is infinite, or no number, without a warning; whoever needs it finite checks
    that. Where equations have no solution then, there is a ModelError, which names the most extreme
    number of a model among the arguments.
    """

    @wraps(function)
    def computing(*values: P.args, **named: P.kwargs) -> R:
        try:
            with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
                return function(*values, **named)
        except (ArithmeticError, ValueError) as fault:
            is_meant = isinstance(fault, OsimliteError)
            is_numeric = (
                isinstance(fault, ArithmeticError | np.linalg.LinAlgError) or str(fault) in _OF_MATH
            )
            if is_meant or not is_numeric:
                raise
            models = [value for value in (*values, *named.values()) if isinstance(value, Model)]
            what = next(
                (text for model in models if (text := find_extreme_number(model))),
                "a number of the model",
            )
            raise ModelError(
                f"{what} is too large or too small to compute with ({fault}); give another"
            ) from None

    return computing


_OF_MATH = {"math domain error", "math range error", "cannot convert float NaN to integer"}


def methods_of_any_numbers(cls: C) -> C:
    """Let all public methods of a class compute with whatever numbers a model has."""
    for name, method in [*vars(cls).items()]:
        if callable(method) and not name.startswith("_"):
            setattr(cls, name, any_numbers(method))
    return cls


def find_extreme_number(model: Model) -> str:
    """The number of a model that is furthest from what models have, with its place; empty if all are usual."""
    tree = model.tree()
    result = [
        (size, f"{name} of '{tree.path_of(component)}', {number:g},")
        for component in tree.components
        for name, number in _list_numbers(component)
        if (size := _size(number))
    ]
    return max(result)[1] if result else ""


def _size(number: float) -> float:
    """How far beyond what is usual a number is, 0 for one that is not."""
    if not isfinite(number):
        return np.inf
    size = abs(number)
    return size / _MOST if size > _MOST else _LEAST / size if 0.0 < size < _LEAST else 0.0


def _list_numbers(component: Component) -> Iterator[tuple[str, float]]:
    """Every number of a component, and of what it holds that is no component."""
    for name, info in type(component).model_fields.items():
        held: Any = getattr(component, name)
        # That some defaults are infinite is as it should be.
        pending = [] if held == info.default else [held]
        while pending:
            value = pending.pop()
            if isinstance(value, float):
                yield name, value
            elif isinstance(value, list | tuple):
                pending += value
            elif isinstance(value, Object) and not isinstance(value, Component):
                pending += [getattr(value, field) for field in type(value).model_fields]
