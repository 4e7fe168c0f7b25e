"""Text to objects: lxml parses, :mod:`osimlite.io.document.objects` makes objects of the elements."""

from __future__ import annotations

import gc
import os
import re
from codecs import BOM_UTF8
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, cast

from lxml import etree

from osimlite.base.files import TABLE_SUFFIXES, expect_size
from osimlite.base.records import dataclass, field
from osimlite.base.text import find_nearest
from osimlite.errors import (
    DocumentError,
    MissingFileError,
    NotWellFormedError,
    SpecialFileError,
    VersionError,
)
from osimlite.io.document.names import as_written, replace_colons
from osimlite.io.document.notes import Note
from osimlite.io.document.objects import (
    Included,
    ObjectReader,
    add_comment,
    estimate_size,
    get_layout,
)
from osimlite.io.document.source import Source
from osimlite.io.document.syntax import expect_plain_doctype, locate_error, rephrase_message
from osimlite.io.document.xml_text import has_only_generated_comments, is_element
from osimlite.schema.base import Object, put_index
from osimlite.schema.layout import Include, Remark
from osimlite.schema.model import CURRENT_VERSION, Model
from osimlite.schema.registry import find_class, list_tags
from osimlite.schema.specs import list_holding_properties

if TYPE_CHECKING:
    from osimlite.io.document.plugins import Paths
    from osimlite.io.document.upgrade import Change, Refusal, UpgradeResult

ROOT = "OpenSimDocument"

OLDEST = 10500
"""The version of documents from before documents said their version."""

OLDEST_KNOWN = 10901
"""The oldest version whose every word is known; of an older document nothing may be left over."""

_COUNT = etree.XPath("count(descendant-or-self::*)")

_MIXED = etree.XPath("/descendant::*[*][text()]")
"""Elements in which there is text beside an element; blank text the parser leaves out."""

_ATTRIBUTES = etree.XPath(
    "boolean(//@*[name() != 'name' and name() != 'file' and name() != 'Version'])"
)
"""Whether there is an attribute besides those that mean something."""

_LEAST_COUNTED = 100_000
"""Bytes that a file counts for at least when those that are included are added up: a small one costs time as well."""

_DEEPEST = 20
"""How many files that are included may be around each other."""
_TOO_DEEP = "is not read: files name each other too deeply"

_NOT_KNOWN = frozenset(("unknown-tag", "unknown-class", "wrong-class"))


@dataclass(slots=True)
class Document:
    """The object at the top of a document, with the text it came from and what the reader noticed in it.

    `fault` is the syntax error of a text that was repaired for reading.
    """

    top: Object
    source: Source
    version: int
    notes: list[Note] = field(default_factory=list)
    upgraded: UpgradeResult | None = None
    fault: NotWellFormedError | None = None

    @property
    def model(self) -> Model:
        """The model, for a document that was read as a model."""
        assert isinstance(self.top, Model)
        return self.top

    @property
    def refusals(self) -> list[Refusal]:
        """Elements over which OpenSim fails when it upgrades the document."""
        result = [] if self.upgraded is None else self.upgraded.refusals
        if not result:
            return []
        tops = (self.top, *(self.top.layout.defaults if self.top.layout is not None else ()))
        read = {item._index for top in tops for item in top.walk()}
        return [refusal for refusal in result if refusal.owner in read]

    @property
    def changes(self) -> list[Change]:
        """Changes of the upgrade, in the order of the document."""
        return [] if self.upgraded is None else self.upgraded.changes


def read(path: str | Path, *, classes: Paths = ()) -> Model:
    """Read a model file.

    Args:
        path: the file.
        classes: files that declare the classes of plug-ins; without them, objects of such classes
            stay text.

    Raises:
        DocumentError: the file is missing or is not an OpenSim model; with line and column.
        OsimliteError: a declaration of a class is wrong; with file and line.
    """
    from osimlite.io.document.plugins import classes_in_use

    with classes_in_use(classes):
        return read_document(Source.of_file(path)).model


def read_any(path: str | Path, *, classes: Paths = ()) -> Object:
    """Read a document of any kind: a model, the setup of a tool, a set of tasks, of markers, of loads.

    Args:
        path: the file.
        classes: files that declare the classes of plug-ins.

    Raises:
        DocumentError: the file is missing or is not an OpenSim document; with line and column.
        OsimliteError: a class is declared wrongly; with file and line.
    """
    from osimlite.io.document.plugins import classes_in_use

    with classes_in_use(classes):
        return read_document(Source.of_file(path), of=Object).top


