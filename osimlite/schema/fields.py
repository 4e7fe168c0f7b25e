"""Field kinds: what the text of one property may hold, written as annotation markers on the component classes.

A field of a component class is declared once, ``radius: Annotated[float, real("m", ">= 0")] =
0.0``; the reader, the printer, the linter and the catalogue test all work from the marker. Markers
hold facts only: how text becomes a value is the business of :mod:`osimlite.io.document.lexical`.
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
Fate = Literal["refused", "left out", "ignored"]

UNBOUNDED: Final = None
_FIXED_SIZE: Final = {"Vec2": 2, "Vec3": 3, "Vec6": 6, "Transform": 6}


class Kind:
    """Base of all markers; gives pydantic a validator that never looks into the classes of other components."""

    __slots__ = ()

    def check(self, value: Any, accepts: type | None) -> Any:
        """Return `value` in the form the model stores, or raise ValueError."""
        raise NotImplementedError

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> core_schema.CoreSchema:
        accepts = find_class(source)
        return core_schema.no_info_plain_validator_function(
            lambda value: self.check(value, accepts)
        )


@dataclass(frozen=True, slots=True)
class Value(Kind):
    """Words of one scalar type: a number, a switch, a text, a vector, a list.

    `least` and `most` bound the number of words of a list (`most` None: no bound). `domain` is a
    condition on every number such as ``"> 0"``; it is what a sane model satisfies, not something
    the reader enforces. `choices` lists the words or numbers that have a meaning. `legacy` marks
    properties of OpenSim's first property system, which are printed after the others and read by
    stricter rules. An `optional` vector may be left out.
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
        """Return the number, switch or text, or a tuple of them; ValueError if it is none."""
        if self.shape == "single":
            return _scalar(self.scalar, value)
        if value is None and (self.optional or self.shape == "optional"):
            return None
        if self.shape == "optional":
            return _scalar(self.scalar, value)
        if isinstance(value, str) or not isinstance(value, Iterable):
            raise ValueError(f"expected {self.words()}, got {value!r}")
        items = tuple(_scalar(self.scalar, item) for item in value)
        size = _FIXED_SIZE.get(self.shape)
        least, most = (size, size) if size is not None else (self.least, self.most)
        if len(items) < least or (most is not None and len(items) > most):
            raise ValueError(f"expected {self.words()}, got {len(items)}")
        return items

    def words(self) -> str:
        """What the text must hold, in words: ``"3 numbers"``, ``"true or false"``."""
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
class Reference(Kind):
    """A text, or a list of words, by which one component names another.

    `rule` is one of the resolution kinds of :mod:`osimlite.schema.references`, `target` the OpenSim
    class that the named component must be; OpenSim insists on one if it is `required`. In Python
    the component itself may be given; the printer turns it into the right text. `words` may stand
    there besides names, of some properties in `any_case`; in a setup `fate` says what OpenSim does
    with a name that leads to nothing: refuse it, leave it out, or ignore the property anyway.
    """

    rule: str
    target: str
    shape: Literal["single", "optional", "list"] = "single"
    required: bool = True
    legacy: bool = False
    words: tuple[str, ...] = ()
    fate: Fate = "refused"
    any_case: bool = False

    def takes(self, word: str) -> bool:
        """Whether a text is one of the words that may stand there besides names."""
        return word in self.words or (self.any_case and word.lower() in map(str.lower, self.words))

    def check(self, value: Any, accepts: type | None) -> Any:
        """Return the text or the component, or a tuple of them; ValueError if a component is of another class."""
        if self.shape == "list":
            if isinstance(value, str) or not isinstance(value, Iterable):
                raise ValueError(
                    f"expected a list of {self.target} components or their names, got {value!r}"
                )
            return tuple(self._one(item) for item in value)
        if value is None and self.shape == "optional":
            return None
        return self._one(value)

    def _one(self, value: Any) -> Any:
        if isinstance(value, str):
            return value
        names = {base.__name__ for base in type(value).__mro__}
        if "Component" in names and (self.target in names or "Unknown" in names):
            return value
        raise ValueError(
            f"expected a {self.target} or the text that names one, got {type(value).__name__}"
        )


@dataclass(frozen=True, slots=True)
class Held(Kind):
    """One or several objects that belong to this one; `form` is how the file holds them.

    ``single`` prints ``<Class name="property">``, ``unnamed`` prints ``<Class>``, ``optional`` and
    ``list`` print ``<property><Class/>...</property>``.
    """

    form: Form
    legacy: bool = False

    def check(self, value: Any, accepts: type | None) -> Any:
        """Return the object, or a list that notes its changes; ValueError if an object is of another class."""
        assert accepts is not None
        if self.form == "list":
            if isinstance(value, str) or not isinstance(value, Iterable):
                raise ValueError(f"expected a list of {accepts.__name__}, got {value!r}")
            return ObjectList(_instance(item, accepts) for item in value)
        if value is None and self.form == "optional":
            return None
        if self.form == "unnamed" and isinstance(value, accepts) and type(value) is not accepts:
            # Its tag is what tells the property.
            raise ValueError(
                f"expected a {accepts.__name__} and no class derived from it, got {type(value).__name__}"
            )
        return _instance(value, accepts)


