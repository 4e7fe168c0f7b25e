"""Analysis of one version of an open file: its objects, findings, names and their targets."""

from __future__ import annotations

import os
from functools import cached_property
from pathlib import Path

from osimlite.base.named_tuples import NamedTuple
from osimlite.cli.language_server.cursor import Cursor, find_cursor
from osimlite.cli.language_server.text import Text
from osimlite.io.document.source import Position, Source
from osimlite.io.document.spans import Span
from osimlite.io.document.survey import survey_source
from osimlite.lint.checked import CheckTarget
from osimlite.lint.config import Config
from osimlite.lint.diagnostic import Report
from osimlite.lint.engine import activate_plugin_classes, make_subject, run_rules
from osimlite.lint.measures import MEASURES
from osimlite.lint.project_files import BEGINNING_BYTES, is_opensim_xml, is_table
from osimlite.lint.registry import all_rules
from osimlite.lint.settings import load_settings
from osimlite.lint.setup import Setup
from osimlite.lint.subject import Subject
from osimlite.schema.base import Component, Object
from osimlite.schema.editing import find_named_component
from osimlite.schema.model import Model
from osimlite.schema.tree import Tree, Use, is_a


class Target(NamedTuple):
    """Object or file that a name refers to.

    Attributes:
        file: path of the file that defines it.
        item: object that is named; None for a file, or a column of a table.
        path: path of the object in its model.
        number: index of the element of the object; without one, that of the nearest owner.
        at: position in a file that is not a document, for example of a column label.
    """

    file: str
    item: Object | None = None
    path: str = ""
    number: int | None = None
    at: Position | None = None

    def is_same_as(self, other: Target | None) -> bool:
        """Return whether another target is the same object."""
        if (
            other is None
            or self.item is None
            or (self.path, self.number) != (other.path, other.number)
        ):
            return False
        return self.file == other.file or os.path.realpath(self.file) == os.path.realpath(
            other.file
        )


