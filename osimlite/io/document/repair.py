"""Reading of text that is almost XML, where its meaning is certain.

No repair adds or removes a line or an element, so that all positions stay valid: each replaces
characters within one line, or replaces text outside of elements by blanks. Ambiguous text is an
error.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from html.entities import html5

from lxml import etree

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later
from osimlite.errors import NotWellFormedError
from osimlite.io.document.names import ATTRIBUTE, decode_name
from osimlite.io.document.notes import Note, NoteKind
from osimlite.io.document.source import Source
from osimlite.io.document.spans import find_markup
from osimlite.io.document.syntax import check_doctype

# A line that begins with seven brackets is no XML in any case.
_MARK = compile_later(r"^(?:<{7}|>{7})(?=[ \r]|$).*", re.MULTILINE)
_HYPHENS = compile_later(r"-{2,}|-\Z")
# XML has five entities of its own; the others of HTML are known to editors.
# OpenSim also rejects a character number without a semicolon.
_AMPERSAND = compile_later(r"&(?!#(?!x?;))(?:([A-Za-z][A-Za-z0-9]{0,31});)?")
_OWN_ENTITIES = frozenset(("amp", "lt", "gt", "quot", "apos"))
_NO_CHARACTER = compile_later("[\x01-\x08\x0e-\x1f\ufffe\uffff]")
_NUMBERED = compile_later(r"&#(?:x([0-9a-fA-F]+)|([0-9]+));")
_VALUE = compile_later(
    r"\"[^\"]*\"|'[^']*'|"
    r"(?<=\s)(?P<name>[^\s=\"'<>/]+)\s*=(?:\s*(?P<bare>[^\s=\"'<>/]+)(?=[\s/>])|(?=\s*/?>))"
)
_TOUCHING = compile_later(r"(?:\"[^\"]*\"|'[^']*')(?=[^\s/>?\"'])")
_SOUND_DECLARATION = compile_later(
    r"<\?xml\s+version\s*=\s*([\"'])1\.[0-9]+\1(?:\s+encoding\s*=\s*([\"'])[A-Za-z][\w.-]*\2)?"
    r"(?:\s+standalone\s*=\s*([\"'])(?:yes|no)\3)?\s*\?>",
    re.ASCII,
)
_OPEN_DECLARATION = compile_later(r"[\s\ufeff]*(<\?xml\b[^<>]*>)(?<!\?>)")
_NAMED = compile_later(r"<\?[^\W\d][\w.:-]*(?:\s|\?>)")
_ENDING = compile_later(r"\]\]>")
_XML_IN_CAPITALS = compile_later(r"<\?xml(?![\w.:-])", re.IGNORECASE)
_REPLACEMENT = "\ufffd"
_BLANK_CONTROLS = compile_later("[\f\v]")
_DECLARATION = compile_later(r"<\?xml\s")
_SPECIAL = compile_later(r"<!(?:--|\[CDATA\[)")
_EN_DASH = "\u2013"


class Repair(NamedTuple):
    """Repair of one piece of text.

    Attributes:
        kind: type of the note about it.
        offset: character offset in the text.
        word: original text.
        replacement: text as which it was read.
    """

    kind: NoteKind
    offset: int
    word: str
    replacement: str


def read_repaired(
    source: Source, fault: NotWellFormedError, parse: Callable[[Source], etree._Element]
) -> tuple[etree._Element, list[Note]]:
    """Parse a text after repairing its syntax errors.

    Args:
        source: text of the document.
        fault: error of the parser.
        parse: function that parses the repaired text.

    Returns:
        The root element, and notes about the repairs.

    Raises:
        NotWellFormedError: the meaning is not certain; with line and column of the error.
    """
    # 1. Refuse what is ambiguous.
    mark = _MARK.search(source.text)
    if mark is not None:
        advice = (
            f"'{mark[0].rstrip()[:40]}' is a mark of the merge; keep one side and delete the marks"
        )
        raise source.fault(
            NotWellFormedError, f"an unfinished merge: {advice}", source.position(mark.start())
        )
    unended = _find_unclosed(source.text)
    if unended is not None:
        message = "not well-formed XML: the markup that begins here with '<!' is not closed"
        raise source.fault(NotWellFormedError, message, source.position(unended))
    check_doctype(source)
    # 2. Repair, and parse again.
    text, repairs = repair_text(source.text)
    if not repairs or not source.spans:
        raise fault
    root = parse(Source(text.encode("utf-8", "replace"), source.file))
    spans = source.spans
    # 3. The repaired text must have the same elements, or positions would be wrong.
    tags = [element.tag for element in root.iter(etree.Element)]
    if len(tags) != len(spans) or any(
        span.tag != decode_name(tag) for span, tag in zip(spans, tags, strict=True)
    ):
        raise fault
    notes = []
    # The elements around the repairs are found in one pass, which needs ascending offsets.
    repairs.sort(key=lambda repair: repair.offset)
    for repair, number in zip(
        repairs, find_elements_at(source, [repair.offset for repair in repairs]), strict=True
    ):
        line = source.position(repair.offset).line
        notes.append(Note(repair.kind, number, repair.word, value=repair.replacement, line=line))
    return root, notes


def find_elements_at(source: Source, offsets: Sequence[int]) -> Iterator[int]:
    """Yield the index of the innermost element around each of some characters; 0, the root, outside all.

    Args:
        source: text of the document.
        offsets: character offsets in ascending order.
    """
    spans = source.spans
    count = len(source.spans)
    following = 0
    around: list[int] = []
    for offset in offsets:
        while following < count and spans[following].start <= offset:
            # Leave the elements that end before this one starts.
            while around and spans[around[-1]].end <= spans[following].start:
                around.pop()
            around.append(following)
            following += 1
        while around and spans[around[-1]].end <= offset:
            around.pop()
        yield around[-1] if around else 0


def repair_text(text: str) -> tuple[str, list[Repair]]:
    """Repair the syntax errors of a text whose meaning is certain.

    Returns:
        The repaired text, and the repairs.
    """
    repairs: list[Repair] = []
    # Form feed and vertical tab are blanks for OpenSim and no XML.
    for match in _BLANK_CONTROLS.finditer(text):
        repairs.append(Repair("control-character", match.start(), f"\\x{ord(match[0]):02x}", " "))
    text = _BLANK_CONTROLS.sub(" ", text)
    for match in _NO_CHARACTER.finditer(text):
        repairs.append(Repair("overlooked", match.start(), match[0], "OpenSim keeps it"))
    # XML cannot contain these characters; a replacement of the same length keeps all positions.
    text = _NO_CHARACTER.sub(_REPLACEMENT, text)
    unended = _OPEN_DECLARATION.match(text)
    if unended is not None:
        repairs.append(Repair("overlooked", unended.start(1), unended[1], "OpenSim passes over it"))
        text = _replace_by_blanks(unended[0]) + text[unended.end() :]
    pieces: list[str] = []
    # `depth` counts open elements: text outside of the root is treated differently.
    offset = depth = 0
    # `as_opensim`: comments and sections end where OpenSim's parser ends them.
    for kind, start, end, _ in find_markup(text, as_opensim=True):
        gap, piece = text[offset:start], text[start:end]
        pieces.append(
            _repair_outside(gap, offset, repairs)
            if not depth
            else _escape_ampersands(gap, offset, repairs)
        )
        if kind == "comment":
            piece = _repair_comment(piece, start, repairs)
        elif kind == "instruction":
            if _DECLARATION.match(piece) and offset > 0:
                repairs.append(Repair("late-declaration", start, piece, ""))
                piece = _replace_by_blanks(piece)
            elif _is_no_instruction(piece):
                repairs.append(Repair("overlooked", start, piece, "OpenSim passes over it"))
                piece = _replace_by_blanks(piece)
        elif kind in ("open", "empty"):
            depth += kind == "open"
            piece = _quote_attributes(
                _escape_ampersands(_repair_attributes(piece, start, repairs), start, repairs),
                start,
                repairs,
            )
        elif kind == "close":
            # A closing tag without a start tag.
            if not depth:
                repairs.append(Repair("overlooked", start, piece, "OpenSim passes over it"))
                piece = _replace_by_blanks(piece)
            depth = max(0, depth - 1)
        pieces.append(piece)
        offset = end
    pieces.append(_repair_outside(text[offset:], offset, repairs) if not depth else text[offset:])
    return "".join(pieces), repairs


def _find_unclosed(text: str) -> int | None:
    """Return the offset of a comment, CDATA section or instruction without an end."""
    last_end = 0
    for _, _, end, _ in find_markup(text, as_opensim=True):
        last_end = end
    result = _SPECIAL.search(text, last_end)
    return None if result is None else result.start()


def _replace_by_blanks(text: str) -> str:
    """Return a text with every character but line ends replaced by a blank."""
    return re.sub(r"[^\r\n]", " ", text)


def _repair_outside(text: str, offset: int, repairs: list[Repair]) -> str:
    """Remove text before or after the root element.

    Returns:
        Text with blanks in place of what was removed.
    """
    before, nul, _ = text.partition("\0")
    if offset and nul and not before.strip():
        repairs.append(Repair("overlooked", offset + len(before), nul, "OpenSim reads no further"))
        return _replace_by_blanks(text)
    # A byte-order mark is white space here.
    stripped = text.strip("\ufeff \t\r\n")
    if offset and stripped.startswith("<?") and ">" not in stripped:
        repairs.append(
            Repair(
                "overlooked", offset + text.index("<?"), stripped[:40], "OpenSim reads no further"
            )
        )
    elif stripped and "<" not in stripped:
        word = stripped.splitlines()[0][:40]
        repairs.append(Repair("text-outside-root", offset + text.index(stripped), word, ""))
    elif not stripped and "\ufeff" in text:
        repairs.append(Repair("byte-order-mark", offset + text.index("\ufeff"), "\ufeff", ""))
    else:
        return text
    return _replace_by_blanks(text)


def _repair_comment(piece: str, offset: int, repairs: list[Repair]) -> str:
    """Return a comment with dashes in place of the hyphens that it must not have."""
    # Without "<!--" and "-->".
    comment_text = piece[4:-3]
    result = _HYPHENS.search(comment_text)
    if result is None:
        return piece
    repairs.append(
        Repair(
            "hyphens-in-comment", offset + 4 + result.start(), result[0], _EN_DASH * len(result[0])
        )
    )
    return f"<!--{_HYPHENS.sub(lambda match: _EN_DASH * len(match[0]), comment_text)}-->"


def _repair_attributes(piece: str, offset: int, repairs: list[Repair]) -> str:
    """Remove repeated attributes but the last, which counts for OpenSim.

    Returns:
        Tag with blanks in place of the removed attributes.
    """
    # The last one counts for OpenSim, the first for most other programs.
    matches = list(ATTRIBUTE.finditer(piece))
    last = {match["name"]: match for match in matches}
    for match in matches:
        winner = last[match["name"]]
        if match is not winner:
            repairs.append(
                Repair("duplicate-attribute", offset + match.start(), match["name"], winner[0])
            )
            piece = piece[: match.start()] + _replace_by_blanks(match[0]) + piece[match.end() :]
    return piece


def _is_no_instruction(piece: str) -> bool:
    """Return whether a text between ``<?`` and ``>`` is neither a declaration nor an instruction."""
    if not piece.endswith("?>"):
        return True
    if _DECLARATION.match(piece):
        return _SOUND_DECLARATION.fullmatch(piece) is None
    return _NAMED.match(piece) is None or _XML_IN_CAPITALS.match(piece) is not None


def _quote_attributes(piece: str, offset: int, repairs: list[Repair]) -> str:
    """Return a start tag with quotes around all values and a blank before each attribute."""

    def quote(match: re.Match[str]) -> str:
        if match["name"] is None:
            return match[0]
        consequence = (
            "OpenSim reads it as if it were quoted"
            if match["bare"]
            else "OpenSim reads an empty value"
        )
        repairs.append(Repair("overlooked", offset + match.start(), match[0], consequence))
        return f'{match["name"]}="{match["bare"] or ""}"'

    def add_blank(match: re.Match[str]) -> str:
        repairs.append(
            Repair(
                "overlooked", offset + match.start(), match[0], "OpenSim needs no blank behind it"
            )
        )
        return f"{match[0]} "

    # Most tags have no attributes.
    return _VALUE.sub(quote, _TOUCHING.sub(add_blank, piece)) if "=" in piece else piece


def _escape_ampersands(text: str, offset: int, repairs: list[Repair]) -> str:
    """Escape ampersands that begin no reference, and ends of CDATA sections outside of one.

    References of HTML are replaced by their characters. Of a reference by a number that is no
    character, OpenSim keeps one byte.

    Returns:
        Text in which every ampersand begins a reference that XML accepts.
    """
    if "]]>" in text:
        repairs += [
            Repair("overlooked", offset + ending.start(), ending[0], "OpenSim keeps it")
            for ending in _ENDING.finditer(text)
        ]
        # The end of a CDATA section must not occur in text.
        text = text.replace("]]>", "]]&gt;")
    if "&" not in text:
        return text

    def replace_invalid_number(match: re.Match[str]) -> str:
        # The ranges are those of XML 1.0, section 2.2.
        value = int(match[1], 16) if match[1] else int(match[2])
        if (
            value in (9, 10, 13)
            or 32 <= value < 0xD800
            or 0xE000 <= value < 0xFFFE
            or 0x10000 <= value < 0x110000
        ):
            return match[0]
        repairs.append(
            Repair("overlooked", offset + match.start(), match[0], "OpenSim reads it as one byte")
        )
        return _REPLACEMENT

    def escape_ampersand(match: re.Match[str]) -> str:
        name = match[1]
        if name in _OWN_ENTITIES:
            return match[0]
        replacement = html5.get(f"{name};") if name else None
        repairs.append(
            Repair("bare-ampersand", offset + match.start(), match[0], replacement or match[0])
        )
        if replacement is None:
            # Line feeds would move all positions below.
            return "&amp;" + match[0][1:]
        return replacement.replace("\n", " ").replace("&", "&amp;").replace("<", "&lt;")

    return _AMPERSAND.sub(escape_ampersand, _NUMBERED.sub(replace_invalid_number, text))
