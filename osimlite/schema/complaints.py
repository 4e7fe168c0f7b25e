"""Messages for invalid arguments and property values of components."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from pydantic import ValidationError

if TYPE_CHECKING:
    from osimlite.schema.base import Object


def describe_unknown_property(cls: type[Object], name: str) -> str:
    """Return the message for a property that a class does not have, with the nearest names.

    Args:
        cls: class without the property.
        name: unknown name.
    """
    from osimlite.base.text import suggest_name

    field_names = [field_name for field_name in cls.model_fields]
    # Users know a socket by the middle of its attribute: ``frame`` for ``socket_frame``.
    matches = [field_name for field_name in field_names if f"_{name}_" in f"{field_name}_"]
    better = (
        f"; did you mean '{min(matches, key=len)}'?"
        if matches and len(name) > 3
        else suggest_name(name, field_names)
    )
    return f"{cls.__name__} has no property '{name}'{better}"


def describe_validation_error(cls: type[Object], error: ValidationError) -> str:
    """Return the message for a value that pydantic rejects, in one line.

    Args:
        cls: class of the component.
        error: error of pydantic.
    """
    first_error = error.errors()[0]
    location = ".".join(str(part) for part in first_error["loc"]) or "?"
    reason = first_error["msg"].removeprefix("Value error, ")
    value = first_error.get("input")
    angle = re.fullmatch(r"\s*([-+.\d]+)\s*(deg|°)\s*", value) if isinstance(value, str) else None
    hint = f"; give a plain number, for an angle in rad math.radians({angle[1]})" if angle else ""
    return f"{cls.__name__}.{location}: {reason}{hint}"


def describe_unnamed_value(cls: type[Object], value: object) -> str:
    """Return the message for a positional argument, which classes of components do not accept.

    Args:
        cls: class of the component.
        value: value of the argument.
    """
    example = repr(value) if isinstance(value, str) else "..."
    return f"{cls.__name__} takes its properties by name, as in {cls.__name__}(name={example})"