def read_text(text: str | bytes, *, classes: Paths = ()) -> Model:
    """Read a model from the text of a document, with `classes` as for `read`; DocumentError if it is none."""
    from osimlite.io.document.plugins import classes_in_use

    with classes_in_use(classes):
        return read_document(
            Source(text) if isinstance(text, bytes) else Source.of_characters(text)
        ).model


def read_document(source: Source, *, of: type[Object] = Model, to_check: bool = False) -> Document:
    """Read a document whose top object is of a class or derived from it, and keep its text and the notes.

    A text that is `to_check` is also asked whether there is anything between its elements.

    Raises:
        DocumentError: the text is not an OpenSim document, or holds something else; with line and
            column.
    """
    try:
        root = parse_source(source)
        if to_check:
            mixed = cast("list[etree._Element]", _MIXED(root))
            source.mixed = (
                [number for number, each in enumerate(root.iter("*")) if each in mixed]
                if mixed
                else ()
            )
            source.attributes = cast("bool", _ATTRIBUTES(root))
    except NotWellFormedError as fault:
        from osimlite.io.document.repair import read_repaired

        root, notes = read_repaired(source, fault, parse_source)
        document = read_tree(source, root, read_version(source, root), of)
        document.notes[:0] = notes
        document.fault = fault
        return document
    return read_tree(source, root, read_version(source, root), of)


def read_tree(
    source: Source, root: etree._Element, version: int, of: type[Object] = Model
) -> Document:
    """The document that an element tree stands for.

    Raises:
        DocumentError: there is no such object in it, or something that no rule carries over from an
            older version.
    """
    with pause_collector():
        if version < CURRENT_VERSION:
            if root.tag != ROOT and has_newer_content(root, version):
                # A model that OpenSim dumps has no <OpenSimDocument> around it, and no version.
                wrapped = _upgrade_tree(source, root, CURRENT_VERSION)
                return _build_document(source, root, version, of, wrapped, is_known=True)
            return _build_document(source, root, version, of, _upgrade_tree(source, root, version))
        document = (
            None
            if _find_class(_find_first_element(root)) is None
            else _build_document(source, root, version, of, None)
        )
        if document is None or any(note.kind in _NOT_KNOWN for note in document.notes):
            from osimlite.io.document.upgrade import rename_old_classes

            upgraded = rename_old_classes(root)
            if document is None or upgraded is not None:
                document = _build_document(source, root, version, of, upgraded)
    return document


def has_newer_content(root: etree._Element, version: int) -> bool:
    """Return whether a document has properties that came after a version."""
    from osimlite.io.document.upgrade.newer import find_newer_content

    return find_newer_content(root, version) is not None


def require_stated_version(source: Source) -> None:
    """Check that a document has nothing newer than the version that it states.

    Raises:
        DocumentError: it is no OpenSim document.
        VersionError: it has something newer, so that its version is wrong.
    """
    from osimlite.io.document.upgrade.newer import find_newer_content

    try:
        root = parse_source(source)
    except NotWellFormedError:
        return
    version = read_version(source, root)
    newer = (
        None
        if root.tag != ROOT or version >= CURRENT_VERSION
        else find_newer_content(root, version)
    )
    if newer is None:
        return
    number = [*root.iter(etree.Element)].index(newer.element)
    message = (
        f"the document says version {version} and holds <{as_written(newer.element.tag)}> in "
        f"<{newer.parent}>, which came with version {newer.since}: one of them is wrong; write "
        f'Version="{CURRENT_VERSION}" if the model is in the current format'
    )
    raise _make_version_error(source, version, message, number)


def _build_document(
    source: Source,
    root: etree._Element,
    version: int,
    of: type[Object],
    upgraded: UpgradeResult | None,
    is_known: bool = False,
) -> Document:
    reader = ObjectReader(_make_include_reader(source))
    top = _read_top(source, root if upgraded is None else upgraded.root, reader, of)
    get_layout(top).version, get_layout(top).file = version, source.file
    notes = reader.notes
    if upgraded is not None:
        notes = _renumber(source, top, notes, upgraded)
        if isinstance(top, Model) and not is_known:
            _refuse_leftovers(source, version, notes)
    return Document(top, source, version, notes, upgraded)


def _upgrade_tree(source: Source, root: etree._Element, version: int) -> UpgradeResult:
    """The tree in the current format; VersionError if something cannot be carried over."""
    from osimlite.io.document.upgrade import UpgradeError, upgrade

    try:
        return upgrade(root, version)
    except UpgradeError as error:
        raise _make_version_error(source, version, error.message, error.number) from None