class DocumentAnalysis:
    """One version of a file; each result is computed when it is first used.

    Args:
        text: text of the file.
        file: path of the file, which need not exist.
        use_cached_measures: whether the report contains findings about paths and muscles that an
            earlier check of the same text has measured and cached.
    """

    def __init__(self, text: Text, file: str, *, use_cached_measures: bool = False) -> None:
        self.text = text
        self.file = file
        self.use_cached_measures = use_cached_measures
        self.is_table = is_table(file)
        beginning = text.content[:BEGINNING_BYTES].encode("utf-8", "replace")
        self.is_foreign = file.lower().endswith(".xml") and not is_opensim_xml(beginning)

    @cached_property
    def source(self) -> Source:
        """Return the text as a source of the reader."""
        return Source.from_text(self.text.content, self.file)

    @property
    def markup(self) -> str:
        """Return the text if it is an OpenSim document; empty for tables and other XML files."""
        return "" if self.is_table or self.is_foreign else self.text.content

    @cached_property
    def config(self) -> Config:
        """Return the settings of the linter for this file.

        Raises:
            OsimliteError: the settings of the project are invalid.
        """
        return load_settings(Path(self.file).resolve().parent).config_for(self.file, Config())

    def cursor(self, offset: int) -> Cursor:
        """Return the tag, attribute or text at an offset, with the elements around it."""
        # Registered classes are global, and the file analysed before may belong to a project with
        # other plug-ins.
        activate_plugin_classes(self.config)
        return find_cursor(self.markup, min(offset, len(self.markup)))

    @cached_property
    def subject(self) -> CheckTarget:
        """Return the file in the form that lint rules check.

        Raises:
            OsimliteError: the settings of the project are invalid.
        """
        return (
            CheckTarget(self.config) if self.is_foreign else make_subject(self.source, self.config)
        )

    @cached_property
    def report(self) -> Report:
        """Return the findings of all rules that need no measured paths or muscles."""
        # Measuring paths takes too long to repeat after each key press.
        return (
            Report([])
            if self.is_foreign
            else run_rules(self.subject, measure=False, recall=self.use_cached_measures)
        )

    @property
    def needs_measuring(self) -> bool:
        """True if some rule needs measurements of paths or muscles that are not cached."""
        subject = self.document
        if (
            subject is None
            or subject.model is None
            or subject.config.classes
            or MEASURES in subject.cache
        ):
            return False
        return any(rule.about == MEASURES and subject.is_for(rule) for rule in all_rules())

    def measure_report(self) -> Report:
        """Return the findings of all rules, also of those that measure paths and muscles.

        This runs in another thread. It reads the text again because model objects are not shared
        between threads.
        """
        source = Source.from_text(self.text.content, self.file)
        return run_rules(Subject(survey_source(source, expected_class=Model), self.config))

    @property
    def is_checked(self) -> bool:
        """True if the rules have checked this version."""
        return "report" in self.__dict__

    @property
    def document(self) -> Subject | None:
        """Document whose elements are numbered as in the text; None if the text is malformed or a table."""
        subject = self.subject
        return (
            subject
            if isinstance(subject, Subject) and subject.top and subject.sure_until is None
            else None
        )

    @property
    def is_readable(self) -> bool:
        """True if the text is a well-formed OpenSim document."""
        return self.document is not None

    @property
    def tree(self) -> Tree | None:
        """Component tree of the model, or of the model that a tool names; None without a model."""
        return None if self.document is None else self.document.tree

    @cached_property
    def objects(self) -> dict[int, Object]:
        """Objects of the document.

        Returns:
            Objects by the index of their element.
        """
        top = None if self.document is None else self.document.top
        result: dict[int, Object] = {}
        for each_object in top.walk() if top is not None else ():
            if each_object._index is not None:
                # Objects of an included file have the index of the element that includes it. The
                # walk meets the including object first, so that one is kept.
                result.setdefault(each_object._index, each_object)
        return result

    def find_span(self, number: int) -> Span:
        """Return the offsets of an element's start tag, content and end tag."""
        return self.source.spans[number]

    def compute_offset(self, position: Position) -> int:
        """Return the offset in the text of a position of a finding (line and column from 1)."""
        return min(
            self.source.line_start(position.line) + position.column - 1, len(self.text.content)
        )

    @cached_property
    def uses(self) -> list[tuple[Use, int, int]]:
        """Return all references in the text, each with the start and end offsets of its word."""
        result = []
        for use in () if self.document is None else self.document.uses:
            word_range = self._find_word_range(use)
            if word_range is not None:
                result.append((use, *word_range))
        return result

    def _find_word_range(self, use: Use) -> tuple[int, int] | None:
        number = use.holder._index
        if number is None or not isinstance(use.value, str) or not use.value:
            return None
        if self.objects.get(number) is not use.holder:
            # The reference is in an included file.
            return None
        if use.spec.tag == "@name":
            return self.find_name_range(number)
        child = self.source.child(number, use.spec.tag)
        if child is None:
            return None
        element_span = self.find_span(child)
        content = self.source.text[element_span.tag_end : element_span.inner_end]
        if use.position is None:
            start = element_span.tag_end + len(content) - len(content.lstrip())
            return start, start + len(content.strip())
        # Count words up to the index: a search for the value could find an equal word before it.
        offset = element_span.tag_end
        for _ in range(use.position + 1):
            offset = next(
                (
                    k
                    for k in range(offset, element_span.inner_end)
                    if not self.source.text[k].isspace()
                ),
                element_span.inner_end,
            )
            start = offset
            while offset < element_span.inner_end and not self.source.text[offset].isspace():
                offset += 1
        return (start, offset) if self.source.text[start:offset] == use.value else None

    def find_name_range(self, number: int) -> tuple[int, int] | None:
        """Find the value of an element's attribute `name`.

        Returns:
            Start and end offset of the value; None without the attribute.
        """
        element_span = self.find_span(number)
        position = self.source.locate_attribute(number, "name")
        start = self.compute_offset(position)
        return (start, start + position.length) if start > element_span.start else None

    def find_label_range(self, number: int) -> tuple[int, int]:
        """Find the name of an element, or its tag if it has no name.

        Returns:
            Start and end offsets.
        """
        element_span = self.find_span(number)
        return self.find_name_range(number) or (
            element_span.start + 1,
            element_span.start + 1 + len(element_span.tag),
        )

    def find_target(self, offset: int) -> Target | None:
        """Return what the name at an offset refers to, or the component whose start tag is there."""
        for use, start, end in self.uses:
            # The cursor after the last character still belongs to the word.
            if start <= offset <= end:
                return self.resolve_use(use)
        for number, each_object in self.objects.items():
            element_span = self.find_span(number)
            if element_span.start <= offset <= element_span.tag_end:
                if each_object.layout is not None and each_object.layout.include is not None:
                    return Target(each_object.layout.include.path)
                return (
                    self._make_target(self.file, each_object)
                    if isinstance(each_object, Component)
                    else None
                )
        return None

    def resolve_use(self, use: Use) -> Target | None:
        """Return what a reference in the text refers to, in this file or another; None without a match."""
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
                next((Target(str(table.file), at=position) for position in labels), None)
                if table is not None
                else None
            )
        if self.tree is None:
            return None
        result = find_named_component(self.tree, use)
        if setup is None:
            return None if result is None else self._make_target(self.file, result)
        if result is not None and setup.tool is not None:
            # A Moco study may contain its model instead of naming a file.
            return self._make_target(setup.model_file or setup.tool[0], result)
        matches = (
            (file, member)
            for file, top in setup.added_sets
            for member in top.walk()
            if member.name == text
        )
        return next(
            (
                Target(*match, number=match[1]._index)
                for match in matches
                if is_a(match[1], use.reference.target)
            ),
            None,
        )

    def _make_target(self, file: str, component: Component) -> Target:
        tree = self.tree
        path = "" if tree is None else tree.path_of(component) or ""
        visible: Component | None = component
        while tree is not None and visible is not None and visible._index is None:
            # Components that OpenSim adds itself have no element: show the owner that has one.
            visible = tree.parent_of(visible)
        return Target(file, component, path, None if visible is None else visible._index)

    def find_references(self, target: Target) -> list[tuple[int, int]]:
        """Return the start and end offsets of all words that refer to a target."""
        return [
            (start, end)
            for use, start, end in self.uses
            if target.is_same_as(self.resolve_use(use))
        ]
