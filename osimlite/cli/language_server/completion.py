"""Completions: tags of classes and properties, names for references, and keywords."""

from __future__ import annotations

from collections.abc import Iterator

from lsprotocol import types

from osimlite.cli.language_server.analysis import DocumentAnalysis
from osimlite.cli.language_server.cursor import Cursor, Element, list_single_object_properties
from osimlite.cli.language_server.hover import is_list_property
from osimlite.cli.language_server.names import find_name_reference, list_names
from osimlite.io.document.lexical import make_formatter
from osimlite.lint.project_files import is_document
from osimlite.schema.descriptions import describe_class, describe_property, describe_value
from osimlite.schema.fields import ObjectField, Reference, Value
from osimlite.schema.registry import find_class, list_class_tags
from osimlite.schema.specs import FieldSpec, get_field_specs

_TOP_TAGS = (
    "AnalyzeTool", "CMCTool", "CMC_TaskSet", "ContactGeometrySet", "ControlSet", "ExternalLoads", "ForceSet",
    "ForwardTool", "IKTaskSet", "IMUInverseKinematicsTool", "IMUPlacer", "InverseDynamicsTool",
    "InverseKinematicsTool", "MarkerSet", "MeasurementSet", "MocoInverse", "MocoStudy", "MocoTrack", "RRATool",
    "ScaleSet", "ScaleTool",
)  # fmt: skip
"""Classes that may be at the top of documents other than models."""


def list_completions(
    analysis: DocumentAnalysis, last_readable: DocumentAnalysis | None, offset: int
) -> list[types.CompletionItem]:
    """Return the completions at an offset.

    Args:
        analysis: analysis of the present text, which is usually half-typed.
        last_readable: last version of the text that could be read, which provides the names; None if
            there was none.
        offset: character offset of the cursor.
    """
    cursor = analysis.cursor(offset)
    enclosing = cursor.inner
    if cursor.kind == "closing tag" and enclosing is not None:
        return [
            _make_item(
                analysis,
                cursor,
                enclosing.tag,
                f"{enclosing.tag}>",
                types.CompletionItemKind.Keyword,
            )
        ]
    if cursor.kind == "tag":
        return [*_complete_tags(analysis, cursor, enclosing, bracket="")]
    if cursor.kind == "attribute" and cursor.attribute == "name" and cursor.element is not None:
        reference = find_name_reference(cursor)
        if reference is not None:
            return [*_complete_names(analysis, last_readable, cursor, reference, cursor.element)]
    if cursor.kind != "text" or enclosing is None:
        return []
    if enclosing.cls is not None or (
        enclosing.spec is not None and is_list_property(enclosing.spec)
    ):
        return [*_complete_tags(analysis, cursor, enclosing, bracket="<")]
    if enclosing.spec is None:
        return []
    field_type = enclosing.spec.names or enclosing.spec.kind
    if isinstance(field_type, Value):
        values = ("true", "false") if field_type.scalar == "bool" else field_type.choices
        return [
            _make_item(analysis, cursor, str(value), str(value), types.CompletionItemKind.Value)
            for value in values
        ]
    if isinstance(field_type, Reference):
        return [
            *_complete_names(
                analysis,
                last_readable,
                cursor,
                field_type,
                cursor.enclosing[-2] if len(cursor.enclosing) > 1 else None,
            )
        ]
    return []


def _complete_names(
    analysis: DocumentAnalysis,
    last_readable: DocumentAnalysis | None,
    cursor: Cursor,
    reference: Reference,
    object_element: Element | None,
) -> Iterator[types.CompletionItem]:
    """Yield the names of the components, files or columns to which a reference may refer.

    Args:
        analysis: analysis of the present text, in which the completion is inserted.
        last_readable: last version of the text that could be read, which provides the names.
        cursor: position of the cursor in the text.
        reference: type of the reference, which determines its possible targets.
        object_element: element of the object that has the reference; None if it is not known.
    """
    # Half-typed text often cannot be read; without an earlier version no name is known.
    if last_readable is None:
        return
    for name in list_names(last_readable, cursor, reference, object_element):
        item = _make_item(
            analysis, cursor, name.text, name.text, types.CompletionItemKind.Reference, name.detail
        )
        # Editors sort by this text, so likely names come first.
        item.sort_text = f"{'0' if name.likely else '1'}{name.text}"
        yield item


