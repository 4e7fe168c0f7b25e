"""Conversion of elements to objects by one reading plan per class."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, TypeVar

from lxml import etree

from osimlite.base.named_tuples import NamedTuple
from osimlite.io.document.lexical import ABSENT, UncleanText, make_converter
from osimlite.io.document.names import decode_name, encode_name
from osimlite.io.document.notes import Note, NoteKind
from osimlite.io.document.xml_text import format_element, is_element, is_generated_comment
from osimlite.schema.base import Object, Unknown
from osimlite.schema.fields import ObjectField, ObjectList
from osimlite.schema.layout import Home, Include, Layout, Remark
from osimlite.schema.model import Model
from osimlite.schema.registry import cache_by_tags, find_class
from osimlite.schema.specs import FieldSpec, get_defaults, get_field_specs

ReadObject = TypeVar("ReadObject", bound=Object)
IncludeReader = Callable[[str, type[Object]], tuple[Object, Include, list[Note]] | str]
"""Function that reads the object of a class from a file.

It returns the object, the include and notes, or the reason why the file is not read, as the end of a
sentence such as "does not exist".
"""

DEFAULTS = "defaults"
"""Tag of the block of a document with default objects by class."""


class ReadingStep(NamedTuple):
    """Plan for reading one child element.

    Attributes:
        action: `_TEXT`, `_ONE`, `_WRAPPED` or `_LIST`.
        name: attribute of the property.
        convert: converter from the text of the element.
        spec: declaration of the property.
    """

    action: int
    name: str
    convert: Callable[[str], Any]
    spec: FieldSpec


_TEXT, _ONE, _WRAPPED, _LIST = range(4)


class ReadingPlan(NamedTuple):
    """Plan for reading the children of an element of one class.

    Attributes:
        steps: steps by tag.
        named: properties with one object, by the name that the object's element has.
    """

    steps: dict[Any, ReadingStep]
    named: dict[str, FieldSpec]


@cache
def get_reading_plan(cls: type[Object]) -> ReadingPlan:
    """Return the reading plan of a class, made once from its declaration."""
    steps: dict[Any, ReadingStep] = {}
    named: dict[str, FieldSpec] = {}
    for tag, spec in get_field_specs(cls).items():
        # Elements have encoded names, since XML names cannot contain every character of a tag.
        tag = encode_name(tag)
        if not isinstance(spec.kind, ObjectField):
            steps[tag] = ReadingStep(_TEXT, spec.name, make_converter(spec.kind), spec)
        elif spec.kind.form == "unnamed":
            steps[tag] = ReadingStep(_ONE, spec.name, str, spec)
        else:
            steps[tag] = ReadingStep(
                _LIST if spec.kind.form == "list" else _WRAPPED, spec.name, str, spec
            )
            # Only single objects are found by name; names of members of a list are free.
            if spec.kind.form == "single":
                named[spec.tag] = spec
    return ReadingPlan(steps, named)


_PendingNote = tuple[NoteKind, int, str, FieldSpec | None, Any]
"""Note about an object that does not exist yet: kind, index of the element, word, property, value."""


def _make_default_object(spec: FieldSpec, values: Mapping[str, Any]) -> Any:
    """Return the default object of a property whose element is empty."""
    assert spec.factory is not None
    return spec.factory()


class _ExtraContent:
    """Content of an element beyond its properties; most elements have none."""

    __slots__ = ("before", "deferred_notes", "pending", "raw")

    def __init__(self) -> None:
        self.pending: list[Remark] = []
        self.before: dict[str | None, list[Remark]] = {}
        self.raw: dict[str, tuple[Any, str]] = {}
        self.deferred_notes: list[_PendingNote] = []

    def attach_pending(self, tag: str | None) -> None:
        """Attach the collected remarks to the position before the property `tag`."""
        if self.pending:
            self.before.setdefault(tag, []).extend(self.pending)
            self.pending = []


class ObjectReader:
    """Reader of one element tree.

    Attributes:
        count: index of the next element in document order.
        notes: notes about content that OpenSim ignores.
        defaults: objects of the document's ``<defaults>`` block, by class.
        read_include: function that reads the object of a file that a ``file`` attribute names.
        home: link to the model that the objects will belong to.
    """

    def __init__(self, read_include: IncludeReader | None = None) -> None:
        self.count = 0
        self.notes: list[Note] = []
        self.defaults: dict[type[Object], Object] = {}
        self.read_include = read_include
        self.home = Home()

    def read_top(self, element: etree._Element, cls: type[ReadObject]) -> ReadObject:
        """Read the object of a document; only it may have a ``<defaults>`` block.

        Args:
            element: XML element of the object.
            cls: class of the object.

        Returns:
            Object of the document; its layout holds the objects of the ``<defaults>`` block.
        """
        block = element.find(DEFAULTS)
        result: list[Object] = []
        if block is not None:
            start = self.count
            # The block is read first because it applies to all objects, also to those before it; the indices of
            # its elements count from its position in the document.
            self.count += 2 + sum(
                count_elements(node)
                for node in block.itersiblings(preceding=True)
                if is_element(node)
            )
            result = self._read_defaults(block)
            self.count = start
        top = self.read_object(element, cls, skip=block)
        if isinstance(top, Model):
            self.home.model = top
        if result:
            get_layout(top).defaults = result
        return top

    def read_object(
        self,
        element: etree._Element,
        cls: type[ReadObject],
        name: str | None = None,
        skip: etree._Element | None = None,
    ) -> ReadObject:
        """Read one element as an object.

        Args:
            element: XML element of the object.
            cls: class of the object.
            name: name that replaces the attribute `name`.
            skip: child element to skip.

        Returns:
            Object of the element; its layout holds the content that belongs to no property.
        """
        # The index counts elements in document order, so it is taken before the children are read.
        number = self.count
        self.count = number + 1
        values: dict[str, Any] = {}
        extra = self._read_children(element, cls, skip, values)
        present = set(values)
        for key, attribute in element.items():
            if key == "name":
                # OpenSim's XML has one name for an object; the name of a property overrides it.
                name = name or str(attribute)
            else:
                extra = extra or _ExtraContent()
                kind: NoteKind = "include" if key == "file" else "unknown-attribute"
                extra.deferred_notes.append(
                    (kind, number, decode_name(str(key)), None, str(attribute))
                )
        if name:
            values["name"] = name
            present.add("name")
        inherited = self._apply_defaults(cls, values) if self.defaults else None
        built = cls.build(values, present, number, self.home)
        if inherited:
            get_layout(built).inherited = inherited
        return built if extra is None else self._add_extra_content(built, extra)

    def _read_children(
        self,
        element: etree._Element,
        cls: type[Object],
        skip: etree._Element | None,
        values: dict[str, Any],
    ) -> _ExtraContent | None:
        """Read the children of an element into `values`, by the names of the properties.

        Returns:
            Content that belongs to no property; None without such content.
        """
        steps, named = get_reading_plan(cls)
        extra: _ExtraContent | None = None
        for child in element:
            # The lookup of a step is the innermost operation of reading, hence one dictionary for
            # each class.
            step = steps.get(child.tag)
            if step is None:
                if child is skip:
                    self.count += count_elements(child)
                else:
                    extra = extra or _ExtraContent()
                    self._read_unknown_tag(child, named, values, extra)
                continue
            # OpenSim takes the first of several elements.
            action, field_name, convert, spec = step
            if field_name in values:
                extra = extra or _ExtraContent()
                self._keep_duplicate(child, spec, extra)
                continue
            if extra is not None:
                extra.attach_pending(spec.tag)
            if action != _TEXT:
                values[field_name], deferred_notes = self._read_object_field(
                    child, cls, step, values
                )
                if deferred_notes:
                    extra = extra or _ExtraContent()
                    extra.deferred_notes += deferred_notes
                continue
            # Most elements are values, so they are read here to save a call for each.
            number = self.count
            self.count = number + 1
            # Comments inside a value split its text.
            text = child.text or ""
            if len(child):
                extra = extra or _ExtraContent()
                text = self._get_mixed_text(child, number, spec, extra)
            try:
                values[field_name] = convert(text)
            except UncleanText as unclean:
                extra = extra or _ExtraContent()
                values[field_name] = self._replace_unclean_text(
                    unclean, text, number, cls, spec, extra
                )
        return extra

    def _replace_unclean_text(
        self,
        unclean: UncleanText,
        text: str,
        number: int,
        cls: type[Object],
        spec: FieldSpec,
        extra: _ExtraContent,
    ) -> Any:
        """Return the value of a text that OpenSim reads only in part or not at all, and note the problem."""
        is_absent = unclean.value is ABSENT
        # An unreadable text gives the default, a readable beginning that part.
        value = self._get_default(cls, spec.name) if is_absent else unclean.value
        extra.raw[spec.name] = (value, text)
        extra.deferred_notes.append(
            (unclean.trouble, number, unclean.word, spec, None if is_absent else value)
        )
        return value

    def _read_object_field(
        self,
        element: etree._Element,
        cls: type[Object],
        step: ReadingStep,
        values: Mapping[str, Any],
    ) -> tuple[Any, list[_PendingNote]]:
        """Read the element of a property that holds objects.

        Returns:
            Value of the property (an object, a list of objects, or None), and pending notes about
            it.
        """
        # The actions are integers, which are compared faster than strings.
        spec, number = step.spec, self.count
        if step.action == _ONE:
            return self._read_object_or_include(element, spec.accepts), []
        members, deferred_notes = self._read_members(element, spec)
        if step.action == _LIST:
            return members, deferred_notes
        # OpenSim takes the first object of a property that holds one.
        deferred_notes += [
            ("duplicate-tag", left_out._index, left_out.tag, spec, None) for left_out in members[1:]
        ]
        if isinstance(spec.kind, ObjectField) and spec.kind.form == "optional":
            return (members[0] if members else None), deferred_notes
        if not members:
            replace = getattr(cls, "replace_empty_function", None)
            if replace is None:
                deferred_notes.append(("empty", number, "", spec, None))
            return (replace or _make_default_object)(spec, values), deferred_notes
        # OpenSim gives the object the name of its property, also in the long form.
        members[0].__dict__["name"] = spec.tag
        members[0].model_fields_set.add("name")
        return members[0], deferred_notes

    def _add_extra_content(self, built: ReadObject, extra: _ExtraContent) -> ReadObject:
        """Add the content beyond properties to an object, and make the pending notes final.

        Returns:
            The object `built`, which is changed in place.
        """
        extra.attach_pending(None)
        if extra.before:
            get_layout(built).before = extra.before
        if extra.raw:
            get_layout(built).raw = extra.raw
        for kind, number, word, spec, value in extra.deferred_notes:
            # Unknown attributes stay with the object, so that writing keeps them.
            if kind in ("include", "unknown-attribute"):
                get_layout(built).attributes[word] = value
            self.notes.append(Note(kind, number, word, built, spec, value))
        return built

    def _keep_duplicate(
        self, element: etree._Element, spec: FieldSpec, extra: _ExtraContent
    ) -> None:
        """Keep a repeated property as an unknown element at the end, where OpenSim ignores it again."""
        extra.deferred_notes.append(("duplicate-tag", self.count, spec.tag, spec, None))
        extra.before.setdefault(None, []).append(Remark(format_element(element), True))
        self.count += count_elements(element)

    def _read_object_or_include(
        self, element: etree._Element, cls: Any, name: str | None = None
    ) -> Object:
        """Read the object of a property, from another file if a ``file`` attribute names one.

        Returns:
            Object of the other file; that of the element if no file is named or it cannot be read.
        """
        file = element.get("file") if self.read_include is not None else None
        if not file or self.read_include is None:
            return self.read_object(element, cls, name)
        result = self.read_include(str(file), cls)
        number = self.count
        note_count = len(self.notes)
        # The reason why the file is not read is added to the note that the reader made.
        if isinstance(result, str):
            empty: Object = self.read_object(element, cls, name)
            self.notes[note_count:] = [
                note._replace(why=result)
                if note.kind == "include" and note.number == number
                else note
                for note in self.notes[note_count:]
            ]
            return empty
        self.count += count_elements(element)
        # Objects of another file have no position here: all get that of the element.
        included, include, notes = result
        for part in included.walk():
            object.__setattr__(part, "_index", number)
            object.__setattr__(part, "_model", self.home)
        if name:
            object.__setattr__(included, "__dict__", {**included.__dict__, "name": name})
        get_layout(included).include = include
        self.notes.append(Note("include", number, "file", included, None, str(file)))
        # Notes of the other file are reported at this element; positions there would mislead.
        self.notes.extend(
            note._replace(number=number) for note in notes if note.kind != "include" or note.why
        )
        return included

    def _read_members(
        self, wrapper: etree._Element, spec: FieldSpec
    ) -> tuple[ObjectList[Any], list[_PendingNote]]:
        """Read the objects inside ``<objects>`` or another wrapper.

        Returns:
            Members of the list, and pending notes about those of an unknown or wrong class.
        """
        self.count += 1
        members: list[Any] = []
        deferred_notes: list[_PendingNote] = []
        pending: list[Remark] = []
        accepts = spec.accepts
        assert accepts is not None
        for child in wrapper:
            cls = _find_accepted_class(child.tag, accepts)
            if cls is not None:
                # OpenSim ignores the ``file`` attribute of members of a set.
                member: Object = (
                    self.read_object(child, cls)
                    if spec.legacy
                    else self._read_object_or_include(child, cls)
                )
                if isinstance(member, Model):
                    # The components of a model inside another document get their model from its
                    # tree, because `home` belongs to the outer document.
                    member.tree()
            elif is_element(child):
                tag = decode_name(child.tag)
                known_class = find_class(tag)
                deferred_notes.append(
                    (
                        "unknown-class" if known_class is None else "wrong-class",
                        self.count,
                        tag,
                        spec,
                        known_class,
                    )
                )
                member = self._read_unknown(child)
            else:
                add_comment(child, pending)
                continue
            # A comment in a list belongs to the member after it, those at the end to the last one.
            if pending:
                get_layout(member).comments.extend(remark.text for remark in pending)
                pending = []
            members.append(member)
        if pending and members:
            get_layout(members[-1]).after.extend(pending)
        return ObjectList(members), deferred_notes

    def _read_unknown_tag(
        self,
        child: etree._Element,
        named: dict[str, FieldSpec],
        values: dict[str, Any],
        extra: _ExtraContent,
    ) -> None:
        """Read a child whose tag is not a property: a comment, an object with the name of a property, or unknown."""
        if not is_element(child):
            add_comment(child, extra.pending)
            return
        tag = decode_name(child.tag)
        name = child.get("name") or None
        tagged_class = find_class(tag)
        spec = named.get(name) if name is not None else None
        if spec is None and name is None and tagged_class is not None:
            # OpenSim assigns an object without a name to the first property that accepts its class
            # and has no value yet.
            candidates = (
                candidate
                for candidate in named.values()
                if candidate.name not in values
                and _find_accepted_class(child.tag, candidate.accepts)
            )
            # The first free property, in the order of the declaration.
            spec = next(candidates, None)
        if spec is not None and spec.name not in values:
            accepted_class = _find_accepted_class(child.tag, spec.accepts)
            if accepted_class is not None:
                extra.attach_pending(spec.tag)
                values[spec.name] = self._read_object_or_include(child, accepted_class, spec.tag)
                return
            extra.deferred_notes.append(
                (
                    "unknown-class" if tagged_class is None else "wrong-class",
                    self.count,
                    tag,
                    spec,
                    tagged_class,
                )
            )
        elif spec is not None:
            self._keep_duplicate(child, spec, extra)
            return
        else:
            extra.deferred_notes.append(("unknown-tag", self.count, tag, None, tagged_class))
        # Unread elements are kept as text, so that writing loses nothing.
        extra.pending.append(Remark(format_element(child), True))
        self.count += count_elements(child)

    def _read_unknown(self, element: etree._Element) -> Unknown:
        content = format_element(element)
        number = self.count
        self.count += count_elements(element)
        name = element.get("name") or ""
        values = {"name": name, "class_name": decode_name(element.tag), "content": content}
        return Unknown.build(values, {"name"} if name else set(), number, self.home)

    def _get_mixed_text(
        self, element: etree._Element, number: int, spec: FieldSpec, extra: _ExtraContent
    ) -> str:
        """Return the text of a value element that contains comments or, by mistake, elements."""
        child_elements = [node for node in element if is_element(node)]
        if child_elements:
            extra.deferred_notes.append(
                ("child-in-value", number, decode_name(child_elements[0].tag), spec, None)
            )
            self.count += sum(count_elements(node) for node in child_elements)
        elif (
            sum(
                1
                for piece in (element.text, *(node.tail for node in element))
                if piece and piece.strip()
            )
            # Two pieces of text mean that a comment stands in the middle of a value.
            > 1
        ):
            extra.deferred_notes.append(("child-in-value", number, "!--", spec, None))
        return "".join([element.text or "", *(node.tail or "" for node in element)])

    def _read_defaults(self, block: etree._Element) -> list[Object]:
        """Read a ``<defaults>`` block.

        Its objects are the defaults of objects of exactly their class.

        Returns:
            Objects of the block in its order, including those of unknown classes.
        """
        result: list[Object] = []
        for child in block:
            if not is_element(child):
                continue
            cls = find_class(decode_name(child.tag))
            if cls is None:
                result.append(self._read_unknown(child))
                continue
            item = self.read_object(child, cls)
            # Of two defaults of a class the first counts.
            self.defaults.setdefault(cls, item)
            result.append(item)
        return result

    def _get_default(self, cls: type[Object], name: str) -> Any:
        """Return the value of a text property that the file does not contain."""
        block = self.defaults.get(cls)
        return get_defaults(cls)[0][name] if block is None else getattr(block, name)

    def _apply_defaults(self, cls: type[Object], values: dict[str, Any]) -> frozenset[str]:
        """Copy properties that the file does not contain from the document's defaults.

        Returns:
            Names of the copied properties.
        """
        block = self.defaults.get(cls)
        if block is None:
            return frozenset()
        # Objects inherit neither their name nor what the file gives.
        inherited = frozenset(block.model_fields_set - values.keys() - {"name"})
        for name in inherited:
            # A copy, since the object may be changed later.
            values[name] = copy.deepcopy(getattr(block, name))
        return inherited


@cache_by_tags
def _find_accepted_class(tag: Any, accepts: type[Object] | None) -> type[Object] | None:
    """Return the class of a tag if a property for `accepts` may hold it; a comment's tag is a function."""
    cls = find_class(decode_name(tag)) if isinstance(tag, str) else None
    return cls if cls is not None and accepts is not None and issubclass(cls, accepts) else None


def add_comment(node: etree._Element, remarks: list[Remark]) -> None:
    """Append a comment to `remarks`, unless OpenSim wrote it.

    Args:
        node: comment of the element tree.
        remarks: list to append to.
    """
    text = node.text or ""
    if isinstance(node, etree._Comment) and not is_generated_comment(text):
        remarks.append(Remark(text, False))


def get_layout(item: Object) -> Layout:
    """Return the layout of an object; create it if it is missing."""
    if item.layout is None:
        object.__setattr__(item, "_layout", Layout())
    assert item.layout is not None
    return item.layout


def count_elements(element: etree._Element) -> int:
    """Return the number of elements in a subtree, including its root."""
    return sum(1 for _ in element.iter(etree.Element))
