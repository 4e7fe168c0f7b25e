"""Object and Component: what every class of an OpenSim document has in common."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator
from functools import cache, partial
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    Self,
    TypeVar,
    cast,
    dataclass_transform,
    get_type_hints,
)

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from osimlite.errors import MissingNameError, ModelError
from osimlite.schema.complaints import (
    describe_unknown_property,
    describe_unnamed_value,
    describe_validation_error,
)
from osimlite.schema.facts import Contradiction, Facts
from osimlite.schema.fields import Many, ObjectList, Reference, Tag, note_change
from osimlite.schema.layout import Home, Layout
from osimlite.schema.specs import (
    FieldSpec,
    get_defaults,
    get_field_specs,
    get_numeric_names,
    list_holding_properties,
    make_checks,
)


def are_equal(left: Any, right: Any) -> bool:
    """Equality of stored values; NaN equals NaN, and a component given as a reference counts by its name."""
    if left is right:
        return True
    if isinstance(left, dict):
        return left.keys() == right.keys() and all(
            are_equal(value, right[key]) for key, value in left.items()
        )
    if isinstance(left, (tuple, list)):
        return (
            isinstance(right, (tuple, list))
            and len(left) == len(right)
            and all(are_equal(one, other) for one, other in zip(left, right, strict=True))
        )
    if isinstance(left, float) and isinstance(right, float):
        return left == right or (left != left and right != right)
    return bool(left == right)


if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass

    from osimlite.schema.model import Model
else:
    ModelMetaclass = type(BaseModel)


_SLOTS = ("_model", "_index", "_layout")

T = TypeVar("T", bound="Object")


def none() -> Any:
    """The default of a property that holds a list of objects: none yet."""
    return Field(default_factory=ObjectList)


def made(cls: type[Object], **values: Any) -> Any:
    """The default of a property that holds one object: a `cls` of its own with these values.

    A value that is a function is called for every new object, so that no two defaults share a part.
    """
    return Field(
        default_factory=lambda: cls.build(
            {name: value() if callable(value) else value for name, value in values.items()}, set()
        )
    )


# A docstring of its own would stand in the place of the property. Type checkers see the arguments
# of constructors only if the very metaclass is decorated, not one that it derives from.
@dataclass_transform(kw_only_default=True, field_specifiers=(Field,))
class ObjectType(ModelMetaclass):  # noqa: D101
    @property
    def __doc__(cls) -> str | None:  # type: ignore[override]
        """The docstring of a class, and what its properties are."""
        own: str | None = cls.__dict__.get("__doc__")
        if not issubclass(cls, Object) or not own:
            return own
        from osimlite.schema.descriptions import add_properties

        return add_properties(cls, own)


class Object(BaseModel, metaclass=ObjectType):
    """Anything with a name and properties that an OpenSim document can hold.

    A subclass is declared with its properties in the order OpenSim prints them. ``tag`` gives the
    XML element when it is not the name of the class: ``class ContactParameters(Object,
    tag="HuntCrossleyForce::ContactParameters")``; ``abstract=True`` marks classes that never stand
    in a file.
    """

    __slots__ = _SLOTS

    model_config = ConfigDict(
        extra="forbid",
        defer_build=True,
        validate_assignment=True,
        validate_default=False,
        protected_namespaces=(),
    )

    tag: ClassVar[str] = ""
    abstract: ClassVar[bool] = True
    is_component: ClassVar[bool] = False
    """Whether objects of the class have a place, and so a path, in the component tree."""
    is_root: ClassVar[bool] = False
    """Whether they are the top of such a tree."""
    since: ClassVar[str] = ""
    """The version of OpenSim that has the class first, where 4.6 has it not."""
    facts: ClassVar[Facts] = Facts()
    """What OpenSim does with objects of this class, besides what its base and its properties say."""
    name_reference: ClassVar[Reference | None] = None
    """The rule by which the object's own name names a component, for the few classes where it does."""

    name: str = ""

    def __init_subclass__(cls, tag: str = "", abstract: bool = False) -> None:
        super().__init_subclass__()
        cls.tag = tag or cls.__name__
        cls.abstract = abstract

    def __init__(self, *positional: Any, **properties: Any) -> None:
        if positional:
            raise ModelError(describe_unnamed_value(type(self), positional[0]))
        for given in properties.keys() - type(self).model_fields.keys():
            spec = get_field_specs(type(self)).get(given)
            if spec is None or spec.name in properties:
                raise MissingNameError(partial(describe_unknown_property, type(self), given))
            properties[spec.name] = properties.pop(given)
        values = _check_values(type(self), properties)
        if values is not None:
            made = self.build(values, set(properties))
            _put_state(self, made.__dict__)
            _put_present(self, made.model_fields_set)
            _put_extra(self, None)
            _put_private(self, None)
        else:
            try:
                super().__init__(**properties)
            except ValidationError as error:
                raise ModelError(describe_validation_error(type(self), error)) from None
        _set(self, "_model", None)
        _set(self, "_index", None)
        _set(self, "_layout", None)

    @classmethod
    def build(
        cls,
        values: dict[str, Any],
        present: set[str],
        index: int | None = None,
        home: Home | None = None,
    ) -> Self:
        """Make an instance from values already of the stored form, without validation.

        `values` may leave out properties, `present` names those the text gave; the rest take their
        defaults. This is the reader's way in, several times faster than ``cls(...)`` and tested to
        be equal to it.
        """
        # Default objects and lists are made when someone asks for them, see `__getattr__`: most are
        # never asked for.
        state = get_defaults(cls)[0].copy()
        state.update(values)
        self = _new(cls)
        _put_state(self, state)
        _put_present(self, present)
        _put_extra(self, None)
        _put_private(self, None)
        put_model(self, home)
        put_index(self, index)
        _put_layout(self, None)
        return self

    @classmethod
    def model_construct(cls, _fields_set: set[str] | None = None, **values: Any) -> Self:
        """Pydantic's way to make an instance without validation; here it is `build`."""
        return cls.build(values, set(values) if _fields_set is None else _fields_set)

    @classmethod
    def field_specs(cls) -> dict[str, FieldSpec]:
        """The properties by XML tag, in the order OpenSim prints them."""
        return get_field_specs(cls)

    @property
    def source_index(self) -> Any:
        """Index of the element that this object was read from among all elements of its text; None without a text."""
        return self._index

    @property
    def layout(self) -> Layout | None:
        """What the file said about this object beyond its properties."""
        return cast("Layout | None", self._layout)

    def objects_held(self) -> list[tuple[FieldSpec, Object]]:
        """Every object this one owns, with the property that holds it, in printing order."""
        held: list[tuple[FieldSpec, Object]] = []
        state = self.__dict__
        for spec, name, is_list, _ in list_holding_properties(type(self)):
            # A list that no one has asked for is empty.
            value: Any = state[name] if name in state else () if is_list else getattr(self, name)
            if is_list or isinstance(value, list):
                held += [(spec, item) for item in value]
            elif value is not None:
                held.append((spec, value))
        return held

    def contradictions(self) -> Iterable[Contradiction]:
        """What OpenSim refuses of properties that each have a sound value."""
        return ()

    def walk(self) -> Iterator[Object]:
        """Yield this object and everything below it, parents first."""
        pending: list[Object] = [self]
        while pending:
            item = pending.pop()
            yield item
            if list_holding_properties(type(item)):
                pending += [held for _, held in item.objects_held()][::-1]

    def copy_deep(self) -> Self:
        """A copy that shares nothing with the original."""
        return copy.deepcopy(self)

    def __getattr__(self, name: str) -> Any:
        if not name.startswith("_"):
            factory = get_defaults(type(self))[1].get(name)
            if factory is not None:
                made = self.__dict__[name] = factory()
                _adopt(made, self._model)
                return made
            spec = get_field_specs(type(self)).get(name)
            if spec is not None:
                return getattr(self, spec.name)
            raise MissingNameError(partial(describe_unknown_property, type(self), name))
        raise AttributeError(name)

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in type(self).model_fields:
            spec = get_field_specs(type(self)).get(name)
            if spec is None:
                raise MissingNameError(partial(describe_unknown_property, type(self), name))
            name = spec.name
        note_change(self._model, numbers_only=name in get_numeric_names(type(self)))
        values = _check_values(type(self), {name: value})
        if values is not None:
            self.__dict__.update(values)
            self.model_fields_set.add(name)
            return
        try:
            super().__setattr__(name, value)
        except ValidationError as error:
            raise ModelError(describe_validation_error(type(self), error)) from None

    def assign(self, name: str, value: Any) -> None:
        """Set a property to a value that is already of the stored form, without validation.

        Pydantic compiles the validation of a class when a property is set for the first time, which
        takes milliseconds.

        Args:
            name: of the property in Python.
            value: of the stored form, not an object.
        """
        note_change(self._model, numbers_only=name in get_numeric_names(type(self)))
        self.__dict__[name] = value
        self.model_fields_set.add(name)

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        assert isinstance(other, Object)
        return are_equal(_get_all_values(self), _get_all_values(other)) and _list_unknown(
            self
        ) == _list_unknown(other)

    __hash__ = None  # type: ignore[assignment]

    def __copy__(self) -> Self:
        clone = super().__copy__()
        put_model(clone, None)
        put_index(clone, self._index)
        _put_layout(clone, self._layout)
        return clone

    def __deepcopy__(self, memo: dict[int, Any] | None = None) -> Self:
        memo = {} if memo is None else memo
        outermost = _NAMING not in memo
        naming: list[tuple[dict[str, Any], str]] = memo.setdefault(_NAMING, [])
        home = Home() if outermost and self.is_root else None
        clone = _clone(self, memo, naming, home)
        if home is not None:
            home.model = cast("Model", clone)
        if outermost:
            # Components that are only named, not owned, are not part of the copy.
            for state, name in naming:
                value = state[name]
                words = value if isinstance(value, tuple) else (value,)
                known = tuple(memo.setdefault(id(word), word) for word in words)
                state[name] = known if isinstance(value, tuple) else known[0]
            del memo[_NAMING]
        return clone

    def __getstate__(self) -> dict[Any, Any]:
        return {**super().__getstate__(), "layout": self._layout, "index": self._index}

    def __setstate__(self, state: dict[Any, Any]) -> None:
        _set(self, "_model", None)
        _set(self, "_index", state.pop("index"))
        _set(self, "_layout", state.pop("layout"))
        super().__setstate__(state)

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        if self.name:
            yield "name", self.name
        for spec in get_field_specs(type(self)).values():
            value = getattr(self, spec.name)
            if spec.name in self.model_fields_set and not isinstance(value, (list, Object)):
                yield spec.name, value

    __str__ = BaseModel.__repr__


