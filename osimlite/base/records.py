"""Records: classes like dataclasses whose methods are compiled with the first object.

``dataclasses.dataclass`` writes and compiles half a dozen methods of each class when its module is
imported. A command loads some 150 records, and creates few objects of most of them. Here ``__init__``
is compiled with the fifth object, and all classes share the functions that compare and print. Everything else
equals dataclasses, whose `replace` and `fields` accept records.
"""

from __future__ import annotations

from collections.abc import Callable
from operator import attrgetter
from typing import Any, TypeVar, cast, dataclass_transform, overload

T = TypeVar("T")
_NOTHING: Any = object()

UNCOMPILED = 4
"""Objects of a record that are created without its compiled ``__init__``: compiling takes as long as twenty of them."""


class _Field:
    """Arguments of `field` for one attribute."""

    __slots__ = "compare", "default", "default_factory", "init", "kw_only", "option", "repr"

    def __init__(
        self,
        default: Any,
        default_factory: Any = _NOTHING,
        *,
        init: bool = True,
        repr: bool = True,
        compare: bool = True,
        option: Any = None,
    ) -> None:
        self.default = default
        self.default_factory = default_factory
        self.init = init
        self.repr = repr
        self.compare = compare
        self.kw_only = False
        self.option = option


def field(
    *, default: Any = _NOTHING, default_factory: Any = _NOTHING, init: bool = True, repr: bool = True,
    compare: bool = True, option: Any = None,
) -> Any:  # fmt: skip
    """Return the declaration of an attribute, as ``dataclasses.field``.

    Args:
        default: default value.
        default_factory: function that creates the default value.
        init: whether ``__init__`` has a parameter for the attribute.
        repr: whether ``__repr__`` shows it.
        compare: whether ``__eq__`` compares it.
        option: declaration of the attribute as an option, see :mod:`osimlite.base.options`.
    """
    return _Field(default, default_factory, init=init, repr=repr, compare=compare, option=option)


def replace(record: T, /, **changes: Any) -> T:
    """Return a copy of a record with new values of some attributes."""
    for name, spec in cast(Any, record).__record_fields__.items():
        if spec.init and name not in changes:
            changes[name] = getattr(record, name)
    return type(record)(**changes)


@overload
def dataclass(cls: type[T], /) -> type[T]: ...
@overload
def dataclass(
    *, frozen: bool = False, eq: bool = True, kw_only: bool = False, slots: bool = False
) -> Callable[[type[T]], type[T]]: ...
@dataclass_transform(field_specifiers=(field,))
def dataclass(
    cls: Any = None,
    /,
    *,
    frozen: bool = False,
    eq: bool = True,
    kw_only: bool = False,
    slots: bool = False,
) -> Any:
    """Make a class a record; the arguments are those of ``dataclasses.dataclass``.

    Returns:
        The class, or without a class a decorator that makes one a record.
    """

    def decorate(cls: type) -> type:
        return _build_record(cls, frozen, eq, kw_only, slots)

    return decorate if cls is None else decorate(cls)


