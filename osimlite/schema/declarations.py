"""Declarations of properties: the annotated attributes of component classes.

The metaclass :class:`DeclaredType` only takes the defaults out of a new class. Types and bases are
looked at when somebody asks for the properties of the class: a command declares some 150 classes and
makes objects of a few.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from functools import cache
from typing import Annotated, Any, ClassVar, NamedTuple, get_args, get_origin, get_type_hints

MISSING: Any = object()
"""Default of an attribute that was declared without one."""


class DefaultFactory(NamedTuple):
    """Function that makes the default of a property for every object anew."""

    make: Callable[[], Any]


def make_default_with(make: Callable[[], Any]) -> Any:
    """Return the default of a property that every object needs for itself.

    Args:
        make: function that makes it.
    """
    return DefaultFactory(make)


class Declaration(NamedTuple):
    """Declared attribute of a class.

    Attributes:
        annotation: its type, without markers.
        metadata: markers of the annotation, such as the type of the property.
        default: default value; None if a function makes it.
        default_factory: function that makes the default; None for values that objects can share.
    """

    annotation: Any
    metadata: tuple[Any, ...]
    default: Any
    default_factory: Callable[[], Any] | None


class DeclaredType(type):
    """Metaclass of classes whose annotated attributes are properties of their objects."""

    _own_defaults: dict[str, Any]

    def __new__(
        metacls, name: str, bases: tuple[type, ...], namespace: dict[str, Any], **options: Any
    ) -> Any:
        """Create a class without its defaults, which would hide that an object lacks a value.

        Raises:
            TypeError: an attribute has no default, or the class replaces an inherited property by
                something without a type.
        """
        own_defaults = {
            attribute: namespace.pop(attribute, MISSING)
            for attribute, annotation in _get_annotations(namespace).items()
            if not attribute.startswith("_") and not _is_class_variable(annotation)
        }
        for attribute, default in own_defaults.items():
            if default is MISSING:
                raise TypeError(f"property '{attribute}' of {name} needs a default")
        for base in bases:
            for ancestor in base.__mro__:
                inherited: dict[str, Any] = ancestor.__dict__.get("_own_defaults", {})
                for attribute in inherited.keys() & namespace.keys():
                    raise TypeError(f"property '{attribute}' of {name} needs a type")
        return super().__new__(
            metacls, name, bases, {**namespace, "_own_defaults": own_defaults}, **options
        )

    @property
    def model_fields(cls) -> dict[str, Declaration]:
        """Declared attributes of the class, those of its bases first."""
        return collect_declarations(cls)


@cache
def collect_declarations(cls: type) -> dict[str, Declaration]:
    """Return the declared attributes of a class and of its bases, those of the bases first.

    A redeclared attribute keeps the place that it has in the base.

    Returns:
        Declarations by attribute.
    """
    return {
        name: declaration
        for base in reversed(cls.__mro__)
        for name, declaration in _collect_own(base).items()
    }


@cache
def _collect_own(cls: type) -> dict[str, Declaration]:
    """Return the attributes that a class itself declares."""
    defaults: dict[str, Any] = cls.__dict__.get("_own_defaults", {})
    annotations = {name: cls.__annotations__[name] for name in defaults}
    if any(isinstance(annotation, str) for annotation in annotations.values()):
        annotations = _evaluate(annotations, cls)
    return {
        name: _make_declaration(annotations[name], default) for name, default in defaults.items()
    }


def _make_declaration(annotation: Any, default: Any) -> Declaration:
    metadata: tuple[Any, ...] = ()
    if get_origin(annotation) is Annotated:
        annotation, *markers = get_args(annotation)
        metadata = tuple(markers)
    if isinstance(default, DefaultFactory):
        return Declaration(annotation, metadata, None, default.make)
    return Declaration(annotation, metadata, default, None)


class _Annotated:
    """Carrier of annotations for `get_type_hints`, which would evaluate all of a class."""

    def __init__(self, annotations: dict[str, Any]) -> None:
        self.__annotations__ = annotations


def _evaluate(annotations: dict[str, Any], cls: type) -> dict[str, Any]:
    """Return the types that the annotations of a class are the texts of."""
    return get_type_hints(
        _Annotated(annotations), vars(sys.modules[cls.__module__]), {}, include_extras=True
    )


def _get_annotations(namespace: Mapping[str, Any]) -> dict[str, Any]:
    """Return the annotations in the body of a class."""
    if sys.version_info >= (3, 14) and "__annotations__" not in namespace:
        # Python 3.14 evaluates annotations when they are asked for.
        import annotationlib

        annotate = annotationlib.get_annotate_from_class_namespace(namespace)
        if annotate is not None:
            return annotationlib.call_annotate_function(annotate, annotationlib.Format.FORWARDREF)
    annotations: dict[str, Any] = namespace.get("__annotations__", {})
    return annotations


def _is_class_variable(annotation: Any) -> bool:
    if isinstance(annotation, str):
        return annotation.removeprefix("typing.").startswith("ClassVar")
    return annotation is ClassVar or get_origin(annotation) is ClassVar
