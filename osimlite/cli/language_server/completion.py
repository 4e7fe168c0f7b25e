"""What may be written at a place: tags of classes and properties, the names a reference may take, words."""

from __future__ import annotations

from collections.abc import Iterator

from lsprotocol import types

from osimlite.cli.language_server.analysis import Analysis
from osimlite.cli.language_server.cursor import Cursor, Element, single_objects
from osimlite.cli.language_server.hover import is_list
from osimlite.cli.language_server.names import names, reference_of
from osimlite.io.document.lexical import make_formatter
from osimlite.lint.project_files import is_document
from osimlite.schema.descriptions import describe_class, describe_property, describe_value
from osimlite.schema.fields import Held, Reference, Value
from osimlite.schema.registry import find_class, list_class_tags
from osimlite.schema.specs import FieldSpec, get_field_specs

_TOPS = (
    "AnalyzeTool", "CMCTool", "CMC_TaskSet", "ContactGeometrySet", "ControlSet", "ExternalLoads", "ForceSet",
    "ForwardTool", "IKTaskSet", "IMUInverseKinematicsTool", "IMUPlacer", "InverseDynamicsTool",
    "InverseKinematicsTool", "MarkerSet", "MeasurementSet", "MocoInverse", "MocoStudy", "MocoTrack", "RRATool",
    "ScaleSet", "ScaleTool",
)  # fmt: skip
"""What may be at the top of documents other than models."""


def completions(
    analysis: Analysis, known: Analysis | None, offset: int
) -> list[types.CompletionItem]:
    """What may stand at an offset.

    Args:
        analysis: of the text as it is, half-typed.
        known: of the last version that could be read: what names there are.
        offset: of the cursor.
    """
    cursor = analysis.cursor(offset)
    around = cursor.inner
    if cursor.kind == "closing tag" and around is not None:
        return [
            _item(analysis, cursor, around.tag, f"{around.tag}>", types.CompletionItemKind.Keyword)
        ]
    if cursor.kind == "tag":
        return [*_tags(analysis, cursor, around, bracket="")]
    if cursor.kind == "attribute" and cursor.attribute == "name" and cursor.element is not None:
        reference = reference_of(cursor)
        if reference is not None:
            return [*_names(analysis, known, cursor, reference, cursor.element)]
    if cursor.kind != "text" or around is None:
        return []
    if around.cls is not None or (around.spec is not None and is_list(around.spec)):
        return [*_tags(analysis, cursor, around, bracket="<")]
    if around.spec is None:
        return []
    kind = around.spec.names or around.spec.kind
    if isinstance(kind, Value):
        words = ("true", "false") if kind.scalar == "bool" else kind.choices
        return [
            _item(analysis, cursor, str(word), str(word), types.CompletionItemKind.Value)
            for word in words
        ]
    if isinstance(kind, Reference):
        return [
            *_names(
                analysis, known, cursor, kind, cursor.around[-2] if len(cursor.around) > 1 else None
            )
        ]
    return []


def _names(
    analysis: Analysis,
    known: Analysis | None,
    cursor: Cursor,
    reference: Reference,
    holder: Element | None,
) -> Iterator[types.CompletionItem]:
    """The texts that a reference may take."""
    for name in names(known, cursor, reference, holder) if known is not None else ():
        item = _item(
            analysis, cursor, name.text, name.text, types.CompletionItemKind.Reference, name.detail
        )
        # Editors sort by it.
        item.sort_text = f"{'0' if name.likely else '1'}{name.text}"
        yield item


def _tags(
    analysis: Analysis, cursor: Cursor, around: Element | None, bracket: str
) -> Iterator[types.CompletionItem]:
    """The elements that may stand inside the one around."""
    if around is None:
        return
    if around.cls is None:
        if around.tag == "OpenSimDocument":
            for tag in _TOPS if is_document(analysis.file) else ("Model",):
                yield _object(analysis, cursor, tag, bracket, "")
        elif around.spec is not None and is_list(around.spec) and around.spec.accepts is not None:
            for tag in list_class_tags(around.spec.accepts):
                yield _object(analysis, cursor, tag, bracket, "")
        return
    given = _list_written_tags(analysis, around)
    for spec in get_field_specs(around.cls).values():
        if spec in single_objects(around.cls):
            assert spec.accepts is not None
            for tag in list_class_tags(spec.accepts):
                yield _object(analysis, cursor, tag, bracket, spec.tag)
        elif spec.tag not in given:
            yield _property(analysis, cursor, spec, bracket)


def _list_written_tags(analysis: Analysis, around: Element) -> set[str]:
    """The tags of the properties that an object has in the text."""
    item = analysis.objects.get(around.number) if analysis.is_certain else None
    if item is None:
        return set()
    return {
        spec.tag
        for spec in get_field_specs(type(item)).values()
        if spec.name in item.model_fields_set
    }


def _property(
    analysis: Analysis, cursor: Cursor, spec: FieldSpec, bracket: str
) -> types.CompletionItem:
    if isinstance(spec.kind, Held):
        inner = ' name="$1">\n\t$0\n' if spec.kind.form == "unnamed" else ">\n\t$0\n"
        text = f"{bracket}{spec.tag}{inner}</{spec.tag}>"
    else:
        default = ""
        if isinstance(spec.kind, Value) and spec.default is not None:
            default = make_formatter(spec.kind, "shortest")(spec.default)
        choices = (
            ("true", "false") if isinstance(spec.kind, Value) and spec.kind.scalar == "bool" else ()
        )
        place = f"${{1|{','.join(choices)}|}}" if choices else f"${{1:{_escape(default)}}}"
        text = f"{bracket}{spec.tag}>{place}</{spec.tag}>"
    item = _item(
        analysis, cursor, spec.tag, text, types.CompletionItemKind.Property, describe_value(spec)
    )
    item.documentation = describe_property(spec) or None
    item.insert_text_format = types.InsertTextFormat.Snippet
    return item


def _object(
    analysis: Analysis, cursor: Cursor, tag: str, bracket: str, name: str
) -> types.CompletionItem:
    named = f'name="{name}"' if name else 'name="$1"'
    text = f"{bracket}{tag} {named}>\n\t$0\n</{tag}>"
    item = _item(analysis, cursor, tag, text, types.CompletionItemKind.Class, name)
    cls = find_class(tag)
    item.documentation = describe_class(cls) if cls is not None else None
    item.insert_text_format = types.InsertTextFormat.Snippet
    return item


def _item(
    analysis: Analysis,
    cursor: Cursor,
    label: str,
    text: str,
    kind: types.CompletionItemKind,
    detail: str = "",
) -> types.CompletionItem:
    place = analysis.text.range(cursor.start, cursor.end)
    # Editors look for what was typed in the text that is to be filtered by; that has the bracket
    # where one is put in.
    return types.CompletionItem(
        label,
        kind=kind,
        detail=detail or None,
        text_edit=types.TextEdit(place, text),
        filter_text=f"<{label}" if text.startswith("<") else label,
    )


def _escape(text: str) -> str:
    return text.replace("\\", "\\\\").replace("$", "\\$").replace("}", "\\}")
