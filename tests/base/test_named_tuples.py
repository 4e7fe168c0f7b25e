"""Tests of osimlite's named tuples: they equal those of `typing`, although their constructors are compiled late."""

from __future__ import annotations

import copy
import inspect
import pickle
import sys
import typing
from typing import Any, Generic, TypeVar

import pytest

from osimlite.base.named_tuples import UNCOMPILED, NamedTuple

T = TypeVar("T")


class Station(NamedTuple):
    """Point on a body."""

    body: str
    depth: float = 0.5
    marks: tuple[Missing, ...] = ()  # type: ignore[name-defined]  # noqa: F821

    def describe(self) -> str:
        """Return the body and the depth."""
        return f"{self.body} {self.depth}"

    @property
    def is_deep(self) -> bool:
        """Whether the depth is above 1."""
        return self.depth > 1.0


class Branch(NamedTuple, Generic[T]):
    link: T
    outer: str


class Typed(typing.NamedTuple):
    body: str
    depth: float = 0.5
    marks: tuple[int, ...] = ()


def declare() -> type[Any]:
    class Fresh(NamedTuple):
        body: str
        depth: float = 0.5
        marks: tuple[int, ...] = ()

    return Fresh


ARGUMENTS: tuple[tuple[tuple[Any, ...], dict[str, Any]], ...] = (
    (("a",), {}),
    (("a", 2.0, (1,)), {}),
    (("a",), {"marks": (3,)}),
    ((), {"depth": 1.0, "body": "b"}),
    ((), {}),
    ((1, 2, 3, 4), {}),
    (("a",), {"body": "b"}),
    (("a",), {"unknown": 1}),
    ((), {"body": "b", "unknown": 1}),
    ((), {"depth": 1.0}),
)


@pytest.mark.parametrize("created_before", [0, UNCOMPILED, UNCOMPILED + 1])
@pytest.mark.parametrize(("values", "named"), ARGUMENTS)
def test_objects_are_those_of_typing_before_and_after_compilation(
    created_before: int, values: tuple[Any, ...], named: dict[str, Any]
) -> None:
    cls = declare()
    for _ in range(created_before):
        cls("x")
    try:
        expected = Typed(*values, **named)
    except TypeError as error:
        with pytest.raises(TypeError) as caught:
            cls(*values, **named)
        assert str(caught.value).partition("() ")[2] == str(error).partition("() ")[2]
    else:
        assert cls(*values, **named) == expected


def test_methods_equal_those_of_typing() -> None:
    station, typed = Station("a", 2.0, (1,)), Typed("a", 2.0, (1,))
    assert repr(station) == "Station(body='a', depth=2.0, marks=(1,))"
    assert station._asdict() == typed._asdict()
    assert Station._fields == Typed._fields == Station.__match_args__
    assert Station._field_defaults == Typed._field_defaults
    assert Station._make(["a", 1, ()]) == ("a", 1, ())
    assert station._replace(depth=3.0) == ("a", 3.0, (1,))
    assert type(station._replace(depth=3.0)) is Station
    assert (station.describe(), station.is_deep) == ("a 2.0", True)
    assert hash(station) == hash(typed)
    assert not hasattr(station, "__dict__")
    assert type(Station) is type
    assert inspect.signature(Station) == inspect.signature(Typed).replace(
        parameters=[
            parameter.replace(annotation=inspect.Parameter.empty)
            for parameter in inspect.signature(Typed).parameters.values()
        ]
    )
    assert Station.__doc__ == "Point on a body."
    match station:
        case Station(body, depth):
            assert (body, depth) == ("a", 2.0)
        case _:
            pytest.fail("no match")


def test_mistakes_are_refused() -> None:
    station = Station("a")
    with pytest.raises(AttributeError):
        station.depth = 1.0  # type: ignore[misc]
    with pytest.raises(ValueError, match="unexpected field names"):
        station._replace(unknown=1)  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="Expected 3 arguments, got 1"):
        Station._make(["a"])
    with pytest.raises(TypeError, match="without a default"):

        class Wrong(NamedTuple):
            depth: float = 0.5
            body: str  # type: ignore[misc]


def test_objects_are_copied_and_pickled() -> None:
    for item in (Station("a", 2.0, (1,)), Branch(1, "b")):
        for twin in (pickle.loads(pickle.dumps(item)), copy.copy(item), copy.deepcopy(item)):
            assert twin == item
            assert type(twin) is type(item)
    if sys.version_info >= (3, 13):
        assert copy.replace(Station("a"), depth=1.0) == ("a", 1.0, ())


def test_generic_and_derived_classes() -> None:
    class Deeper(Station):
        __slots__ = ()

    assert Branch[int](1, "b") == (1, "b")
    assert Branch.__parameters__ == (T,)  # type: ignore[attr-defined]
    deeper = [Deeper("a", depth=2.0) for _ in range(UNCOMPILED + 2)]
    assert {type(item) for item in deeper} == {Deeper}
    assert deeper[0] == deeper[-1] == ("a", 2.0, ())
