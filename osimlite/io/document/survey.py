"""Reading for a check: as much of a text as can be read, and every reason why the rest cannot."""

from __future__ import annotations

import re

from lxml import etree

from osimlite.base.records import dataclass, field
from osimlite.errors import DocumentError, NotWellFormedError, VersionError
from osimlite.io.document.names import as_written
from osimlite.io.document.reader import (
    ROOT,
    Document,
    parse_source,
    read_document,
    read_tree,
    read_version,
)
from osimlite.io.document.source import Source
from osimlite.schema.base import Object
from osimlite.schema.model import CURRENT_VERSION, Model


@dataclass(slots=True)
class Survey:
    """What could be read of a text.

    `document` is None if nothing could. `faults` are the errors the reader would have raised. Of a
    text that is not well-formed only what stands before line `sure_until` was certainly understood.
    """

    source: Source
    document: Document | None = None
    faults: list[DocumentError] = field(default_factory=list)
    sure_until: int | None = None


def survey_source(source: Source, *, of: type[Object] = Model) -> Survey:
    """Read as much of `source` as can be read; raises nothing for what is wrong with the text.

    The object at the top is of a class or derived from it.
    """
    try:
        return Survey(source, read_document(source, of=of, to_check=True))
    except NotWellFormedError as fault:
        return _survey_damaged(source, fault, of)
    except VersionError as fault:
        # Without a version the document is taken for a current one; an older format would give
        # false findings.
        if fault.version is not None:
            return Survey(source, None, [fault])
        try:
            return _add_document(Survey(source, None, [fault]), parse_source(source), of)
        except NotWellFormedError:
            return Survey(source, None, [fault])
    except DocumentError as fault:
        result = Survey(source, None, [fault])
        if fault.meant != ROOT:
            return result
        root = parse_source(source)
        root.tag = ROOT
        return _add_document(result, root, of)


def _survey_damaged(source: Source, fault: NotWellFormedError, of: type[Object]) -> Survey:
    result = Survey(source, None, [fault], fault.line)
    unclosed = re.search(r"of line (\d+) is not closed", fault.message)
    if unclosed:
        result.sure_until = int(unclosed[1])
    try:
        # What the parser takes for a character in spite of all may be none that lxml can give back.
        from osimlite.io.document.repair import repair_text

        mended, _ = repair_text(source.text)
        root = parse_source(Source(mended.encode("utf-8", "replace"), source.file), recover=True)
    except NotWellFormedError:
        return result
    if root.tag != ROOT or not _has_same_elements(source, root, result.sure_until):
        return result
    return _add_document(result, root, of)


def _add_document(found: Survey, root: etree._Element, of: type[Object]) -> Survey:
    try:
        version = read_version(found.source, root)
    except DocumentError:
        version = CURRENT_VERSION
    try:
        found.document = read_tree(found.source, root, version, of)
    except DocumentError as fault:
        found.faults.append(fault)
    return found


def _has_same_elements(source: Source, root: etree._Element, sure_until: int | None) -> bool:
    """Whether the recovered tree numbers its elements as the text does, as far as that matters."""
    numbered = zip(source.spans, root.iter(etree.Element), strict=False)
    for number, (span, element) in enumerate(numbered):
        if sure_until is not None and source.of_tag(number).line >= sure_until:
            return True
        if span.tag != as_written(element.tag):
            return False
    return True
