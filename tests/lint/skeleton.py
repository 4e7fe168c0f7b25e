"""Insert a few lines of a model into a small complete model, so that examples show only what they are about."""

from __future__ import annotations

import re
from pathlib import Path

from osimlite.io.document.source import Source
from osimlite.lint.rules.classes import find_set
from osimlite.schema.registry import find_class

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures" / "lint"
SKELETON, LIMB = FIXTURES / "skeleton.osim", FIXTURES / "limb.osim"
"""Models of a leg; LIMB also has a foot, wrap objects, paths and muscles."""


def document(fragment: str) -> str:
    """Return the small model with the elements of `fragment` inserted.

    An element replaces the first one with its tag and, if it has one, its name. An element that
    only LIMB has keeps the properties that `fragment` does not state. A new member is added at the
    end of its set, anything else at the end of the model.
    """
    text = SKELETON.read_text(encoding="utf-8")
    wrapped = Source(f"<_>{fragment}</_>".encode())
    tops = wrapped.children(0)
    if not tops or "<<<<" in fragment:
        return _at_the_end(text, fragment)
    spans = [wrapped.spans[number] for number in tops]
    if any(
        span.end == span.tag_end and not wrapped.text[: span.end].endswith("/>") for span in spans
    ):
        # Insert an element without end tag as it is.
        return _placed(text, wrapped, tops[0], len(wrapped.text) - 4)
    limb = LIMB.read_text(encoding="utf-8")
    of_limb = [
        top
        for top in tops
        if _found(text, wrapped, top) is None and _found(limb, wrapped, top) is not None
    ]
    text = limb if of_limb else text
    for top in tops:
        if top in of_limb:
            for child in wrapped.children(top):
                text = _within(text, wrapped, top, child)
        else:
            text = _placed(text, wrapped, top, wrapped.spans[top].end)
    return text


def _found(text: str, wrapped: Source, number: int) -> int | None:
    """Return the number of the element of a text with the tag and name of another element, or None."""
    span = wrapped.spans[number]
    name = re.search(r'\sname="[^"]*"', wrapped.text[span.start : span.tag_end])
    for result, other in enumerate(Source(text.encode()).spans):
        if other.tag == span.tag and (name is None or name[0] in text[other.start : other.tag_end]):
            return result
    return None


def _placed(text: str, wrapped: Source, number: int, end: int) -> str:
    tag, element = wrapped.spans[number].tag, wrapped.text[wrapped.spans[number].start : end]
    source = Source(text.encode())
    result = _found(text, wrapped, number)
    if result is not None:
        return text[: source.spans[result].start] + element + text[source.spans[result].end :]
    holder = find_set(find_class(tag))
    if holder is None:
        return _at_the_end(text, element)
    model = source.child(0, "Model")
    assert model is not None
    held = source.child(model, holder)
    members = None if held is None else source.child(held, "objects")
    if members is None:
        return _at_the_end(text, f"<{holder}><objects>{element}</objects></{holder}>")
    place = source.spans[members].inner_end
    return text[:place] + element + "\n" + text[place:]


def _within(text: str, wrapped: Source, number: int, child: int) -> str:
    """Insert a child into the corresponding element of a text, in place of a child with the same tag."""
    source, span = Source(text.encode()), wrapped.spans[child]
    result = _found(text, wrapped, number)
    assert result is not None
    before = source.child(result, span.tag)
    start = end = source.spans[result].inner_end
    if before is not None:
        start, end = source.spans[before].start, source.spans[before].end
    return text[:start] + wrapped.text[span.start : span.end] + text[end:]


def _at_the_end(text: str, element: str) -> str:
    place = text.rindex("\n", 0, text.index("</Model>")) + 1
    return text[:place] + element + "\n" + text[place:]
