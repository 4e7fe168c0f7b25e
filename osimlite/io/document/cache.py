"""Cache of documents by file, and reading of documents with one object."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Generic, TypeVar

from osimlite.base.files import get_file_stamp
from osimlite.base.text import find_nearest
from osimlite.errors import DocumentError, OsimliteError
from osimlite.io.document.notes import Note
from osimlite.io.document.objects import get_layout
from osimlite.io.document.reader import read_document
from osimlite.io.document.source import Source
from osimlite.schema.base import Object
from osimlite.schema.registry import add_change_callback
from osimlite.schema.specs import get_field_specs

T = TypeVar("T")
Top = TypeVar("Top", bound=Object)


class FileCache(Generic[T]):
    """Cache of the results of a function of a file, for the last `size` files.

    A result is valid until the file changes or other plug-in classes are registered.

    Args:
        make: function of a path.
        size: number of files.
    """

    def __init__(self, make: Callable[[str], T], size: int) -> None:
        self._make, self._size = make, size
        self._cached: dict[str, tuple[int, T]] = {}
        # Documents depend on the registered classes.
        add_change_callback(self._cached.clear)

    def __call__(self, path: str) -> T | None:
        """Return the result for a file; None if the file does not exist."""
        stamp = get_file_stamp(path)
        # Relative and absolute paths of a file share one entry.
        key = os.path.abspath(path)
        if stamp is None:
            return None
        # Removed and added again: the dictionary keeps the order of use.
        entry = self._cached.pop(key, None)
        if entry is None or entry[0] != stamp:
            entry = stamp, self._make(path)
        self._cached[key] = entry
        if len(self._cached) > self._size:
            # The first key is the one that was used longest ago.
            del self._cached[next(iter(self._cached))]
        return entry[1]

    def has(self, path: str) -> bool:
        """Return whether the cache has a valid result for a file."""
        entry = self._cached.get(os.path.abspath(path))
        return entry is not None and entry[0] == get_file_stamp(path)

    def keep(self, path: str, result: T) -> None:
        """Store a result that was computed elsewhere from the current content of a file.

        Args:
            path: path of the file.
            result: result for the file.
        """
        stamp = get_file_stamp(path)
        key = os.path.abspath(path)
        if stamp is None:
            return
        self._cached.pop(key, None)
        self._cached[key] = stamp, result
        if len(self._cached) > self._size:
            del self._cached[next(iter(self._cached))]


def cache_by_file(size: int) -> Callable[[Callable[[str], T]], FileCache[T]]:
    """Return a decorator that caches a function of a path for the last `size` files."""
    return lambda make: FileCache(make, size)


@cache_by_file(256)
def get_object(path: str) -> Object | None:
    """Return the object of a document; None if it cannot be read."""
    try:
        return read_document(Source.from_file(path), expected_class=Object).top
    # A caller that needs the reason reads the document itself.
    except (OsimliteError, ValueError, RecursionError):
        return None


@cache_by_file(256)
def _has_no_include(path: str) -> bool:
    """Return whether all parts of a document are in its file; changes of other files go unnoticed."""
    top = get_object(path)
    return top is not None and not any(
        item.layout is not None and item.layout.include for item in top.walk()
    )


@cache_by_file(256)
def _has_only_known_tags(path: str) -> bool:
    """Return whether a document is known to have no unknown elements; `keep_object` stores that."""
    return False


def keep_object(path: str, top: Object, notes: Iterable[Note]) -> None:
    """Store the object of a document that was read elsewhere, so that it is not read again.

    Args:
        path: path of the file, which must be well-formed.
        top: object of the document, as `read_document` returns it.
        notes: notes of the reader.
    """
    get_object.keep(path, top)
    _has_only_known_tags.keep(path, not any(note.kind == "unknown-tag" for note in notes))


def read_copy(path: str | Path, expected_class: type[Top]) -> Top:
    """Return the object of a document as a copy that the caller may change.

    Args:
        path: path of the document.
        expected_class: class of the object.

    Raises:
        DocumentError: the file is missing or has an object of another class; with line and column.
    """
    from osimlite.io.document.plugins import classes_in_use

    file = str(path)
    # Plug-in classes of the caller are not those of the cached document.
    with classes_in_use(()):
        top = get_object(file) if get_object.has(file) and _has_no_include(file) else None
        if not isinstance(top, expected_class):
            document = read_document(Source.from_file(path), expected_class=expected_class)
            assert isinstance(document.top, expected_class)
            return document.top
        copied = top.copy_deep()
        # Relative names in the document are resolved from its file.
        get_layout(copied).file = file
        return copied


AnyObject = TypeVar("AnyObject", bound=Object)


def read_object(path: str | Path, cls: type[AnyObject]) -> AnyObject:
    """Read a document with one object of a class.

    Unknown elements are ignored as in OpenSim, unless their names are similar to a property.

    Args:
        path: path of the document.
        cls: class of the object.

    Returns:
        Object that the document contains.

    Raises:
        DocumentError: the file is missing, has an object of another class, or has a misspelt
            property; with line and column.
    """
    # In a document without unknown elements there is nothing to suggest.
    if _has_only_known_tags(str(path)):
        return read_copy(path, cls)
    document = read_document(Source.from_file(path), expected_class=cls)
    for note in document.notes:
        # Many files have properties of old versions; a name similar to a present one is a
        # spelling mistake.
        if (
            note.kind == "unknown-tag"
            and note.owner
            and (suggestion := find_nearest(note.word, get_field_specs(type(note.owner))))
        ):
            message = f"<{note.word}> is unknown in this document; did you mean <{suggestion}>?"
            raise document.source.fault(
                DocumentError, message, document.source.locate_tag(note.number)
            )
    assert isinstance(document.top, cls)
    return document.top
