"""Tests of records: they behave as dataclasses, although their methods are generated late."""

from __future__ import annotations

import copy
import dataclasses
import pickle
import pprint
from typing import Any

import pytest

from osimlite.base.records import UNCOMPILED, dataclass, field, replace


@dataclass(frozen=True)
class Place:
    name: str
    depth: float = 0.5
    parts: list[int] = field(default_factory=list, compare=False)


@dataclass(frozen=True, slots=True)
class Slotted:
    name: str
    depth: float = 0.5


@dataclass(slots=True)
class Changing:
    count: int = 0
    seen: set[str] = field(default_factory=set, init=False, repr=False)


@dataclass(frozen=True, kw_only=True)
class Named:
    of: int = 1
    more: int

    def __post_init__(self) -> None:
        if self.more < 0:
            raise ValueError(self.more)


@dataclass(frozen=True, eq=False)
class Deeper(Place):
    depth: float = 2.0
    last: str = "z"


def fields_of(item: Any) -> list[tuple[str, bool]]:
    return [(each.name, each.init) for each in dataclasses.fields(item)]


def test_objects_are_made_as_those_of_dataclasses() -> None:
    assert (Place("a").depth, Place("a", parts=[1]).parts, Slotted("a", 2.0).depth) == (
        0.5,
        [1],
        2.0,
    )
    assert Place("a").parts is not Place("a").parts
    assert (Named(more=2).of, Named(more=2).more) == (1, 2)
    assert (Deeper("a").depth, Deeper("a", 1.0, [], "y").last) == (2.0, "y")
    assert Changing(3).seen == set()
    for wrong in (
        lambda: Place(),  # type: ignore[call-arg]
        lambda: Named(1, 2),  # type: ignore[call-arg]
        lambda: Slotted("a", deep=1),  # type: ignore[call-arg]
        lambda: Changing(1, set()),  # type: ignore[call-arg]
    ):
        with pytest.raises(TypeError):
            wrong()
    with pytest.raises(ValueError):
        Named(more=-1)


def test_objects_compare_and_print_as_those_of_dataclasses() -> None:
    assert (
        Place("a", parts=[1]) == Place("a") != Place("b")
        and len({Place("a"), Place("a", 0.5, [2])}) == 1
    )
    assert Slotted("a") == Slotted("a") != Slotted("b") and len({Slotted("a"), Slotted("a")}) == 1
    assert Deeper("a") == Deeper("a", last="y") != Deeper("b")
    assert (
        repr(Place("a")) == "Place(name='a', depth=0.5, parts=[])"
        and repr(Changing(1)) == "Changing(count=1)"
    )
    with pytest.raises(TypeError):
        hash(Changing())


@pytest.mark.parametrize("item", [Place("a"), Slotted("a"), Deeper("a"), Named(more=2)])
def test_what_is_frozen_cannot_be_changed(item: Any) -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        item.name = "b"
    with pytest.raises(dataclasses.FrozenInstanceError):
        del item.name


@pytest.mark.parametrize("item", [Place("a", 1.0), Slotted("a", 1.0), Changing(2), Named(more=2)])
def test_objects_can_be_copied_pickled_and_varied(item: Any) -> None:
    for made in (
        copy.copy(item),
        copy.deepcopy(item),
        pickle.loads(pickle.dumps(item)),
        replace(item),
    ):
        assert made == item and type(made) is type(item) and made is not item
    assert dataclasses.replace(item) == item
    assert fields_of(item) == [(name, name != "seen") for name in item.__record_fields__]


def test_nothing_is_compiled_before_several_objects_are_made() -> None:
    @dataclass
    class Late:
        size: int = 1

    before: Any = vars(Late)["__init__"]
    assert [Late().size for _ in range(UNCOMPILED)] == [1] * UNCOMPILED
    assert vars(Late)["__init__"] is before
    assert Late().size == 1 and vars(Late)["__init__"] is not before
    made: Any = vars(Late)["__init__"]
    assert Late(2).size == 2 and vars(Late)["__init__"] is made


def make_fresh():
    """Return a function that declares a class anew: as a record without instances, and as a dataclass."""

    def declare(make, attribute):
        class Item:
            name: str
            depth: float = 0.5
            parts: list[int] = attribute(default_factory=list)
            total: int = attribute(default=0, init=False)

            def __post_init__(self) -> None:
                self.total = len(self.parts)

        return make(Item)

    return declare(dataclass, field), declare(dataclasses.dataclass, dataclasses.field)


@pytest.mark.parametrize(
    ("values", "named"),
    [
        (("a",), {}),
        (("a", 1.0, [1, 2]), {}),
        ((), {"parts": [3], "name": "a"}),
        ((), {}),
        (("a", 1.0, [], 4), {}),
        (("a",), {"name": "b"}),
        (("a",), {"total": 3}),
        (("a",), {"other": 3}),
    ],
)
def test_the_first_objects_are_like_later_ones(values, named) -> None:
    ours, theirs = make_fresh()
    for _ in range(2 * UNCOMPILED):
        try:
            expected = vars(theirs(*values, **named))
        except TypeError as error:
            with pytest.raises(TypeError) as raised:
                ours(*values, **named)
            assert str(raised.value) == str(error)
        else:
            assert vars(ours(*values, **named)) == expected


def test_a_record_can_be_printed_by_pprint():
    # The text is wider than `width`: otherwise pprint does not treat the record as a dataclass.
    assert pprint.pformat(Place("a"), width=10) == repr(Place("a"))


def test_a_dataclass_may_extend_a_record_that_is_frozen_as_it_is():
    @dataclasses.dataclass(frozen=True)
    class Longer(Place):
        length: float = 1.0

    assert [item.name for item in dataclasses.fields(Longer)][-1] == "length"
    with pytest.raises(TypeError, match="cannot inherit non-frozen"):
        dataclasses.dataclass(type("Other", (Place,), {}))
    with pytest.raises(TypeError, match="cannot inherit frozen"):
        dataclasses.dataclass(frozen=True)(type("Other", (Changing,), {}))
