"""What the reader, the printer and the linter ask about a class: its properties, gathered once from its declaration."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from osimlite.base.records import replace
from osimlite.schema.fields import (
    Held,
    Kind,
    Legacy,
    NamesOf,
    ObjectList,
    Reference,
    Tag,
    Value,
    find_class,
)

if TYPE_CHECKING:
    from osimlite.schema.base import Object


class FieldSpec(NamedTuple):
    """One property of a class as the reader, the printer and the linter see it.

    `name` is the Python attribute, `tag` the XML element, `accepts` the class of the objects held
    (None for text). `factory` makes the default value of an object property; `default` is the value
    of the others. `names` says what the words, objects or columns in it are names of, where that is
    not said by their class.
    """

    name: str
    tag: str
    kind: Kind
    accepts: type[Object] | None
    default: Any
    factory: Any
    declarers: tuple[type[Object], ...]
    names: Reference | None = None

    @property
    def declared_in(self) -> type[Object]:
        """The class that has the property first; those derived from it may declare it anew."""
        return self.declarers[-1]

    @property
    def legacy(self) -> bool:
        """Whether the property belongs to OpenSim's first property system."""
        return bool(getattr(self.kind, "legacy", False))

    @property
    def reference(self) -> Reference:
        """What it names, of a property that names something."""
        return cast("Reference", self.kind)


@cache
def get_field_specs(cls: type[Object]) -> dict[str, FieldSpec]:
    """The properties of `cls` by XML tag, in the order OpenSim prints them (first-system properties last)."""
    specs = []
    for name, info in cls.model_fields.items():
        kind = next((item for item in info.metadata if isinstance(item, Kind)), None)
        if kind is None:
            continue
        if any(isinstance(item, Legacy) for item in info.metadata):
            kind = replace(kind, legacy=True)
        held = isinstance(kind, Held)
        accepts = find_class(info.annotation) if held else None
        tag = (
            accepts.tag
            if accepts is not None and isinstance(kind, Held) and kind.form == "unnamed"
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
    specs.sort(key=lambda spec: spec.legacy)
    return {spec.tag: spec for spec in specs}


@cache
def make_checks(cls: type[Object]) -> dict[str, Callable[[Any], Any]] | None:
    """Return what checks the value of each property, by attribute, as pydantic's validator of the class would.

    To build that validator takes milliseconds for every class, to call these functions nothing.
    Each returns the value in the form that is stored, or raises ValueError.

    Returns:
        None for a class with validators of its own, which pydantic alone runs.
    """
    decorators = cls.__pydantic_decorators__
    own = (
        decorators.validators,
        decorators.field_validators,
        decorators.root_validators,
        decorators.model_validators,
    )
    if any(own) or cls.__pydantic_post_init__ is not None:
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
    """The properties of `cls` that hold objects."""
    return tuple(spec for spec in get_field_specs(cls).values() if isinstance(spec.kind, Held))


class Holding(NamedTuple):
    """A property that holds objects, and what it holds as long as no one asks for it.

    Either a list, which is empty, or an object, which is plain if nothing in it has a path or names
    another.
    """

    spec: FieldSpec
    name: str
    is_list: bool
    is_plain: bool


@cache
def list_holding_properties(cls: type[Object]) -> tuple[Holding, ...]:
    """The properties of `cls` that hold objects."""
    return tuple(
        Holding(spec, spec.name, spec.factory is ObjectList, _is_plain(spec))
        for spec in get_object_specs(cls)
    )


def _is_plain(spec: FieldSpec) -> bool:
    made: Object | list[Any] | None = spec.factory() if spec.factory is not None else None
    if made is None or isinstance(made, list):
        return False
    return not any(item.is_component or get_reference_specs(type(item)) for item in made.walk())


@cache
def get_class_names(cls: type[Object]) -> tuple[str, ...]:
    """The names of a class and of those it derives from, as far as :class:`Object`."""
    from osimlite.schema.base import Object

    return tuple(base.__name__ for base in cls.__mro__ if issubclass(base, Object))


@cache
def get_reference_specs(cls: type[Object]) -> tuple[FieldSpec, ...]:
    """The properties of `cls` that name other components."""
    return tuple(spec for spec in get_field_specs(cls).values() if isinstance(spec.kind, Reference))


@cache
def get_numeric_names(cls: type[Object]) -> frozenset[str]:
    """The attributes of `cls` with numbers and switches: no path and no reference of a model depends on them."""
    values = (spec for spec in get_field_specs(cls).values() if isinstance(spec.kind, Value))
    return frozenset(spec.name for spec in values if cast("Value", spec.kind).scalar != "string")


@cache
def get_file_specs(cls: type[Object], rule: str) -> tuple[FieldSpec, ...]:
    """The properties of `cls` that name files by a rule: ``file``, ``output-file`` or ``output-folder``."""
    return tuple(spec for spec in get_reference_specs(cls) if spec.reference.rule == rule)


@cache
def get_naming_specs(cls: type[Object]) -> tuple[FieldSpec, ...]:
    """The properties of `cls` whose words are names of something, each with the reference as its kind."""
    return tuple(
        spec if spec.names is None else spec._replace(kind=spec.names)
        for spec in get_field_specs(cls).values()
        if isinstance(spec.kind, Reference)
        or (spec.names is not None and isinstance(spec.kind, Value))
    )


@cache
def get_member_specs(cls: type[Object]) -> tuple[FieldSpec, ...]:
    """The properties of `cls` that hold objects, or a table, with the names of something."""
    return tuple(spec for spec in get_object_specs(cls) if spec.names is not None)


@cache
def get_name_spec(cls: type[Object], names: Reference | None = None) -> FieldSpec:
    """The name of an object that is the name of something else, as a property with tag ``@name``.

    What it names is said by its class, or by the property that holds it.
    """
    reference = names or cls.name_reference
    assert reference is not None
    return FieldSpec("name", "@name", reference, None, "", None, (cls,), names)


@cache
def get_value_specs(cls: type[Object]) -> tuple[FieldSpec, ...]:
    """The properties of `cls` that are numbers, switches or texts."""
    return tuple(spec for spec in get_field_specs(cls).values() if isinstance(spec.kind, Value))


@cache
def get_defaults(cls: type[Object]) -> tuple[dict[str, Any], dict[str, Callable[[], Any]]]:
    """Default values by field name, and the factories of the fields whose default is an object or a list."""
    plain: dict[str, Any] = {}
    factories: dict[str, Any] = {}
    for name, info in cls.model_fields.items():
        if info.default_factory is None:
            plain[name] = info.default
        else:
            factories[name] = info.default_factory
    return plain, factories
