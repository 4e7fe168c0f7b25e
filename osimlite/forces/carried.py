"""What a law has to say for numbers that carry derivatives: to floats these functions do nothing new.

Machine code with tangents puts its own in their places.
"""

from __future__ import annotations


def settled(root: float, error: float, slope: float) -> float:
    """A root as a search has found it; its derivatives are those that the equation says.

    A search ends when the value is good, and its derivatives may be a step behind, or those of where it started.

    Args:
        root: of the equation.
        error: of the equation at the root.
        slope: of the error over the root.
    """
    return root


def is_nothing(number: float) -> bool:
    """Whether a number is 0 with all its derivatives, so that what is multiplied by it can be left out."""
    return number == 0.0
