"""Text to model. lxml parses; one plan per class says what each tag becomes."""

from __future__ import annotations

import gc
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from lxml import etree

from osimlite.document.comments import is_generated
from osimlite.document.lexical import ABSENT, Unclean, converter
from osimlite.document.notes import Note
from osimlite.document.source import Source
from osimlite.errors import DocumentError
from osimlite.schema.base import FieldSpec, Layout, Object, Remark, Unknown, field_specs
from osimlite.schema.fields import Held, ObjectList
from osimlite.schema.model import CURRENT_VERSION, Model
from osimlite.schema.registry import class_for

OLDEST_READ = 40000

_COLONS = re.compile(rb"(</?[A-Za-z_][A-Za-z0-9_.-]*)::(?=[A-Za-z_])")
_STAND_IN = "\u00b7"
"""Takes the place of ``::`` in a tag: two bytes in UTF-8 as well, and legal in a name where ``::`` is not."""


@dataclass(slots=True)
class Document:
    """A model together with the text it came from and what the reader noticed in it."""

    model: Model
    source: Source
    version: int
    notes: list[Note] = field(default_factory=list)


def read(path: str | Path) -> Model:
    """Read a model file.

    Raises:
        DocumentError: the file is missing or is not an OpenSim model document; with line and column.
    """
    return read_document(Source.of_file(path)).model


def read_text(text: str | bytes) -> Model:
    """Read a model from the text of a document; DocumentError if it is none."""
    return read_document(Source(text if isinstance(text, bytes) else text.encode())).model


def read_document(source: Source) -> Document:
    """Read a model and keep its text and the notes.

    Raises:
        DocumentError: the text is not an OpenSim model document; with line and column.
    """
    with _collector_paused():
        root = parse(source)
        version = _version(source, root)
        reader = _Reader()
        model = reader.document(source, root)
        if version != CURRENT_VERSION:
            _layout_of(model).version = version
    return Document(model, source, version, reader.notes)


def parse(source: Source) -> etree._Element:
    """The element tree of a text, ``::`` in tags replaced by the stand-in.

    Raises:
        DocumentError: the text is not well-formed, or declares entities.
    """
    data = source.data if source.encoding in ("utf-8", "utf-8-sig") else source.text.encode()
    doctype = data.find(b"<!DOCTYPE")
    if doctype >= 0 and re.match(rb"<!DOCTYPE[^>]*\[", data[doctype : doctype + 4096]):
        line, column, _ = source.position(source.text.index("<!DOCTYPE"))
        raise DocumentError(
            "a DOCTYPE with declarations inside is not read; remove it",
            file=source.file, line=line, column=column,
        )  # fmt: skip
    if b"::" in data:
        data = _COLONS.sub(rb"\1" + _STAND_IN.encode(), data)
    parser = etree.XMLParser(encoding="utf-8", resolve_entities=False, no_network=True, load_dtd=False)
    try:
        return etree.fromstring(data, parser)
    except etree.XMLSyntaxError as error:
        line, column = error.position
        message = str(error.msg or "the text is not XML").split(", line")[0].replace(_STAND_IN, "::")
        if not data.strip():
            message = "the file is empty"
        raise DocumentError(
            f"not well-formed XML: {message}", file=source.file, line=max(line, 1), column=max(column, 1)
        ) from None


def _version(source: Source, root: etree._Element) -> int:
    text = root.get("Version")
    line, column, _ = source.of_tag(0)
    if root.tag != "OpenSimDocument":
        raise DocumentError(
            f"the root element is <{root.tag}>, not <OpenSimDocument>: this is no OpenSim document",
            file=source.file, line=line, column=column,
        )  # fmt: skip
    if text is None or not text.strip().isdecimal():
        found = "has no Version" if text is None else f'has Version="{text}", which is not a whole number'
        raise DocumentError(
            f'<OpenSimDocument> {found}; write Version="{CURRENT_VERSION}"', file=source.file, line=line, column=column
        )
    version = int(text)
    if version < OLDEST_READ:
        raise DocumentError(
            f"document version {version} is older than {OLDEST_READ}, which is not read yet; "
            "open and save the model with OpenSim 4 first",
            file=source.file, line=line, column=column,
        )  # fmt: skip
    return version


class Step(NamedTuple):
    """What to do with a child element: the action, the field, the text converter, the property."""

    action: int
    name: str
    convert: Callable[[str], Any]
    spec: FieldSpec


Read = TypeVar("Read", bound=Object)

_TEXT, _ONE, _WRAPPED, _LIST = range(4)


