"""Ways through a file: outline, folding, renaming with all references."""

from __future__ import annotations

from lsprotocol import types

from osimlite.document.spans import markup
from osimlite.errors import ModelError
from osimlite.lsp.analysis import Analysis
from osimlite.schema.base import Component, Object
from osimlite.schema.editing import rename
from osimlite.schema.specs import object_specs
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
    """The objects of a model as a tree; empty while the text is broken."""
    model = analysis.subject.model
    if model is None or not analysis.is_certain:
        return []
    return _symbols(analysis, model)


def _symbols(analysis: Analysis, item: Object) -> list[types.DocumentSymbol]:
    """The symbol of an object, or those of its parts if the text does not give it."""
    inner: list[types.DocumentSymbol] = []
    if object_specs(type(item)):
        for _, held in item.objects_held():
            inner += _symbols(analysis, held)
    if item._index is None:
        return inner
    span = analysis.span(item._index)
    name = analysis.name_of(item._index)
    start, end = name or (span.start + 1, span.start + 1 + len(span.tag))
    cls = type(item)
    kind = next((kind for known, kind in _SYMBOLS.items() if is_a(item, known)), types.SymbolKind.Field)
    return [
        types.DocumentSymbol(
            item.name or cls.tag, kind, analysis.text.range(span.start, span.end), analysis.text.range(start, end),
            detail=cls.tag if item.name else None, children=inner,
        )
    ]  # fmt: skip


def folds(analysis: Analysis) -> list[types.FoldingRange]:
    """Elements and comments of more than one line."""
    found, open_lines = [], []
    for piece in markup(analysis.text.content):
        line = analysis.text.position(piece.start).line
        if piece.kind == "open":
            open_lines.append((piece.tag, line))
        elif piece.kind == "comment":
            last = analysis.text.position(piece.end).line
            if last > line:
                found.append(types.FoldingRange(line, last, kind=types.FoldingRangeKind.Comment))
        elif piece.kind == "close" and any(tag == piece.tag for tag, _ in open_lines):
            tag, first = open_lines.pop()
            while tag != piece.tag:
                tag, first = open_lines.pop()
            if line > first:
                found.append(types.FoldingRange(first, line))
    return found


def renaming(analysis: Analysis, component: Component, name: str) -> list[types.TextEdit]:
    """The changes of the text that give a component another name, everywhere.

    Raises:
        ModelError: the name is illegal or taken, or the text gives the component no name.
    """
    place = None if component._index is None else analysis.name_of(component._index)
    if place is None or component._index is None:
        raise ModelError(f"the text does not give '{component.name}' a name; nothing can be renamed")
    # Renaming changes a model, so it is done to another one of the same text.
    twin = Analysis(analysis.text, analysis.file)
    target, model = twin.objects[component._index], twin.subject.model
    assert isinstance(target, Component) and model is not None
    uses = twin.places
    rename(model, target, name)
    edits = [types.TextEdit(analysis.text.range(*place), name)]
    for use, start, end in uses:
        value = getattr(use.holder, use.spec.name)
        text = value if use.position is None else value[use.position]
        if text != use.value and (start, end) != place:
            edits.append(types.TextEdit(analysis.text.range(start, end), str(text)))
    return edits
