"""Types of properties, written as annotation markers on the component classes.

A property is declared once, ``radius: Annotated[float, real("m", ">= 0")] = 0.0``; the reader, the
printer, the linter and the catalogue test all use the marker. How text becomes a value is the task
of :mod:`osimlite.io.document.lexical`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, TypeVar

from pydantic_core import core_schema

from osimlite.base.records import dataclass

if TYPE_CHECKING:
    from osimlite.schema.base import Object

T = TypeVar("T")

Scalar = Literal["double", "int", "bool", "string"]
Shape = Literal["single", "optional", "list", "vector", "Vec2", "Vec3", "Vec6", "Transform"]
Form = Literal["single", "unnamed", "optional", "list"]
Consequence = Literal["refused", "left out", "ignored"]

UNBOUNDED: Final = None
"""Value of `Value.most` for lists of any length."""
_FIXED_SIZE: Final = {"Vec2": 2, "Vec3": 3, "Vec6": 6, "Transform": 6}


class FieldType:
    """Base class of all markers.

    It gives pydantic a validator that does not build those of other component classes.
    """

    __slots__ = ()

    def check(self, value: Any, accepts: type | None) -> Any:
        """Return a value of the property in the form in which objects store it.

        Args:
            value: value to convert.
            accepts: class of the objects that the property holds; None for text.

        Raises:
            ValueError: the value does not fit the property.
        """
        raise NotImplementedError

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> core_schema.CoreSchema:
        accepts = find_class(source)
        return core_schema.no_info_plain_validator_function(
            lambda value: self.check(value, accepts)
        )


@dataclass(frozen=True, slots=True)
class Value(FieldType):
    """Property with words of one scalar type: a number, a switch, a text, a vector, a list.

    Attributes:
        scalar: type of one word.
        shape: arrangement of the words.
        unit: unit of the numbers.
        domain: condition on every number such as ``"> 0"``, which lint rules check and the reader
            does not enforce.
        least: smallest number of words of a list.
        most: largest number of words of a list; None without a bound.
        legacy: whether the property belongs to OpenSim's first property system, which is printed last
            and parsed by stricter rules.
        choices: words or numbers that have a meaning.
        optional: whether a vector may be left out.
    """

    scalar: Scalar
    shape: Shape = "single"
    unit: str | None = None
    domain: str = ""
    least: int = 0
    most: int | None = UNBOUNDED
    legacy: bool = False
    choices: tuple[str | int, ...] = ()
    optional: bool = False

    @property
    def size(self) -> int | None:
        """Number of words if it is fixed (1 for single values, 3 for Vec3 ...), else None."""
        if self.shape in ("single", "optional"):
            return 1
        return _FIXED_SIZE.get(self.shape)

    def check(self, value: Any, accepts: type | None) -> Any:
        """Return the number, switch or text, or a tuple of them.

        Args:
            value: value to convert.
            accepts: not used.

        Raises:
            ValueError: the value has another type or size.
        """
        if self.shape == "single":
            return _check_scalar(self.scalar, value)
        if value is None and (self.optional or self.shape == "optional"):
            return None
        if self.shape == "optional":
            return _check_scalar(self.scalar, value)
        # A text is iterable too: each of its letters would count as a value.
        if isinstance(value, str) or not isinstance(value, Iterable):
            raise ValueError(f"expected {self.words()}, got {value!r}")
        checked = tuple(_check_scalar(self.scalar, item) for item in value)
        size = _FIXED_SIZE.get(self.shape)
        min_count, max_count = (size, size) if size is not None else (self.least, self.most)
        if len(checked) < min_count or (max_count is not None and len(checked) > max_count):
            raise ValueError(f"expected {self.words()}, got {len(checked)}")
        return checked

    def words(self) -> str:
        """Describe the expected text: ``"3 numbers"``, ``"true or false"``.

        Returns:
            The number of values and what they are, for "expected ..." in a message.
        """
        nouns = {
            "double": "numbers",
            "int": "whole numbers",
            "bool": "true or false",
            "string": "words",
        }[self.scalar]
        if self.size == 1:
            return {"bool": nouns, "string": "a text"}.get(self.scalar, f"one {nouns[:-1]}")
        exact = (
            self.size if self.size is not None else self.most if self.most == self.least else None
        )
        if exact is not None:
            return f"{exact} {nouns}"
        if self.most is not None:
            return f"at most {self.most} {nouns}"
        return f"at least {self.least} {nouns}" if self.least else f"a list of {nouns}"


@dataclass(frozen=True, slots=True)
class Reference(FieldType):
    """Property that names other components by text.

    In Python it also accepts the component itself, which the printer converts to text.

    Attributes:
        rule: rule of :mod:`osimlite.schema.resolution` that resolves the text.
        target: OpenSim class that the named component must have.
        shape: whether the property has one name, an optional one, or a list.
        required: whether OpenSim rejects an empty property.
        legacy: whether the property belongs to OpenSim's first property system.
        words: words that are accepted besides names.
        consequence: consequence in OpenSim of a name in a setup that leads to nothing: it rejects
            the setup, leaves the name out, or ignores the property.
        any_case: whether `words` are accepted in any letter case.
    """

    rule: str
    target: str
    shape: Literal["single", "optional", "list"] = "single"
    required: bool = True
    legacy: bool = False
    words: tuple[str, ...] = ()
    consequence: Consequence = "refused"
    any_case: bool = False

    def accepts_word(self, word: str) -> bool:
        """Return whether a text is one of the words that are accepted besides names."""
        return word in self.words or (self.any_case and word.lower() in map(str.lower, self.words))

    def check(self, value: Any, accepts: type | None) -> Any:
        """Return the text or the component, or a tuple of them.

        Args:
            value: value to convert.
            accepts: not used.

        Raises:
            ValueError: a component has another class.
        """
        if self.shape == "list":
            if isinstance(value, str) or not isinstance(value, Iterable):
                raise ValueError(
                    f"expected a list of {self.target} components or their names, got {value!r}"
                )
            return tuple(self._check_target(item) for item in value)
        if value is None and self.shape == "optional":
            return None
        return self._check_target(value)

    def _check_target(self, value: Any) -> Any:
        if isinstance(value, str):
            return value
        # Compare names, since the classes of components import this module.
        names = {base.__name__ for base in type(value).__mro__}
        if "Component" in names and (self.target in names or "Unknown" in names):
            return value
        raise ValueError(
            f"expected a {self.target} or the text that names one, got {type(value).__name__}"
        )


@dataclass(frozen=True, slots=True)
class ObjectField(FieldType):
    """Property that holds one or several objects.

    Attributes:
        form: XML form. ``single`` prints ``<Class name="property">``, ``unnamed`` prints ``<Class>``,
            ``optional`` and ``list`` print ``<property><Class/>...</property>``.
        legacy: whether the property belongs to OpenSim's first property system.
    """

    form: Form
    legacy: bool = False

    def check(self, value: Any, accepts: type | None) -> Any:
        """Return the object, or a list that reports its changes.

        Args:
            value: value to convert.
            accepts: class of the objects.

        Raises:
            ValueError: an object has another class.
        """
        assert accepts is not None
        if self.form == "list":
            if isinstance(value, str) or not isinstance(value, Iterable):
                raise ValueError(f"expected a list of {accepts.__name__}, got {value!r}")
            return ObjectList(_check_instance(item, accepts) for item in value)
        if value is None and self.form == "optional":
            return None
        if self.form == "unnamed" and isinstance(value, accepts) and type(value) is not accepts:
            # The tag identifies the property, so the class must be exact.
            raise ValueError(
                f"expected a {accepts.__name__} and no class derived from it, got {type(value).__name__}"
            )
        return _check_instance(value, accepts)


@dataclass(frozen=True, slots=True)
class Tag:
    """XML tag of a property whose tag is not the name of the Python attribute."""

    text: str


@dataclass(frozen=True, slots=True)
class Legacy:
    """Mark of a property of OpenSim's first property system whose type is shared with other properties."""


