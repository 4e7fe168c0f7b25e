"""What is known of one version of an open file: its objects as far as it can be read, its findings, its names."""

from __future__ import annotations

import os
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from osimlite.cli.language_server.cursor import Cursor, cursor_at
from osimlite.cli.language_server.text import Text
from osimlite.io.document.source import Position, Source
from osimlite.io.document.spans import Span
from osimlite.io.document.survey import survey_source
from osimlite.lint.checked import CheckTarget
from osimlite.lint.config import Config
from osimlite.lint.diagnostic import Report
from osimlite.lint.engine import make_subject, run_rules, use_classes
from osimlite.lint.measures import MEASURES
from osimlite.lint.project_files import BEGINNING, is_opensim_xml, is_table
from osimlite.lint.registry import all_rules
from osimlite.lint.settings import load_settings
from osimlite.lint.setup import Setup
from osimlite.lint.subject import Subject
from osimlite.schema.base import Component, Object
from osimlite.schema.editing import find_named_component
from osimlite.schema.model import Model
from osimlite.schema.tree import Tree, Use, is_a


class Target(NamedTuple):
    """What a name leads to: an object that stands in a document, or a file.

    `number` is that of its element, or of the element of what has a part that stands in no file;
    `path` is its path in the model; `at` is the place in a file that is no document.
    """

    file: str
    item: Object | None = None
    path: str = ""
    number: int | None = None
    at: Position | None = None

    def is_same(self, other: Target | None) -> bool:
        """Whether another is the same thing."""
        if (
            other is None
            or self.item is None
            or (self.path, self.number) != (other.path, other.number)
        ):
            return False
        return self.file == other.file or os.path.realpath(self.file) == os.path.realpath(
            other.file
        )


