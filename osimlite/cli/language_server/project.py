"""The documents that an editor has open, and those on the disk beside them: where things stand, who names them."""

from __future__ import annotations

import codecs
import os
from collections.abc import Iterator
from pathlib import Path

from lsprotocol import types
from pygls.uris import from_fs_path

from osimlite.base.files import read_file, unsaved
from osimlite.cli.language_server.analysis import Analysis, Target
from osimlite.cli.language_server.text import Text
from osimlite.errors import ModelError, OsimliteError
from osimlite.io.document.source import Source
from osimlite.lint.beside import list_documents, list_folders
from osimlite.schema.base import Component
from osimlite.schema.editing import rename_component
from osimlite.schema.resolution import ILLEGAL_CHARACTERS, get_last_name


class Project:
    """The documents around those that are open.

    Attributes:
        open: the analysis of each open file as it is now, by URI.
        known: of each, the last one that could be read.
        unit: how the editor counts characters.
    """

    def __init__(self) -> None:
        self.open: dict[str, Analysis] = {}
        self.known: dict[str, Analysis] = {}
        self.unit: str = types.PositionEncodingKind.Utf16

    def uri(self, path: str) -> str:
        """The URI of a file, as the editor writes it."""
        real = os.path.realpath(path)
        opened = (
            uri for uri, analysis in self.open.items() if os.path.realpath(analysis.file) == real
        )
        return next(opened, None) or from_fs_path(path) or path

    def analysis(self, path: str) -> Analysis | None:
        """A document as it is in the editor, or on the disk; None if it cannot be read."""
        known = self.open.get(self.uri(path))
        if known is not None:
            return known
        try:
            return Analysis(Text(Source.of_file(path).text, self.unit), path)
        except OsimliteError:
            return None

    def hold(self, analysis: Analysis) -> bool:
        """Let others see a document that can be read as it is in the editor; whether it is another one to them."""
        path = os.path.realpath(analysis.file)
        # The mark counts for more than what the text says of its encoding.
        held = codecs.BOM_UTF8 + analysis.source.data
        before = unsaved.get(path)
        if before is None:
            try:
                before = codecs.BOM_UTF8 + read_file(path).removeprefix(codecs.BOM_UTF8)
            except OsimliteError:
                return False
        unsaved[path] = held
        return before != held

    def close(self, uri: str) -> Analysis | None:
        """Forget a file, which is from now on as it is on the disk."""
        analysis = self.open.pop(uri, None)
        self.known.pop(uri, None)
        if analysis is not None:
            unsaved.pop(os.path.realpath(analysis.file), None)
        return analysis

    def depending_on(self, analysis: Analysis) -> list[str]:
        """The URIs of other open files that are checked together with a document."""
        path = os.path.realpath(analysis.file)
        result = []
        for uri, other in self.open.items():
            if other is not analysis and other.is_checked:
                outside = other.subject.list_outside_paths()
                if outside is None or path in map(os.path.realpath, outside):
                    result.append(uri)
        return result

    def location(self, target: Target) -> types.Location | None:
        """Where something stands."""
        if target.item is None:
            line, column = (
                (0, 0) if target.at is None else (target.at.line - 1, target.at.column - 1)
            )
            start = types.Position(line, column)
            return types.Location(self.uri(target.file), types.Range(start, start))
        analysis = self.analysis(target.file)
        if analysis is None or target.number not in analysis.objects:
            return None
        return types.Location(
            self.uri(target.file), analysis.text.range(*analysis.place_of(target.number))
        )

    def naming(self, target: Target) -> Iterator[Analysis]:
        """Every document that may name something, first the one that it is in."""
        own = self.analysis(target.file)
        if own is None or target.item is None:
            return
        yield own
        real = os.path.realpath(target.file)
        here = Path(real).parent
        folders = [here, here.parent, *list_folders(here), *list_folders(here.parent)]
        for folder in dict.fromkeys(map(os.path.realpath, folders)):
            for path in list_documents(folder) or ():
                other = self.analysis(path) if os.path.realpath(path) != real else None
                if other is not None and target.item.name in other.text.content:
                    yield other

    def references(self, target: Target) -> list[types.Location]:
        """Every word that leads to something."""
        return [
            types.Location(self.uri(analysis.file), analysis.text.range(*place))
            for analysis in self.naming(target)
            for place in analysis.references(target)
        ]

    def renaming(self, target: Target, name: str) -> dict[str, list[types.TextEdit]]:
        """The changes that give something another name, everywhere, by URI.

        Raises:
            ModelError: the name is illegal or taken, or the text gives it no name.
        """
        own = self.analysis(target.file)
        item = None if own is None or target.number is None else own.objects.get(target.number)
        place = (
            None if own is None or item is None or item._index is None else own.name_of(item._index)
        )
        if (
            own is None
            or item is None
            or place is None
            or target.item is None
            or item.name != target.item.name
        ):
            raise ModelError(
                f"the text does not give '{target.path or target.file}' a name; nothing can be renamed"
            )
        path, changes = f"/{name}", {}
        if own.document is not None and own.document.model is not None:
            path, edits = _rename_in_model(own, item, name)
        else:
            if not name or any(character in name for character in ILLEGAL_CHARACTERS):
                raise ModelError(f"'{name}' is no name")
            edits = _rename_in_setup(own, target, path)
        edits.insert(0, types.TextEdit(own.text.range(*place), name))
        changes[self.uri(own.file)] = edits
        for other in self.naming(target):
            edits = _rename_in_setup(other, target, path) if other is not own else []
            if edits:
                changes[self.uri(other.file)] = edits
        return changes


def _rename_in_model(
    analysis: Analysis, item: object, name: str
) -> tuple[str, list[types.TextEdit]]:
    """The new path of a component, and the changes of the references in its model."""
    assert isinstance(item, Component) and item._index is not None
    # Renaming changes a model, so it is done to another one of the same text.
    twin = Analysis(analysis.text, analysis.file)
    assert twin.document is not None and twin.document.model is not None
    target, model = twin.objects[item._index], twin.document.model
    assert isinstance(target, Component)
    own, uses = twin.name_of(item._index), twin.places
    rename_component(model, target, name)
    edits = []
    for use, start, end in uses:
        value = getattr(use.holder, use.spec.name)
        text = value if use.position is None else value[use.position]
        if text != use.value and (start, end) != own:
            edits.append(types.TextEdit(analysis.text.range(start, end), str(text)))
    return model.tree().path_of(target) or f"/{name}", edits


def _rename_in_setup(analysis: Analysis, target: Target, path: str) -> list[types.TextEdit]:
    """The changes of the names in a setup that lead to something, or through it, once that has another path."""
    edits = []
    for use, start, end in analysis.places:
        text = str(use.value)
        led = analysis.led_to(use)
        if led is None or os.path.realpath(led.file) != os.path.realpath(target.file):
            continue
        if text.startswith("/") and target.path and f"{text}/".startswith(f"{target.path}/"):
            edits.append(
                types.TextEdit(analysis.text.range(start, end), path + text[len(target.path) :])
            )
        elif target.is_same(led) and not text.startswith("/"):
            edits.append(types.TextEdit(analysis.text.range(start, end), get_last_name(path)))
    return edits
