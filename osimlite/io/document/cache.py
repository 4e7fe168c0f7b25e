"""Cache of documents by file, and reading of documents with one object."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Generic, TypeVar

from osimlite.base.files import get_file_stamp
from osimlite.base.text import find_nearest
from osimlite.errors import DocumentError, OsimliteError
from osimlite.io.document.objects import get_layout
from osimlite.io.document.reader import read_document
from osimlite.io.document.source import Source
from osimlite.schema.base import Object
from osimlite.schema.registry import on_class_change
from osimlite.schema.specs import get_field_specs

T = TypeVar("T")
Top = TypeVar("Top", bound=Object)


class FileCache(Generic[T]):
    """What was made of the last `size` files, as long as these do not change; None of one that is not there."""

    def __init__(self, make: Callable[[str], T], size: int) -> None:
        self._make, self._size = make, size
        self._kept: dict[str, tuple[int, T]] = {}
        on_class_change(self._kept.clear)

    def __call__(self, path: str) -> T | None:
        """What the file at a path makes."""
        # A file is the same by a relative and by an absolute path.
        stamp, place = get_file_stamp(path), os.path.abspath(path)
        if stamp is None:
            return None
        known = self._kept.pop(place, None)
        if known is None or known[0] != stamp:
            known = stamp, self._make(path)
        self._kept[place] = known
        if len(self._kept) > self._size:
            del self._kept[next(iter(self._kept))]
        return known[1]

    def has(self, path: str) -> bool:
        """Whether it is known of a file as it is now."""
        known = self._kept.get(os.path.abspath(path))
        return known is not None and known[0] == get_file_stamp(path)

    def keep(self, path: str, made: T) -> None:
        """Keep what somebody else has made of the file at a path, as it is now."""
        stamp, place = get_file_stamp(path), os.path.abspath(path)
        if stamp is None:
            return
        self._kept.pop(place, None)
        self._kept[place] = stamp, made
        if len(self._kept) > self._size:
            del self._kept[next(iter(self._kept))]


def cache_by_file(size: int) -> Callable[[Callable[[str], T]], FileCache[T]]:
    """Keep what a function makes of the last `size` files."""
    return lambda make: FileCache(make, size)


@cache_by_file(256)
def get_object(path: str) -> Object | None:
    """The top of a document; None if it cannot be read."""
    try:
        return read_document(Source.of_file(path), of=Object).top
    except (OsimliteError, ValueError, RecursionError):
        return None


@cache_by_file(256)
def _has_no_include(path: str) -> bool:
    """Whether no part of a document is in another file, which nobody would see change."""
    top = get_object(path)
    return top is not None and not any(
        item.layout is not None and item.layout.include for item in top.walk()
    )


def read_copy(path: str | Path, of: type[Top]) -> Top:
    """The top of a document, of a class, for whoever changes it: a copy, if it is known from before.

    Raises:
        DocumentError: the file is missing or holds something else; with line and column.
    """
    from osimlite.io.document.plugins import classes_in_use

    file = str(path)
    with classes_in_use(()):
        top = get_object(file) if get_object.has(file) and _has_no_include(file) else None
        if not isinstance(top, of):
            document = read_document(Source.of_file(path), of=of)
            assert isinstance(document.top, of)
            return document.top
        copied = top.copy_deep()
        get_layout(copied).file = file
        return copied


AnyObject = TypeVar("AnyObject", bound=Object)


def read_object(path: str | Path, cls: type[AnyObject]) -> AnyObject:
    """Read a document that holds one object of a class; what is like nothing of that class is ignored, as in OpenSim.

    Raises:
        DocumentError: the file is missing or holds something else; with line and column.
    """
    document = read_document(Source.of_file(path), of=cls)
    for note in document.notes:
        # Properties of older versions are still in many files; what is like one of today is
        # misspelt.
        if (
            note.kind == "unknown-tag"
            and note.owner
            and (near := find_nearest(note.word, get_field_specs(type(note.owner))))
        ):
            message = f"<{note.word}> means nothing in this document; did you mean <{near}>?"
            raise document.source.fault(DocumentError, message, document.source.of_tag(note.number))
    assert isinstance(document.top, cls)
    return document.top
