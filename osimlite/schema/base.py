"""Object and Component, the base classes of everything in an OpenSim document."""

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
    """Return whether two stored values are equal; NaN equals NaN.

    A component that is given as a reference is compared by its name.

    Args:
        left: first value.
        right: second value.
    """
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
            and all(
                are_equal(left_item, right_item)
                for left_item, right_item in zip(left, right, strict=True)
            )
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


def make_empty_list() -> Any:
    """Return the default of a property that holds a list of objects: an empty list."""
    return Field(default_factory=ObjectList)


def make_default(cls: type[Object], **values: Any) -> Any:
    """Return the default of a property that holds one object.

    Args:
        cls: class of the object.
        values: values of its properties by name. A function is called for every new object, so that
            defaults share no part.
    """
    return Field(
        default_factory=lambda: cls.build(
            {name: value() if callable(value) else value for name, value in values.items()}, set()
        )
    )


# A docstring here would hide the property `__doc__`. Type checkers see the arguments of
# constructors only if this metaclass itself is decorated, not one of its bases.
@dataclass_transform(kw_only_default=True, field_specifiers=(Field,))
class ObjectType(ModelMetaclass):  # noqa: D101
    @property
    def __doc__(cls) -> str | None:  # type: ignore[override]
        """Docstring of a class, followed by descriptions of its properties."""
        docstring: str | None = cls.__dict__.get("__doc__")
        if not issubclass(cls, Object) or not docstring:
            return docstring
        from osimlite.schema.descriptions import add_properties

        return add_properties(cls, docstring)


