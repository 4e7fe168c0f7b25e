"""Properties of classes for the reader, the printer and the linter, collected once from the declarations."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import TYPE_CHECKING, Any, cast

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import replace
from osimlite.schema.fields import (
    FieldType,
    Legacy,
    NamesOf,
    ObjectField,
    ObjectList,
    Reference,
    Tag,
    Value,
    find_class,
)

if TYPE_CHECKING:
    from osimlite.schema.base import Object


class FieldSpec(NamedTuple):
    """Property of a class.

    Attributes:
        name: name of the Python attribute.
        tag: tag of the XML element.
        kind: type of the property.
        accepts: class of the objects that it holds; None for text.
        default: default value; None for properties that hold objects.
        factory: function that makes the default object or list.
        declarers: classes that declare the property, the most derived first.
        names: type of reference of its words, objects or columns, unless their class declares it.
    """

    name: str
    tag: str
    kind: FieldType
    accepts: type[Object] | None
    default: Any
    factory: Any
    declarers: tuple[type[Object], ...]
    names: Reference | None = None

    @property
    def declared_in(self) -> type[Object]:
        """Base class that declares the property first; derived classes may redeclare it."""
        return self.declarers[-1]

    @property
    def legacy(self) -> bool:
        """True if the property belongs to OpenSim's first property system."""
        return bool(getattr(self.kind, "legacy", False))

    @property
    def reference(self) -> Reference:
        """Type of the property as a reference, for properties that name something."""
        return cast("Reference", self.kind)


@cache
def get_field_specs(cls: type[Object]) -> dict[str, FieldSpec]:
    """Return the properties of a class in the order OpenSim prints them, those of the first system last.

    Returns:
        Properties by XML tag.
    """
    specs = []
    for name, info in cls.model_fields.items():
        kind = next((item for item in info.metadata if isinstance(item, FieldType)), None)
        if kind is None:
            continue
        if any(isinstance(item, Legacy) for item in info.metadata):
            kind = replace(kind, legacy=True)
        holds_objects = isinstance(kind, ObjectField)
        accepts = find_class(info.annotation) if holds_objects else None
        tag = (
            accepts.tag
            if accepts is not None and isinstance(kind, ObjectField) and kind.form == "unnamed"
            else name
        )
        tag = next((item.text for item in info.metadata if isinstance(item, Tag)), tag)
        declared = tuple(
            base for base in cls.__mro__ if name in getattr(base, "__annotations__", {})
        )
        default = info.default if info.default_factory is None else None
        names = next((item.reference for item in info.metadata if isinstance(item, NamesOf)), None)
        specs.append(
            FieldSpec(name, tag, kind, accepts, default, info.default_factory, declared, names)
        )
    # OpenSim prints the properties of its first system after those of the second; the sort is stable.
    specs.sort(key=lambda spec: spec.legacy)
    return {spec.tag: spec for spec in specs}


@cache
def make_checks(cls: type[Object]) -> dict[str, Callable[[Any], Any]] | None:
    """Return functions that check the values of properties as pydantic's validator of the class would.

    Building that validator takes milliseconds for every class; these functions need no preparation.

    Returns:
        Functions by attribute, which return the stored form or raise ValueError. None for a class with
        validators of its own, which only pydantic can run.
    """
    decorators = cls.__pydantic_decorators__
    class_validators = (
        decorators.validators,
        decorators.field_validators,
        decorators.root_validators,
        decorators.model_validators,
    )
    if any(class_validators) or cls.__pydantic_post_init__ is not None:
        return None
    result = {
        spec.name: partial(spec.kind.check, accepts=spec.accepts)
        for spec in get_field_specs(cls).values()
    }
    texts = (
        name
        for name, info in cls.model_fields.items()
        if info.annotation is str and not info.metadata
    )
    return {**dict.fromkeys(texts, _check_text), **result}


def _check_text(value: Any) -> str:
    if type(value) is not str:
        raise ValueError("pydantic converts some other values")
    return value


@cache
def get_object_specs(cls: type[Object]) -> tuple[FieldSpec, ...]:
    """Return the properties of a class that hold objects.

    Returns:
        Properties in printing order.
    """
    return tuple(
        spec for spec in get_field_specs(cls).values() if isinstance(spec.kind, ObjectField)
    )


