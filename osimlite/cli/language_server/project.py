"""Documents that an editor has open and those in the folders around them: locations, references, renaming."""

from __future__ import annotations

import codecs
import os
from collections.abc import Iterator
from pathlib import Path

from lsprotocol import types
from pygls.uris import from_fs_path

from osimlite.base.files import read_file, unsaved
from osimlite.cli.language_server.analysis import DocumentAnalysis, Target
from osimlite.cli.language_server.text import Text
from osimlite.errors import ModelError, OsimliteError
from osimlite.io.document.source import Source
from osimlite.lint.neighbours import list_documents, list_folders
from osimlite.schema.base import Component
from osimlite.schema.editing import describe_illegal_name, rename_component
from osimlite.schema.resolution import get_last_name


class Project:
    """Open documents, and those on disk that belong to the same project.

    Attributes:
        open: current analysis of each open file, by URI.
        last_readable: last analysis of each open file that could be read, by URI.
        unit: encoding in which the editor counts characters.
    """

    def __init__(self) -> None:
        self.open: dict[str, DocumentAnalysis] = {}
        self.last_readable: dict[str, DocumentAnalysis] = {}
        # The default of the protocol, until the editor names another one.
        self.unit: str = types.PositionEncodingKind.Utf16

    def find_uri(self, path: str) -> str:
        """Return the URI of a file in the spelling of the editor if the file is open."""
        # Editors may spell a path in another way, for example with links.
        real = os.path.realpath(path)
        opened = (
            uri for uri, analysis in self.open.items() if os.path.realpath(analysis.file) == real
        )
        return next(opened, None) or from_fs_path(path) or path

    def get_analysis(self, path: str) -> DocumentAnalysis | None:
        """Return the analysis of a document, open or on disk; None if it cannot be read."""
        open_analysis = self.open.get(self.find_uri(path))
        if open_analysis is not None:
            return open_analysis
        try:
            return DocumentAnalysis(Text(Source.from_file(path).text, self.unit), path)
        # A damaged file in the folder must not end a search through the others.
        except OsimliteError:
            return None

    def publish_unsaved(self, analysis: DocumentAnalysis) -> bool:
        """Make the unsaved text of a document visible to all readers of that file.

        Returns:
            Whether the text differs from what readers saw before.
        """
        path = os.path.realpath(analysis.file)
        # The editor has decoded the text already. A byte order mark makes readers take UTF-8
        # whatever encoding the XML declaration names.
        content = codecs.BOM_UTF8 + analysis.source.data
        previous = unsaved.get(path)
        if previous is None:
            try:
                previous = codecs.BOM_UTF8 + read_file(path).removeprefix(codecs.BOM_UTF8)
            except OsimliteError:
                return False
        unsaved[path] = content
        return previous != content

    def close(self, uri: str) -> DocumentAnalysis | None:
        """Remove a file from the open ones, so that readers see it as it is on disk.

        Returns:
            The last analysis of the file; None if it was not open.
        """
        analysis = self.open.pop(uri, None)
        self.last_readable.pop(uri, None)
        if analysis is not None:
            unsaved.pop(os.path.realpath(analysis.file), None)
        return analysis

    def list_dependents(self, analysis: DocumentAnalysis) -> list[str]:
        """Return the URIs of the other open files whose findings depend on a document."""
        path = os.path.realpath(analysis.file)
        result = []
        for uri, open_analysis in self.open.items():
            if open_analysis is not analysis and open_analysis.is_checked:
                outside = open_analysis.subject.list_outside_paths()
                # Unknown dependencies count as possible ones.
                if outside is None or path in map(os.path.realpath, outside):
                    result.append(uri)
        return result

    def find_location(self, target: Target) -> types.Location | None:
        """Return where a target is defined; None if no file contains it."""
        if target.item is None:
            line, column = (
                (0, 0) if target.at is None else (target.at.line - 1, target.at.column - 1)
            )
            start = types.Position(line, column)
            return types.Location(self.find_uri(target.file), types.Range(start, start))
        analysis = self.get_analysis(target.file)
        if analysis is None or target.number not in analysis.objects:
            return None
        return types.Location(
            self.find_uri(target.file),
            analysis.text.range(*analysis.find_label_range(target.number)),
        )

    def find_documents_naming(self, target: Target) -> Iterator[DocumentAnalysis]:
        """Yield the documents that may refer to a target, first the one that defines it.

        It searches the folder of the target, its parent folder, and the folders directly in both, and
        skips documents whose text does not contain the name.
        """
        defining = self.get_analysis(target.file)
        if defining is None or target.item is None:
            return
        yield defining
        real = os.path.realpath(target.file)
        folder_of_file = Path(real).parent
        folders = [
            folder_of_file,
            folder_of_file.parent,
            *list_folders(folder_of_file),
            *list_folders(folder_of_file.parent),
        ]
        for folder in dict.fromkeys(map(os.path.realpath, folders)):
            for path in list_documents(folder) or ():
                analysis = self.get_analysis(path) if os.path.realpath(path) != real else None
                # A search in the text is much cheaper than an analysis, which most files of a
                # project do not need.
                if analysis is not None and target.item.name in analysis.text.content:
                    yield analysis

    def find_references(self, target: Target) -> list[types.Location]:
        """Return the locations of all names that refer to a target."""
        return [
            types.Location(self.find_uri(analysis.file), analysis.text.range(*word_range))
            for analysis in self.find_documents_naming(target)
            for word_range in analysis.find_references(target)
        ]

    def compute_rename(self, target: Target, name: str) -> dict[str, list[types.TextEdit]]:
        """Compute the edits that rename a component and update all references to it.

        Args:
            target: component to rename.
            name: new name of the component.

        Returns:
            The edits of each document, by URI.

        Raises:
            ModelError: the name is illegal or in use, or the component has no name in the text.
        """
        defining = self.get_analysis(target.file)
        component = (
            None
            if defining is None or target.number is None
            else defining.objects.get(target.number)
        )
        name_range = (
            None
            if defining is None or component is None or component._index is None
            else defining.find_name_range(component._index)
        )
        if (
            defining is None
            or component is None
            or name_range is None
            or target.item is None
            or component.name != target.item.name
        ):
            raise ModelError(
                f"the text does not give '{target.path or target.file}' a name; nothing can be renamed"
            )
        path = f"/{name}"
        edits_by_uri = {}
        if defining.document is not None and defining.document.model is not None:
            path, edits = _compute_model_edits(defining, component, name)
        else:
            if reason := describe_illegal_name(name):
                raise ModelError(f"'{name}' is not a legal name: {reason}")
            edits = _compute_setup_edits(defining, target, path)
        # The name itself first, then all references.
        edits.insert(0, types.TextEdit(defining.text.range(*name_range), name))
        edits_by_uri[self.find_uri(defining.file)] = edits
        for analysis in self.find_documents_naming(target):
            edits = _compute_setup_edits(analysis, target, path) if analysis is not defining else []
            if edits:
                edits_by_uri[self.find_uri(analysis.file)] = edits
        return edits_by_uri


