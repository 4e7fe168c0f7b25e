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


def _make_symbols(analysis: DocumentAnalysis, owner: Object) -> list[types.DocumentSymbol]:
    """Return the symbol of an object, or those of its parts if the object has no element."""
    children: list[types.DocumentSymbol] = []
    if get_object_specs(type(owner)):
        for _, member in owner.list_owned_objects():
            children += _make_symbols(analysis, member)
    if owner._index is None:
        return children
    element_span = analysis.find_span(owner._index)
    name = analysis.find_name_range(owner._index)
    start, end = name or (element_span.start + 1, element_span.start + 1 + len(element_span.tag))
    cls = type(owner)
    symbol_kind = next(
        (
            symbol_kind
            for symbol_class, symbol_kind in _SYMBOLS.items()
            if is_a(owner, symbol_class)
        ),
        types.SymbolKind.Field,
    )
    return [
        types.DocumentSymbol(
            owner.name or cls.tag,
            symbol_kind,
            analysis.text.range(element_span.start, element_span.end),
            analysis.text.range(start, end),
            detail=cls.tag if owner.name else None,
            children=children,
        )
    ]


def list_folding_ranges(analysis: DocumentAnalysis) -> list[types.FoldingRange]:
    """Return the elements and comments that span several lines."""
    result, open_lines = [], []
    for markup in find_markup(analysis.markup):
        line = analysis.text.position(markup.start).line
        if markup.kind == "open":
            open_lines.append((markup.tag, line))
        elif markup.kind == "comment":
            last = analysis.text.position(markup.end).line
            if last > line:
                result.append(types.FoldingRange(line, last, kind=types.FoldingRangeKind.Comment))
        # A closing tag without an element is ignored; elements without a closing tag do not fold.
        elif markup.kind == "close" and any(tag == markup.tag for tag, _ in open_lines):
            tag, first = open_lines.pop()
            while tag != markup.tag:
                tag, first = open_lines.pop()
            if line > first:
                result.append(types.FoldingRange(first, line))
    return result