class ObjectHolder(NamedTuple):
    """Property that holds objects, with the state of its default until it is first accessed.

    Attributes:
        spec: declaration of the property.
        name: name of the Python attribute.
        is_list: whether it is a list, which is empty by default.
        is_plain: whether the default object contains no component and no reference.
    """

    spec: FieldSpec
    name: str
    is_list: bool
    is_plain: bool


@cache
def list_holding_properties(cls: type[Object]) -> tuple[ObjectHolder, ...]:
    """Return the properties of a class that hold objects, with the state of their defaults.

    Returns:
        Properties in printing order.
    """
    return tuple(
        ObjectHolder(spec, spec.name, spec.factory is ObjectList, _is_plain(spec))
        for spec in get_object_specs(cls)
    )


def _is_plain(spec: FieldSpec) -> bool:
    default: Object | list[Any] | None = spec.factory() if spec.factory is not None else None
    if default is None or isinstance(default, list):
        return False
    return not any(item.is_component or get_reference_specs(type(item)) for item in default.walk())


@cache
def get_class_names(cls: type[Object]) -> tuple[str, ...]:
    """Return the names of a class and of its bases up to :class:`Object`.

    Returns:
        Names, the most derived first.
    """
    from osimlite.schema.base import Object

    return tuple(base.__name__ for base in cls.__mro__ if issubclass(base, Object))


@cache
def get_reference_specs(cls: type[Object]) -> tuple[FieldSpec, ...]:
    """Return the properties of a class that name other components.

    Returns:
        Properties in printing order.
    """
    return tuple(spec for spec in get_field_specs(cls).values() if isinstance(spec.kind, Reference))


@cache
def get_numeric_names(cls: type[Object]) -> frozenset[str]:
    """Return the attributes with numbers and switches, on which no path and no reference depends."""
    values = (spec for spec in get_field_specs(cls).values() if isinstance(spec.kind, Value))
    return frozenset(spec.name for spec in values if cast("Value", spec.kind).scalar != "string")


@cache
def get_file_specs(cls: type[Object], rule: str) -> tuple[FieldSpec, ...]:
    """Return the properties of a class that name files.

    Args:
        cls: class of an object.
        rule: ``file``, ``output-file`` or ``output-folder``.

    Returns:
        Properties in printing order.
    """
    return tuple(spec for spec in get_reference_specs(cls) if spec.reference.rule == rule)


@cache
def get_naming_specs(cls: type[Object]) -> tuple[FieldSpec, ...]:
    """Return the properties of a class whose words are names, each with the reference as its type.

    Returns:
        Properties in printing order.
    """
    return tuple(
        spec if spec.names is None else spec._replace(kind=spec.names)
        for spec in get_field_specs(cls).values()
        if isinstance(spec.kind, Reference)
        or (spec.names is not None and isinstance(spec.kind, Value))
    )


@cache
def get_member_specs(cls: type[Object]) -> tuple[FieldSpec, ...]:
    """Return the properties of a class whose objects or table columns are names of something.

    Returns:
        Properties in printing order.
    """
    return tuple(spec for spec in get_object_specs(cls) if spec.names is not None)


@cache
def get_name_spec(cls: type[Object], names: Reference | None = None) -> FieldSpec:
    """Return the name of an object as a property with the tag ``@name``, for objects named after others.

    Args:
        cls: class of the object.
        names: type of the reference if the holding property declares it; by default that of the
            class.
    """
    reference = names or cls.name_reference
    assert reference is not None
    return FieldSpec("name", "@name", reference, None, "", None, (cls,), names)


@cache
def get_value_specs(cls: type[Object]) -> tuple[FieldSpec, ...]:
    """Return the properties of a class that are numbers, switches or texts.

    Returns:
        Properties in printing order.
    """
    return tuple(spec for spec in get_field_specs(cls).values() if isinstance(spec.kind, Value))


@cache
def get_defaults(cls: type[Object]) -> tuple[dict[str, Any], dict[str, Callable[[], Any]]]:
    """Return the defaults of a class.

    Returns:
        Default values by field, and factories of the fields that default to an object or a list.
    """
    plain: dict[str, Any] = {}
    factories: dict[str, Any] = {}
    for name, info in cls.model_fields.items():
        if info.default_factory is None:
            plain[name] = info.default
        else:
            factories[name] = info.default_factory
    return plain, factories
