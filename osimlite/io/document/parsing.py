"""From the text of a document to an element tree and its version, with errors at their places.

lxml parses the text. A root that is no document of OpenSim is reported with the tag that was
probably meant.
"""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from typing import TYPE_CHECKING, cast

from lxml import etree

from osimlite.base.files import TABLE_SUFFIXES
from osimlite.base.text import find_nearest
from osimlite.errors import (
    DocumentError,
    NotWellFormedError,
    VersionError,
)
from osimlite.io.document.names import decode_name, replace_colons
from osimlite.io.document.source import Source
from osimlite.io.document.syntax import check_doctype, locate_error, rephrase_message
from osimlite.io.document.xml_text import has_only_generated_comments, is_element
from osimlite.schema.base import Object
from osimlite.schema.model import CURRENT_VERSION
from osimlite.schema.registry import find_class, list_tags

if TYPE_CHECKING:
    pass


ROOT = "OpenSimDocument"
"""Tag of the root element."""

OLDEST_VERSION = 10500
"""Version that is assumed for old documents that do not state one."""

_COUNT = etree.XPath("count(descendant-or-self::*)")


def make_version_error(source: Source, version: int, message: str, number: int = 0) -> VersionError:
    """Return the error that a document of a version cannot be read, at one of its elements."""
    fault = source.fault(VersionError, message, source.locate_tag(number))
    fault.version = version
    return fault


def parse_source(source: Source, *, recover: bool = False) -> etree._Element:
    """Parse a text to an element tree without namespaces (see :mod:`osimlite.io.document.names`).

    Args:
        source: text of the document.
        recover: whether to continue after syntax errors; the tree is then a guess.

    Returns:
        Root of the element tree.

    Raises:
        NotWellFormedError: the text is not well-formed (without `recover`), or declares entities.
    """  # noqa: DOC501 - a function makes the error, which is named
    # lxml gets UTF-8 whatever the text declares, because the encoding was detected before.
    data = source.data if source.encoding in ("utf-8", "utf-8-sig") else source.text.encode()
    # OpenSim knows no namespaces: its parser takes a colon for a part of the name.
    data = replace_colons(data)
    # OpenSim accepts blank lines before the XML declaration, with or without a byte-order mark
    # before them. lxml rejects them, so they are removed, and their number is added to positions.
    unmarked = data.removeprefix(BOM_UTF8)
    body = unmarked.lstrip()
    if body.startswith(BOM_UTF8):
        body = data
    blank = data[: len(data) - len(body)].count(b"\n")
    plain = has_only_generated_comments(data)
    parser = etree.XMLParser(
        encoding="utf-8",
        # No entities, network or DTD: a model file must not read other files, nor expand to
        # gigabytes.
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        recover=recover,
        remove_comments=plain,
        remove_blank_text=True,
    )
    try:
        root = etree.fromstring(body, parser)
    except etree.XMLSyntaxError as error:
        if not body:
            raise NotWellFormedError(
                "the file is empty", file=source.file, line=1, column=1
            ) from None
        message = str(error.msg or "the text is not XML")
        raise _make_syntax_error(
            source, error.position[0] + blank, error.position[1], message
        ) from None
    if root is None:
        raise NotWellFormedError(
            "not well-formed XML: no element", file=source.file, line=1, column=1
        )
    if root.getroottree().docinfo.internalDTD is not None:
        check_doctype(source)
        # These warnings come with a DOCTYPE only.
        for remark in parser.error_log.filter_types(etree.ErrorTypes.WAR_UNDECLARED_ENTITY):
            # With a DOCTYPE, lxml assumes that an unknown entity is declared elsewhere, and drops
            # it without an error.
            raise _make_syntax_error(source, remark.line + blank, remark.column, remark.message)
    if not recover:
        source.elements = int(cast("float", _COUNT(root)))
        source.remarks = not plain
    return root


def is_binary(text: str) -> bool:
    """Return whether the text of a file begins with bytes that no text has."""
    return "\0" in text[:200]