class Analysis:
    """One version of a file; everything is found out when it is first asked for.

    Args:
        text: of the file.
        file: its path; it need not exist.
        recalls: whether findings about paths and muscles that were measured before are among what
            is found.
    """

    def __init__(self, text: Text, file: str, *, recalls: bool = False) -> None:
        self.text = text
        self.file = file
        self.recalls = recalls
        self.is_table = is_table(file)
        beginning = text.content[:BEGINNING].encode("utf-8", "replace")
        self.is_foreign = file.lower().endswith(".xml") and not is_opensim_xml(beginning)

    @cached_property
    def source(self) -> Source:
        """The text as the reader takes it."""
        return Source.of_characters(self.text.content, self.file)

    @property
    def markup(self) -> str:
        """The text of a document; nothing is told of what stands in tables, and in XML of other programs."""
        return "" if self.is_table or self.is_foreign else self.text.content

    @cached_property
    def config(self) -> Config:
        """What the project asks for; raises OsimliteError if that makes no sense."""
        return load_settings(Path(self.file).resolve().parent).config_for(self.file, Config())

    def cursor(self, offset: int) -> Cursor:
        """What stands at an offset."""
        # Another file may be of a project with other classes.
        use_classes(self.config)
        return cursor_at(self.markup, min(offset, len(self.markup)))

    @cached_property
    def subject(self) -> CheckTarget:
        """What the rules look at.

        Raises:
            OsimliteError: the settings of the project make no sense.
        """
        return (
            CheckTarget(self.config) if self.is_foreign else make_subject(self.source, self.config)
        )

    @cached_property
    def report(self) -> Report:
        """What the rules find."""
        # Measuring paths takes too long for every change of a text.
        return (
            Report([])
            if self.is_foreign
            else run_rules(self.subject, measure=False, recall=self.recalls)
        )

    @property
    def is_to_be_measured(self) -> bool:
        """Whether there are paths or muscles that nobody has measured."""
        subject = self.document
        if (
            subject is None
            or subject.model is None
            or subject.config.classes
            or MEASURES in subject.cache
        ):
            return False
        return any(known.about == MEASURES and subject.is_for(known) for known in all_rules())

    def measured(self) -> Report:
        """What the rules find once paths and muscles are measured.

        For another thread: it reads the text anew, and shares nothing with who answers questions
        meanwhile.
        """
        source = Source.of_characters(self.text.content, self.file)
        return run_rules(Subject(survey_source(source, of=Model), self.config))

    @property
    def is_checked(self) -> bool:
        """Whether the rules have looked at it."""
        return "report" in self.__dict__

    @property
    def document(self) -> Subject | None:
        """The subject, if its elements are numbered as in the text: it is a document, and well-formed."""
        subject = self.subject
        return (
            subject
            if isinstance(subject, Subject) and subject.top and subject.sure_until is None
            else None
        )

    @property
    def is_certain(self) -> bool:
        """Whether there is a document that can be read."""
        return self.document is not None

    @property
    def tree(self) -> Tree | None:
        """The components that names lead to: those of the model, or of the model of the tool; None if there is none."""
        return None if self.document is None else self.document.tree

    @cached_property
    def objects(self) -> dict[int, Object]:
        """The objects of the document by the number of their element."""
        top = None if self.document is None else self.document.top
        result: dict[int, Object] = {}
        for item in top.walk() if top is not None else ():
            if item._index is not None:
                # What is read from another file has the number of the element that names that.
                result.setdefault(item._index, item)
        return result

    def span(self, number: int) -> Span:
        """Where an element stands."""
        return self.source.spans[number]

    def offset_of(self, place: Position) -> int:
        """The offset of a place as findings tell it."""
        return min(self.source.line_start(place.line) + place.column - 1, len(self.text.content))

    @cached_property
    def places(self) -> list[tuple[Use, int, int]]:
        """Every reference that stands in the text, with the offsets of the beginning and the end of its word."""
        result = []
        for use in () if self.document is None else self.document.uses:
            place = self._place(use)
            if place is not None:
                result.append((use, *place))
        return result

    def _place(self, use: Use) -> tuple[int, int] | None:
        number = use.holder._index
        if number is None or not isinstance(use.value, str) or not use.value:
            return None
        if self.objects.get(number) is not use.holder:
            # It stands in a file that is named here.
            return None
        if use.spec.tag == "@name":
            return self.name_of(number)
        inner = self.source.child(number, use.spec.tag)
        if inner is None:
            return None
        span = self.span(inner)
        content = self.source.text[span.tag_end : span.inner_end]
        if use.position is None:
            start = span.tag_end + len(content) - len(content.lstrip())
            return start, start + len(content.strip())
        # The nth word of a list is not found by looking for it: it may stand there twice.
        place = span.tag_end
        for _ in range(use.position + 1):
            place = next(
                (k for k in range(place, span.inner_end) if not self.source.text[k].isspace()),
                span.inner_end,
            )
            start = place
            while place < span.inner_end and not self.source.text[place].isspace():
                place += 1
        return (start, place) if self.source.text[start:place] == use.value else None

    def name_of(self, number: int) -> tuple[int, int] | None:
        """The offsets of the name that an element gives its object."""
        span = self.span(number)
        place = self.source.of_attribute(number, "name")
        start = self.offset_of(place)
        return (start, start + place.length) if start > span.start else None

    def place_of(self, number: int) -> tuple[int, int]:
        """The offsets of the name that an element gives its object, or of its tag."""
        span = self.span(number)
        return self.name_of(number) or (span.start + 1, span.start + 1 + len(span.tag))

    def target_at(self, offset: int) -> Target | None:
        """What is named at an offset, or the component whose start tag or name stands there."""
        for use, start, end in self.places:
            if start <= offset <= end:
                return self.led_to(use)
        for number, item in self.objects.items():
            span = self.span(number)
            if span.start <= offset <= span.tag_end:
                if item.layout is not None and item.layout.include is not None:
                    return Target(item.layout.include.path)
                return self._target(self.file, item) if isinstance(item, Component) else None
        return None

    def led_to(self, use: Use) -> Target | None:
        """What a name in the text leads to, here or in another file; None if it leads nowhere."""
        setup = self.document if isinstance(self.document, Setup) else None
        text = str(use.value).strip()
        if use.reference.rule in ("file", "output-file"):
            path = (
                setup.resolve_path(text)
                if setup is not None
                else os.path.join(os.path.dirname(self.file), text)
            )
            return Target(path) if os.path.isfile(path) else None
        if use.reference.rule == "column" and setup is not None:
            table = setup.read_table(getattr(setup.top, "datafile", ""))
            labels = (
                ()
                if table is None
                else (label.at for label in table.labels if label.text.startswith(text))
            )
            return (
                next((Target(str(table.file), at=at) for at in labels), None)
                if table is not None
                else None
            )
        if self.tree is None:
            return None
        result = find_named_component(self.tree, use)
        if setup is None:
            return None if result is None else self._target(self.file, result)
        if result is not None and setup.tool is not None:
            # A study may hold its model itself.
            return self._target(setup.model_file or setup.tool[0], result)
        named = (
            (file, item)
            for file, top in setup.added_sets
            for item in top.walk()
            if item.name == text
        )
        return next(
            (
                Target(*one, number=one[1]._index)
                for one in named
                if is_a(one[1], use.reference.target)
            ),
            None,
        )

    def _target(self, file: str, item: Component) -> Target:
        tree = self.tree
        path = "" if tree is None else tree.path_of(item) or ""
        shown: Component | None = item
        while tree is not None and shown is not None and shown._index is None:
            # A part that OpenSim makes stands in no file.
            shown = tree.parent_of(shown)
        return Target(file, item, path, None if shown is None else shown._index)

    def references(self, target: Target) -> list[tuple[int, int]]:
        """The offsets of every word that leads to something."""
        return [(start, end) for use, start, end in self.places if target.is_same(self.led_to(use))]