LEGACY: Final = Legacy()


@dataclass(frozen=True, slots=True)
class NamesOf:
    """Mark of a property whose words, names of objects, or labels of a table refer to something.

    Classes such as sets of weights have many uses; only the property that holds them declares what
    they name.
    """

    reference: Reference


def note_change(owner: Any, *, numbers_only: bool = False) -> None:
    """Report to its model that an object or list is about to change.

    An object without a model changes no index: it enters a model by a change of its holder.

    Args:
        owner: model or home in which the object was last seen.
        numbers_only: whether paths and references stay the same.
    """
    model = None if owner is None else owner.model
    if model is not None:
        model.outdate(numbers_only=numbers_only)


class ObjectList(list[T]):
    """List of objects that reports every change, so that paths and look-ups stay valid.

    Two objects with equal properties are equal but not the same, so `index` and `remove` compare
    identity. `owner` is the model in which the list was last seen.
    """

    __slots__ = ("owner",)

    owner: Any

    def __reduce_ex__(self, protocol: Any) -> Any:
        # A copy is in no model.
        return type(self), (list(self),)

    def index(self, value: T, *limits: Any) -> int:
        """Return the index of an object, compared by identity.

        Args:
            value: object to find.
            limits: start and end of the search, as of ``list.index``.

        Raises:
            ValueError: the object is not in the list.
        """
        return [id(item) for item in self].index(id(value), *limits)

    def remove(self, value: T) -> None:
        """Remove this very object.

        Raises:
            ValueError: the object is not in the list.
        """
        del self[self.index(value)]


