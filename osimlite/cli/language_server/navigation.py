"""Ways through a file: outline and folding."""

from __future__ import annotations

from lsprotocol import types

from osimlite.cli.language_server.analysis import Analysis
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
"""What stands for a class and those derived from it in an outline; a field for all else."""


def outline(analysis: Analysis) -> list[types.DocumentSymbol]:
    """The objects of a document as a tree; empty while the text is broken."""
    top = None if analysis.document is None else analysis.document.top
    return [] if top is None else _symbols(analysis, top)


def _symbols(analysis: Analysis, item: Object) -> list[types.DocumentSymbol]:
    """The symbol of an object, or those of its parts if the text does not give it."""
    inner: list[types.DocumentSymbol] = []
    if get_object_specs(type(item)):
        for _, held in item.objects_held():
            inner += _symbols(analysis, held)
    if item._index is None:
        return inner
    span = analysis.span(item._index)
    name = analysis.name_of(item._index)
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


def folds(analysis: Analysis) -> list[types.FoldingRange]:
    """Elements and comments of more than one line."""
    result, open_lines = [], []
    for piece in find_markup(analysis.markup):
        line = analysis.text.position(piece.start).line
        if piece.kind == "open":
            open_lines.append((piece.tag, line))
        elif piece.kind == "comment":
            last = analysis.text.position(piece.end).line
            if last > line:
                result.append(types.FoldingRange(line, last, kind=types.FoldingRangeKind.Comment))
        elif piece.kind == "close" and any(tag == piece.tag for tag, _ in open_lines):
            tag, first = open_lines.pop()
            while tag != piece.tag:
                tag, first = open_lines.pop()
            if line > first:
                result.append(types.FoldingRange(first, line))
    return result