def _renumber(
    source: Source, top: Object, notes: list[Note], upgraded: UpgradeResult
) -> list[Note]:
    """Give everything read from an upgraded tree the place it has in the old text."""
    source.moved = upgraded.moved
    numbers = upgraded.numbers
    if numbers is None:
        return notes
    # What no one has asked for yet has no place; to ask for it here would make it.
    items: list[Object] = [top, *get_layout(top).defaults]
    for item in items:
        if item._index is not None:
            put_index(item, numbers[item._index])
        for _, name, *_ in list_holding_properties(type(item)):
            held = item.__dict__.get(name)
            items += held if isinstance(held, list) else [] if held is None else [held]
    return [note._replace(number=numbers[note.number]) for note in notes]


def _refuse_leftovers(source: Source, version: int, notes: list[Note]) -> None:
    """Refuse a document from before every word is known, if there is a word in it that no rule knows."""
    left = [note for note in notes if note.kind in _NOT_KNOWN]
    if version >= OLDEST_KNOWN or not left:
        return
    tags = ", ".join(f"<{tag}>" for tag in sorted({note.word for note in left})[:8])
    message = (
        f"document version {version} is older than {OLDEST_KNOWN}, and no rule says what becomes of {tags}: that would "
        "be lost; take it out, or open and save the model with OpenSim 2"
    )
    raise _make_version_error(source, version, message, left[0].number)


def _make_version_error(
    source: Source, version: int, message: str, number: int = 0
) -> VersionError:
    """The error that an element of a document of a version cannot be read."""
    fault = source.fault(VersionError, message, source.of_tag(number))
    fault.version = version
    return fault