# Making an object by its slots' own setters is a good third faster than through setattr.
_new = object.__new__
_put_state, _put_present, _put_extra, _put_private = (
    BaseModel.__dict__[name].__set__
    for name in (
        "__dict__",
        "__pydantic_fields_set__",
        "__pydantic_extra__",
        "__pydantic_private__",
    )
)
put_model, put_index, _put_layout = (Object.__dict__[name].__set__ for name in _SLOTS)


class Component(Object, abstract=True):
    """An object with a place in the component tree, which other components can name by its path."""

    is_component: ClassVar[bool] = True
    internal: ClassVar[tuple[tuple[str, type[Component]], ...]] = ()
    """Names and classes of the parts that OpenSim makes for itself: they have a path and stand in no file."""

    subcomponents: Annotated[Many[Component], Tag("components")] = none()
    """Further components that belong to this one; they may be of any class."""

    @property
    def model(self) -> Model | None:
        """The model this component was last seen in."""
        known = self._model
        return known.model if type(known) is Home else cast("Model | None", known)

    @property
    def parent(self) -> Component | None:
        """The component above in the tree; None for the model, or while the component is in no model."""
        model = self.model
        return None if model is None else model.tree().parent_of(self)

    @property
    def path(self) -> str:
        """The absolute path as OpenSim writes it; the name alone while the component is in no model."""
        model = self.model
        path = None if model is None else model.tree().path_of(self)
        return self.name if path is None else path


