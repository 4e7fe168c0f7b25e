"""What is said when a component is made, or changed, wrongly."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from pydantic import ValidationError

if TYPE_CHECKING:
    from osimlite.schema.base import Object


def describe_unknown_property(cls: type[Object], name: str) -> str:
    """There is no property of this name; with the nearest ones."""
    from osimlite.base.text import suggest_name

    known = [field_name for field_name in cls.model_fields]
    # Sockets are known by the middle of their names: ``frame`` is ``socket_frame``.
    within = [field_name for field_name in known if f"_{name}_" in f"{field_name}_"]
    better = (
        f"; did you mean '{min(within, key=len)}'?"
        if within and len(name) > 3
        else suggest_name(name, known)
    )
    return f"{cls.__name__} has no property '{name}'{better}"


def describe_validation_error(cls: type[Object], error: ValidationError) -> str:
    """What pydantic found wrong with a value, in one line."""
    first = error.errors()[0]
    place = ".".join(str(part) for part in first["loc"]) or "?"
    reason = first["msg"].removeprefix("Value error, ")
    given = first.get("input")
    angle = re.fullmatch(r"\s*([-+.\d]+)\s*(deg|°)\s*", given) if isinstance(given, str) else None
    hint = (
        f"; give the number alone, and what is in rad as math.radians({angle[1]})" if angle else ""
    )
    return f"{cls.__name__}.{place}: {reason}{hint}"


def describe_unnamed_value(cls: type[Object], given: object) -> str:
    """Properties have names."""
    example = repr(given) if isinstance(given, str) else "..."
    return f"{cls.__name__} takes its properties by name, as in {cls.__name__}(name={example})"
