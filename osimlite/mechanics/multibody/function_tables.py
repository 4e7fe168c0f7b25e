"""Tables of functions, by which the kernels evaluate them.

The format is described in :mod:`osimlite.mechanics.kernels.functions`.
"""

from __future__ import annotations

from math import isfinite

from osimlite.base.text import add_article
from osimlite.errors import ModelError, UnsupportedError
from osimlite.mechanics.kernels.functions import FUNCTION_TYPE
from osimlite.mechanics.multibody import functions as f


def function_table(function: f.SmoothFunction, description: str) -> list[float]:
    """Return the table of a function of coordinates.

    Args:
        function: the function.
        description: description of the function, for messages.

    Raises:
        UnsupportedError: the kernels cannot evaluate it.
    """
    return _require_table(f.table_at_knots(function), function, description)


def _require_table(table: list[float], function: f.SmoothFunction, description: str) -> list[float]:
    """Return the table of a function after checking that it is not empty.

    Args:
        table: table of the function.
        function: function.
        description: description of the function, for messages.

    Raises:
        UnsupportedError: the table is empty, because the kernels cannot evaluate the function.
    """
    if not table:
        name = type(function).__name__
        raise UnsupportedError(
            f"{description} is {add_article(name)}, which osimlite cannot compute; use another function"
        )
    return table


def table_of_one(function: f.SmoothFunction, description: str) -> list[float]:
    """Return the table of a function of one number, for `functions.evaluate_function`.

    Args:
        function: the function.
        description: description of the function, for messages.

    Raises:
        ModelError: a number of the function is not finite.
        UnsupportedError: the kernels cannot evaluate it.
    """
    table = _table_of_one(function, description)
    # The sum of finite numbers may overflow, hence the second test.
    if not isfinite(sum(table)) and not all(map(isfinite, table)):
        raise ModelError(f"{description} has a number that is not finite; give one that is")
    return table


def _table_of_one(function: f.SmoothFunction, description: str) -> list[float]:
    """Return the table of a function of one number, whose numbers are not checked.

    Args:
        function: function.
        description: description of the function, for messages.
    """
    if isinstance(function, f.ScaledFunction):
        function_type, factor, *remainder = _table_of_one(function.function, description)
        return [function_type, function.scale * factor, *remainder]
    if isinstance(function, f.WeightedSum):
        # Functions of several numbers are written as polynomials of one.
        function = f.Linear(function.weights[0], function.start)
    elif isinstance(function, f.MultivariatePolynomial):
        coefficients = [0.0] * (1 + max(power for (power,) in function.powers))
        for (power,), coefficient in zip(function.powers, function.coefficients, strict=True):
            coefficients[power] += coefficient
        function_type, *remainder = f.Polynomial(tuple(reversed(coefficients))).table
        return [
            FUNCTION_TYPE.PIECES_OF_OPENSIM if function.opensim_derivatives else function_type,
            *remainder,
        ]
    return _require_table([*function.table], function, description)