def _compute_model_edits(
    analysis: DocumentAnalysis, component: object, name: str
) -> tuple[str, list[types.TextEdit]]:
    """Compute the edits of the references in the model that contains a component.

    Args:
        analysis: analysis of the document.
        component: component to rename.
        name: new name of the component.

    Returns:
        The new path of the component, and the edits.
    """
    assert isinstance(component, Component) and component._index is not None
    # Renaming changes the model, so a second one is read from the same text.
    copied = DocumentAnalysis(analysis.text, analysis.file)
    assert copied.document is not None and copied.document.model is not None
    target = copied.objects[component._index]
    model = copied.document.model
    assert isinstance(target, Component)
    name_range = copied.find_name_range(component._index)
    uses = copied.uses
    rename_component(model, target, name)
    edits = []
    for use, start, end in uses:
        value = getattr(use.holder, use.spec.name)
        text = value if use.position is None else value[use.position]
        if text != use.value and (start, end) != name_range:
            edits.append(types.TextEdit(analysis.text.range(start, end), str(text)))
    return model.tree().path_of(target) or f"/{name}", edits


def _compute_setup_edits(
    analysis: DocumentAnalysis, target: Target, path: str
) -> list[types.TextEdit]:
    """Return the edits of the names in a setup that refer to a component or pass through it.

    Args:
        analysis: analysis of the setup.
        target: component to rename.
        path: new path of the component.
    """
    edits = []
    for use, start, end in analysis.uses:
        text = str(use.value)
        use_target = analysis.resolve_use(use)
        if use_target is None or os.path.realpath(use_target.file) != os.path.realpath(target.file):
            continue
        # Also paths that pass through the component, such as those of its frames.
        if text.startswith("/") and target.path and f"{text}/".startswith(f"{target.path}/"):
            edits.append(
                types.TextEdit(analysis.text.range(start, end), path + text[len(target.path) :])
            )
        # A bare name stays one, since many properties do not accept paths.
        elif target.is_same_as(use_target) and not text.startswith("/"):
            edits.append(types.TextEdit(analysis.text.range(start, end), get_last_name(path)))
    return edits
