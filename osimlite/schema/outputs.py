"""The outputs of components."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

from osimlite.schema.base import Component


class Output(NamedTuple):
    """The type of an output, and whether it has channels."""

    type: str
    channels: bool


@cache
def outputs_of(cls: type[Component]) -> dict[str, Output]:
    """The outputs of a class by name."""
    result: dict[str, Output] = {}
    for base in cls.__mro__:
        own = base.__dict__.get("facts")
        for word in own.outputs.split() if own is not None else ():
            name, _, kind = word.partition(":")
            result[name.removesuffix("[]")] = Output(kind or "double", name.endswith("[]"))
    return result
