"""Reading of damaged documents for the linter: everything readable, and all errors."""

from __future__ import annotations

import re

from lxml import etree

from osimlite.base.records import dataclass, field
from osimlite.errors import DocumentError, NotWellFormedError, VersionError
from osimlite.io.document.names import decode_name
from osimlite.io.document.parsing import ROOT, parse_source, read_version
from osimlite.io.document.reader import Document, read_document, read_tree
from osimlite.io.document.source import Source
from osimlite.schema.base import Object
from osimlite.schema.model import CURRENT_VERSION, Model


@dataclass(slots=True)
class Survey:
    """Result of reading a text that may be damaged.

    Attributes:
        source: text of the document.
        document: document as far as it was read; None if nothing is readable.
        faults: errors that the reader would raise.
        sure_until: line before which a text with syntax errors was certainly understood.
    """

    source: Source
    document: Document | None = None
    faults: list[DocumentError] = field(default_factory=list)
    sure_until: int | None = None


def survey_source(source: Source, *, expected_class: type[Object] = Model) -> Survey:
    """Read as much of a text as possible; errors of the text are part of the result.

    Args:
        source: text of the document.
        expected_class: class of the object, or one of its bases.

    Returns:
        Document as far as it could be read, and the errors of the text.
    """
    try:
        return Survey(source, read_document(source, expected_class=expected_class, to_check=True))
    except NotWellFormedError as fault:
        return _survey_damaged(source, fault, expected_class)
    except VersionError as fault:
        # Without a version the document is read as a current one; with an older format the
        # findings would be wrong.
        if fault.version is not None:
            return Survey(source, None, [fault])
        try:
            return _read_survey_document(
                Survey(source, None, [fault]), parse_source(source), expected_class
            )
        except NotWellFormedError:
            return Survey(source, None, [fault])
    except DocumentError as fault:
        result = Survey(source, None, [fault])
        if fault.meant != ROOT:
            return result
        try:
            root = parse_source(source)
        except NotWellFormedError as damage:
            # The root was read before the place where the text is damaged.
            return _survey_damaged(source, damage, expected_class)
        # The root is probably a misspelt <OpenSimDocument>: read on as if it were not.
        root.tag = ROOT
        return _read_survey_document(result, root, expected_class)


def _survey_damaged(
    source: Source, fault: NotWellFormedError, expected_class: type[Object]
) -> Survey:
    """Survey a text that is not well-formed, as far as a repaired text can be parsed.

    Returns:
        Document as far as it could be read, and the syntax error of the text.
    """
    result = Survey(source, None, [fault], fault.line)
    unclosed = re.search(r"of line (\d+) is not closed", fault.message)
    if unclosed:
        result.sure_until = int(unclosed[1])
    try:
        # Repair first: lxml cannot return some characters that its parser recovers.
        from osimlite.io.document.repair import repair_text

        repaired, _ = repair_text(source.text)
        root = parse_source(Source(repaired.encode("utf-8", "replace"), source.file), recover=True)
    except NotWellFormedError:
        return result
    if root.tag != ROOT or not _has_same_elements(source, root, result.sure_until):
        return result
    return _read_survey_document(result, root, expected_class)


def _read_survey_document(
    survey: Survey, root: etree._Element, expected_class: type[Object]
) -> Survey:
    """Read the document of a survey from its tree, or add the error that prevents it.

    Args:
        survey: survey of the text; changed.
        root: root of the parsed, maybe repaired, text.
        expected_class: class of the top object.

    Returns:
        `survey` with the document, or with one more error.
    """
    # A wrong version has its own error already; the current rules fit most documents.
    try:
        version = read_version(survey.source, root)
    except DocumentError:
        version = CURRENT_VERSION
    try:
        survey.document = read_tree(survey.source, root, version, expected_class)
    except DocumentError as fault:
        survey.faults.append(fault)
    return survey


def _has_same_elements(source: Source, root: etree._Element, sure_until: int | None) -> bool:
    """Return whether the recovered tree has the elements of the text up to line `sure_until`."""
    numbered = zip(source.spans, root.iter(etree.Element), strict=False)
    for number, (span, element) in enumerate(numbered):
        if sure_until is not None and source.locate_tag(number).line >= sure_until:
            return True
        if span.tag != decode_name(element.tag):
            return False
    return True
