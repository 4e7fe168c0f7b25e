"""Puts a few lines of a model into a small whole one, so that an example need not show what it is not about."""

from __future__ import annotations

import re
from pathlib import Path

from osimlite.document.source import Source
from osimlite.lint.rules.classes import set_for
from osimlite.schema.registry import class_for

SKELETON = Path(__file__).resolve().parents[2] / "fixtures" / "lint" / "skeleton.osim"


def document(fragment: str) -> str:
    """The skeleton with the elements of `fragment` in place.

    An element takes the place of the one with its tag and name, a set or value of the model that of its tag. A new
    member is put at the end of its set, all else at the end of the model.
    """
    text = SKELETON.read_text(encoding="utf-8")
    wrapped = Source(f"<_>{fragment}</_>".encode())
    tops = wrapped.children(0)
    if not tops or "<<<<" in fragment:
        return _at_the_end(text, fragment)
    spans = [wrapped.spans[number] for number in tops]
    if any(span.end == span.tag_end and not wrapped.text[: span.end].endswith("/>") for span in spans):
        # Not closed: take it as it stands.
        spans = [spans[0]._replace(end=len(wrapped.text) - 4)]
    for span in spans:
        end = span.end
        element = wrapped.text[span.start : end]
        name = re.search(r'\sname="([^"]*)"', wrapped.text[span.start : span.tag_end])
        text = _placed(text, span.tag, name[1] if name else None, element)
    return text


def _placed(text: str, tag: str, name: str | None, element: str) -> str:
    source = Source(text.encode())
    model = source.child(0, "Model")
    assert model is not None
    for child in source.children(model):
        if source.spans[child].tag == tag:
            return _replaced(text, source, child, element)
    holder = set_for(class_for(tag))
    if holder is None:
        return _at_the_end(text, element)
    number = source.child(model, holder)
    if number is None:
        return _at_the_end(text, f"<{holder}><objects>{element}</objects></{holder}>")
    members = source.child(number, "objects")
    assert members is not None
    for member in source.children(members):
        head = text[source.spans[member].start : source.spans[member].tag_end]
        if source.spans[member].tag == tag and name is not None and f'name="{name}"' in head:
            return _replaced(text, source, member, element)
    place = source.spans[members].inner_end
    return text[:place] + element + "\n" + text[place:]


def _replaced(text: str, source: Source, number: int, element: str) -> str:
    span = source.spans[number]
    return text[: span.start] + element + text[span.end :]


def _at_the_end(text: str, element: str) -> str:
    place = text.rindex("\n", 0, text.index("</Model>")) + 1
    return text[:place] + element + "\n" + text[place:]