def _build_record(cls: type, frozen: bool, eq: bool, kw_only: bool, slots: bool) -> type:
    """Add the methods of a record to a class; return a new class if it has slots.

    Returns:
        The class itself, or the new one with slots.
    """
    namespace = cls.__dict__
    fields: dict[str, _Field] = {}
    # From the most general class on, so that derived classes replace defaults.
    for base in reversed(cls.__mro__[1:]):
        fields |= base.__dict__.get("__record_fields__", {})
    annotated = [
        name
        for name, kind in namespace.get("__annotations__", {}).items()
        if not str(kind).startswith("ClassVar")
    ]
    for name in annotated:
        value = namespace.get(name, _NOTHING)
        fields[name] = value if isinstance(value, _Field) else _Field(value)
        fields[name].kw_only = kw_only
        # With slots the class is made anew without these values, which would conflict with the
        # slots.
        if value is not _NOTHING and not slots:
            if fields[name].default is _NOTHING:
                delattr(cls, name)
            else:
                setattr(cls, name, fields[name].default)
    if slots:
        remaining = {
            name: value
            for name, value in namespace.items()
            if name not in (*annotated, "__dict__", "__weakref__")
        }
        # Slots can only be declared while a class is created, so that it is created again.
        cls = type(cls)(
            cls.__name__,
            cls.__bases__,
            {**remaining, "__slots__": tuple(annotated), "__qualname__": cls.__qualname__},
        )
        namespace = cls.__dict__
    methods: dict[str, Any] = {
        "__init__": _make_first_init(cls, frozen),
        "__repr__": _format_record,
    }
    if eq:
        names = [name for name, spec in fields.items() if spec.compare]
        methods["__record_key__"] = attrgetter(*names) if names else repr
        methods["__eq__"] = _compare_records
        if "__eq__" not in namespace:
            methods["__hash__"] = _hash_record if frozen else None
    if frozen:
        methods |= {"__setattr__": _refuse_change, "__delattr__": _refuse_change}
        if slots:
            methods |= {"__getstate__": _get_state, "__setstate__": _set_state}
    inherited: Any = cls.__repr__
    if inherited is not object.__repr__ and inherited is not _format_record:
        # A class keeps the text that its base class gives it.
        del methods["__repr__"]
    for name, method in methods.items():
        # Python sets __hash__ to None in classes that define __eq__.
        if name not in namespace or (name == "__hash__" and namespace[name] is None):
            setattr(cls, name, method)
    setattr(cls, "__record_fields__", fields)  # noqa: B010 - mypy does not know the attribute
    for name in _DATACLASS_ATTRIBUTES:
        setattr(cls, name, _DataclassAttribute(name, frozen))
    setattr(cls, "__match_args__", tuple(name for name, spec in fields.items() if spec.init))  # noqa: B010
    return cls


def _make_first_init(cls: Any, frozen: bool) -> Callable[..., None]:
    """Return an ``__init__`` for the first objects, which compiles the final one after them."""
    count = 0
    set_value: Callable[[Any, str, Any], None] = object.__setattr__ if frozen else setattr

    def __init__(self: Any, *values: Any, **named: Any) -> None:
        nonlocal count
        count += 1
        bound = None if count > UNCOMPILED else _bind_arguments(cls, values, named)
        if bound is None:
            cls.__init__ = _compile_init(cls, frozen)
            cls.__init__(self, *values, **named)
            return
        for name, value in bound:
            set_value(self, name, value)
        if hasattr(cls, "__post_init__"):
            self.__post_init__()

    return __init__


def _bind_arguments(
    cls: Any, values: tuple[Any, ...], keywords: dict[str, Any]
) -> list[tuple[str, Any]] | None:
    """Return the attributes that arguments of ``__init__`` give.

    Returns:
        Names and values in the order of the fields; None if arguments are wrong, about which the
        compiled function complains.
    """
    attributes = []
    position = used_count = 0
    for name, spec in cls.__record_fields__.items():
        if spec.init and not spec.kw_only and position < len(values):
            if name in keywords:
                return None
            attributes.append((name, values[position]))
            position += 1
        elif spec.init and name in keywords:
            attributes.append((name, keywords[name]))
            used_count += 1
        elif spec.default_factory is not _NOTHING:
            attributes.append((name, spec.default_factory()))
        elif not spec.init:
            continue
        elif spec.default is _NOTHING:
            return None
        else:
            attributes.append((name, spec.default))
    return attributes if position == len(values) and used_count == len(keywords) else None


