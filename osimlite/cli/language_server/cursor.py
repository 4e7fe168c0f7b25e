"""Kind of text at the cursor, derived from the tags before it.

A half-typed file is not valid XML, but the text before the cursor usually is.
"""

from __future__ import annotations

import re
from typing import Literal

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later
from osimlite.io.document.spans import Markup, find_markup
from osimlite.schema.base import Object
from osimlite.schema.fields import ObjectField
from osimlite.schema.registry import find_class
from osimlite.schema.specs import FieldSpec, get_field_specs

TextType = Literal["tag", "closing tag", "attribute", "text", "comment"]

_TAG_NAME = compile_later(r"[^\s/<>!?\"'&=]*")
_NAME_ATTRIBUTE = compile_later(r"\sname\s*=\s*([\"'])(.*?)\1", re.DOTALL)
_ATTRIBUTE_VALUE = compile_later(r"([^\s=\"'<>/]+)\s*=\s*([\"'])([^\"'<]*)$")
_SPECIAL = compile_later(r"<[!?]")
_WORD = compile_later(r"[^\s<>]*")


class Element(NamedTuple):
    """Element that encloses the cursor."""

    tag: str
    start: int  # offset of `<`
    number: int  # index in document order, as the reader counts
    name: str  # attribute `name`
    # class of the object; None for a property or an unknown tag
    cls: type[Object] | None
    spec: FieldSpec | None  # property of the element or of its object; None if unknown


class Cursor(NamedTuple):
    """Kind of text at an offset, the word there, and the enclosing elements."""

    kind: TextType
    # enclosing elements, outermost first; without the element itself if the cursor is in its tag
    enclosing: tuple[Element, ...]
    # offset of the start of the word: a tag, an attribute value or a word of text
    start: int
    end: int  # offset after the word
    word: str  # word at the offset; of a tag only its name
    attribute: str = ""  # name of the attribute whose value is at the cursor
    element: Element | None = None  # element of the tag or attribute at the cursor

    @property
    def inner(self) -> Element | None:
        """Innermost enclosing element."""
        return self.enclosing[-1] if self.enclosing else None

    @property
    def subject(self) -> Element | None:
        """Element of the tag at the cursor, otherwise the innermost enclosing element."""
        return self.element or self.inner


def find_cursor(text: str, offset: int) -> Cursor:
    """Return the kind of text, the word and the elements at an offset.

    Args:
        text: complete text of the document.
        offset: character offset of the cursor.
    """
    stack: list[Element] = []
    count = markup_end = 0
    for markup in find_markup(text[:offset]):
        markup_end = markup.end
        if markup.kind == "open":
            stack.append(_make_element(text, markup.tag, markup.start, markup.end, count, stack))
        elif markup.kind == "close":
            _close_element(stack, markup)
        count += markup.kind in ("open", "empty")
    enclosing = tuple(stack)
    comment = _SPECIAL.search(text, markup_end, offset)
    if comment is not None:
        # Comments that are closed before the cursor are part of the markup that was scanned above.
        return Cursor("comment", enclosing, comment.start(), offset, "")
    start = text.rfind("<", markup_end, offset)
    if start < 0:
        return _find_word(text, offset, markup_end, enclosing)
    if text.startswith("</", start):
        name = _TAG_NAME.match(text, start + 2)
        assert name is not None
        return Cursor(
            "closing tag",
            enclosing,
            start + 2,
            name.end(),
            name[0],
            element=enclosing[-1] if enclosing else None,
        )
    name = _TAG_NAME.match(text, start + 1)
    assert name is not None
    end = _find_tag_end(text, start)
    element = _make_element(text, name[0], start, end, count, stack)
    if offset <= name.end():
        return Cursor("tag", enclosing, start + 1, name.end(), name[0], element=element)
    value = _ATTRIBUTE_VALUE.search(text, start, offset)
    if value is None:
        return Cursor("attribute", enclosing, offset, offset, "", element=element)
    value_end = re.compile(r"[^\"'<>]*").match(text, offset)
    assert value_end is not None
    value_start = value.start(3)
    return Cursor(
        "attribute",
        enclosing,
        value_start,
        value_end.end(),
        text[value_start : value_end.end()],
        value[1],
        element,
    )


def _find_word(text: str, offset: int, markup_end: int, enclosing: tuple[Element, ...]) -> Cursor:
    start = offset
    while start > markup_end and not text[start - 1].isspace():
        start -= 1
    word = _WORD.match(text, start)
    assert word is not None
    return Cursor("text", enclosing, start, word.end(), word[0])


def _find_tag_end(text: str, start: int) -> int:
    """Return the offset after a tag; of an unclosed tag, that of the next markup."""
    result = re.compile(r"[<>]").search(text, start + 1)
    return len(text) if result is None else result.end() if result[0] == ">" else result.start()


def _close_element(stack: list[Element], markup: Markup) -> None:
    """Close the innermost open element of a tag; ignore a closing tag without one."""
    for depth in range(len(stack) - 1, -1, -1):
        if stack[depth].tag == markup.tag:
            del stack[depth:]
            return


def _make_element(
    text: str, tag: str, start: int, end: int, number: int, stack: list[Element]
) -> Element:
    name_match = _NAME_ATTRIBUTE.search(text, start, end)
    name = name_match[2] if name_match else ""
    cls, spec = _identify_element(stack[-1] if stack else None, tag, name)
    return Element(tag, start, number, name, cls, spec)


def _identify_element(
    enclosing: Element | None, tag: str, name: str
) -> tuple[type[Object] | None, FieldSpec | None]:
    """Identify the class and the property of an element.

    Args:
        enclosing: enclosing element; None at the top.
        tag: tag of the element.
        name: value of the attribute `name`; "" without it.

    Returns:
        Class of the object, and the property that it is or that holds it; None where unknown.
    """
    if enclosing is None or (enclosing.tag == "OpenSimDocument" and enclosing.cls is None):
        return find_class(tag), None
    if enclosing.cls is None:
        # The enclosing element is a property that holds objects, or an unknown tag.
        return find_class(tag), enclosing.spec
    spec = get_field_specs(enclosing.cls).get(tag)
    if spec is None:
        result = find_class(tag)
        return result, None if result is None else _find_holding_property(
            enclosing.cls, result, name
        )
    if isinstance(spec.kind, ObjectField) and spec.kind.form == "unnamed":
        return spec.accepts, spec
    return None, spec


def _find_holding_property(
    owner: type[Object], member_class: type[Object], name: str
) -> FieldSpec | None:
    """Return the property of `owner` that holds one object of a class directly.

    The tag of such an element is the class; its attribute `name` is the property.
    """
    fitting = [
        spec
        for spec in list_single_object_properties(owner)
        if spec.accepts is not None and issubclass(member_class, spec.accepts)
    ]
    return next((spec for spec in fitting if spec.tag == name), fitting[0] if fitting else None)


def list_single_object_properties(owner: type[Object]) -> list[FieldSpec]:
    """Return the properties that hold one object each without a tag of their own."""
    specs = get_field_specs(owner).values()
    return [
        spec for spec in specs if isinstance(spec.kind, ObjectField) and spec.kind.form == "single"
    ]