class ModelComponent(Component, abstract=True):
    """A component of a model."""


class Unknown(ModelComponent, abstract=True):
    """An object of a class osimlite does not know (a plug-in, a misspelling), kept as it was written.

    `class_name` is its tag in the file, `content` the XML text inside.
    """

    class_name: str = ""
    content: str = ""

    @property
    def objects(self) -> ObjectList[Any]:
        """The members, where it stands in the place of a set: none that anybody knows."""
        return ObjectList()


# Pydantic evaluates the annotations of all bases for every class, but those of their fields:
# evaluated here once, they cost it little. What is no field it has noted for all classes below.
for _base in (Object, Component):
    _hints = get_type_hints(_base, include_extras=True)
    _base.__annotations__ = {
        name: _hints[name] for name in _base.__annotations__ if name in _base.model_fields
    }

_set = object.__setattr__


def _check_values(cls: type[Object], properties: dict[str, Any]) -> dict[str, Any] | None:
    """Return properties in the form that is stored; None if pydantic has to look at them, or to say what is wrong."""
    known = make_checks(cls)
    if known is None or not properties.keys() <= known.keys():
        return None
    try:
        return {name: known[name](value) for name, value in properties.items()}
    except ValueError:
        return None


_NAMING = -1
"""Key in the memo of a deep copy of what names components, by state and name; no object has this identity."""
_PLAIN = frozenset((str, float, int, bool, type(None)))


