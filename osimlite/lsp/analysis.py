"""What is known of one version of an open file: its model as far as it can be read, its findings, its elements."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

from osimlite.document.reader import collector_paused
from osimlite.document.source import Source
from osimlite.document.spans import Span
from osimlite.document.survey import survey
from osimlite.lint.config import Config
from osimlite.lint.diagnostic import Report
from osimlite.lint.engine import run
from osimlite.lint.settings import settings_for
from osimlite.lint.subject import Subject
from osimlite.lsp.text import Text
from osimlite.schema.base import Component, Object
from osimlite.schema.fields import Reference
from osimlite.schema.tree import Tree, Use


class Analysis:
    """One version of a file; everything is found out when it is first asked for.

    Args:
        text: of the file.
        file: its path; it need not exist.
    """

    def __init__(self, text: Text, file: str) -> None:
        self.text = text
        self.file = file
        self.source = Source.of_characters(text.content, file)

    @cached_property
    def subject(self) -> Subject:
        """What the rules look at.

        Raises:
            OsimliteError: the settings of the project make no sense.
        """
        config = settings_for(Path(self.file).resolve().parent).config_for(self.file, Config())
        with collector_paused():
            return Subject(survey(self.source), config)

    @cached_property
    def report(self) -> Report:
        """What the rules find."""
        with collector_paused():
            return run(self.subject)

    @property
    def tree(self) -> Tree | None:
        """The component tree, None if no model can be read."""
        return None if self.subject.model is None else self.subject.tree

    @property
    def is_certain(self) -> bool:
        """Whether elements are numbered as in the text: it is well-formed."""
        return self.subject.model is not None and self.subject.sure_until is None

    @cached_property
    def objects(self) -> dict[int, Object]:
        """The objects of the model by the number of their element."""
        items = [item for held in self.subject.by_class.values() for item in held]
        return {item._index: item for item in items if item._index is not None}

    def span(self, number: int) -> Span:
        """Where an element stands."""
        return self.source.spans[number]

    @cached_property
    def places(self) -> list[tuple[Use, int, int]]:
        """Every reference that stands in the text, with the offsets of the beginning and the end of its word."""
        found = []
        for use in self.subject.uses:
            place = self._place(use)
            if place is not None:
                found.append((use, *place))
        return found

    def _place(self, use: Use) -> tuple[int, int] | None:
        number = use.holder._index
        if number is None or not isinstance(use.value, str) or not use.value:
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
            place = next((k for k in range(place, span.inner_end) if not self.source.text[k].isspace()), span.inner_end)
            start = place
            while place < span.inner_end and not self.source.text[place].isspace():
                place += 1
        return (start, place) if self.source.text[start:place] == use.value else None

    def name_of(self, number: int) -> tuple[int, int] | None:
        """The offsets of the name that an element gives its object."""
        span = self.span(number)
        place = self.source.of_attribute(number, "name")
        start = self.source.line_start(place.line) + place.column - 1
        return (start, start + place.length) if start > span.start else None

    def target_at(self, offset: int) -> Component | None:
        """The component that is named at an offset, or whose start tag or name stands there."""
        tree = self.tree
        if tree is None or not self.is_certain:
            return None
        for use, start, end in self.places:
            if start <= offset <= end and isinstance(use.spec.kind, Reference):
                return self.subject.resolution(use).target
        for number, item in self.objects.items():
            span = self.span(number)
            if span.start <= offset <= span.tag_end and isinstance(item, Component):
                return item
        return None

    def definition(self, component: Component) -> tuple[int, int] | None:
        """The offsets of the name of a component, or of its tag; of a part that stands in no file, of what has it."""
        tree = self.tree
        item: Component | None = component
        while item is not None and item._index is None:
            item = None if tree is None else tree.parent_of(item)
        if item is None or item._index is None:
            return None
        span = self.span(item._index)
        return self.name_of(item._index) or (span.start + 1, span.start + 1 + len(span.tag))

    def references(self, component: Component) -> list[tuple[int, int]]:
        """The offsets of every word that names a component."""
        return [(start, end) for use, start, end in self.places if self.subject.resolution(use).target is component]