def _compile_init(cls: Any, frozen: bool) -> Callable[..., None]:
    """Return the compiled ``__init__`` of a record."""
    positional: list[str] = []
    keyword_only: list[str] = []
    lines: list[str] = []
    names: dict[str, Any] = {"_nothing": _NOTHING, "_set": object.__setattr__}
    for name, spec in cls.__record_fields__.items():
        value = name
        # Defaults are passed by name: the text of an object need not be code that makes it again.
        names |= {f"_default_{name}": spec.default, f"_make_{name}": spec.default_factory}
        if spec.default_factory is not _NOTHING:
            value = (
                f"_make_{name}() if {name} is _nothing else {name}"
                if spec.init
                else f"_make_{name}()"
            )
        elif not spec.init:
            continue
        if spec.init:
            default = (
                ""
                if spec.default is spec.default_factory is _NOTHING
                else "=_nothing"
                if spec.default is _NOTHING
                else f"=_default_{name}"
            )
            (keyword_only if spec.kw_only else positional).append(name + default)
        lines.append(f'_set(self, "{name}", {value})' if frozen else f"self.{name} = {value}")
    if hasattr(cls, "__post_init__"):
        lines.append("self.__post_init__()")
    arguments = ", ".join(["self", *positional, *(["*", *keyword_only] if keyword_only else [])])
    body = "\n    ".join(lines or ["pass"])
    exec(f"def __init__({arguments}):\n    {body}", names)
    result: Callable[..., None] = names["__init__"]
    result.__qualname__ = f"{cls.__qualname__}.__init__"
    return result


_DATACLASS_ATTRIBUTES = ("__dataclass_fields__", "__dataclass_params__")
"""Attributes that `dataclasses`, `pprint` and pytest read from the class of a dataclass."""


class _DataclassAttribute:
    """Descriptor of an attribute that dataclasses have, which is created when it is needed."""

    def __init__(self, name: str, frozen: bool) -> None:
        self.name = name
        self.frozen = frozen

    def __get__(self, instance: object, cls: Any) -> Any:
        import dataclasses as d

        fields = []
        for name, spec in cls.__record_fields__.items():
            arguments = {
                attribute_name: getattr(spec, attribute_name)
                for attribute_name in ("init", "repr", "compare", "kw_only")
            }
            defaults = {
                attribute_name: getattr(spec, attribute_name)
                for attribute_name in ("default", "default_factory")
            }
            arguments |= {
                attribute_name: value
                for attribute_name, value in defaults.items()
                if value is not _NOTHING
            }
            fields.append((name, Any, d.field(**arguments)))
        twin = d.make_dataclass(cls.__name__, fields, frozen=self.frozen)
        # Replace the descriptors by their results, because creating the fields takes long.
        for name in _DATACLASS_ATTRIBUTES:
            setattr(cls, name, twin.__dict__[name])
        return twin.__dict__[self.name]


def _format_record(self: Any) -> str:
    """Return the text of ``__repr__``."""
    values = (
        f"{name}={getattr(self, name)!r}"
        for name, spec in self.__record_fields__.items()
        if spec.repr
    )
    return f"{type(self).__qualname__}({', '.join(values)})"


def _compare_records(self: Any, other: Any) -> bool:
    """Return whether two records of one class have equal attributes."""
    if other.__class__ is not self.__class__:
        return NotImplemented
    return bool(self.__record_key__(self) == self.__record_key__(other))


def _hash_record(self: Any) -> int:
    """Return the hash of the attributes that are compared."""
    return hash(self.__record_key__(self))


def _refuse_change(self: Any, name: str, *_: Any) -> None:
    """Raise the error for a change of a frozen record.

    Raises:
        FrozenInstanceError: always.
    """
    from dataclasses import FrozenInstanceError

    raise FrozenInstanceError(f"cannot change '{name}' of {type(self).__name__}")


def _get_state(self: Any) -> list[Any]:
    """Return the values for pickle."""
    return [getattr(self, name) for name in self.__record_fields__]


def _set_state(self: Any, values: list[Any]) -> None:
    """Set the values from pickle."""
    for name, value in zip(self.__record_fields__, values, strict=True):
        # The record itself refuses assignments.
        object.__setattr__(self, name, value)