@dataclass(frozen=True, slots=True)
class Tag:
    """Gives the XML tag of a property whose tag cannot be the name of the Python attribute."""

    text: str


@dataclass(frozen=True, slots=True)
class Legacy:
    """Marks a property of OpenSim's first property system where the kind of the field is shared with others."""


LEGACY: Final = Legacy()


@dataclass(frozen=True, slots=True)
class NamesOf:
    """Says of what a property holds names: its words, the names of its objects, the labels of its table.

    Classes such as sets of weights are used for many things; only the property that holds them
    tells for what.
    """

    reference: Reference


def note_change(owner: Any, *, numbers_only: bool = False) -> None:
    """Tell the model that an object or list was last seen in that it is about to change.

    What was in no index yet changes none: it came, or comes, into a model by a change of what is
    there.
    """
    model = None if owner is None else owner.model
    if model is not None:
        model.outdate(numbers_only=numbers_only)


class ObjectList(list[T]):
    """A list of objects that notes every change, so that paths and look-ups stay right.

    Two objects with the same properties are equal but not the same: `index` and `remove` go by
    identity. `owner` is the model that the list was last seen in.
    """

    __slots__ = ("owner",)

    owner: Any

    def __reduce_ex__(self, protocol: Any) -> Any:
        # A copy is in no model.
        return type(self), (list(self),)

    def index(self, value: T, *limits: Any) -> int:
        """Position of this very object; ValueError if it is not here."""
        return [id(item) for item in self].index(id(value), *limits)

    def remove(self, value: T) -> None:
        """Take this very object out; ValueError if it is not here."""
        del self[self.index(value)]


def _noting(name: str) -> Callable[..., Any]:
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
    setattr(ObjectList, _name, _noting(_name))
for _name in ("__iadd__", "__imul__"):
    setattr(ObjectList, _name, _noting(_name))


def find_class(annotation: Any) -> type[Object] | None:
    """The component class inside an annotation such as ``list[Body]`` or ``Function | None``."""
    if isinstance(annotation, type) and hasattr(annotation, "field_specs"):
        return annotation
    for argument in getattr(annotation, "__args__", ()):
        result = find_class(argument)
        if result is not None:
            return result
    return None


def _instance(value: Any, accepts: type) -> Any:
    if isinstance(value, accepts) or type(value).__name__ == "Unknown":
        return value
    if isinstance(value, list | tuple) and "objects" in getattr(accepts, "model_fields", ()):
        name = str(getattr(accepts, "tag", accepts.__name__)).replace("::", ".")
        raise ValueError(f"expected a {name}, got a list; write {name}(objects=[...])")
    raise ValueError(f"expected a {accepts.__name__}, got {type(value).__name__}")


def _scalar(scalar: Scalar, value: Any) -> Any:
    if scalar == "string":
        if isinstance(value, str):
            return value
    elif scalar == "bool":
        if isinstance(value, bool):
            return value
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
    """Marker of one number with its unit and the domain a sane model keeps to."""
    return Value("double", unit=unit, domain=domain, legacy=legacy)


def vec3(unit: str | None = None, domain: str = "") -> Value:
    """Marker of three numbers, a station or direction in the frame that the class names."""
    return Value("double", "Vec3", unit=unit, domain=domain)


def reals(
    unit: str | None = None, *, least: int = 0, most: int | None = None, legacy: bool = False
) -> Value:
    """Marker of a list of numbers."""
    return Value("double", "list", unit=unit, least=least, most=most, legacy=legacy)


def maybe(unit: str | None = None, domain: str = "") -> Value:
    """Marker of a number that may be left out."""
    return Value("double", "optional", unit=unit, domain=domain)


def word(*choices: str, legacy: bool = False) -> Value:
    """Marker of a text of which only some words have a meaning."""
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

Single = Annotated[T, Held("single")]
Unnamed = Annotated[T, Held("unnamed")]
Optional = Annotated[T | None, Held("optional")]
Many = Annotated[list[T], Held("list")]
LegacyUnnamed = Annotated[T, Held("unnamed", legacy=True)]
LegacyMany = Annotated[list[T], Held("list", legacy=True)]
LegacyOptional = Annotated[T | None, Held("optional", legacy=True)]


def make_domain_test(domain: str) -> Callable[[float], bool]:
    """The test that a domain such as ``"> 0"``, ``">= 1"``, ``"0 to 1"`` or ``">= 0 or -1"`` stands for."""
    domain, _, besides = domain.partition(" or ")
    if besides:
        inside, alone = make_domain_test(domain), float(besides)
        return lambda value: value == alone or inside(value)
    between = re.fullmatch(r"(\S+) to (\S+)", domain)
    if between:
        low, high = float(between[1]), float(between[2])
        return lambda value: low <= value <= high
    sign, _, bound = domain.partition(" ")
    limit = float(bound)
    return {
        ">": lambda value: value > limit,
        ">=": lambda value: value >= limit,
        "<": lambda value: value < limit,
        "<=": lambda value: value <= limit,
        "!=": lambda value: value != limit,
    }[sign]
