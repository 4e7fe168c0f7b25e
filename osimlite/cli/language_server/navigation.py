"""Outline and folding ranges of a document."""

from __future__ import annotations

from lsprotocol import types

from osimlite.cli.language_server.analysis import DocumentAnalysis
from osimlite.io.document.spans import find_markup
from osimlite.schema.base import Object
from osimlite.schema.specs import get_object_specs
from osimlite.schema.tree import is_a

_SYMBOLS = {
    "Model": types.SymbolKind.Module,
    "ModelComponentSet": types.SymbolKind.Namespace,
    "Joint": types.SymbolKind.Interface,
    "Coordinate": types.SymbolKind.Variable,
    "Force": types.SymbolKind.Function,
    "Frame": types.SymbolKind.Class,
    "Function": types.SymbolKind.Operator,
    "Constraint": types.SymbolKind.Key,
    "Point": types.SymbolKind.Constant,
}
"""Symbol kinds by base class, the first match counts; other classes are shown as fields."""


def list_symbols(analysis: DocumentAnalysis) -> list[types.DocumentSymbol]:
    """Return the objects of a document as a tree of symbols; empty while the text is malformed."""
    top = None if analysis.document is None else analysis.document.top
    return [] if top is None else _make_symbols(analysis, top)


def _make_symbols(analysis: DocumentAnalysis, item: Object) -> list[types.DocumentSymbol]:
    """Return the symbol of an object, or those of its parts if the object has no element."""
    inner: list[types.DocumentSymbol] = []
    if get_object_specs(type(item)):
        for _, held in item.list_owned_objects():
            inner += _make_symbols(analysis, held)
    if item._index is None:
        return inner
    span = analysis.find_span(item._index)
    name = analysis.find_name_range(item._index)
    start, end = name or (span.start + 1, span.start + 1 + len(span.tag))
    cls = type(item)
    kind = next(
        (kind for known, kind in _SYMBOLS.items() if is_a(item, known)), types.SymbolKind.Field
    )
    return [
        types.DocumentSymbol(
            item.name or cls.tag,
            kind,
            analysis.text.range(span.start, span.end),
            analysis.text.range(start, end),
            detail=cls.tag if item.name else None,
            children=inner,
        )
    ]


def list_folding_ranges(analysis: DocumentAnalysis) -> list[types.FoldingRange]:
    """Return the elements and comments that span several lines."""
    result, open_lines = [], []
    for piece in find_markup(analysis.markup):
        line = analysis.text.position(piece.start).line
        if piece.kind == "open":
            open_lines.append((piece.tag, line))
        elif piece.kind == "comment":
            last = analysis.text.position(piece.end).line
            if last > line:
                result.append(types.FoldingRange(line, last, kind=types.FoldingRangeKind.Comment))
        # A closing tag without an opening one is ignored; elements that are never closed do not fold.
        # A closing tag without an open element is ignored; elements inside that are not closed end here.
        elif piece.kind == "close" and any(tag == piece.tag for tag, _ in open_lines):
            tag, first = open_lines.pop()
            while tag != piece.tag:
                tag, first = open_lines.pop()
            if line > first:
                result.append(types.FoldingRange(first, line))
    return result
