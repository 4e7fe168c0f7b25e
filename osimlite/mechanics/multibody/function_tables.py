"""Functions as tables of numbers, which the kernels evaluate; see :mod:`osimlite.mechanics.kernels.functions`."""

from __future__ import annotations

from math import isfinite

from osimlite.errors import ModelError, UnsupportedError
from osimlite.mechanics.kernels.functions import PIECES_OF_OPENSIM
from osimlite.mechanics.multibody import functions as f


def function_table(function: f.Function, where: str) -> list[float]:
    """The table of a function of coordinates.

    Raises:
        UnsupportedError: there is none.
    """
    return _has_table(f.table_at_knots(function), function, where)


def _has_table(table: list[float], function: f.Function, where: str) -> list[float]:
    if not table:
        name = type(function).__name__
        raise UnsupportedError(
            f"{where} is a {name}, which cannot be computed; take another function"
        )
    return table


def table_of_one(function: f.Function, where: str) -> list[float]:
    """The table of a function of one number, for `value_at`.

    Raises:
        ModelError: one of its numbers is not finite.
        UnsupportedError: there is no kind for it.
    """
    table = _table_of_one(function, where)
    # A sum that is finite has finite parts only.
    if not isfinite(sum(table)) and not all(map(isfinite, table)):
        raise ModelError(f"{where} has a number that is not finite; give one that is")
    return table


def _table_of_one(function: f.Function, where: str) -> list[float]:
    if isinstance(function, f.Scaled):
        kind, factor, *rest = _table_of_one(function.function, where)
        return [kind, function.scale * factor, *rest]
    if isinstance(function, f.WeightedSum):
        function = f.Linear(function.weights[0], function.start)
    elif isinstance(function, f.MultivariatePolynomial):
        coefficients = [0.0] * (1 + max(power for (power,) in function.powers))
        for (power,), coefficient in zip(function.powers, function.coefficients, strict=True):
            coefficients[power] += coefficient
        kind, *rest = f.Polynomial(tuple(reversed(coefficients))).table
        return [PIECES_OF_OPENSIM if function.opensim_derivatives else kind, *rest]
    return _has_table([*function.table], function, where)