def _clone(
    item: T, memo: dict[int, Any], naming: list[tuple[dict[str, Any], str]], home: Home | None
) -> T:
    """A copy of an object and of all that it owns; what names components is noted, to be seen to at the end."""
    if id(item) in memo:
        return cast("T", memo[id(item)])
    state, owned = item.__dict__.copy(), _list_owned_fields(type(item))
    for name, value in state.items():
        kind = type(value)
        if kind in _PLAIN or (kind is tuple and _PLAIN.issuperset(map(type, value))):
            continue
        if kind is ObjectList:
            state[name] = ObjectList(_clone(each, memo, naming, home) for each in value)
        elif name in owned and isinstance(value, Object):
            state[name] = _clone(value, memo, naming, home)
        elif isinstance(value, Component) or kind is tuple:
            naming.append((state, name))
        else:
            state[name] = copy.deepcopy(value, memo)
    clone = memo[id(item)] = _new(type(item))
    _put_state(clone, state)
    _put_present(clone, item.model_fields_set.copy())
    _put_extra(clone, None)
    _put_private(clone, None)
    put_model(clone, home)
    put_index(clone, item._index)
    _put_layout(clone, None if item.layout is None else copy.deepcopy(item.layout, memo))
    return clone


@cache
def _list_owned_fields(cls: type[Object]) -> frozenset[str]:
    return frozenset(name for _, name, _, _ in list_holding_properties(cls))


def _adopt(value: Any, owner: Any) -> None:
    """Let an object or a list that was just made, and all in it, belong where its holder does."""
    if isinstance(value, list):
        if isinstance(value, ObjectList):
            value.owner = owner
        for item in value:
            _adopt(item, owner)
    elif isinstance(value, Object):
        put_model(value, owner)
        for _, name, _, _ in list_holding_properties(type(value)):
            _adopt(value.__dict__.get(name), owner)


def _get_all_values(item: Object) -> dict[str, Any]:
    """The values of an object by field name, those included that no one has asked for yet."""
    for name in get_defaults(type(item))[1]:
        getattr(item, name)
    return item.__dict__


def _list_unknown(item: Object) -> list[str]:
    return item.layout.unknown if item.layout is not None else []
