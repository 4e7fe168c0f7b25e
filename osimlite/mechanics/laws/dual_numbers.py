"""What is said of numbers that carry derivatives: to floats these functions do nothing new.

Machine code with tangents puts its own in their places, and so does
:mod:`osimlite.simulation.engines.carrying` in Python.
"""

from __future__ import annotations

from typing import Any


def settled(root: float, error: float, slope: float) -> float:
    """A root as a search has found it; its derivatives are those that the equation says.

    A search ends when the value is good, and its derivatives may be a step behind, or those of
    where it started.

    Args:
        root: of the equation.
        error: of the equation at the root.
        slope: of the error over the root.
    """
    return root


def is_nothing(number: float) -> bool:
    """Whether a number is 0 with all its derivatives, so that what is multiplied by it can be left out."""
    return number == 0.0


def plain(number: float) -> float:
    """A number without derivatives."""
    return number


def carrying(number: float, direction: int, directions: int) -> float:
    """A number that from here on carries derivatives along so many directions, of which it is one itself."""
    return number


def carrying_room(vector: Any, directions: int) -> Any:
    """Room of floats as room of numbers that carry derivatives; each takes the place of 1 + directions."""
    return vector


def slope_of(number: float, direction: int) -> float:
    """The derivative of a number along a direction."""
    return 0.0
