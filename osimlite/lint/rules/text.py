"""OSIM0xx: faults of the text itself, such as its encoding, syntax and version."""

from __future__ import annotations

import codecs
import re
from typing import Final

from osimlite.base.patterns import compile_later
from osimlite.base.text import append_clause
from osimlite.errors import NotWellFormedError, VersionError
from osimlite.io.document.parsing import is_binary
from osimlite.io.document.source import Source
from osimlite.lint.fixes import rename_tag
from osimlite.lint.registry import ERROR, INFO, REFUSES, RUNS, WARNING, FindingCollector, rule
from osimlite.lint.subject import Subject
from osimlite.schema.model import CURRENT_VERSION

# The line of seven "=" between the two sides is left out: it may occur in a comment.
_CONFLICT = compile_later(r"^(<{7}|>{7})(?= |$)[^\n]*", re.MULTILINE)
_OLDEST_FOR_OPENSIM = 10901
"""Oldest version that OpenSim 4.6 loads."""
_SOCKETS = 30505
"""Version in which joints, points and forces got sockets."""
_SOCKET = compile_later(r"<(socket_\w+)>")
_LATE: Final = (
    (compile_later(r"\w+Joint"), ("socket_parent_frame", "socket_child_frame")),
    (compile_later("Marker"), ("socket_parent_frame",)),
    (
        compile_later("(?:Conditional|Moving)PathPoint"),
        ("socket_coordinate", *(f"socket_{x}_coordinate" for x in "xyz")),
    ),
    (compile_later(r"Contact(?:HalfSpace|Sphere|Mesh)"), ("socket_frame",)),
    (compile_later(r"\w*BushingForce|WeldConstraint"), ("socket_frame1", "socket_frame2")),
    (compile_later("(?:Point|ConstantDistance)Constraint"), ("socket_body_1", "socket_body_2")),
    (compile_later("PointOnLineConstraint"), ("socket_line_body", "socket_follower_body")),
)
"""Sockets that OpenSim does not read in an older document, by class."""


