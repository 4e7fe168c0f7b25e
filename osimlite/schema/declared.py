"""What the body of a class declares: properties, by annotated names that have defaults.

An annotation is looked at when somebody asks for the properties of a class: most commands use few of all classes.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import cache
from typing import Any, ClassVar, get_origin

from osimlite.schema.fields import Kind, Value, class_in

_TEXT = Value("string")


class Property:
    """A property as its class declares it.

    Attributes:
        annotation: its type, without the markers.
        metadata: the markers.
        default: its value where none is given; None if that is made for each object.
        default_factory: what makes it.
    """

    __slots__ = "_accepts", "_kind", "annotation", "default", "default_factory", "metadata"

    def __init__(self, default: Any, default_factory: Callable[[], Any] | None = None) -> None:
        self.default, self.default_factory = default, default_factory
        self.annotation: Any = None
        self.metadata: tuple[Any, ...] = ()

    def read(self, module: str) -> None:
        """Take apart the annotation, which stands in this module."""
        whole = self.annotation
        if isinstance(whole, str):
            whole = eval(whole, vars(sys.modules[module]))
        if hasattr(whole, "__metadata__"):
            self.metadata, whole = whole.__metadata__, whole.__origin__
        self.annotation = whole
        # What is no property of OpenSim's, as the name of an object, is a text.
        self._kind = next((item for item in self.metadata if isinstance(item, Kind)), _TEXT)
        self._accepts = class_in(self.annotation)

    def check(self, value: Any) -> Any:
        """Return `value` in the form that objects store; ValueError if it is none for this property."""
        return self._kind.check(value, self._accepts)


def field(*, default_factory: Callable[[], Any]) -> Any:
    """The default of a property that is made for each object."""
    return Property(None, default_factory)


def declare(cls: type) -> None:
    """Note what the body of a class declares, and leave no defaults there: they would hide what an object lacks."""
    declared: dict[str, Property] = {}
    for name, annotation in cls.__annotations__.items():
        if _is_of_the_class(annotation):
            continue
        default = cls.__dict__[name]
        declared[name] = default if isinstance(default, Property) else Property(default)
        declared[name].annotation = annotation
        delattr(cls, name)
    cls._declared = declared  # type: ignore[attr-defined]


def _is_of_the_class(annotation: Any) -> bool:
    if isinstance(annotation, str):
        return annotation.startswith("ClassVar")
    return ClassVar in (annotation, get_origin(annotation))


@cache
def properties_of(cls: type) -> dict[str, Property]:
    """The properties of a class by attribute, those of its bases first."""
    result: dict[str, Property] = {}
    for base in reversed(cls.__mro__):
        for name, each in base.__dict__.get("_declared", {}).items():
            each.read(base.__module__)
            result[name] = each
    return result
