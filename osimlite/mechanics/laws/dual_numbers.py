"""Operations on dual numbers, which carry derivatives; for floats they do nothing.

Machine code with tangents replaces them by its own, and so does
:mod:`osimlite.simulation.engines.dual_numbers` in Python.
"""

from __future__ import annotations

from typing import Any


def differentiate_root(root: float, error: float, slope: float) -> float:
    """Return a root that a search found, with the derivatives of the implicit function theorem.

    A search ends when the value is good; its own derivatives may lag a step behind, or be those of the
    start.

    Args:
        root: root of an equation.
        error: residual of the equation at the root, with derivatives by the parameters.
        slope: derivative of the residual by the unknown.
    """
    # The derivative is that of root - error / slope; floats have none, so the value is returned as
    # it is.
    return root


def is_exact_zero(number: float) -> bool:
    """Return whether a number and all its derivatives are 0.

    Multiplication by such a number can be skipped.
    """
    # A dual number counts as nothing only if its derivatives vanish too; see the replacements.
    return number == 0.0


def strip_derivatives(number: float) -> float:
    """Return a number without its derivatives."""
    return number


def seed_derivative(number: float, direction: int, directions: int) -> float:
    """Return a number that carries derivatives: 1 along `direction`, 0 along the others.

    Args:
        number: value.
        direction: index of the direction along which the number has derivative 1.
        directions: number of directions.
    """
    return number


def make_dual_workspace(vector: Any, directions: int) -> Any:
    """Return workspace of floats as workspace of dual numbers, each of 1 + `directions` floats.

    Args:
        vector: array of floats.
        directions: number of directions.
    """
    return vector


def get_derivative(number: float, direction: int) -> float:
    """Return the derivative of a number along a direction.

    Args:
        number: number that may carry derivatives.
        direction: index of the direction.
    """
    return 0.0
