"""Documents that hold something else than a model, such as the external loads of a trial."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from osimlite.document.foreign import is_element
from osimlite.document.objects import ObjectReader
from osimlite.document.reader import parse, version_of
from osimlite.document.source import Source
from osimlite.errors import DocumentError, VersionError
from osimlite.schema.base import Object
from osimlite.schema.model import CURRENT_VERSION

AnyObject = TypeVar("AnyObject", bound=Object)


def read_object(path: str | Path, cls: type[AnyObject]) -> AnyObject:
    """Read a document that holds one object of a class.

    Raises:
        DocumentError: the file is missing or holds something else; with line and column.
    """
    source = Source.of_file(path)
    root = parse(source)
    version = version_of(source, root)
    if version < CURRENT_VERSION:
        from osimlite.document.upgrade import Refused, upgrade

        try:
            root = upgrade(root, version).root
        except Refused as refused:
            line, column, _ = source.of_tag(refused.number)
            raise VersionError(refused.message, file=source.file, line=line, column=column) from None
    top = next((child for child in root if is_element(child)), None)
    if top is None or top.tag != cls.tag:
        found = "nothing" if top is None else f"<{top.tag}>"
        line, column, _ = source.of_tag(0 if top is None else 1)
        raise DocumentError(f"this holds {found}, not <{cls.tag}>", file=source.file, line=line, column=column)
    reader = ObjectReader(None)
    reader.count = 1
    item = reader.top(top, cls)
    bad = next((note for note in reader.notes if note.kind == "unknown-tag"), None)
    if bad is not None:
        line, column, _ = source.of_tag(bad.number)
        raise DocumentError(f"<{bad.word}> means nothing in this document", file=source.file, line=line, column=column)
    assert isinstance(item, cls)
    return item
