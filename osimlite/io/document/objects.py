"""Elements to objects: one plan per class says what each tag becomes."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, NamedTuple, TypeVar

from lxml import etree

from osimlite.io.document.lexical import ABSENT, UncleanText, make_converter
from osimlite.io.document.names import as_parsed, as_written
from osimlite.io.document.notes import Note, NoteKind
from osimlite.io.document.xml_text import format_element, is_element, is_generated_comment
from osimlite.schema.base import Object, Unknown
from osimlite.schema.fields import Held, ObjectList
from osimlite.schema.layout import Home, Include, Layout, Remark
from osimlite.schema.model import Model
from osimlite.schema.registry import cache_by_tags, find_class
from osimlite.schema.specs import FieldSpec, get_defaults, get_field_specs

Read = TypeVar("Read", bound=Object)
Included = Callable[[str, type[Object]], tuple[Object, Include, list[Note]] | str]
"""What reads the object of a class in a file; a text says why it cannot be read, as in "which is not there"."""

DEFAULTS = "defaults"


class Step(NamedTuple):
    """What to do with a child element: the action, the field, the text converter, the property."""

    action: int
    name: str
    convert: Callable[[str], Any]
    spec: FieldSpec


_TEXT, _ONE, _WRAPPED, _LIST = range(4)


class Plan(NamedTuple):
    """How the children of one class's element are read: steps by tag, and named one-object properties by name."""

    steps: dict[Any, Step]
    named: dict[str, FieldSpec]


@cache
def get_reading_plan(cls: type[Object]) -> Plan:
    """The plan of a class, made once from its declaration."""
    steps: dict[Any, Step] = {}
    named: dict[str, FieldSpec] = {}
    for tag, spec in get_field_specs(cls).items():
        tag = as_parsed(tag)
        if not isinstance(spec.kind, Held):
            steps[tag] = Step(_TEXT, spec.name, make_converter(spec.kind), spec)
        elif spec.kind.form == "unnamed":
            steps[tag] = Step(_ONE, spec.name, str, spec)
        else:
            steps[tag] = Step(_LIST if spec.kind.form == "list" else _WRAPPED, spec.name, str, spec)
            if spec.kind.form == "single":
                named[spec.tag] = spec
    return Plan(steps, named)


_Late = tuple[NoteKind, int, str, FieldSpec | None, Any]


def _find_factory(spec: FieldSpec, values: Mapping[str, Any]) -> Any:
    """The object of a property whose element holds none."""
    assert spec.factory is not None
    return spec.factory()


class _Extra:
    """What an element says beyond its properties; most say nothing of the kind."""

    __slots__ = ("before", "late", "pending", "raw")

    def __init__(self) -> None:
        self.pending: list[Remark] = []
        self.before: dict[str | None, list[Remark]] = {}
        self.raw: dict[str, tuple[Any, str]] = {}
        self.late: list[_Late] = []

    def settle(self, tag: str | None) -> None:
        """Put the remarks that wait before the property `tag`."""
        if self.pending:
            self.before.setdefault(tag, []).extend(self.pending)
            self.pending = []