@rule("OSIM001", "syntax-error", severity=ERROR)
def report_syntax_error(subject: Subject, report: FindingCollector) -> None:
    """The text is not well-formed XML.

    Reports where the XML parser stops: a tag that is not closed, a stray `<` or `&`, a truncated
    file.

    OpenSim cannot load the file. osimlite still checks the tags and values before the error. It
    cannot check the rest, because nobody knows to which element the rest belongs. It also checks no
    references, because they may lead into the rest.

    ```xml
    - <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia>
    + <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    # Conflict markers are no XML either; OSIM005 explains them better.
    if subject.source is None or _find_conflicts(subject.source):
        return
    for fault in subject.faults:
        if isinstance(fault, NotWellFormedError):
            _report_at(
                subject.source,
                report,
                append_clause(fault.message, _describe_extent(subject)),
                fault.line,
                fault.column,
            )


def _describe_extent(subject: Subject) -> str:
    """Return how much of a text with a syntax error was checked."""
    # Below line 2 nothing was read with certainty.
    if subject.model is None or subject.sure_until is None or subject.sure_until < 2:
        return "nothing else is checked until this is fixed"
    return f"until this is fixed, only tags and values above line {subject.sure_until} are checked"


@rule("OSIM010", "unused-ignore", severity=INFO)
def report_unused_ignore(subject: Subject, report: FindingCollector) -> None:
    """A comment ignores a finding that does not exist.

    Reports `<!-- osimlite: ignore CODE -->` for each code without a finding in its scope. The scope
    of such a comment is its line. If the comment is alone on its line, the scope is the element
    that follows. Before the root element, the scope is the whole file. In a table, a line
    `osimlite: ignore CODE` in the header applies to the whole table.

    Usually the problem was fixed, but the comment remained. It would hide the next problem.

    ```xml
      <Body name="thigh">
    -     <!-- osimlite: ignore OSIM203 -->
          <mass>8</mass>
          <inertia>0.1 0.1 0.02 0 0 0</inertia>
      </Body>
    ```
    """
    # The engine knows what was ignored, and reports it in the name of this rule.


@rule("OSIM002", "encoding", severity=WARNING, consequences=(REFUSES,))
def report_encoding(subject: Subject, report: FindingCollector) -> None:
    """The bytes are not in the encoding that the file declares.

    Reports the first byte that is not UTF-8 (or the encoding of the XML declaration). osimlite then
    reads the file as Windows text (cp1252). A file in UTF-16 or UTF-32 is an error.

    OpenSim copies the bytes unchanged. But every other XML reader rejects the file, and names with
    accents differ between programs. A file in UTF-16 or UTF-32 cannot be loaded by OpenSim at all.
    Save the file as UTF-8.

    ```document
    - <?xml version="1.0" encoding="US-ASCII" ?>
    + <?xml version="1.0" encoding="UTF-8" ?>
      <OpenSimDocument Version="40600">
          <Model name="leg"> <credits>Müller, 2016</credits> </Model>
      </OpenSimDocument>
    ```
    """
    source = subject.source
    if source is not None and source.encoding in ("utf-16", "utf-32"):
        report(
            f"the file is in {source.encoding.upper()}: OpenSim cannot load it; save it as UTF-8",
            at=source.position(0),
            severity=ERROR,
        )
    # A binary file is no text in any encoding.
    if source is None or is_binary(source.text):
        return
    # The declaration is read from the bytes, since the encoding is what is in doubt.
    declared = re.match(rb"\s*<\?xml[^>]*?encoding\s*=\s*[\"']([A-Za-z0-9._-]+)", source.data)
    name = declared[1].decode() if declared else "UTF-8"
    if source.encoding not in ("cp1252", "latin-1") and _is_known_encoding(name):
        return
    try:
        source.data.decode(name)
    except UnicodeDecodeError as error:
        # A byte-order mark decodes to a character that no editor counts as a column.
        before = source.data[: error.start].decode(name).removeprefix("\ufeff")
        report(
            f"byte 0x{source.data[error.start]:02X} is not {name}; the text is read as "
            f"{source.encoding}",
            at=source.position(len(before)),
        )
    except LookupError:
        report(
            f"the encoding '{name}' is not known; the text is read as {source.encoding}",
            at=source.position(0),
        )


def _is_known_encoding(name: str) -> bool:
    """Return whether Python can decode an encoding."""
    try:
        codecs.lookup(name)
    except LookupError:
        return False
    return True


@rule("OSIM003", "not-a-model", severity=ERROR, fixes="unsafe")
def report_not_a_model(subject: Subject, report: FindingCollector) -> None:
    """The document is XML, but not an OpenSim model.

    Reports a root element other than `<OpenSimDocument>`, with the correct spelling if it is known,
    and a document without a `<Model>`. In a folder, osimlite skips and counts XML files of other
    programs. A file counts as OpenSim's if its root is spelt almost like `OpenSimDocument`, or if
    it contains a class of OpenSim with its properties. Special files (a pipe, a device), and files
    larger than 100 MB or the setting `largest-file`, are reported and not read.

    OpenSim fails with a message about a missing node, or creates an empty model without a message.

    ```document
    - <OpenSimDokument Version="40600">
    + <OpenSimDocument Version="40600">
          <Model name="empty" />
    - </OpenSimDokument>
    + </OpenSimDocument>
    ```
    """
    if subject.source is None:
        return
    for fault in subject.faults:
        # Faults of syntax and version have the rules OSIM001 and OSIM004.
        if isinstance(fault, (NotWellFormedError, VersionError)):
            continue
        # The suggestion is printed apart.
        message = fault.message.removesuffix(f"; did you mean '{fault.meant}'?")
        if fault.meant is None or not subject.source.well_formed:
            _report_at(subject.source, report, message, fault.line, fault.column)
            continue
        root = subject.source.locate_tag(0)
        # The wrong tag is the root, or the element inside it.
        number = int((root.line, root.column) != (fault.line, fault.column))
        fix = rename_tag(subject.source, number, fault.meant, safe=False)
        report(message, at=subject.source.locate_tag(number), suggestion=fault.meant, fix=fix)


@rule("OSIM004", "document-version", severity=ERROR, consequences=(REFUSES, RUNS))
def report_document_version(subject: Subject, report: FindingCollector) -> None:
    """The document has no version or an unsupported one.

    Reports a `Version` that is missing, not a whole number, too old for osimlite, or newer than
    that of OpenSim 4.6. Also reports a version that is too old for a socket in the document:
    OpenSim had no such socket at that time.

    OpenSim reads each file by the rules of its version. If the version is missing, OpenSim fails.
    If the version is unknown, OpenSim reads what it understands, without a message; the finding is
    then a warning.

    ```document
    - <OpenSimDocument>
    + <OpenSimDocument Version="40600">
          <Model name="empty" />
      </OpenSimDocument>
    ```
    """
    if subject.source is None:
        return
    for fault in subject.faults:
        if isinstance(fault, VersionError):
            suggested_version = None if fault.version is not None else str(CURRENT_VERSION)
            report(fault.message, number=0, attribute="Version", suggestion=suggested_version)
    if subject.version is not None and subject.version > CURRENT_VERSION:
        report(
            f"version {subject.version} is newer than {CURRENT_VERSION}, the format of OpenSim "
            "4.6: OpenSim ignores newer content without a message",
            number=0,
            attribute="Version",
            severity=WARNING,
            suggestion=str(CURRENT_VERSION),
        )
    # OpenSim reads setups of every older version.
    if subject.about == "model":
        _report_old_version(subject, report)


def _report_old_version(subject: Subject, report: FindingCollector) -> None:
    """Report a version of a model that OpenSim rejects, or that is too old for its sockets."""
    assert subject.source is not None
    spans = subject.source.spans
    # A bare <Model> is read by OpenSim as a document without a version.
    has_root = bool(spans) and spans[0].tag != "Model"
    late = ""
    if subject.version is not None and subject.version < _SOCKETS:
        late = _find_late_socket(subject.source)
    if not has_root and late:
        report(
            "the <Model> is not inside an <OpenSimDocument>: OpenSim reads it as version "
            f"{subject.version} and "
            f'rejects it; put it into <OpenSimDocument Version="{CURRENT_VERSION}">, as `osimlite upgrade` does',
            number=0,
            consequence=REFUSES,
        )
        return
    if subject.version is not None and subject.version < _OLDEST_FOR_OPENSIM:
        # `osimlite upgrade` cannot write what a wrong version hides.
        advice = "; `osimlite upgrade` writes the model in the current format" if not late else ""
        report(
            f"version {subject.version} is too old for OpenSim 4.6, which rejects it{advice}",
            number=0,
            attribute="Version",
            consequence=REFUSES,
        )
    if late:
        report(
            f"the document says version {subject.version} but contains {late}, which came later: "
            "OpenSim reads the document by the rules of the old format and does not find this element",
            number=0,
            attribute="Version",
            suggestion=str(CURRENT_VERSION),
        )


def _find_late_socket(source: Source) -> str:
    """Return the first socket that is not read in an old document, as ``<socket> in <Class>``; empty without one."""
    if not _SOCKET.search(source.text):
        return ""
    for number, span in enumerate(source.spans):
        for cls, sockets in _LATE:
            if cls.fullmatch(span.tag):
                child_tags = {source.spans[child].tag for child in source.children(number)}
                late = [socket for socket in sockets if socket in child_tags]
                if late:
                    return f"<{late[0]}> in <{span.tag}>"
    return ""


@rule("OSIM005", "merge-conflict", severity=ERROR)
def report_merge_conflict(subject: Subject, report: FindingCollector) -> None:
    """The file contains merge conflict markers.

    Reports every line that begins with seven `<` or seven `>`.

    OpenSim cannot load the file, and its message points somewhere else.

    ```xml
    - <<<<<<< HEAD
    - <credits>Anna</credits>
    - =======
    - <credits>Bert</credits>
    - >>>>>>> feature
    + <credits>Anna and Bert</credits>
    ```
    """
    if subject.source is not None:
        for start, end in _find_conflicts(subject.source):
            report(
                "unfinished merge: keep one side and delete the conflict markers",
                at=subject.source.position(start, end - start),
            )


@rule("OSIM006", "duplicate-attribute", severity=ERROR, consequences=(RUNS,))
def report_duplicate_attribute(subject: Subject, report: FindingCollector) -> None:
    """An element has the same attribute twice.

    Reports two attributes with the same name.

    This is not valid XML. OpenSim uses the last attribute without a message; every other reader
    rejects the file.

    ```xml
    - <Marker name="hip" name="asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    + <Marker name="asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    ```
    """
    for note in subject.notes:
        if note.kind == "duplicate-attribute":
            report(
                f"the attribute '{note.word}' is given twice; OpenSim uses the last one",
                at=subject.attribute_name(note.number, note.word),
            )


@rule("OSIM007", "second-object", severity=ERROR, consequences=(RUNS,))
def report_second_object(subject: Subject, report: FindingCollector) -> None:
    """The document contains more than one object.

    Reports every element of the document after the first.

    OpenSim reads the first object and ignores the others without a message.

    ```document
      <OpenSimDocument Version="40600">
          <Model name="walker" />
    -     <Model name="runner" />
      </OpenSimDocument>
    ```
    """
    for note in subject.notes:
        if note.kind == "second-object":
            report(
                f"OpenSim reads only the first object of a document and ignores this <{note.word}>",
                number=note.number,
            )


def _find_conflicts(source: Source) -> list[tuple[int, int]]:
    # This saves a search in texts that are valid, which are nearly all.
    # In well-formed XML only a comment can hold the first marker, and it then holds the last one
    # too.
    if source.well_formed and not (source.remarks and ">>>>>>>" in source.text):
        return []
    if "<<<<<<<" not in source.text and ">>>>>>>" not in source.text:
        return []
    return [match.span() for match in _CONFLICT.finditer(source.text)]


def _report_at(
    source: Source, report: FindingCollector, message: str, line: int | None, column: int | None
) -> None:
    report(message, at=source.position(_compute_offset(source, line, column)))


def _compute_offset(source: Source, line: int | None, column: int | None) -> int:
    """Return the offset of the character at a line and column, at most the end of that line."""
    line = line or 1
    lines = source.lines
    if line > len(lines):
        return len(source.text)
    # The parser counts columns differently at the end of a line; the offset stays in its line.
    return source.line_start(line) + min(
        max((column or 1) - 1, 0), max(0, len(lines[line - 1]) - 1)
    )