class Plan(NamedTuple):
    """How the children of one class's element are read: steps by tag, and named one-object properties by name."""

    steps: dict[Any, Step]
    named: dict[str, FieldSpec]


@cache
def plan_for(cls: type[Object]) -> Plan:
    """The plan of a class, made once from its declaration."""
    steps: dict[Any, Step] = {}
    named: dict[str, FieldSpec] = {}
    for tag, spec in field_specs(cls).items():
        tag = tag.replace("::", _STAND_IN)
        if not isinstance(spec.kind, Held):
            steps[tag] = Step(_TEXT, spec.name, converter(spec.kind), spec)
        elif spec.kind.form == "unnamed":
            steps[tag] = Step(_ONE, spec.name, str, spec)
        else:
            steps[tag] = Step(_LIST if spec.kind.form == "list" else _WRAPPED, spec.name, str, spec)
            if spec.kind.form == "single":
                named[spec.tag] = spec
    return Plan(steps, named)


class _Reader:
    """Walks one element tree. `count` is the number of the next element in document order."""

    def __init__(self) -> None:
        self.count = 0
        self.notes: list[Note] = []

    def document(self, source: Source, root: etree._Element) -> Model:
        self.count = 1
        model: Model | None = None
        pending: list[Remark] = []
        for child in root:
            if not _is_element(child):
                self._comment(child, pending)
            elif model is not None:
                self.notes.append(Note("second-object", self.count, child.tag))
                self.count += _size(child)
            elif child.tag == "Model":
                model = self.object(child, Model)
                _attach(model, pending)
                pending = []
            else:
                line, column, _ = source.of_tag(self.count)
                raise DocumentError(
                    f"the document holds a <{child.tag}>, not a <Model>", file=source.file, line=line, column=column
                )
        if model is None:
            line, column, _ = source.of_tag(0)
            raise DocumentError("the document holds no <Model>", file=source.file, line=line, column=column)
        if pending:
            _layout_of(model).after.extend(pending)
        for place, nodes in (("prolog", [*root.itersiblings(preceding=True)][::-1]), ("epilog", root.itersiblings())):
            outside: list[Remark] = []
            for node in nodes:
                self._comment(node, outside)
            if outside:
                getattr(_layout_of(model), place).extend(remark.text for remark in outside)
        return model

    def object(self, element: etree._Element, cls: type[Read], name: str | None = None) -> Read:
        """Read one element as an instance of `cls`; `name` overrides the attribute."""
        number = self.count
        self.count = number + 1
        steps, _ = plan_for(cls)
        values: dict[str, Any] = {}
        present: set[str] = set()
        late: list[tuple[Any, ...]] = []
        pending: list[Remark] = []
        before: dict[str | None, list[Remark]] = {}
        raw: dict[str, tuple[Any, str]] = {}
        for child in element:
            step = steps.get(child.tag)
            if step is None:
                if _is_element(child):
                    spec = self._indirect(child, cls, values, present, pending, late)
                    if spec is not None and pending:
                        before[spec.tag] = pending
                        pending = []
                else:
                    self._comment(child, pending)
                continue
            action, field_name, convert, spec = step
            if field_name in present:
                late.append(("duplicate-tag", self.count, spec.tag, spec, None))
                self.count += _size(child)
                continue
            if pending:
                before[spec.tag] = pending
                pending = []
            if action == _TEXT:
                here = self.count
                self.count = here + 1
                text = child.text or ""
                if len(child):
                    text = self._text_of(child, here, spec, late)
                present.add(field_name)
                try:
                    values[field_name] = convert(text)
                except Unclean as unclean:
                    value = None if unclean.value is ABSENT else unclean.value
                    if value is not None:
                        values[field_name] = value
                    raw[field_name] = (value, text)
                    late.append((unclean.trouble, here, unclean.word, spec, value))
            elif action == _LIST:
                self.count += 1
                values[field_name] = self._members(child, spec, late)
                present.add(field_name)
            elif action == _ONE:
                values[field_name] = self.object(child, class_for(spec.tag) or Unknown)
                present.add(field_name)
            else:
                self.count += 1
                members = self._members(child, spec, late)
                if members:
                    values[field_name] = members[0]
                present.add(field_name)
        attributes = element.attrib
        given = attributes.get("name", "")
        if given or name:
            values["name"] = given if name is None else name
            present.add("name")
        built = cls.build(values, present, number)
        if len(attributes) > 1 or (attributes and not given and "name" not in attributes):
            for key, text in ((str(key), str(text)) for key, text in attributes.items()):
                if key != "name":
                    _layout_of(built).attributes[key] = text
                    kind = "include" if key == "file" else "unknown-attribute"
                    late.append((kind, number, key, None, text))
        if pending:
            before[None] = pending
        if before:
            _layout_of(built).before = before
        if raw:
            defaults = {
                key: (getattr(built, key) if value is None else value, text) for key, (value, text) in raw.items()
            }
            _layout_of(built).raw = defaults
        for kind, where, word, spec, value in late:
            self.notes.append(Note(kind, where, word, built, spec, value))
        return built

    def _members(self, wrapper: etree._Element, spec: FieldSpec, late: list[tuple[Any, ...]]) -> ObjectList[Any]:
        """Read the objects inside ``<objects>`` or another wrapper."""
        members: ObjectList[Any] = ObjectList()
        pending: list[Remark] = []
        assert spec.accepts is not None
        for child in wrapper:
            tag = child.tag
            if not _is_element(child):
                self._comment(child, pending)
                continue
            cls = class_for(tag.replace(_STAND_IN, "::"))
            if cls is not None and issubclass(cls, spec.accepts):
                member = self.object(child, cls)
            else:
                late.append(("unknown-class" if cls is None else "wrong-class", self.count, tag, spec, cls))
                member = self._unknown(child)
            if pending:
                _attach(member, pending)
                pending = []
            members.append(member)
        if pending and members:
            _layout_of(members[-1]).after.extend(pending)
        return members

    def _indirect(
        self,
        child: etree._Element,
        cls: type[Object],
        values: dict[str, Any],
        present: set[str],
        pending: list[Remark],
        late: list[tuple[Any, ...]],
    ) -> FieldSpec | None:
        """Read a child whose tag is no property: an object by its property's name, or something unknown."""
        tag = child.tag.replace(_STAND_IN, "::")
        name = child.get("name")
        held = class_for(tag)
        named = plan_for(cls).named
        spec = named.get(name) if name is not None else None
        if spec is None and name is None and held is not None:
            # OpenSim takes an acceptable object without a name for a property that has none yet.
            free = (s for s in named.values() if s.name not in present and s.accepts and issubclass(held, s.accepts))
            spec = next(free, None)
        if spec is not None and spec.name not in present:
            assert spec.accepts is not None
            if held is not None and issubclass(held, spec.accepts):
                values[spec.name] = self.object(child, held, spec.tag)
                present.add(spec.name)
                return spec
            late.append(("unknown-class" if held is None else "wrong-class", self.count, tag, spec, held))
        elif spec is not None:
            late.append(("duplicate-tag", self.count, tag, spec, None))
        else:
            late.append(("unknown-tag", self.count, tag, None, held))
        pending.append(Remark(_xml(child), True))
        self.count += _size(child)
        return None

    def _unknown(self, element: etree._Element) -> Unknown:
        content = _xml(element)
        number = self.count
        self.count += _size(element)
        name = element.get("name") or ""
        values = {"name": name, "class_name": element.tag.replace(_STAND_IN, "::"), "content": content}
        return Unknown.build(values, {"name"} if name else set(), number)

    def _text_of(self, element: etree._Element, number: int, spec: FieldSpec, late: list[tuple[Any, ...]]) -> str:
        """The text of a value element that has comments or, wrongly, elements inside."""
        inner = [node for node in element if _is_element(node)]
        if inner:
            late.append(("child-in-value", number, inner[0].tag, spec, None))
            self.count += sum(_size(node) for node in inner)
        return "".join([element.text or "", *(node.tail or "" for node in element)])

    @staticmethod
    def _comment(node: etree._Element, pending: list[Remark]) -> None:
        text = node.text or ""
        if isinstance(node, etree._Comment) and not is_generated(text):
            pending.append(Remark(text, False))


def _is_element(node: etree._Element) -> bool:
    """Whether a node is an element, and no comment or processing instruction (whose tag is a function)."""
    return type(node.tag) is str


def _layout_of(item: Object) -> Layout:
    if item.layout is None:
        object.__setattr__(item, "_layout", Layout())
    assert item.layout is not None
    return item.layout


def _attach(item: Object, remarks: list[Remark]) -> None:
    if remarks:
        _layout_of(item).comments.extend(remark.text for remark in remarks)


def _size(element: etree._Element) -> int:
    """Number of elements in a subtree, its root included."""
    return sum(1 for _ in element.iter(etree.Element))


def _xml(element: etree._Element) -> str:
    text = etree.tostring(element, encoding="unicode", with_tail=False)
    return text.replace(_STAND_IN, "::")


@contextmanager
def _collector_paused() -> Iterator[None]:
    """Thousands of objects are made and none dropped: the garbage collector would look at them in vain."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()
