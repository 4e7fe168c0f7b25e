"""Records: classes declared as dataclasses are, whose methods are made when the first object is.

``dataclasses.dataclass`` writes and compiles half a dozen methods of each class when its module is
imported. A command loads some 150 records and makes objects of few: here ``__init__`` is compiled
with the first object, what compares and prints is the same function for all. Everything else is as
with dataclasses, whose `replace` and `fields` take records.
"""

from __future__ import annotations

from collections.abc import Callable
from operator import attrgetter
from typing import Any, TypeVar, cast, dataclass_transform, overload

T = TypeVar("T")
_NOTHING: Any = object()


class _Field:
    """What `field` says of an attribute."""

    __slots__ = "choice", "compare", "default", "default_factory", "init", "kw_only", "repr"

    def __init__(
        self,
        default: Any,
        default_factory: Any = _NOTHING,
        *,
        init: bool = True,
        repr: bool = True,
        compare: bool = True,
        choice: Any = None,
    ) -> None:
        self.default, self.default_factory = default, default_factory
        self.init, self.repr, self.compare, self.kw_only, self.choice = (
            init,
            repr,
            compare,
            False,
            choice,
        )


def field(
    *, default: Any = _NOTHING, default_factory: Any = _NOTHING, init: bool = True, repr: bool = True,
    compare: bool = True, choice: Any = None,
) -> Any:  # fmt: skip
    """As ``dataclasses.field``; `choice` is what else is said of the attribute, see :mod:`osimlite.base.choices`."""
    return _Field(default, default_factory, init=init, repr=repr, compare=compare, choice=choice)


def replace(item: T, /, **changes: Any) -> T:
    """A record with other values of some attributes."""
    for name, each in cast(Any, item).__record_fields__.items():
        if each.init and name not in changes:
            changes[name] = getattr(item, name)
    return type(item)(**changes)


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
    """As ``dataclasses.dataclass``."""

    def made(cls: type) -> type:
        return _made(cls, frozen, eq, kw_only, slots)

    return made if cls is None else made(cls)


def _made(cls: type, frozen: bool, eq: bool, kw_only: bool, slots: bool) -> type:
    space = cls.__dict__
    fields: dict[str, _Field] = {}
    for base in reversed(cls.__mro__[1:]):
        fields |= base.__dict__.get("__record_fields__", {})
    own = [
        name
        for name, kind in space.get("__annotations__", {}).items()
        if not str(kind).startswith("ClassVar")
    ]
    for name in own:
        given = space.get(name, _NOTHING)
        fields[name] = given if isinstance(given, _Field) else _Field(given)
        fields[name].kw_only = kw_only
        if given is not _NOTHING and not slots:
            if fields[name].default is _NOTHING:
                delattr(cls, name)
            else:
                setattr(cls, name, fields[name].default)
    if slots:
        left = {
            name: value
            for name, value in space.items()
            if name not in (*own, "__dict__", "__weakref__")
        }
        cls = type(cls)(
            cls.__name__,
            cls.__bases__,
            {**left, "__slots__": tuple(own), "__qualname__": cls.__qualname__},
        )
        space = cls.__dict__
    methods: dict[str, Any] = {"__init__": _first(cls, frozen), "__repr__": _shown}
    if eq:
        names = [name for name, each in fields.items() if each.compare]
        methods["__record_key__"] = attrgetter(*names) if names else repr
        methods["__eq__"] = _equal
        if "__eq__" not in space:
            methods["__hash__"] = _hashed if frozen else None
    if frozen:
        methods |= {"__setattr__": _refuse, "__delattr__": _refuse}
        if slots:
            methods |= {"__getstate__": _state, "__setstate__": _take_state}
    for name, method in methods.items():
        # Python itself says that what has __eq__ has no hash.
        if name not in space or (name == "__hash__" and space[name] is None):
            setattr(cls, name, method)
    setattr(cls, "__record_fields__", fields)  # noqa: B010 - a class of anybody's
    setattr(cls, "__dataclass_fields__", _AsDataclass())  # noqa: B010
    setattr(cls, "__match_args__", tuple(name for name, each in fields.items() if each.init))  # noqa: B010
    return cls


def _first(cls: Any, frozen: bool) -> Callable[..., None]:
    """What stands for ``__init__`` until there is an object."""

    def __init__(self: Any, *values: Any, **named: Any) -> None:
        cls.__init__ = _compiled(cls, frozen)
        cls.__init__(self, *values, **named)

    return __init__


def _compiled(cls: Any, frozen: bool) -> Callable[..., None]:
    given: list[str] = []
    named: list[str] = []
    lines: list[str] = []
    names: dict[str, Any] = {"_nothing": _NOTHING, "_set": object.__setattr__}
    for name, each in cls.__record_fields__.items():
        value = name
        names |= {f"_default_{name}": each.default, f"_make_{name}": each.default_factory}
        if each.default_factory is not _NOTHING:
            value = (
                f"_make_{name}() if {name} is _nothing else {name}"
                if each.init
                else f"_make_{name}()"
            )
        elif not each.init:
            continue
        if each.init:
            default = (
                ""
                if each.default is each.default_factory is _NOTHING
                else "=_nothing"
                if each.default is _NOTHING
                else f"=_default_{name}"
            )
            (named if each.kw_only else given).append(name + default)
        lines.append(f'_set(self, "{name}", {value})' if frozen else f"self.{name} = {value}")
    if hasattr(cls, "__post_init__"):
        lines.append("self.__post_init__()")
    arguments = ", ".join(["self", *given, *(["*", *named] if named else [])])
    body = "\n    ".join(lines or ["pass"])
    exec(f"def __init__({arguments}):\n    {body}", names)
    made: Callable[..., None] = names["__init__"]
    made.__qualname__ = f"{cls.__qualname__}.__init__"
    return made


class _AsDataclass:
    """The fields of a record as dataclasses know them."""

    def __get__(self, item: object, cls: Any) -> dict[str, Any]:
        import dataclasses as d

        made = []
        for name, each in cls.__record_fields__.items():
            told = {word: getattr(each, word) for word in ("init", "repr", "compare", "kw_only")}
            defaults = {word: getattr(each, word) for word in ("default", "default_factory")}
            told |= {word: value for word, value in defaults.items() if value is not _NOTHING}
            made.append((name, Any, d.field(**told)))
        result: dict[str, Any] = d.make_dataclass(cls.__name__, made).__dict__[
            "__dataclass_fields__"
        ]
        # The next one asks the class itself: to make them costs more than many a motion.
        cls.__dataclass_fields__ = result
        return result


def _shown(self: Any) -> str:
    values = (
        f"{name}={getattr(self, name)!r}"
        for name, each in self.__record_fields__.items()
        if each.repr
    )
    return f"{type(self).__qualname__}({', '.join(values)})"


def _equal(self: Any, other: Any) -> bool:
    if other.__class__ is not self.__class__:
        return NotImplemented
    return bool(self.__record_key__(self) == self.__record_key__(other))


def _hashed(self: Any) -> int:
    return hash(self.__record_key__(self))


def _refuse(self: Any, name: str, *_: Any) -> None:
    from dataclasses import FrozenInstanceError

    raise FrozenInstanceError(f"cannot change '{name}' of {type(self).__name__}")


def _state(self: Any) -> list[Any]:
    return [getattr(self, name) for name in self.__record_fields__]


def _take_state(self: Any, values: list[Any]) -> None:
    for name, value in zip(self.__record_fields__, values, strict=True):
        object.__setattr__(self, name, value)
