"""When two values of a property are the same."""

from __future__ import annotations

from typing import Any


def same(left: Any, right: Any) -> bool:
    """Equality of stored values; NaN equals NaN, and a component given as a reference counts by its name."""
    if left is right:
        return True
    if isinstance(left, dict):
        return left.keys() == right.keys() and all(
            same(value, right[key]) for key, value in left.items()
        )
    if isinstance(left, (tuple, list)):
        return (
            isinstance(right, (tuple, list))
            and len(left) == len(right)
            and all(same(one, other) for one, other in zip(left, right, strict=True))
        )
    if isinstance(left, float) and isinstance(right, float):
        return left == right or (left != left and right != right)
    return bool(left == right)
