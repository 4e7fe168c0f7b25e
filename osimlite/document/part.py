"""Documents that hold something else than a model and may say nothing unknown, such as the loads of a trial."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from osimlite.document.reader import read_document
from osimlite.document.source import Source
from osimlite.errors import DocumentError
from osimlite.schema.base import Object

AnyObject = TypeVar("AnyObject", bound=Object)


def read_object(path: str | Path, cls: type[AnyObject]) -> AnyObject:
    """Read a document that holds one object of a class.

    Raises:
        DocumentError: the file is missing or holds something else; with line and column.
    """
    document = read_document(Source.of_file(path), of=cls)
    bad = next((note for note in document.notes if note.kind == "unknown-tag"), None)
    if bad is not None:
        place = document.source.of_tag(bad.number)
        raise document.source.fault(DocumentError, f"<{bad.word}> means nothing in this document", place)
    assert isinstance(document.top, cls)
    return document.top