def _complete_tags(
    analysis: DocumentAnalysis, cursor: Cursor, enclosing: Element | None, bracket: str
) -> Iterator[types.CompletionItem]:
    """Yield the tags that may be inside an element: properties of an object, objects of a property.

    Args:
        analysis: analysis of the present text.
        cursor: position of the cursor in the text.
        enclosing: element around the cursor; None outside all, where nothing is offered.
        bracket: "<" if the completion has to insert it, "" if it is typed already.
    """
    if enclosing is None:
        return
    if enclosing.cls is None:
        if enclosing.tag == "OpenSimDocument":
            # The object of the document: a model, or in setups one of the tools and sets.
            for tag in _TOP_TAGS if is_document(analysis.file) else ("Model",):
                yield _complete_object(analysis, cursor, tag, bracket, "")
        elif (
            enclosing.spec is not None
            and is_list_property(enclosing.spec)
            and enclosing.spec.accepts is not None
        ):
            # A property with a list of objects: all classes that derive from the accepted one.
            for tag in list_class_tags(enclosing.spec.accepts):
                yield _complete_object(analysis, cursor, tag, bracket, "")
        return
    # Properties that the object has already would be ignored by OpenSim.
    written_tags = _list_written_tags(analysis, enclosing)
    for spec in get_field_specs(enclosing.cls).values():
        # The object of a property without a tag of its own stands directly in the enclosing one.
        if spec in list_single_object_properties(enclosing.cls):
            assert spec.accepts is not None
            for tag in list_class_tags(spec.accepts):
                yield _complete_object(analysis, cursor, tag, bracket, spec.tag)
        elif spec.tag not in written_tags:
            yield _complete_property(analysis, cursor, spec, bracket)


def _list_written_tags(analysis: DocumentAnalysis, enclosing: Element) -> set[str]:
    """Return the tags of properties that the text already gives to an object."""
    enclosing_object = analysis.objects.get(enclosing.number) if analysis.is_readable else None
    if enclosing_object is None:
        return set()
    return {
        spec.tag
        for spec in get_field_specs(type(enclosing_object)).values()
        if spec.name in enclosing_object.model_fields_set
    }


def _complete_property(
    analysis: DocumentAnalysis, cursor: Cursor, spec: FieldSpec, bracket: str
) -> types.CompletionItem:
    """Return the completion for the element of a property, with its default as a placeholder."""
    if isinstance(spec.kind, ObjectField):
        # An unnamed property takes objects of several classes, which a name tells apart.
        content = ' name="$1">\n\t$0\n' if spec.kind.form == "unnamed" else ">\n\t$0\n"
        text = f"{bracket}{spec.tag}{content}</{spec.tag}>"
    else:
        default = ""
        if isinstance(spec.kind, Value) and spec.default is not None:
            default = make_formatter(spec.kind, "shortest")(spec.default)
        values = (
            ("true", "false") if isinstance(spec.kind, Value) and spec.kind.scalar == "bool" else ()
        )
        # `${1|a,b|}` is the choice of a snippet, `${1:text}` a placeholder.
        placeholder = (
            f"${{1|{','.join(values)}|}}" if values else f"${{1:{_escape_snippet(default)}}}"
        )
        text = f"{bracket}{spec.tag}>{placeholder}</{spec.tag}>"
    item = _make_item(
        analysis, cursor, spec.tag, text, types.CompletionItemKind.Property, describe_value(spec)
    )
    item.documentation = describe_property(spec) or None
    item.insert_text_format = types.InsertTextFormat.Snippet
    return item


def _complete_object(
    analysis: DocumentAnalysis, cursor: Cursor, tag: str, bracket: str, name: str
) -> types.CompletionItem:
    """Return the completion for the element of an object; an empty name becomes a placeholder."""
    name_attribute = f'name="{name}"' if name else 'name="$1"'
    text = f"{bracket}{tag} {name_attribute}>\n\t$0\n</{tag}>"
    item = _make_item(analysis, cursor, tag, text, types.CompletionItemKind.Class, name)
    cls = find_class(tag)
    item.documentation = describe_class(cls) if cls is not None else None
    item.insert_text_format = types.InsertTextFormat.Snippet
    return item


def _make_item(
    analysis: DocumentAnalysis,
    cursor: Cursor,
    label: str,
    text: str,
    kind: types.CompletionItemKind,
    detail: str = "",
) -> types.CompletionItem:
    """Return a completion that replaces the word at the cursor by a text."""
    edit_range = analysis.text.range(cursor.start, cursor.end)
    # Editors match the typed text against `filter_text`, which therefore has the opening bracket if
    # the inserted text has one.
    return types.CompletionItem(
        label,
        kind=kind,
        detail=detail or None,
        text_edit=types.TextEdit(edit_range, text),
        filter_text=f"<{label}" if text.startswith("<") else label,
    )


def _escape_snippet(text: str) -> str:
    """Return a text whose characters with a meaning in snippets are escaped."""
    return text.replace("\\", "\\\\").replace("$", "\\$").replace("}", "\\}")
