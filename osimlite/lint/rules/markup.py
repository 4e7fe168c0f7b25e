"""OSIM0xx: markup that OpenSim reads differently from other XML parsers."""

from __future__ import annotations

from osimlite.base.patterns import compile_later
from osimlite.io.document.source import Source
from osimlite.io.document.spans import blank_comments
from osimlite.lint.diagnostic import Edit, Fix
from osimlite.lint.fixes import remove_text, replace_text
from osimlite.lint.registry import ERROR, INFO, REFUSES, RUNS, WARNING, FindingCollector, rule
from osimlite.lint.subject import Subject

_CONTROLS = compile_later("[\f\v]")
# The bracket first: one character is searched for much faster than a class of them.
_BLANK_BEFORE_END = compile_later(r">(?<=\s>)")
_BLANK_IN_CLOSING = compile_later(r"</[^<>\s]+(\s+)>")
_NUMBERED = compile_later(r"&#(?:x([0-9a-fA-F]+)|([0-9]+));")


@rule("OSIM008", "character-reference", severity=ERROR, fixes="safe", consequences=(RUNS,))
def report_character_reference(subject: Subject, report: FindingCollector) -> None:
    """A numeric character reference stands for a character beyond ASCII.

    Reports references such as `&#233;` with a number above 127.

    OpenSim keeps only the lowest byte of the number: a name with `&#233;` in it becomes invalid
    UTF-8, and `&#8364;` becomes another character. Write the character itself.

    ```xml
    - <credits>Ren&#233;</credits>
    + <credits>René</credits>
    ```
    """
    source = subject.source
    # One character is found much faster than two.
    if source is None or "&" not in source.text:
        return
    for match in _NUMBERED.finditer(source.text):
        number = int(match[1], 16) if match[1] else int(match[2])
        # ASCII is read correctly; larger numbers are no characters of Unicode.
        if 127 < number < 0x110000:
            report(
                f"OpenSim cuts '{match[0]}' to the byte 0x{number & 255:02X}; write the character "
                "itself",
                at=(position := source.position(match.start(), len(match[0]))),
                suggestion=chr(number),
                fix=replace_text(source, position, chr(number)),
            )


@rule("OSIM009", "lenient-xml", severity=WARNING, fixes="safe")
def report_lenient_xml(subject: Subject, report: FindingCollector) -> None:
    """The text has an XML error that OpenSim tolerates.

    Reports a bare `&`, `]]>`, two hyphens inside a comment, and characters that XML does not have.
    Also reports attribute values without quotes, attributes without a blank between them, and an
    XML declaration that is malformed or not at the very beginning.

    OpenSim's parser reads such a file, but most other XML readers reject it. OpenSim removes a bare
    `&`: from `Anna & Bert` it keeps `Anna` and `Bert`.

    ```xml
    - <credits>Anna & Bert</credits>
    + <credits>Anna &amp; Bert</credits>
    ```
    """
    source = subject.source
    if source is None:
        return
    offset = -1
    for note in subject.notes:
        if note.kind not in _OVERLOOKED:
            continue
        # Notes are in the order of the text, so the search continues after the previous word.
        offset = _find_word(source, max(offset + 1, source.line_start(note.line or 1)), note.word)
        position = source.position(offset, len(note.word.splitlines()[0]))
        match note.kind:
            case "bare-ampersand":
                is_entity = note.value != note.word
                better = str(note.value) if is_entity else f"&amp;{note.word[1:]}"
                consequence = (
                    f"leaves the & out and keeps '{note.word[1:]}'"
                    if is_entity
                    else "leaves it out"
                )
                report(
                    f"'{note.word}' is not valid XML; OpenSim {consequence}, other programs reject the "
                    "file",
                    at=position,
                    suggestion=better,
                    fix=replace_text(source, position, better),
                )
            case "hyphens-in-comment":
                report(
                    f"'{note.word}' is not allowed in a comment; OpenSim reads it, other programs "
                    "reject the file",
                    at=position,
                    suggestion="-",
                    fix=replace_text(source, position, "-"),
                )
            case "overlooked":
                # A single unprintable character is named by its code point.
                is_unprintable = len(note.word) == 1 and not note.word.isprintable()
                description = (
                    f"the character U+{ord(note.word):04X}"
                    if is_unprintable
                    else f"'{note.word.splitlines()[0][:40]}'"
                )
                report(
                    f"{description} is not valid XML; {note.value}, other programs reject the file",
                    at=position,
                )
            case "control-character":
                position = source.position(_find_control_character(source, offset))
                report(
                    f"the character {note.word} is not valid XML; OpenSim reads it as a blank, "
                    "other programs reject the file",
                    at=position,
                    fix=replace_text(source, position, " "),
                )
            case _:
                report(
                    "the XML declaration belongs at the very beginning; OpenSim reads it here, "
                    "other programs reject the file",
                    at=position,
                    fix=remove_text(source, offset, offset + len(note.word)),
                )
    start = source.text.find("<?xml")
    # Blanks before the declaration are the only text that the reader accepts there.
    if start > 0 and not source.text[:start].strip():
        report(
            "there are blanks before the XML declaration; OpenSim reads the file, other programs "
            "reject it",
            at=source.position(start, 5),
            fix=Fix((Edit(0, start, ""),)),
        )


