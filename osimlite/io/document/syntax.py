"""Readable messages and positions for XML syntax errors."""

from __future__ import annotations

import re

from osimlite.base.patterns import compile_later
from osimlite.errors import NotWellFormedError
from osimlite.io.document.names import decode_name
from osimlite.io.document.source import Position, Source
from osimlite.io.document.spans import find_markup

_PLAIN = (
    (
        r"Opening and ending tag mismatch: (\S+) line (\d+) and (\S+)",
        r"<\1> of line \2 is not closed before </\3>",
    ),
    (
        r"Premature end of data in tag (\S+) line (\d+)",
        r"the file ends before <\1> of line \2 is closed",
    ),
    (r"Couldn't find end of Start Tag (\S+)(?: line \d+)?", r"the tag <\1 has no '>'"),
    (r"EndTag: '</' not found", "the file ends before its elements are closed"),
    (r"Failed to parse QName '(.*)'", r"'\1' is not a legal name of an element or attribute"),
    (
        r"StartTag: invalid element name",
        "no tag begins with this '<'; write &lt; for the character itself",
    ),
    (
        r"Extra content at the end of the document",
        "there is content after the root element",
    ),
    (r"Specification mandates value for attribute (\S+)", r"the attribute \1 has no value"),
    (r"AttValue: \" or ' expected", "the value of an attribute must be in quotes"),
    (r"AttValue: ' expected", "the value of an attribute has no closing quote"),
    (
        r"Unescaped '<' not allowed in attributes values",
        "an attribute contains '<' or has no closing quote; write &lt; for the character '<'",
    ),
    (r"attributes construct error", "attributes must be separated by spaces"),
    (
        r"(?:PCDATA i|I|xmlParse\w+: i)nvalid (?:xml)?Char(?: value)? (\d+).*",
        r"XML does not allow character number \1",
    ),
)


_PLAIN_DOCTYPE = compile_later(r"<!DOCTYPE(?:[^\[>\"']|\"[^\">]*\"|'[^'>]*'|\[[^\]<>\"']*\])*>")
"""DOCTYPE that ends at its first ``>``, so that it declares nothing."""


def check_doctype(source: Source) -> None:
    """Reject a DOCTYPE that does not end at its first ``>``, for example because it declares entities.

    Raises:
        NotWellFormedError: there is such a DOCTYPE; with its position.
    """
    start = next(
        (piece.start for piece in find_markup(source.text) if piece.kind == "doctype"), None
    )
    if start is not None and _PLAIN_DOCTYPE.match(source.text, start) is None:
        message = "OpenSim takes the first '>' in a DOCTYPE for its end and cannot load the file; remove the DOCTYPE"
        raise source.fault(NotWellFormedError, message, source.position(start))


def rephrase_message(message: str) -> str:
    """Return the parser's message in plain words, without its position."""
    message = " ".join(decode_name(re.sub(r", line \d+, column \d+$", "", message)).split())
    for pattern, words in _PLAIN:
        match = re.fullmatch(pattern, message)
        if match is not None:
            return match.expand(words)
    return message


def locate_error(source: Source, line: int, column: int, message: str) -> Position:
    """Return the position in the text at which the parser stopped.

    Args:
        source: text of the document.
        line: line of the parser's message.
        column: column of the parser's message, which is after a wrong closing tag.
        message: message of the parser.
    """
    lines = source.lines
    line = min(max(line, 1), len(lines))
    text = lines[line - 1]
    column = min(max(column, 1), len(text) + 1)
    if "tag mismatch" in message:
        column = max(text.rfind("</", 0, column - 1), 0) + 1
    return Position(line, max(1, min(column, len(text))))
