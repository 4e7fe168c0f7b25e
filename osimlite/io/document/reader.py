"""Reading of documents, with the files that they include.

:mod:`osimlite.io.document.parsing` makes the element tree, :mod:`osimlite.io.document.objects` the objects.
"""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, cast

from lxml import etree

from osimlite.base.files import expect_size
from osimlite.base.records import dataclass, field
from osimlite.base.text import add_article, find_nearest
from osimlite.errors import (
    DocumentError,
    MissingFileError,
    NotWellFormedError,
    SpecialFileError,
)
from osimlite.io.document.names import decode_name
from osimlite.io.document.notes import Note
from osimlite.io.document.objects import (
    IncludeReader,
    ObjectReader,
    add_comment,
    count_elements,
    get_layout,
)
from osimlite.io.document.source import Source
from osimlite.io.document.xml_text import is_element
from osimlite.schema.base import Object, put_index
from osimlite.schema.layout import Include, Remark
from osimlite.schema.model import CURRENT_VERSION, Model
from osimlite.schema.registry import list_tags
from osimlite.schema.specs import list_holding_properties

if TYPE_CHECKING:
    from osimlite.io.document.plugins import Paths
    from osimlite.io.document.upgrade import Change, Refusal, UpgradeResult

from osimlite.io.document.parsing import (
    ROOT,
    add_suggestion,
    find_first_element,
    find_tagged_class,
    make_version_error,
    parse_source,
    read_version,
)

FIRST_COMPLETE_VERSION = 10901
"""First version of which every property is known; older documents must not contain unknown ones."""

_MIXED = etree.XPath("/descendant::*[*][text()]")
"""Elements that contain both elements and text; the parser removes blank text."""

_ATTRIBUTES = etree.XPath(
    "boolean(//@*[name() != 'name' and name() != 'file' and name() != 'Version'])"
)
"""Whether there is an attribute besides those with a meaning."""

_MIN_INCLUDED_BYTES = 100_000
"""Bytes that an included file counts at least in the sum of included files, because small files take time, too."""

_MAX_INCLUDE_DEPTH = 20
"""Largest depth of files that include each other."""
_TOO_DEEP_MESSAGE = "is not read: too many levels of files that refer to each other"

_UNKNOWN_KINDS = frozenset(("unknown-tag", "unknown-class", "wrong-class"))


@dataclass(slots=True)
class Document:
    """Object at the top of a document, with its text and the notes of the reader.

    Attributes:
        top: object at the top of the document.
        source: text of the document.
        version: version of the document.
        notes: notes about content that OpenSim ignores.
        upgraded: result of the upgrade of an old document; None for a current one.
        fault: syntax error of a text that was repaired for reading.
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
        # An element that the reader passes over is no obstacle for OpenSim either.
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
        path: path of the model file.
        classes: files that declare the classes of plug-ins; without them, objects of such classes
            stay text.

    Returns:
        Model that the file contains.

    Raises:
        DocumentError: the file is missing or is not an OpenSim model; with line and column.
        OsimliteError: a declaration of a class is wrong; with file and line.
    """
    from osimlite.io.document.plugins import classes_in_use

    with classes_in_use(classes):
        return read_document(Source.from_file(path)).model


def read_any(path: str | Path, *, classes: Paths = ()) -> Object:
    """Read a document of any kind: a model, a tool setup, or a set of tasks, markers or loads.

    Args:
        path: path of the document.
        classes: files that declare the classes of plug-ins.

    Returns:
        Object at the top of the document.

    Raises:
        DocumentError: the file is missing or is not an OpenSim document; with line and column.
        OsimliteError: a class is declared wrongly; with file and line.
    """
    from osimlite.io.document.plugins import classes_in_use

    with classes_in_use(classes):
        return read_document(Source.from_file(path), expected_class=Object).top