class Object(BaseModel, metaclass=ObjectType):
    """Named object with properties that an OpenSim document can hold.

    A subclass is declared with its properties in the order OpenSim prints them. ``tag`` gives the
    XML element when it is not the name of the class: ``class ContactParameters(Object,
    tag="HuntCrossleyForce::ContactParameters")``; ``abstract=True`` marks classes that never occur
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
    """Whether objects of the class have a path in the component tree."""
    is_root: ClassVar[bool] = False
    """Whether objects of the class are the root of a component tree."""
    since: ClassVar[str] = ""
    """Version of OpenSim that introduced the class, for classes that 4.6 does not have."""
    facts: ClassVar[Facts] = Facts()
    """Behaviour of OpenSim with objects of this class that bases and properties do not declare."""
    name_reference: ClassVar[Reference | None] = None
    """Rule by which the object's own name refers to a component; None for most classes."""

    name: str = ""

    def __init_subclass__(cls, tag: str = "", abstract: bool = False) -> None:
        super().__init_subclass__()
        cls.tag = tag or cls.__name__
        cls.abstract = abstract

    def __init__(self, *positional: Any, **properties: Any) -> None:
        if positional:
            raise ModelError(describe_unnamed_value(type(self), positional[0]))
        for unknown in properties.keys() - type(self).model_fields.keys():
            spec = get_field_specs(type(self)).get(unknown)
            if spec is None or spec.name in properties:
                raise MissingNameError(partial(describe_unknown_property, type(self), unknown))
            properties[spec.name] = properties.pop(unknown)
        values = _check_values(type(self), properties)
        if values is not None:
            built = self.build(values, set(properties))
            _put_state(self, built.__dict__)
            _put_present(self, built.model_fields_set)
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
        """Make an instance from values in their stored form, without validation.

        The reader uses this method. It is several times faster than ``cls(...)``, and a test compares
        the results.

        Args:
            values: values by property; properties that are left out take their defaults.
            present: properties that the text contains.
            index: index of the object's element in its text.
            home: model that the object will belong to.

        Returns:
            New instance of the class.
        """
        # Default objects and lists are made on first access (see `__getattr__`), because most are never
        # used.
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
        """Make an instance without validation; pydantic's name for :meth:`build`.

        Args:
            _fields_set: properties that count as set; all of `values` by default.
            values: values by property.

        Returns:
            New instance of the class.
        """
        return cls.build(values, set(values) if _fields_set is None else _fields_set)

    @classmethod
    def field_specs(cls) -> dict[str, FieldSpec]:
        """Return the properties of the class in the order OpenSim prints them.

        Returns:
            Properties by XML tag.
        """
        return get_field_specs(cls)

    @property
    def source_index(self) -> Any:
        """Index of the object's element among all elements of its text; None without a text."""
        return self._index

    @property
    def layout(self) -> Layout | None:
        """Comments, unknown elements and other content of the file that properties do not hold."""
        return cast("Layout | None", self._layout)

    def list_owned_objects(self) -> list[tuple[FieldSpec, Object]]:
        """Return every object that this one owns, with the property that holds it, in printing order."""
        owned: list[tuple[FieldSpec, Object]] = []
        state = self.__dict__
        for spec, name, is_list, _ in list_holding_properties(type(self)):
            # A list that was never accessed is empty; do not create it.
            value: Any = state[name] if name in state else () if is_list else getattr(self, name)
            if is_list or isinstance(value, list):
                owned += [(spec, item) for item in value]
            elif value is not None:
                owned.append((spec, value))
        return owned

    def find_contradictions(self) -> Iterable[Contradiction]:
        """Yield combinations of property values that OpenSim rejects although each value is valid.

        Returns:
            The combinations; none for a class that does not define this method.
        """
        return ()

    def walk(self) -> Iterator[Object]:
        """Yield this object and everything below it, parents first."""
        pending: list[Object] = [self]
        while pending:
            item = pending.pop()
            yield item
            if list_holding_properties(type(item)):
                pending += [child for _, child in item.list_owned_objects()][::-1]

    def copy_deep(self) -> Self:
        """Return a copy that shares nothing with the original."""
        return copy.deepcopy(self)

    def __getattr__(self, name: str) -> Any:
        if not name.startswith("_"):
            factory = get_defaults(type(self))[1].get(name)
            if factory is not None:
                default = self.__dict__[name] = factory()
                _assign_owner(default, self._model)
                return default
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
        """Set a property to a value in its stored form, without validation.

        Pydantic compiles the validation of a class when a property is set for the first time, which
        takes milliseconds.

        Args:
            name: name of the property in Python.
            value: value of the property; not an object.
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
        clone = _copy_object(self, memo, naming, home)
        if home is not None:
            home.model = cast("Model", clone)
        if outermost:
            # References to components outside of the copied object keep pointing to the originals; those
            # inside point to the copies.
            for state, name in naming:
                value = state[name]
                targets = value if isinstance(value, tuple) else (value,)
                copies = tuple(memo.setdefault(id(target), target) for target in targets)
                state[name] = copies if isinstance(value, tuple) else copies[0]
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


# The setters of the slots are a third faster than setattr.
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
    """Object with a path in the component tree, by which other components can name it."""

    is_component: ClassVar[bool] = True
    internal: ClassVar[tuple[tuple[str, type[Component]], ...]] = ()
    """Names and classes of the parts that OpenSim adds itself: they have a path but no element in a file."""

    subcomponents: Annotated[Many[Component], Tag("components")] = make_empty_list()
    """Further components that belong to this one; they may be of any class."""

    @property
    def model(self) -> Model | None:
        """Model in which this component was last seen."""
        holder = self._model
        return holder.model if type(holder) is Home else cast("Model | None", holder)

    @property
    def parent(self) -> Component | None:
        """Component above in the tree; None for the model, or while the component is in no model."""
        model = self.model
        return None if model is None else model.tree().parent_of(self)

    @property
    def path(self) -> str:
        """Absolute path as OpenSim writes it; only the name while the component is in no model."""
        model = self.model
        path = None if model is None else model.tree().path_of(self)
        return self.name if path is None else path


class ModelComponent(Component, abstract=True):
    """A component of a model."""


class Unknown(ModelComponent, abstract=True):
    """Object of a class that osimlite does not know (a plug-in, a misspelling), preserved as text.

    `class_name` is its tag in the file, `content` the XML text inside.
    """

    class_name: str = ""
    content: str = ""

    @property
    def objects(self) -> ObjectList[Any]:
        """Empty list, so that an unknown class may replace a set; its members are part of `content`."""
        return ObjectList()

    def __getattr__(self, name: str) -> Any:
        try:
            return super().__getattr__(name)
        except MissingNameError:
            if not self.class_name:
                raise
            # The text of the object may well have this property: what is missing is its class.
            raise MissingNameError(partial(self._describe_missing, name)) from None

    def _describe_missing(self, name: str) -> str:
        """Return the message for a property that code expects of the class that should stand here."""
        return (
            f"'{self.name}' is a {self.class_name}, a class that osimlite does not know, so that its '{name}' "
            "cannot be read; run 'osimlite validate' for its line"
        )


# For every class pydantic evaluates all annotations of its bases again, unless they are evaluated
# already. Annotations that are not fields it remembers, so they can be dropped.
for _base in (Object, Component):
    _hints = get_type_hints(_base, include_extras=True)
    _base.__annotations__ = {
        name: _hints[name] for name in _base.__annotations__ if name in _base.model_fields
    }

_set = object.__setattr__


def _check_values(cls: type[Object], properties: dict[str, Any]) -> dict[str, Any] | None:
    """Return properties in their stored form; None if pydantic has to validate or to report an error."""
    checks = make_checks(cls)
    if checks is None or not properties.keys() <= checks.keys():
        return None
    try:
        return {name: checks[name](value) for name, value in properties.items()}
    except ValueError:
        return None


_NAMING = -1
"""Key in the memo of a deep copy for references to components; no object has this identity."""
_PLAIN = frozenset((str, float, int, bool, type(None)))
"""Types of values that a deep copy can share."""


def _copy_object(
    item: T, memo: dict[int, Any], naming: list[tuple[dict[str, Any], str]], home: Home | None
) -> T:
    """Copy an object and all that it owns; append its references to `naming`, to be redirected at the end.

    Returns:
        The copy; of an object that `memo` contains, the copy made before.
    """
    if id(item) in memo:
        return cast("T", memo[id(item)])
    state = item.__dict__.copy()
    owned = _list_owned_fields(type(item))
    for name, value in state.items():
        kind = type(value)
        if kind in _PLAIN or (kind is tuple and _PLAIN.issuperset(map(type, value))):
            continue
        if kind is ObjectList:
            state[name] = ObjectList(_copy_object(member, memo, naming, home) for member in value)
        elif name in owned and isinstance(value, Object):
            state[name] = _copy_object(value, memo, naming, home)
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


def _assign_owner(value: Any, owner: Any) -> None:
    """Set the model of a new object or list, and of all objects in it."""
    if isinstance(value, list):
        if isinstance(value, ObjectList):
            value.owner = owner
        for item in value:
            _assign_owner(item, owner)
    elif isinstance(value, Object):
        put_model(value, owner)
        for _, name, _, _ in list_holding_properties(type(value)):
            _assign_owner(value.__dict__.get(name), owner)


def _get_all_values(item: Object) -> dict[str, Any]:
    """Return the values of an object by field, including defaults that were never accessed."""
    for name in get_defaults(type(item))[1]:
        getattr(item, name)
    return item.__dict__


def _list_unknown(item: Object) -> list[str]:
    return item.layout.unknown if item.layout is not None else []
