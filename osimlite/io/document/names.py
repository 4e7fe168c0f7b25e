"""Colons in the names of elements and attributes.

For OpenSim a colon is a letter: ``HuntCrossleyForce::ContactParameters`` is the name of a class, and
``xmlns`` is an attribute like any other. For lxml it separates a namespace. Therefore colons are
replaced by other characters while a text is parsed.
"""

from __future__ import annotations

from bisect import bisect_right

from osimlite.base.patterns import compile_later

_COLON = "\u02d0"
_XMLNS = "xml\u0274s"
_REPLACEMENTS = {b":": _COLON.encode(), b"xmlns": _XMLNS.encode()}

ATTRIBUTE = compile_later(
    r"(?<=\s)(?P<name>[^\s=\"'<>/]++)\s*+=\s*+(?P<quoted>\"[^\"]*+\"|'[^']*+')"
)
"""Attribute in a start tag, and its value with quotation marks."""
_COLONS = compile_later(b":")
_NAMESPACE = compile_later(rb"(?<=\s)xmlns(?=\s*=)")
_TAG_SO_FAR = compile_later(
    rb"</?[A-Za-z_\x80-\xff][^\s<>=\"'/]*"
    rb"(?:\s+[^\s<>=\"'/]+\s*=\s*(?:\"[^\"]*\"|'[^']*'))*"
    rb"(?:\s+[^\s<>=\"'/]+)?"
)
_MAX_TAG_LENGTH = 4096
"""Number of bytes before a colon that are searched for the start of its tag."""
_HIDING = ((b"<!--", b"-->"), (b"<![CDATA[", b"]]>"))


def encode_name(name: str) -> str:
    """Return a name as it appears in the element tree."""
    return name.replace(":", _COLON)


def decode_name(name: str) -> str:
    """Return a name of the element tree, or a message of the parser, with its colons restored."""
    return name.replace(_COLON, ":").replace(_XMLNS, "xmlns")


def replace_colons(data: bytes) -> bytes:
    """Return a UTF-8 text with the colons in names replaced.

    Every character keeps its line and column.
    """
    pieces = []
    copied_end = 0
    hidden: list[tuple[int, int]] | None = None
    result = [match.span() for match in _COLONS.finditer(data)]
    if b"xmlns" in data:
        result = sorted([*result, *(match.span() for match in _NAMESPACE.finditer(data))])
    for start, end in result:
        tag = data.rfind(b"<", max(0, start - _MAX_TAG_LENGTH), start)
        so_far = data[tag:start] if end - start == 1 else data[tag:start].rstrip()
        if tag < 0 or _TAG_SO_FAR.fullmatch(so_far) is None:
            continue
        if hidden is None:
            hidden = _find_hidden_text(data)
        section_index = bisect_right(hidden, (tag, len(data))) - 1
        if section_index >= 0 and start < hidden[section_index][1]:
            continue
        pieces += [data[copied_end:start], _REPLACEMENTS[data[start:end]]]
        copied_end = end
    return b"".join([*pieces, data[copied_end:]]) if pieces else data


def _find_hidden_text(data: bytes) -> list[tuple[int, int]]:
    """Return start and end of all comments and CDATA sections, in order."""
    result = []
    for opening, ending in _HIDING:
        start = data.find(opening)
        while start >= 0:
            end = data.find(ending, start)
            if end < 0:
                break
            result.append((start, end))
            start = data.find(opening, end)
    return sorted(result)