def read_text(text: str | bytes, *, classes: Paths = ()) -> Model:
    """Read a model from the text of a document.

    Args:
        text: text of the document; bytes are decoded as a file would be.
        classes: files that declare the classes of plug-ins.

    Returns:
        Model that the text contains.

    Raises:
        DocumentError: the text is not an OpenSim model; with line and column.
        OsimliteError: a declaration of a class is wrong; with file and line.
    """
    from osimlite.io.document.plugins import classes_in_use

    with classes_in_use(classes):
        return read_document(
            Source(text) if isinstance(text, bytes) else Source.from_text(text)
        ).model


def read_document(
    source: Source, *, expected_class: type[Object] = Model, to_check: bool = False
) -> Document:
    """Read a document with its text and notes.

    Args:
        source: text of the document.
        expected_class: class of the object at the top, or one of its bases.
        to_check: whether to find text between elements and attributes without meaning, for the
            linter.

    Returns:
        Document with its object, text, version and notes.

    Raises:
        DocumentError: the text is not an OpenSim document, or has an object of another class; with
            line and column.
    """
    try:
        # 1. Parse the text; 2. on a syntax error parse a repaired text; 3. make objects of the
        # tree.
        root = parse_source(source)
        if to_check:
            # The search for text between elements is needed by the checks only.
            mixed = cast("list[etree._Element]", _MIXED(root))
            source.mixed = (
                [number for number, element in enumerate(root.iter("*")) if element in mixed]
                if mixed
                else ()
            )
            source.attributes = cast("bool", _ATTRIBUTES(root))
    except NotWellFormedError as fault:
        from osimlite.io.document.repair import read_repaired

        root, notes = read_repaired(source, fault, parse_source)
        document = read_tree(source, root, read_version(source, root), expected_class)
        document.notes[:0] = notes
        document.fault = fault
        return document
    return read_tree(source, root, read_version(source, root), expected_class)


def read_tree(
    source: Source, root: etree._Element, version: int, expected_class: type[Object] = Model
) -> Document:
    """Return the document that an element tree describes.

    Args:
        source: text from which the tree was parsed.
        root: root element.
        version: version of the document.
        expected_class: class of the object at the top, or one of its bases.

    Raises:
        DocumentError: the document has no such object, or content of an older version that cannot
            be upgraded.
    """
    with pause_collector():
        if version < CURRENT_VERSION:
            if root.tag != ROOT and has_newer_content(root, version):
                # A current model that OpenSim dumps has no <OpenSimDocument> around it, and therefore
                # no version.
                wrapped = _upgrade_tree(source, root, CURRENT_VERSION)
                return _build_document(
                    source, root, version, expected_class, wrapped, is_known=True
                )
            return _build_document(
                source, root, version, expected_class, _upgrade_tree(source, root, version)
            )
        document = (
            None
            # A first attempt without renaming: nearly all files have no old class names, and the
            # search for them takes time.
            if find_tagged_class(find_first_element(root)) is None
            else _build_document(source, root, version, expected_class, None)
        )
        if document is None or any(note.kind in _UNKNOWN_KINDS for note in document.notes):
            from osimlite.io.document.upgrade import rename_old_classes

            upgraded = rename_old_classes(root)
            if document is None or upgraded is not None:
                document = _build_document(source, root, version, expected_class, upgraded)
    return document


def has_newer_content(root: etree._Element, version: int) -> bool:
    """Return whether a document contains properties that are newer than its version.

    Args:
        root: root element.
        version: version that the document states.
    """
    from osimlite.io.document.upgrade.newer import find_newer_content

    return find_newer_content(root, version) is not None


def require_stated_version(source: Source) -> None:
    """Check that a document contains nothing newer than the version that it states.

    Raises:
        DocumentError: the text is not an OpenSim document.
        VersionError: it has newer content, so its version is wrong.
    """  # noqa: DOC501 - a function makes the error, which is named
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
    # Positions are found by the index of an element, which counts elements only.
    number = [*root.iter(etree.Element)].index(newer.element)
    message = (
        f"the document has version {version}, but <{decode_name(newer.element.tag)}> in "
        f"<{newer.parent}> exists only since version {newer.since}; write "
        f'Version="{CURRENT_VERSION}" if the model is in the current format'
    )
    raise make_version_error(source, version, message, number)


