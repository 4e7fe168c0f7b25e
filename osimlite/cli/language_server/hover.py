"""Hover texts: what an editor shows about the word under the pointer."""

from __future__ import annotations

import os

from lsprotocol import types

from osimlite.base.files import get_relative_path
from osimlite.cli.language_server.analysis import DocumentAnalysis
from osimlite.cli.language_server.cursor import Element
from osimlite.cli.language_server.names import find_marker_labels
from osimlite.io.document.lexical import make_formatter
from osimlite.lint.setup import Setup
from osimlite.schema.base import Object
from osimlite.schema.descriptions import describe_class, describe_property, describe_value
from osimlite.schema.fields import ObjectField, Value
from osimlite.schema.specs import FieldSpec
from osimlite.schema.tree import is_a


def describe_cursor(analysis: DocumentAnalysis, offset: int) -> types.Hover | None:
    """Describe the class, the property, or the target of the reference at an offset.

    Args:
        analysis: analysis of the open file.
        offset: character offset in the text of the file.

    Returns:
        Description to show at the cursor; None if there is nothing to describe.
    """
    cursor = analysis.cursor(offset)
    element = cursor.subject
    if cursor.kind == "comment" or element is None:
        return None
    paragraphs = []
    if cursor.kind == "text" or cursor.attribute == "name":
        paragraphs.append(_describe_target(analysis, offset))
    if element.cls is not None:
        paragraphs.append(_describe_class(element.cls))
        if cursor.kind in ("tag", "closing tag"):
            paragraphs.insert(0, _find_path(analysis, element))
    elif element.spec is not None:
        enclosing = (
            cursor.enclosing[-2:]
            if cursor.kind in ("text", "closing tag")
            else cursor.enclosing[-1:]
        )
        paragraphs.append(_describe_property(element.spec, enclosing[0].cls if enclosing else None))
    text = "\n\n".join(paragraph for paragraph in paragraphs if paragraph)
    if not text:
        return None
    content = types.MarkupContent(types.MarkupKind.Markdown, text)
    return types.Hover(
        content, analysis.text.range(cursor.start, max(cursor.end, cursor.start + 1))
    )


def _describe_class(cls: type[Object]) -> str:
    return f"**{cls.tag}**\n\n{describe_class(cls)}"


def _describe_property(spec: FieldSpec, owner: type[Object] | None) -> str:
    heading = f"**{spec.tag}**: {describe_value(spec)}"
    owner_text = "" if owner is None else f"Property of {owner.tag}."
    return "\n\n".join(
        paragraph
        for paragraph in (
            f"{heading}{_describe_default(spec)}",
            describe_property(spec),
            owner_text,
        )
        if paragraph
    )


def _describe_default(spec: FieldSpec) -> str:
    if not isinstance(spec.kind, Value) or spec.default in (None, "", ()):
        return ""
    return f"; by default `{make_formatter(spec.kind, 'shortest')(spec.default)}`"


def _describe_target(analysis: DocumentAnalysis, offset: int) -> str:
    target = analysis.find_target(offset)
    if target is None:
        return ""
    file = get_relative_path(target.file, os.path.dirname(analysis.file) or ".")
    if target.item is None:
        return (
            f"In `{file}`, line {target.at.line}." if target.at is not None else f"File `{file}`."
        )
    description = f"{type(target.item).tag} `{target.path or target.item.name}`"
    if target.file == analysis.file:
        return description
    data = (
        find_marker_labels(analysis.document)
        if isinstance(analysis.document, Setup) and is_a(target.item, "Marker")
        else None
    )
    data_note = (
        f"; {'in' if target.item.name in data[1] else '**not** in'} `{data[0]}`"
        if data is not None
        else ""
    )
    return f"{description} of `{file}`{data_note}"


def _find_path(analysis: DocumentAnalysis, element: Element) -> str:
    """Return the path of the component of an element, as markup; empty if the text is malformed."""
    if analysis.tree is None:
        return ""
    component = analysis.objects.get(element.number)
    path = None if component is None else analysis.tree.path_of(component)
    return f"`{path}`" if path else ""


def is_list_property(spec: FieldSpec) -> bool:
    """Return whether a property is an element that encloses objects."""
    return isinstance(spec.kind, ObjectField) and spec.kind.form in ("list", "optional")
