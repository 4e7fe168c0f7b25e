"""What stands at a place of a text: found from the tags before it, so that it can be told of a text that is broken.

A half-typed file is no XML, and what is before the cursor is nearly always right.
"""

from __future__ import annotations

import re
from typing import Literal, NamedTuple

from osimlite.io.document.spans import Markup, find_markup
from osimlite.schema.base import Object
from osimlite.schema.fields import Held
from osimlite.schema.registry import find_class
from osimlite.schema.specs import FieldSpec, get_field_specs

Kind = Literal["tag", "closing tag", "attribute", "text", "comment"]

_TAG_NAME = re.compile(r"[^\s/<>!?\"'&=]*")
_NAME_GIVEN = re.compile(r"\sname\s*=\s*([\"'])(.*?)\1", re.DOTALL)
_ATTRIBUTE_VALUE = re.compile(r"([^\s=\"'<>/]+)\s*=\s*([\"'])([^\"'<]*)$")
_SPECIAL = re.compile(r"<[!?]")
_WORD = re.compile(r"[^\s<>]*")


class Element(NamedTuple):
    """An element around a place."""

    tag: str  # its name
    start: int  # offset of its `<`
    number: int  # in document order, as the reader counts
    given: str  # its attribute `name`
    # the class of the object it is; None for a property, and for what is not known
    cls: type[Object] | None
    spec: FieldSpec | None  # the property it is, or that holds it; None for what is not known


class Cursor(NamedTuple):
    """What stands at a place."""

    kind: Kind  # of what
    # the elements around it, outermost first; for a tag, the element itself is not among them
    around: tuple[Element, ...]
    # offset of the beginning of the word there: a tag, an attribute's value, a word of a text
    start: int
    end: int  # and behind its end
    word: str  # that word; of a tag only its name
    attribute: str = ""  # the name of the attribute whose value it is
    element: Element | None = None  # for a tag and an attribute, the element they belong to

    @property
    def inner(self) -> Element | None:
        """The innermost element around."""
        return self.around[-1] if self.around else None

    @property
    def subject(self) -> Element | None:
        """The element that is spoken of: that of a tag, else the innermost around."""
        return self.element or self.inner


def cursor_at(text: str, offset: int) -> Cursor:
    """What stands at an offset of a text."""
    stack: list[Element] = []
    count = behind = 0
    for piece in find_markup(text[:offset]):
        behind = piece.end
        if piece.kind == "open":
            stack.append(_element(text, piece.tag, piece.start, piece.end, count, stack))
        elif piece.kind == "close":
            _close(stack, piece)
        count += piece.kind in ("open", "empty")
    around = tuple(stack)
    special = _SPECIAL.search(text, behind, offset)
    if special is not None:
        # What begins so and has ended is behind already.
        return Cursor("comment", around, special.start(), offset, "")
    start = text.rfind("<", behind, offset)
    if start < 0:
        return _in_text(text, offset, behind, around)
    if text.startswith("</", start):
        name = _TAG_NAME.match(text, start + 2)
        assert name is not None
        return Cursor(
            "closing tag",
            around,
            start + 2,
            name.end(),
            name[0],
            element=around[-1] if around else None,
        )
    name = _TAG_NAME.match(text, start + 1)
    assert name is not None
    end = _end_of_tag(text, start)
    element = _element(text, name[0], start, end, count, stack)
    if offset <= name.end():
        return Cursor("tag", around, start + 1, name.end(), name[0], element=element)
    value = _ATTRIBUTE_VALUE.search(text, start, offset)
    if value is None:
        return Cursor("attribute", around, offset, offset, "", element=element)
    rest = re.compile(r"[^\"'<>]*").match(text, offset)
    assert rest is not None
    begin = value.start(3)
    return Cursor(
        "attribute", around, begin, rest.end(), text[begin : rest.end()], value[1], element
    )


def _in_text(text: str, offset: int, behind: int, around: tuple[Element, ...]) -> Cursor:
    start = offset
    while start > behind and not text[start - 1].isspace():
        start -= 1
    word = _WORD.match(text, start)
    assert word is not None
    return Cursor("text", around, start, word.end(), word[0])


def _end_of_tag(text: str, start: int) -> int:
    """Behind a tag, or where the next markup begins if it has no end."""
    result = re.compile(r"[<>]").search(text, start + 1)
    return len(text) if result is None else result.end() if result[0] == ">" else result.start()


def _close(stack: list[Element], piece: Markup) -> None:
    """Leave the element; a closing tag of something that is not open closes nothing."""
    for depth in range(len(stack) - 1, -1, -1):
        if stack[depth].tag == piece.tag:
            del stack[depth:]
            return


def _element(
    text: str, tag: str, start: int, end: int, number: int, stack: list[Element]
) -> Element:
    given = _NAME_GIVEN.search(text, start, end)
    name = given[2] if given else ""
    cls, spec = _meaning(stack[-1] if stack else None, tag, name)
    return Element(tag, start, number, name, cls, spec)


def _meaning(
    around: Element | None, tag: str, name: str
) -> tuple[type[Object] | None, FieldSpec | None]:
    """The class of the object that an element `tag` is, and the property that it is or that holds it."""
    if around is None or (around.tag == "OpenSimDocument" and around.cls is None):
        return find_class(tag), None
    if around.cls is None:
        # A property that holds objects, or what is not known.
        return find_class(tag), around.spec
    spec = get_field_specs(around.cls).get(tag)
    if spec is None:
        result = find_class(tag)
        return result, None if result is None else _holder(around.cls, result, name)
    if isinstance(spec.kind, Held) and spec.kind.form == "unnamed":
        return spec.accepts, spec
    return None, spec


def _holder(owner: type[Object], held: type[Object], name: str) -> FieldSpec | None:
    """The property that holds one object of a class directly: the tag is the class, the name the property."""
    fitting = [
        spec
        for spec in single_objects(owner)
        if spec.accepts is not None and issubclass(held, spec.accepts)
    ]
    return next((spec for spec in fitting if spec.tag == name), fitting[0] if fitting else None)


def single_objects(owner: type[Object]) -> list[FieldSpec]:
    """The properties that hold one object each without a tag of their own."""
    specs = get_field_specs(owner).values()
    return [spec for spec in specs if isinstance(spec.kind, Held) and spec.kind.form == "single"]