def _make_syntax_error(source: Source, line: int, column: int, message: str) -> NotWellFormedError:
    """Return the error for a message of the parser, at the right position and in plain words."""
    line, column, _ = locate_error(source, line, column, message)
    words = rephrase_message(message) if "<" in source.text else "there is no element in it"
    if is_binary(source.text):
        words = "this is a binary file"
        if source.file is not None and source.file.lower().endswith(".c3d"):
            words += "; the commands 'ik', 'scale' and 'fit' read .c3d files"
    elif source.file is not None and source.file.lower().endswith(TABLE_SUFFIXES):
        words += "; the commands 'validate' and 'info' accept tables, and 'diff' those of two .sto or .mot files"
    return NotWellFormedError(
        f"not well-formed XML: {words}", file=source.file, line=line, column=column
    )


def read_version(source: Source, root: etree._Element) -> int:
    """Return the version of a document.

    Args:
        source: text of the document, for positions in errors.
        root: root element.

    Raises:
        DocumentError: the text is not an OpenSim document.
        VersionError: the version is missing, not a whole number, or too old.
    """  # noqa: DOC501 - a function makes the error, which is named
    text = root.get("Version")
    # OpenSim reads a 32-bit integer, which only blanks may follow.
    # `Version="30000 "` is valid for OpenSim, and `Version="3.0"` is not.
    digits = None if text is None else re.fullmatch(r"[ \t\r\n]*\+?0*([0-9]{1,10})[ \t\r\n]*", text)
    number = int(digits[1]) if digits is not None and int(digits[1]) < 2**31 else None
    if root.tag == ROOT and number is not None and number >= OLDEST_VERSION:
        return number
    if text is None and root.tag != ROOT:
        from osimlite.io.document.upgrade.class_names import RENAMED

        if find_tagged_class(root) is not None or root.tag in RENAMED:
            return OLDEST_VERSION
    # Errors follow; the order is from the worst mismatch to the mildest.
    # Computing a position takes a pass over the text, so it is done for errors only.
    position = source.locate_tag(0)
    if root.tag != ROOT:
        tag = decode_name(root.tag)
        message = (
            f"the root element is <{tag}>, not <OpenSimDocument>: this is not an OpenSim document"
        )
        if tag == "mujoco":
            message += "; this is MJCF (MuJoCo): convert it with 'osimlite convert'"
        raise add_suggestion(source.fault(DocumentError, message, position), _guess_root(tag, root))
    if number is None:
        result = (
            "has no Version"
            if text is None
            else f'has Version="{text[:40]}", which is not a whole number'
        )
        raise source.fault(
            VersionError, f'<OpenSimDocument> {result}; write Version="{CURRENT_VERSION}"', position
        )
    message = (
        f"OpenSim never wrote document version {number} (the oldest is {OLDEST_VERSION}); "
        f'write Version="{CURRENT_VERSION}" if the model is in the current format'
    )
    raise make_version_error(source, number, message)


def add_suggestion(fault: DocumentError, suggestion: str | None) -> DocumentError:
    """Add the tag that was probably meant to an error, if known.

    Returns:
        The error `fault`, which is changed in place.
    """
    if suggestion is not None:
        fault.meant = suggestion
        fault.message += f"; did you mean '{suggestion}'?"
    return fault


def _guess_root(tag: str, root: etree._Element) -> str | None:
    """Return the likely name of a root: that of a document, or the class of an old setup."""
    name = tag.rpartition(":")[2]
    first_element = find_first_element(root)
    has_known_object = (
        first_element is not None
        and find_nearest(decode_name(first_element.tag), list_tags(), cutoff=85) is not None
    )
    # A likely object inside, or a similar name, speaks for the root of a document.
    return (
        ROOT
        if has_known_object or find_nearest(name, [ROOT], cutoff=85) is not None
        else find_nearest(name, list_tags(), cutoff=85)
    )


def find_first_element(root: etree._Element) -> etree._Element | None:
    """Return the element of the document's object."""
    return next((child for child in root if is_element(child)), None)


def find_tagged_class(element: etree._Element | None) -> type[Object] | None:
    """Return the class that the tag of an element names; None for another tag or no element."""
    return None if element is None else find_class(decode_name(element.tag))
