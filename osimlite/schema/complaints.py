"""What is said when a component is made, or changed, wrongly."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import ValidationError

if TYPE_CHECKING:
    from osimlite.schema.base import Object


def misspelt(cls: type[Object], name: str) -> str:
    """There is no property of this name; with the nearest ones."""
    from osimlite.text import did_you_mean

    known = [field_name for field_name in cls.model_fields]
    # Sockets are known by the middle of their names: ``frame`` is ``socket_frame``.
    within = [field_name for field_name in known if f"_{name}_" in f"{field_name}_"]
    better = f"; did you mean '{min(within, key=len)}'?" if within and len(name) > 3 else did_you_mean(name, known)
    return f"{cls.__name__} has no property '{name}'{better}"


def explained(cls: type[Object], error: ValidationError) -> str:
    """What pydantic found wrong with a value, in one line."""
    first = error.errors()[0]
    place = ".".join(str(part) for part in first["loc"]) or "?"
    reason = first["msg"].removeprefix("Value error, ")
    return f"{cls.__name__}.{place}: {reason}"