def _build_document(
    source: Source,
    root: etree._Element,
    version: int,
    expected_class: type[Object],
    upgraded: UpgradeResult | None,
    is_known: bool = False,
) -> Document:
    """Make the objects of an element tree, and map notes to the old text after an upgrade.

    Returns:
        Document with its objects; after an upgrade its notes name elements of the old text.
    """
    reader = ObjectReader(_make_include_reader(source))
    top = _read_top(source, root if upgraded is None else upgraded.root, reader, expected_class)
    get_layout(top).version, get_layout(top).file = version, source.file
    notes = reader.notes
    if upgraded is not None:
        notes = _map_to_old_text(source, top, notes, upgraded)
        if isinstance(top, Model) and not is_known:
            # A current model without a version has been upgraded from its real version.
            _check_leftovers(source, version, notes)
    return Document(top, source, version, notes, upgraded)


def _upgrade_tree(source: Source, root: etree._Element, version: int) -> UpgradeResult:
    """Return the tree in the current format.

    Raises:
        VersionError: some content cannot be upgraded.
    """  # noqa: DOC501 - a function makes the error, which is named
    from osimlite.io.document.upgrade import UpgradeError, upgrade

    try:
        return upgrade(root, version)
    except UpgradeError as error:
        raise make_version_error(source, version, error.message, error.number) from None


def _map_to_old_text(
    source: Source, top: Object, notes: list[Note], upgraded: UpgradeResult
) -> list[Note]:
    """Replace indices of elements in the upgraded tree by those in the old text.

    Returns:
        Notes with the indices of elements in the old text.
    """
    source.old_indices = upgraded.old_indices
    numbers = upgraded.numbers
    if numbers is None:
        return notes
    # Read instance dictionaries instead of attributes: accessing a default would create it.
    objects: list[Object] = [top, *get_layout(top).defaults]
    for owner in objects:
        if owner._index is not None:
            put_index(owner, numbers[owner._index])
        for _, name, *_ in list_holding_properties(type(owner)):
            value = owner.__dict__.get(name)
            objects += value if isinstance(value, list) else [] if value is None else [value]
    return [note._replace(number=numbers[note.number]) for note in notes]


def _check_leftovers(source: Source, version: int, notes: list[Note]) -> None:
    """Reject a very old document with unknown elements, which the upgrade would lose.

    Raises:
        VersionError: the document is older than `FIRST_COMPLETE_VERSION` and has unknown elements.
    """  # noqa: DOC501 - a function makes the error, which is named
    unknown_notes = [note for note in notes if note.kind in _UNKNOWN_KINDS]
    if version >= FIRST_COMPLETE_VERSION or not unknown_notes:
        # Newer documents lose what OpenSim loses as well; of older ones nothing is known.
        return
    tags = ", ".join(f"<{tag}>" for tag in sorted({note.word for note in unknown_notes})[:8])
    message = (
        f"document version {version} is older than {FIRST_COMPLETE_VERSION}, and osimlite cannot "
        f"convert {tags} of such documents, which would be lost; remove it, or open and save the "
        "model with OpenSim 2"
    )
    raise make_version_error(source, version, message, unknown_notes[0].number)


