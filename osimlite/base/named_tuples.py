"""Named tuples whose constructor is compiled with the first objects.

``typing.NamedTuple`` compiles a constructor and every annotation when its module is imported. A
command loads some 90 named tuples, and creates objects of half of them. Here the constructor is
compiled with the fifth object, and all classes share the other methods. Everything else equals
``typing.NamedTuple``, which type checkers take it for.
"""

from __future__ import annotations

from operator import itemgetter
from typing import TYPE_CHECKING, Any

UNCOMPILED = 4
"""Objects of a class that are created without its compiled constructor: compiling takes as long as a hundred of them."""

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from inspect import Signature
    from typing import NamedTuple as NamedTuple

try:
    # Reads an item in half the time of a property.
    from _collections import _tuplegetter as _make_getter  # type: ignore[import-not-found]
except ImportError:

    def _make_getter(index: int, doc: str) -> Any:
        return property(itemgetter(index), doc=doc)


_new_tuple = tuple.__new__


class _Signature:
    """Descriptor of ``__signature__``, which compiles the constructor that ``inspect.signature`` describes."""

    def __get__(self, instance: object, cls: Any) -> Signature:
        import inspect

        signature = inspect.signature(_compile_constructor(cls._fields, cls._field_defaults))
        return signature.replace(parameters=list(signature.parameters.values())[1:])


class _NamedTupleMethods(tuple[Any, ...]):
    """Methods that all named tuples share."""

    __slots__ = ()
    __signature__ = _Signature()
    _fields: tuple[str, ...] = ()
    _field_defaults: dict[str, Any] = {}  # noqa: RUF012 - each class has its own

    @classmethod
    def _make(cls, iterable: Iterable[Any]) -> Any:
        """Return an object with the items of an iterable.

        Raises:
            TypeError: the iterable has more or fewer items than the class has fields.
        """
        result = _new_tuple(cls, iterable)
        if len(result) != len(cls._fields):
            raise TypeError(f"Expected {len(cls._fields)} arguments, got {len(result)}")
        return result

    def _replace(self, /, **changes: Any) -> Any:
        """Return a copy with new values of some items.

        Raises:
            ValueError: the class has no field of a given name.
        """
        result = self._make(map(changes.pop, self._fields, self))
        if changes:
            raise ValueError(f"Got unexpected field names: {list(changes)!r}")
        return result

    __replace__ = _replace

    def _asdict(self) -> dict[str, Any]:
        """Return the items by name."""
        return dict(zip(self._fields, self, strict=True))

    def __repr__(self) -> str:
        items = ", ".join(
            f"{name}={value!r}" for name, value in zip(self._fields, self, strict=True)
        )
        return f"{type(self).__name__}({items})"

    def __getnewargs__(self) -> tuple[Any, ...]:
        return tuple(self)


def _compile_constructor(
    fields: tuple[str, ...], defaults: dict[str, Any]
) -> Callable[..., tuple[Any, ...]]:
    """Return the compiled ``__new__`` of a named tuple with given fields."""
    arguments = "".join(f"{field}, " for field in fields)
    result: Any = eval(
        f"lambda _cls, {arguments}: _new_tuple(_cls, ({arguments}))", {"_new_tuple": _new_tuple}
    )
    result.__name__ = "__new__"
    result.__defaults__ = tuple(defaults.values())
    constructor: Callable[..., tuple[Any, ...]] = result
    return constructor


def _create_class(
    name: str, bases: tuple[type, ...], namespace: dict[str, Any], **keywords: Any
) -> type:
    """Return the class that a class statement with the base `NamedTuple` declares.

    Raises:
        TypeError: a field without a default follows one with a default.
    """
    bases = tuple(_NamedTupleMethods if base is _Declaration else base for base in bases)
    result: Any = type(name, bases, {**namespace, "__slots__": ()}, **keywords)
    fields = tuple(result.__annotations__)
    defaults = {field: namespace[field] for field in fields if field in namespace}
    if tuple(defaults) != fields[len(fields) - len(defaults) :]:
        raise TypeError(f"{name} has a field without a default after one with a default")
    count = 0

    def __new__(cls: Any, /, *values: Any, **named: Any) -> Any:
        nonlocal count
        count += 1
        remaining = fields[len(values) :]
        if (
            count <= UNCOMPILED
            and len(values) <= len(fields)
            and named.keys() <= {*remaining} <= named.keys() | defaults.keys()
        ):
            items = [named[field] if field in named else defaults[field] for field in remaining]
            return _new_tuple(cls, (*values, *items))
        constructor = _compile_constructor(fields, defaults)
        constructor.__qualname__ = f"{result.__qualname__}.__new__"
        result.__new__ = staticmethod(constructor)
        return constructor(cls, *values, **named)

    result.__new__ = staticmethod(__new__)
    result._fields = fields
    setattr(result, "__match_args__", fields)  # noqa: B010 - mypy refuses assignments
    result._field_defaults = defaults
    for index, field in enumerate(fields):
        setattr(result, field, _make_getter(index, f"Item {index} of the tuple"))
    created: type = result
    return created


class _DeclarationType(type):
    """Metaclass of the base in class statements alone; the classes that these declare are plain."""

    def __new__(
        mcs, name: str, bases: tuple[type, ...], namespace: dict[str, Any], **keywords: Any
    ) -> Any:
        if not bases:
            return super().__new__(mcs, name, bases, namespace)
        return _create_class(name, bases, namespace, **keywords)


class _Declaration(metaclass=_DeclarationType):
    """Base in class statements, which makes `_create_class` create the class."""


if not TYPE_CHECKING:
    NamedTuple = _Declaration