def _wrap_mutator(name: str) -> Callable[..., Any]:
    # The methods of `list` do not call each other's overridden versions, so each one is wrapped.
    plain = getattr(list, name)

    def method(self: Any, *args: Any, **kwargs: Any) -> Any:
        note_change(getattr(self, "owner", None))
        return plain(self, *args, **kwargs)

    method.__name__ = name
    method.__doc__ = plain.__doc__
    return method


for _name in (
    "append",
    "extend",
    "insert",
    "pop",
    "clear",
    "sort",
    "reverse",
    "__setitem__",
    "__delitem__",
):
    setattr(ObjectList, _name, _wrap_mutator(_name))
for _name in ("__iadd__", "__imul__"):
    setattr(ObjectList, _name, _wrap_mutator(_name))


def find_class(annotation: Any) -> type[Object] | None:
    """Return the component class in an annotation such as ``list[Body]`` or ``Function | None``."""
    # No `issubclass`: the class Object is defined in a module that imports this one.
    if isinstance(annotation, type) and hasattr(annotation, "field_specs"):
        return annotation
    for argument in getattr(annotation, "__args__", ()):
        result = find_class(argument)
        if result is not None:
            return result
    return None


def _check_instance(value: Any, accepts: type) -> Any:
    if isinstance(value, accepts) or type(value).__name__ == "Unknown":
        return value
    if isinstance(value, list | tuple) and "objects" in getattr(accepts, "model_fields", ()):
        name = str(getattr(accepts, "tag", accepts.__name__)).replace("::", ".")
        raise ValueError(f"expected a {name}, got a list; write {name}(objects=[...])")
    raise ValueError(f"expected a {accepts.__name__}, got {type(value).__name__}")


def _check_scalar(scalar: Scalar, value: Any) -> Any:
    """Return a value in its stored form.

    Raises:
        ValueError: the value has another type.
    """
    if scalar == "string":
        if isinstance(value, str):
            return value
    elif scalar == "bool":
        if isinstance(value, bool):
            return value
    # Numbers of NumPy are no `int`, and not all are `float`, so they are recognised by their
    # conversions. True would pass as 1 by the same conversions, and is excluded.
    elif not isinstance(value, (bool, str, bytes)):
        if scalar == "double" and hasattr(value, "__float__"):
            return float(value)
        if scalar == "int" and hasattr(value, "__index__"):
            return int(value)
    noun = {
        "double": "a number",
        "int": "a whole number",
        "bool": "True or False",
        "string": "a text",
    }[scalar]
    raise ValueError(f"expected {noun}, got {value!r}")