_OVERLOOKED = frozenset(
    ("bare-ampersand", "hyphens-in-comment", "control-character", "late-declaration", "overlooked")
)


def _find_word(source: Source, start: int, word: str) -> int:
    word_start = source.text.find(word, start)
    return word_start if word_start >= 0 else start


def _find_control_character(source: Source, start: int) -> int:
    match = _CONTROLS.search(source.text, start)
    return match.start() if match is not None else start


@rule("OSIM011", "text-outside-root", severity=ERROR, fixes="safe", consequences=(REFUSES,))
def report_text_outside_root(subject: Subject, report: FindingCollector) -> None:
    """There is text before or after the root element.

    Reports text outside `<OpenSimDocument>`: notes that are not comments, remains of an editor, or
    a byte-order mark that is not at the beginning.

    OpenSim then finds no root element and rejects the file, with a message about an invalid node.
    Write notes as comments: `<!-- ... -->`.

    ```document
    - scaled by Anna, 2021
    + <!-- scaled by Anna, 2021 -->
      <OpenSimDocument Version="40600">
          <Model name="empty" />
      </OpenSimDocument>
    ```
    """
    source = subject.source
    for note in subject.notes if source is not None else ():
        assert source is not None
        if note.kind in ("text-outside-root", "byte-order-mark"):
            start = _find_word(source, source.line_start(note.line or 1), note.word)
            if not start and note.kind == "byte-order-mark":
                # Two of them at the beginning do no harm.
                continue
            description = (
                "a byte-order mark" if note.kind == "byte-order-mark" else f"the text '{note.word}'"
            )
            report(
                f"{description} is outside the root element: OpenSim rejects the file",
                at=source.position(start, len(note.word)),
                fix=remove_text(source, start, start + 1)
                if note.kind == "byte-order-mark"
                else None,
            )


@rule("OSIM012", "byte-order-mark", severity=INFO)
def report_byte_order_mark(subject: Subject, report: FindingCollector) -> None:
    """The file has a byte-order mark.

    Reports the bytes EF BB BF at the beginning of a file, which some Windows editors write, and the
    same mark between elements.

    OpenSim and XML readers ignore it. But joining, cutting or comparing files with other tools can
    move it into a name or a number, where it is invisible.

    ```document
    - \ufeff<OpenSimDocument Version="40600">
    + <OpenSimDocument Version="40600">
          <Model name="empty" />
      </OpenSimDocument>
    ```
    """
    source = subject.source
    if source is not None and source.encoding == "utf-8-sig":
        report("the file begins with a byte-order mark", at=source.position(0))


@rule("OSIM013", "closing-tag", severity=ERROR, fixes="safe")
def report_closing_tag(subject: Subject, report: FindingCollector) -> None:
    """There is white space in a closing tag.

    Reports closing tags such as `</mass >`, and closing tags that span two lines.

    XML allows this, so editors and other programs accept it. OpenSim's parser does not accept it,
    and OpenSim cannot load the file.

    ```xml
    - <Body name="thigh"> <mass>8</mass > <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    + <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    source = subject.source
    if source is None or not _BLANK_BEFORE_END.search(source.text):
        return
    # Closing tags inside comments are no tags; their length is kept.
    plain = blank_comments(source.text, "-")
    for match in _BLANK_IN_CLOSING.finditer(plain):
        start, end = match.span(1)
        report(
            f"OpenSim cannot read '{''.join(match[0].split())[:-1]} ': white space is not allowed "
            "in a closing tag",
            at=source.position(match.start(), start - match.start()),
            suggestion="".join(match[0].split()),
            fix=Fix((Edit(start, end, ""),)),
        )