def _read_top(
    source: Source, root: etree._Element, reader: ObjectReader, expected_class: type[Object]
) -> Object:
    """Read the object of a document, with the comments around it.

    Returns:
        Object of the document.

    Raises:
        DocumentError: the document has no object of the class `expected_class`.
    """  # noqa: DOC501 - a function makes the error, which is named
    first_element = find_first_element(root)
    cls = find_tagged_class(first_element)
    if first_element is None or cls is None or not issubclass(cls, expected_class):
        tag = ""
        if first_element is None:
            description = "no object" if expected_class is Object else f"no <{expected_class.tag}>"
        elif expected_class is Object:
            tag = decode_name(first_element.tag)
            description = f"{add_article(f'<{tag}>')}, which is not a class of OpenSim 4.6"
        else:
            tag = decode_name(first_element.tag)
            description = f"{add_article(f'<{tag}>')}, not {add_article(f'<{expected_class.tag}>')}"
        position = source.locate_tag(0 if first_element is None else 1)
        suggestion = (
            None
            if first_element is None or cls is not None
            else find_nearest(
                tag, list_tags() if expected_class is Object else [expected_class.tag]
            )
        )
        raise add_suggestion(
            source.fault(DocumentError, f"the document holds {description}", position), suggestion
        )
    # Element 0 is the root, 1 the object.
    reader.count = 1
    top = reader.read_top(first_element, cls)
    for sibling in first_element.itersiblings(etree.Element):
        reader.notes.append(Note("second-object", reader.count, decode_name(sibling.tag)))
        reader.count += count_elements(sibling)
    # Comments before an element are listed backwards by lxml.
    for remark_field, nodes in (
        ("comments", [*first_element.itersiblings(preceding=True)][::-1]),
        ("after", first_element.itersiblings()),
        ("prolog", [*root.itersiblings(preceding=True)][::-1]),
        ("epilog", root.itersiblings()),
    ):
        remarks: list[Remark] = []
        for node in nodes:
            add_comment(node, remarks)
        if remarks:
            getattr(get_layout(top), remark_field).extend(
                remarks if remark_field == "after" else [remark.text for remark in remarks]
            )
    return top


def _make_include_reader(
    source: Source, around: tuple[str, ...] = (), read: list[int] | None = None
) -> IncludeReader | None:
    """Return a function that reads objects named by ``file`` attributes, from files relative to the text's.

    A text without a file includes nothing. As in OpenSim, a file that cannot be read, has another
    object, or is being read already, leaves the object unchanged.

    Args:
        source: text of the document.
        around: paths of the files that are being read.
        read: number of bytes of included files so far; limits files that include each other many times.
    """
    around_it = source.file
    if around_it is None:
        return None
    # The list is shared by all files that include each other.
    total = [0] if read is None else read

    def read_include(file: str, cls: type[Object]) -> tuple[Object, Include, list[Note]] | str:
        include_path = Path(around_it).parent / file
        path = os.path.realpath(include_path)
        if path in around:
            # A file that includes itself, directly or through others.
            return "refers back to itself, directly or through other files"
        if len(around) == _MAX_INCLUDE_DEPTH:
            return _TOO_DEEP_MESSAGE
        try:
            included = Source.from_file(include_path)
            # Each file counts at least some bytes, so that ten thousand tiny files are refused as
            # well.
            total[0] += max(_MIN_INCLUDED_BYTES, len(included.data))
            expect_size(total[0], include_path)
            root = parse_source(included)
            version = read_version(included, root)
            # An included file may have another version than the one around it.
            if version < CURRENT_VERSION:
                root = _upgrade_tree(included, root, version).root
            top = next((child for child in root if is_element(child)), None)
            if top is None or top.tag != cls.tag:
                return f"contains no {cls.tag}"
            reader = ObjectReader(_make_include_reader(included, (*around, path), total))
            reader.count = 1
            included_object = reader.read_top(top, cls)
        except SpecialFileError as fault:
            return f"is not read: {fault.message.partition(': ')[2]}"
        except MissingFileError:
            return "does not exist"
        except DocumentError:
            return "is not a document of OpenSim"
        except RecursionError:
            return _TOO_DEEP_MESSAGE
        return included_object, Include(file, path, included_object.copy_deep()), reader.notes

    return read_include


@contextmanager
def pause_collector() -> Iterator[None]:
    """Pause the garbage collector in a context.

    Reading makes thousands of objects and frees none, which the collector would scan in vain.
    """
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        # The collector may have been off before.
        if enabled:
            gc.enable()