class ObjectReader:
    """Walks one element tree. `count` is the number of the next element in document order.

    `included` reads the object of another file that a ``file`` attribute names. `defaults` is
    what the document's own ``<defaults>`` block says, by class; it ends with the document.
    """

    def __init__(self, included: Included | None = None) -> None:
        self.count = 0
        self.notes: list[Note] = []
        self.defaults: dict[type[Object], Object] = {}
        self.included = included
        self.home = Home()

    def top(self, element: etree._Element, cls: type[Read]) -> Read:
        """Read the object of a document; only there may a ``<defaults>`` block stand."""
        block = element.find(DEFAULTS)
        result: list[Object] = []
        if block is not None:
            start = self.count
            self.count += 2 + sum(
                estimate_size(node)
                for node in block.itersiblings(preceding=True)
                if is_element(node)
            )
            result = self._block(block)
            self.count = start
        top = self.object(element, cls, skip=block)
        if isinstance(top, Model):
            self.home.model = top
        if result:
            get_layout(top).defaults = result
        return top

    def object(
        self,
        element: etree._Element,
        cls: type[Read],
        name: str | None = None,
        skip: etree._Element | None = None,
    ) -> Read:
        """Read one element as an instance of `cls`; `name` overrides the attribute, `skip` is a child to pass over."""
        number = self.count
        self.count = number + 1
        values: dict[str, Any] = {}
        extra = self._children(element, cls, skip, values)
        present = set(values)
        for key, attribute in element.items():
            if key == "name":
                name = name or str(attribute)
            else:
                extra = extra or _Extra()
                kind: NoteKind = "include" if key == "file" else "unknown-attribute"
                extra.late.append((kind, number, as_written(str(key)), None, str(attribute)))
        if name:
            values["name"] = name
            present.add("name")
        inherited = self._inherit(cls, values) if self.defaults else None
        built = cls.build(values, present, number, self.home)
        if inherited:
            get_layout(built).inherited = inherited
        return built if extra is None else self._finish(built, extra)

    def _children(
        self,
        element: etree._Element,
        cls: type[Object],
        skip: etree._Element | None,
        values: dict[str, Any],
    ) -> _Extra | None:
        """Read the children of an element into `values`, by field name; what they say beyond that is returned."""
        steps, named = get_reading_plan(cls)
        extra: _Extra | None = None
        for child in element:
            step = steps.get(child.tag)
            if step is None:
                if child is skip:
                    self.count += estimate_size(child)
                else:
                    extra = extra or _Extra()
                    self._indirect(child, named, values, extra)
                continue
            action, field_name, convert, spec = step
            if field_name in values:
                extra = extra or _Extra()
                self._duplicate(child, spec, extra)
                continue
            if extra is not None:
                extra.settle(spec.tag)
            if action != _TEXT:
                values[field_name], late = self._held(child, cls, step, values)
                if late:
                    extra = extra or _Extra()
                    extra.late += late
                continue
            # Most elements are values, so they are read here and not in a method of their own.
            number = self.count
            self.count = number + 1
            text = child.text or ""
            if len(child):
                extra = extra or _Extra()
                text = self._text_of(child, number, spec, extra)
            try:
                values[field_name] = convert(text)
            except UncleanText as unclean:
                extra = extra or _Extra()
                values[field_name] = self._unclean(unclean, text, number, cls, spec, extra)
        return extra

    def _unclean(
        self,
        unclean: UncleanText,
        text: str,
        number: int,
        cls: type[Object],
        spec: FieldSpec,
        extra: _Extra,
    ) -> Any:
        """The value that stands for a text which reads only partly, or not at all."""
        missing = unclean.value is ABSENT
        value = self._default(cls, spec.name) if missing else unclean.value
        extra.raw[spec.name] = (value, text)
        extra.late.append((unclean.trouble, number, unclean.word, spec, None if missing else value))
        return value

    def _held(
        self, element: etree._Element, cls: type[Object], step: Step, values: Mapping[str, Any]
    ) -> tuple[Any, list[_Late]]:
        """Read the element of a property that holds objects: its value, and what is noted of it."""
        spec, number = step.spec, self.count
        if step.action == _ONE:
            return self._owned(element, spec.accepts), []
        members, late = self._members(element, spec)
        if step.action == _LIST:
            return members, late
        late += [
            ("duplicate-tag", left_out._index, left_out.tag, spec, None) for left_out in members[1:]
        ]
        if isinstance(spec.kind, Held) and spec.kind.form == "optional":
            return (members[0] if members else None), late
        if not members:
            made = getattr(cls, "in_place_of_none", None)
            if made is None:
                late.append(("empty", number, "", spec, None))
            return (made or _find_factory)(spec, values), late
        # The object of a property is called as the property is, also in the long form.
        members[0].__dict__["name"] = spec.tag
        members[0].model_fields_set.add("name")
        return members[0], late

    def _finish(self, built: Read, extra: _Extra) -> Read:
        """Give an object what its element said beyond its properties."""
        extra.settle(None)
        if extra.before:
            get_layout(built).before = extra.before
        if extra.raw:
            get_layout(built).raw = extra.raw
        for kind, where, word, spec, value in extra.late:
            if kind in ("include", "unknown-attribute"):
                get_layout(built).attributes[word] = value
            self.notes.append(Note(kind, where, word, built, spec, value))
        return built

    def _duplicate(self, element: etree._Element, spec: FieldSpec, extra: _Extra) -> None:
        """Keep a repeated property at the end, where OpenSim passes over it again."""
        extra.late.append(("duplicate-tag", self.count, spec.tag, spec, None))
        extra.before.setdefault(None, []).append(Remark(format_element(element), True))
        self.count += estimate_size(element)

    def _owned(self, element: etree._Element, cls: Any, name: str | None = None) -> Object:
        """Read the object of a property, from another file if a ``file`` attribute says so."""
        file = element.get("file") if self.included is not None else None
        if not file or self.included is None:
            return self.object(element, cls, name)
        result, number, known = self.included(str(file), cls), self.count, len(self.notes)
        if isinstance(result, str):
            empty: Object = self.object(element, cls, name)
            self.notes[known:] = [
                note._replace(why=result)
                if note.kind == "include" and note.number == number
                else note
                for note in self.notes[known:]
            ]
            return empty
        self.count += estimate_size(element)
        item, include, notes = result
        for part in item.walk():
            object.__setattr__(part, "_index", number)
            object.__setattr__(part, "_model", self.home)
        if name:
            object.__setattr__(item, "__dict__", {**item.__dict__, "name": name})
        get_layout(item).include = include
        self.notes.append(Note("include", number, "file", item, None, str(file)))
        self.notes.extend(
            note._replace(number=number) for note in notes if note.kind != "include" or note.why
        )
        return item

    def _members(
        self, wrapper: etree._Element, spec: FieldSpec
    ) -> tuple[ObjectList[Any], list[_Late]]:
        """Read the objects inside ``<objects>`` or another wrapper; and what is noted of them."""
        self.count += 1
        members: list[Any] = []
        late: list[_Late] = []
        pending: list[Remark] = []
        accepts = spec.accepts
        assert accepts is not None
        for child in wrapper:
            cls = _find_accepted_class(child.tag, accepts)
            if cls is not None:
                # OpenSim reads no other file for the members of a set.
                member: Object = self.object(child, cls) if spec.legacy else self._owned(child, cls)
                if isinstance(member, Model):
                    # Of a model inside another document the parts know their model by its tree.
                    member.tree()
            elif is_element(child):
                tag = as_written(child.tag)
                known = find_class(tag)
                late.append(
                    (
                        "unknown-class" if known is None else "wrong-class",
                        self.count,
                        tag,
                        spec,
                        known,
                    )
                )
                member = self._unknown(child)
            else:
                add_comment(child, pending)
                continue
            if pending:
                get_layout(member).comments.extend(remark.text for remark in pending)
                pending = []
            members.append(member)
        if pending and members:
            get_layout(members[-1]).after.extend(pending)
        return ObjectList(members), late

    def _indirect(
        self,
        child: etree._Element,
        named: dict[str, FieldSpec],
        values: dict[str, Any],
        extra: _Extra,
    ) -> None:
        """Read a child whose tag is no property: a comment, an object by its property's name, something unknown."""
        if not is_element(child):
            add_comment(child, extra.pending)
            return
        tag = as_written(child.tag)
        name = child.get("name") or None
        held = find_class(tag)
        spec = named.get(name) if name is not None else None
        if spec is None and name is None and held is not None:
            # OpenSim takes an acceptable object without a name for a property that has none yet.
            free = (
                s
                for s in named.values()
                if s.name not in values and _find_accepted_class(child.tag, s.accepts)
            )
            spec = next(free, None)
        if spec is not None and spec.name not in values:
            accepted = _find_accepted_class(child.tag, spec.accepts)
            if accepted is not None:
                extra.settle(spec.tag)
                values[spec.name] = self._owned(child, accepted, spec.tag)
                return
            extra.late.append(
                ("unknown-class" if held is None else "wrong-class", self.count, tag, spec, held)
            )
        elif spec is not None:
            self._duplicate(child, spec, extra)
            return
        else:
            extra.late.append(("unknown-tag", self.count, tag, None, held))
        extra.pending.append(Remark(format_element(child), True))
        self.count += estimate_size(child)

    def _unknown(self, element: etree._Element) -> Unknown:
        content = format_element(element)
        number = self.count
        self.count += estimate_size(element)
        name = element.get("name") or ""
        values = {"name": name, "class_name": as_written(element.tag), "content": content}
        return Unknown.build(values, {"name"} if name else set(), number, self.home)

    def _text_of(self, element: etree._Element, number: int, spec: FieldSpec, extra: _Extra) -> str:
        """The text of a value element that has comments or, wrongly, elements inside."""
        inner = [node for node in element if is_element(node)]
        if inner:
            extra.late.append(("child-in-value", number, as_written(inner[0].tag), spec, None))
            self.count += sum(estimate_size(node) for node in inner)
        elif (
            sum(
                1
                for piece in (element.text, *(node.tail for node in element))
                if piece and piece.strip()
            )
            > 1
        ):
            extra.late.append(("child-in-value", number, "!--", spec, None))
        return "".join([element.text or "", *(node.tail or "" for node in element)])

    def _block(self, block: etree._Element) -> list[Object]:
        """Read a ``<defaults>`` block; each object counts for those of its class that are read after it."""
        result: list[Object] = []
        for child in block:
            if not is_element(child):
                continue
            cls = find_class(as_written(child.tag))
            if cls is None:
                result.append(self._unknown(child))
                continue
            item = self.object(child, cls)
            self.defaults.setdefault(cls, item)
            result.append(item)
        return result

    def _default(self, cls: type[Object], name: str) -> Any:
        """The value of a text property that the file does not give."""
        block = self.defaults.get(cls)
        return get_defaults(cls)[0][name] if block is None else getattr(block, name)

    def _inherit(self, cls: type[Object], values: dict[str, Any]) -> frozenset[str]:
        """Take what the file does not give from the document's defaults; the names of the fields taken."""
        block = self.defaults.get(cls)
        if block is None:
            return frozenset()
        taken = frozenset(block.model_fields_set - values.keys() - {"name"})
        for name in taken:
            values[name] = copy.deepcopy(getattr(block, name))
        return taken


@cache_by_tags
def _find_accepted_class(tag: Any, accepts: type[Object] | None) -> type[Object] | None:
    """The class of a tag if it is one that a property for `accepts` may hold; a comment's tag is a function."""
    cls = find_class(as_written(tag)) if isinstance(tag, str) else None
    return cls if cls is not None and accepts is not None and issubclass(cls, accepts) else None


def add_comment(node: etree._Element, remarks: list[Remark]) -> None:
    """Add a comment to `remarks` unless OpenSim wrote it."""
    text = node.text or ""
    if isinstance(node, etree._Comment) and not is_generated_comment(text):
        remarks.append(Remark(text, False))


def get_layout(item: Object) -> Layout:
    """The layout of an object, made if it has none."""
    if item.layout is None:
        object.__setattr__(item, "_layout", Layout())
    assert item.layout is not None
    return item.layout


def estimate_size(element: etree._Element) -> int:
    """Number of elements in a subtree, its root included."""
    return sum(1 for _ in element.iter(etree.Element))