def parse_source(source: Source, *, recover: bool = False) -> etree._Element:
    """The element tree of a text, without namespaces: see :mod:`osimlite.io.document.names`.

    With `recover` the parser goes on after what is not well-formed; the tree is then a guess.

    Raises:
        NotWellFormedError: the text is not well-formed (without `recover`), or declares entities.
    """
    data = source.data if source.encoding in ("utf-8", "utf-8-sig") else source.text.encode()
    data = replace_colons(data)
    # OpenSim accepts blank lines before the XML declaration, with or without a byte-order mark
    # before them.
    unmarked = data.removeprefix(BOM_UTF8)
    body = unmarked.lstrip()
    if body.startswith(BOM_UTF8):
        body = data
    blank = data[: len(data) - len(body)].count(b"\n")
    plain = has_only_generated_comments(data)
    parser = etree.XMLParser(
        encoding="utf-8",
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
        expect_plain_doctype(source)
        for remark in parser.error_log.filter_types(etree.ErrorTypes.WAR_UNDECLARED_ENTITY):
            # With a DOCTYPE the parser takes it that the entity is declared elsewhere, and leaves
            # it out.
            raise _make_syntax_error(source, remark.line + blank, remark.column, remark.message)
    if not recover:
        source.elements = int(cast("float", _COUNT(root)))
        source.remarks = not plain
    return root


def _make_syntax_error(source: Source, line: int, column: int, message: str) -> NotWellFormedError:
    """The error for what the parser says of a place in the text that it was given."""
    line, column, _ = locate_error(source, line, column, message)
    words = rephrase_message(message) if "<" in source.text else "there is no element in it"
    if source.file is not None and source.file.lower().endswith(TABLE_SUFFIXES):
        words += "; of tables, 'validate', 'info' and 'diff' know more"
    return NotWellFormedError(
        f"not well-formed XML: {words}", file=source.file, line=line, column=column
    )


def read_version(source: Source, root: etree._Element) -> int:
    """The version of the document.

    Raises:
        DocumentError: it is no OpenSim document.
        VersionError: the version is missing, no whole number, or too old to be read.
    """
    text = root.get("Version")
    # OpenSim reads an int of 32 bits, and nothing may follow it but blanks.
    digits = None if text is None else re.fullmatch(r"[ \t\r\n]*\+?0*([0-9]{1,10})[ \t\r\n]*", text)
    number = int(digits[1]) if digits is not None and int(digits[1]) < 2**31 else None
    if root.tag == ROOT and number is not None and number >= OLDEST:
        return number
    if text is None and root.tag != ROOT:
        from osimlite.io.document.upgrade.class_names import RENAMED

        if _find_class(root) is not None or root.tag in RENAMED:
            return OLDEST
    # Places cost a pass over the text, so they are computed for errors only.
    place = source.of_tag(0)
    if root.tag != ROOT:
        tag = as_written(root.tag)
        message = f"the root element is <{tag}>, not <OpenSimDocument>: this is no OpenSim document"
        raise _with_suggestion(source.fault(DocumentError, message, place), _guess_root(tag, root))
    if number is None:
        result = (
            "has no Version"
            if text is None
            else f'has Version="{text[:40]}", which is not a whole number'
        )
        raise source.fault(
            VersionError, f'<OpenSimDocument> {result}; write Version="{CURRENT_VERSION}"', place
        )
    message = (
        f"document version {number} is none that OpenSim ever wrote (they begin at {OLDEST}); "
        f'write Version="{CURRENT_VERSION}" if the model is in the current format'
    )
    raise _make_version_error(source, number, message)


def _with_suggestion(fault: DocumentError, meant: str | None) -> DocumentError:
    """A fault with the tag that was meant, if that is known."""
    if meant is not None:
        fault.meant = meant
        fault.message += f"; did you mean '{meant}'?"
    return fault


def _guess_root(tag: str, root: etree._Element) -> str | None:
    """Return the likely name of a root: that of a document, or the class of an old setup."""
    name = tag.rpartition(":")[2]
    first = _find_first_element(root)
    held = (
        first is not None
        and find_nearest(as_written(first.tag), list_tags(), cutoff=85) is not None
    )
    return (
        ROOT
        if held or find_nearest(name, [ROOT], cutoff=85) is not None
        else find_nearest(name, list_tags(), cutoff=85)
    )


def _find_first_element(root: etree._Element) -> etree._Element | None:
    """The element of the one object of a document."""
    return next((child for child in root if is_element(child)), None)


def _find_class(element: etree._Element | None) -> type[Object] | None:
    return None if element is None else find_class(as_written(element.tag))


def _read_top(
    source: Source, root: etree._Element, reader: ObjectReader, of: type[Object]
) -> Object:
    """Read the one object of a document, with the comments around it."""
    first = _find_first_element(root)
    cls = _find_class(first)
    if first is None or cls is None or not issubclass(cls, of):
        tag = ""
        if first is None:
            what = "no object" if of is Object else f"no <{of.tag}>"
        elif of is Object:
            tag = as_written(first.tag)
            what = f"a <{tag}>, which is no class of OpenSim 4.6"
        else:
            tag = as_written(first.tag)
            what = f"a <{tag}>, not a <{of.tag}>"
        at = source.of_tag(0 if first is None else 1)
        meant = (
            None
            if first is None or cls is not None
            else find_nearest(tag, list_tags() if of is Object else [of.tag])
        )
        raise _with_suggestion(source.fault(DocumentError, f"the document holds {what}", at), meant)
    reader.count = 1
    top = reader.top(first, cls)
    for second in first.itersiblings(etree.Element):
        reader.notes.append(Note("second-object", reader.count, as_written(second.tag)))
        reader.count += estimate_size(second)
    for place, nodes in (
        ("comments", [*first.itersiblings(preceding=True)][::-1]),
        ("after", first.itersiblings()),
        ("prolog", [*root.itersiblings(preceding=True)][::-1]),
        ("epilog", root.itersiblings()),
    ):
        remarks: list[Remark] = []
        for node in nodes:
            add_comment(node, remarks)
        if remarks:
            getattr(get_layout(top), place).extend(
                remarks if place == "after" else [remark.text for remark in remarks]
            )
    return top


def _make_include_reader(
    source: Source, around: tuple[str, ...] = (), read: list[int] | None = None
) -> Included | None:
    """What reads the objects that ``file`` attributes of a text name, from files beside it.

    A text without a file has none beside it. Like OpenSim, a file that cannot be read, or holds
    something else, or is being read already, leaves the object as it is. `around` are the files
    that are being read, `read` is how many bytes have been read of files so far: a few that name
    each other often enough would never end.
    """
    around_it = source.file
    if around_it is None:
        return None
    total = [0] if read is None else read

    def included(file: str, cls: type[Object]) -> tuple[Object, Include, list[Note]] | str:
        place = Path(around_it).parent / file
        path = os.path.realpath(place)
        if path in around:
            return "is being read already"
        if len(around) == _DEEPEST:
            return _TOO_DEEP
        try:
            inner = Source.of_file(place)
            total[0] += max(_LEAST_COUNTED, len(inner.data))
            expect_size(total[0], place)
            root = parse_source(inner)
            version = read_version(inner, root)
            if version < CURRENT_VERSION:
                root = _upgrade_tree(inner, root, version).root
            top = next((child for child in root if is_element(child)), None)
            if top is None or top.tag != cls.tag:
                return "holds none"
            reader = ObjectReader(_make_include_reader(inner, (*around, path), total))
            reader.count = 1
            item = reader.top(top, cls)
        except SpecialFileError as fault:
            return f"is not read: {fault.message.partition(': ')[2]}"
        except MissingFileError:
            return "is not there"
        except DocumentError:
            return "holds none"
        except RecursionError:
            return _TOO_DEEP
        return item, Include(file, path, item.copy_deep()), reader.notes

    return included


@contextmanager
def pause_collector() -> Iterator[None]:
    """Thousands of objects are made and none dropped: the garbage collector would look at them in vain."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()