def real(unit: str | None = None, domain: str = "", *, legacy: bool = False) -> Value:
    """Return the marker of one number.

    Args:
        unit: unit of the number.
        domain: condition that valid numbers satisfy.
        legacy: whether it belongs to the first property system.
    """
    return Value("double", unit=unit, domain=domain, legacy=legacy)


def vec3(unit: str | None = None, domain: str = "") -> Value:
    """Return the marker of three numbers, a station or direction in the frame that the class names.

    Args:
        unit: unit of the numbers.
        domain: condition that valid numbers satisfy.
    """
    return Value("double", "Vec3", unit=unit, domain=domain)


def reals(
    unit: str | None = None, *, least: int = 0, most: int | None = None, legacy: bool = False
) -> Value:
    """Return the marker of a list of numbers.

    Args:
        unit: unit of the numbers.
        least: smallest length.
        most: largest length; None without a bound.
        legacy: whether it belongs to the first property system.
    """
    return Value("double", "list", unit=unit, least=least, most=most, legacy=legacy)


def maybe(unit: str | None = None, domain: str = "") -> Value:
    """Return the marker of a number that may be left out.

    Args:
        unit: unit of the number.
        domain: condition that valid numbers satisfy.
    """
    return Value("double", "optional", unit=unit, domain=domain)


def word(*choices: str, legacy: bool = False) -> Value:
    """Return the marker of a text property that has a fixed set of valid words.

    Args:
        choices: valid words.
        legacy: whether it belongs to the first property system.
    """
    return Value("string", choices=choices, legacy=legacy)


Vec2 = tuple[float, float]
Vec3 = tuple[float, float, float]
Vec6 = tuple[float, float, float, float, float, float]
Reals = tuple[float, ...]

Flag = Annotated[bool, Value("bool")]
Text = Annotated[str, Value("string")]
Number = Annotated[float, Value("double")]
Integer = Annotated[int, Value("int")]
Vector = Annotated[Reals, Value("double", "vector")]
LegacyFlag = Annotated[bool, Value("bool", legacy=True)]
LegacyText = Annotated[str, Value("string", legacy=True)]
LegacyNumber = Annotated[float, real(legacy=True)]
LegacyInteger = Annotated[int, Value("int", legacy=True)]
LegacyReals = Annotated[Reals, reals(legacy=True)]
MaybeFlag = Annotated[bool | None, Value("bool", "optional")]

Single = Annotated[T, ObjectField("single")]
Unnamed = Annotated[T, ObjectField("unnamed")]
Optional = Annotated[T | None, ObjectField("optional")]
Many = Annotated[list[T], ObjectField("list")]
LegacyUnnamed = Annotated[T, ObjectField("unnamed", legacy=True)]
LegacyMany = Annotated[list[T], ObjectField("list", legacy=True)]
LegacyOptional = Annotated[T | None, ObjectField("optional", legacy=True)]


def make_domain_test(domain: str) -> Callable[[float], bool]:
    """Return a test for a domain such as ``"> 0"``, ``">= 1"``, ``"0 to 1"`` or ``">= 0 or -1"``."""
    domain, _, alternative = domain.partition(" or ")
    if alternative:
        is_in_domain, extra_value = make_domain_test(domain), float(alternative)
        return lambda value: value == extra_value or is_in_domain(value)
    interval = re.fullmatch(r"(\S+) to (\S+)", domain)
    if interval:
        low, high = float(interval[1]), float(interval[2])
        return lambda value: low <= value <= high
    sign, _, limit_text = domain.partition(" ")
    limit = float(limit_text)
    return {
        ">": lambda value: value > limit,
        ">=": lambda value: value >= limit,
        "<": lambda value: value < limit,
        "<=": lambda value: value <= limit,
        "!=": lambda value: value != limit,
    }[sign]
