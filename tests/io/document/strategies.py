"""Hypothesis strategies for objects of any class and for models."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

from osimlite.schema.base import Component, Object
from osimlite.schema.fields import ObjectField, ObjectList, Reference, Value
from osimlite.schema.model import Model
from osimlite.schema.registry import find_class, list_tags
from osimlite.schema.specs import get_field_specs

CLASSES: list[type[Object]] = [
    cls for cls in map(find_class, list_tags()) if cls is not None and cls is not Model
]

numbers = st.floats(allow_nan=True, allow_infinity=True)
# Characters that XML can hold. OpenSim trims texts and collapses white space.
texts = st.text(
    st.characters(exclude_categories=("Cs", "Cc", "Z"), exclude_characters="\ufffe\uffff"),
    max_size=8,
) | st.sampled_from(["", "a b", "<&>\"'", "0x10", "1e5", "--"])
words = st.text(st.sampled_from("abcXYZ019_.:é&<>"), min_size=1, max_size=6)
names = words.filter(lambda name: "/" not in name)
_SCALARS: dict[str, st.SearchStrategy[Any]] = {
    "double": numbers,
    "int": st.integers(-(2**31), 2**31 - 1),
    "bool": st.booleans(),
    "string": texts,
}


def values(kind: Value) -> st.SearchStrategy[Any]:
    """Return a strategy for values that a property of this type accepts and a text can hold."""
    one = words if kind.scalar == "string" and kind.shape == "list" else _SCALARS[kind.scalar]
    if kind.shape == "single":
        return one
    if kind.shape == "optional":
        return st.none() | one
    least = kind.size or kind.least
    most = kind.size or kind.most
    return st.lists(one, min_size=least, max_size=least + 3 if most is None else most).map(tuple)


@st.composite
def objects(draw: st.DrawFn, accepts: type[Object] = Component, depth: int = 2) -> Object:
    """Draw an object that a property for `accepts` may hold, with some of its properties set."""
    kinds = [cls for cls in CLASSES if issubclass(cls, accepts)]
    cls = draw(st.sampled_from(kinds))
    given: dict[str, Any] = {"name": draw(names)}
    specs = list(get_field_specs(cls).values())
    for spec in (
        draw(st.lists(st.sampled_from(specs), unique_by=lambda spec: spec.name, max_size=5))
        if specs
        else []
    ):
        kind = spec.kind
        if isinstance(kind, Reference):
            several = st.lists(words, max_size=3).map(tuple)
            given[spec.name] = draw(
                {"list": several, "optional": st.none() | words}.get(kind.shape, words)
            )
        elif isinstance(kind, Value):
            value = draw(values(kind))
            # A file cannot say that a text is absent if the default is present: an empty element is
            # an empty text. OpenSim keeps the default of a vector whose element is empty.
            is_absent_text = value is None and kind.scalar == "string" and spec.default is not None
            is_empty_vector = kind.shape == "vector" and not value and bool(spec.default)
            if not is_absent_text and not is_empty_vector:
                given[spec.name] = value
        elif depth and spec.accepts is not None:
            assert isinstance(kind, ObjectField)
            held = objects(spec.accepts, depth - 1)
            if kind.form == "list":
                given[spec.name] = ObjectList(draw(st.lists(held, max_size=2)))
            else:
                item = draw(held)
                # The object of a named property has the property's name. An unnamed property holds
                # exactly its own class.
                if kind.form == "single":
                    item.name = spec.tag
                if kind.form != "unnamed" or type(item) is spec.accepts:
                    given[spec.name] = item
    return cls(**given)


@st.composite
def models(draw: st.DrawFn) -> Model:
    """Draw a model with a few components of any class."""
    model = Model(
        name=draw(names), credits=draw(texts), gravity=draw(st.tuples(numbers, numbers, numbers))
    )
    for component in draw(st.lists(objects(Component), max_size=4)):
        assert isinstance(component, Component)
        model.subcomponents.append(component)
    return model
