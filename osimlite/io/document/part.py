"""Documents that hold something else than a model and may say nothing misspelt, such as the loads of a trial."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from osimlite.base.text import find_nearest
from osimlite.errors import DocumentError
from osimlite.io.document.reader import read_document
from osimlite.io.document.source import Source
from osimlite.schema.base import Object
from osimlite.schema.specs import field_specs

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
            and (near := find_nearest(note.word, field_specs(type(note.owner))))
        ):
            message = f"<{note.word}> means nothing in this document; did you mean <{near}>?"
            raise document.source.fault(DocumentError, message, document.source.of_tag(note.number))
    assert isinstance(document.top, cls)
    return document.top
