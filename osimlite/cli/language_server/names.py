"""Candidate names for a reference: components, files, columns and states, each with a description."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from osimlite.base.files import get_relative_path
from osimlite.base.named_tuples import NamedTuple
from osimlite.cli.language_server.analysis import DocumentAnalysis
from osimlite.cli.language_server.cursor import Cursor, Element
from osimlite.lint.neighbours import list_folders, read_beginning
from osimlite.lint.setup import Setup
from osimlite.schema.base import Component
from osimlite.schema.fields import Reference
from osimlite.schema.specs import FieldSpec, get_class_names
from osimlite.schema.states import find_variables
from osimlite.schema.tree import Tree, Use

_OPAQUE = (
    "input",
    "positional",
    "point-index",
    "output-file",
    "input-folder",
    "output-folder",
    "pattern",
)
"""Rules of references for whose values there are no candidates."""
_NAMED_AFTER = {
    "Control": Reference("actuator-name", "Actuator"),
    "MarkerWeight": Reference("marker-name", "Marker"),
}
"""References after which objects of a class are usually named; OpenSim does not require it."""
_TABLE = (".sto", ".mot")
_SUFFIXES = {
    "Model": (".osim",),
    "marker data": (".trc", ".sto"),
    "table": _TABLE,
    "motion": _TABLE,
}
"""File name endings by content; all other contents are XML documents."""


class Name(NamedTuple):
    """Candidate text for a reference.

    Attributes:
        text: text to insert.
        detail: description of the target, for display.
        likely: whether it is listed before candidates that are possible but unlikely.
    """

    text: str
    detail: str = ""
    likely: bool = True


def find_name_reference(cursor: Cursor) -> Reference | None:
    """Return the reference for the name of the object at the cursor; None if the name is free."""
    cls = None if cursor.element is None else cursor.element.cls
    if cls is None:
        return None
    # For some classes the property that holds them, or the set they are in, declares what their
    # name refers to.
    property_references = (
        element.spec.names
        for element in reversed(cursor.enclosing[-2:])
        if element.spec is not None
    )
    declared = next(filter(None, property_references), None)
    class_references = (_NAMED_AFTER[name] for name in get_class_names(cls) if name in _NAMED_AFTER)
    return declared or cls.name_reference or next(class_references, None)


def list_names(
    analysis: DocumentAnalysis, cursor: Cursor, reference: Reference, owner: Element | None
) -> Iterator[Name]:
    """Yield the candidate texts for a reference.

    Args:
        analysis: last version of the document that could be read.
        cursor: position of the reference.
        reference: type of the reference.
        owner: element that has the reference.
    """
    setup = analysis.document if isinstance(analysis.document, Setup) else None
    if reference.rule == "file":
        yield from _suggest_files(
            os.path.dirname(analysis.file),
            reference.target.removesuffix(" file").partition(" or ")[0],
        )
    elif reference.rule == "column":
        table = None if setup is None else setup.read_table(getattr(setup.top, "datafile", ""))
        columns = [] if table is None else table.columns
        for prefix in dict.fromkeys(column[:-1] for column in columns if column[-1:] in "xyzXYZ"):
            yield Name(prefix, " ".join(column for column in columns if column.startswith(prefix)))
    elif analysis.tree is not None and reference.rule not in _OPAQUE:
        if setup is None:
            yield from _list_components(
                analysis.tree, reference, _find_owner(analysis, analysis.tree, owner)
            )
        elif reference.rule == "state-path":
            for text, component in find_variables(analysis.tree, reference.target).items():
                yield Name(text, type(component).tag)
        else:
            yield from map(Name, sorted(reference.words))
            yield from _list_names_in_setup(setup, analysis.tree, reference)


def _find_owner(analysis: DocumentAnalysis, tree: Tree, element: Element | None) -> Component:
    """Return the component from which relative paths of a reference start."""
    if element is None:
        return tree.model
    owner = analysis.objects.get(element.number)
    if (owner is None or type(owner) is not element.cls) and element.name:
        # The readable version is older than the text, so indices of elements may have shifted; look
        # for an object of the same name and class.
        owner = next(
            (
                component
                for component in tree.components
                if component.name == element.name and type(component) is element.cls
            ),
            None,
        )
    return tree.model if owner is None else tree.owner_of(owner)


def _list_components(tree: Tree, reference: Reference, owner: Component) -> Iterator[Name]:
    spec = FieldSpec("", "", reference, None, None, None, (type(owner),))
    for text in tree.list_spellings(Use(owner, owner, spec, "")):
        target = tree.lookup(reference, text, owner).target
        yield Name(text, "" if target is None else f"{type(target).tag} {tree.path_of(target)}")


def _list_names_in_setup(setup: Setup, tree: Tree, reference: Reference) -> Iterator[Name]:
    """Yield names in the tool's model and in the sets that the setup adds to it.

    Markers that the marker file contains come first.
    """
    if reference.rule == "set-member":
        names = [Name(text) for text in sorted(setup.list_names(reference.target))]
    else:
        names = list(_list_components(tree, reference, tree.model))
        added_names = (
            setup.list_names(reference.target) - {name.text for name in names}
            if setup.added_sets
            else set()
        )
        names += [
            Name(text, reference.target)
            for text in sorted(added_names)
            if not reference.rule.endswith("path")
        ]
    table = (
        find_marker_labels(setup)
        if reference.target in ("Marker", "PhysicalFrame", "Coordinate")
        else None
    )
    for name in names:
        if table is None or reference.target != "Marker":
            yield name
        else:
            is_in_data = name.text in table[1]
            yield Name(
                name.text,
                f"{name.detail}, {'in' if is_in_data else 'not in'} {table[0]}",
                is_in_data,
            )


def find_marker_labels(setup: Setup) -> tuple[str, list[str]] | None:
    """Find the marker file of a tool.

    Returns:
        Name of the file as in the setup, and its labels; None without such a file.
    """
    for part in setup.tool[1].walk() if setup.tool is not None else ():
        name = str(getattr(part, "marker_file", "")).strip()
        table = setup.read_tool_table(name)
        if table is not None:
            return name, table.columns
    return None


def _suggest_files(folder: str, content: str) -> Iterator[Name]:
    """Yield the files that a property could name, in a folder and in the folders directly below it.

    Args:
        folder: folder to search.
        content: content of the files: a key of `_SUFFIXES`, or the class of the objects in them.

    Yields:
        Paths relative to the folder. Files without the class in their first bytes are unlikely.
    """
    suffixes = _SUFFIXES.get(content, (".xml",))
    for searched_folder in (folder, *map(str, list_folders(Path(folder))[:50])):
        for path in _list_entries(searched_folder, suffixes):
            is_likely = content in _SUFFIXES or f"<{content}".encode() in read_beginning(path)
            yield Name(get_relative_path(path, folder), content if is_likely else "", is_likely)


def _list_entries(folder: str, suffixes: tuple[str, ...]) -> list[str]:
    try:
        with os.scandir(folder) as entries:
            return sorted(entry.path for entry in entries if entry.name.lower().endswith(suffixes))
    except OSError:
        return []
