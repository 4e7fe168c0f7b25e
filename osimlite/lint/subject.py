"""Model as a check target, with its text if there is one, and queries for rules."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from functools import cached_property, wraps
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypeVar, cast

from osimlite.errors import DocumentError, SpecialFileError
from osimlite.io.document.notes import Note
from osimlite.io.document.source import Position
from osimlite.io.document.survey import Survey
from osimlite.lint.checked import CheckTarget
from osimlite.lint.config import Config
from osimlite.lint.construction import CONSTRUCTION, find_obstacles, may_fail
from osimlite.lint.measures import MEASURES, has_measures, measure_subject
from osimlite.lint.words import describe_object
from osimlite.schema.base import Component, Object, Unknown
from osimlite.schema.model import Model
from osimlite.schema.specs import FieldSpec, get_class_names, get_file_specs
from osimlite.schema.tree import Resolution, Tree, Use

if TYPE_CHECKING:
    from osimlite.io.document.upgrade.draft import Change, Refusal
    from osimlite.lint.registry import Rule

T = TypeVar("T", bound=Object)
S = TypeVar("S", bound="Subject")
Cached = TypeVar("Cached")
P = ParamSpec("P")


def cache_per_subject(
    make: Callable[Concatenate[S, P], Cached],
) -> Callable[Concatenate[S, P], Cached]:
    """Cache a function per subject and per value of its other arguments.

    Returns:
        A function that computes each result once.
    """

    @wraps(make)
    def get_cached(subject: S, /, *args: P.args, **named: P.kwargs) -> Cached:
        # Functions of different modules may share a name, hence the function itself is a part of
        # the key.
        key = (make, *args, *named.items())
        if key not in subject.cache:
            subject.cache[key] = make(subject, *args, **named)
        return cast("Cached", subject.cache[key])

    return get_cached


class Subject(CheckTarget):
    """Model under check. A model made in Python has no `source`, an unreadable text has no `model`.

    `top` is the object at the top of the document, of any class; `cache_folder` is the folder for
    its measurements. `needs_remeasuring` is true if machine code for the measurements was missing:
    the next check may find more.
    """

    def __init__(self, content: Survey | Model, config: Config | None = None) -> None:
        super().__init__(config)
        self.model: Model | None
        self.top: Object | None
        self.faults: list[DocumentError] = []
        self.notes: list[Note] = []
        self.changes: list[Change] = []
        self.refusals: list[Refusal] = []
        self.cache: dict[object, object] = {}
        self.cache_folder: Path | None = None
        self.needs_remeasuring = False
        if isinstance(content, Model):
            self.model = self.top = content
        else:
            self.source = content.source
            self.file, self.data = content.source.file, content.source.data
            self.faults = content.faults
            self.sure_until = content.sure_until
            self.top = content.document.top if content.document else None
            self.model = self.top if isinstance(self.top, Model) else None
            self.notes = content.document.notes if content.document else []
            self.version = content.document.version if content.document else None
            self.changes = content.document.changes if content.document else []
            self.upgraded = bool(self.changes)
            self.refusals = content.document.refusals if content.document else []
            if self.sure_until is not None:
                # The reader guesses after a syntax error; findings on guesses would mislead.
                self.notes = [note for note in self.notes if self._is_sure(note)]

    def _is_sure(self, note: Note) -> bool:
        """Return whether a note is about text before a syntax error, where elements are numbered reliably."""
        assert self.source is not None and self.sure_until is not None
        return (
            note.number < len(self.source.spans)
            and self.source.locate_tag(note.number).line < self.sure_until
        )

    def is_for(self, rule: Rule) -> bool:
        """Return whether a rule applies; after a syntax error only rules on single places do."""
        if rule.about == MEASURES and self.about == "model":
            return self.model is not None and self.sure_until is None and has_measures(self)
        # Without this quick test every check would build the complete mechanism.
        if rule.about == CONSTRUCTION and self.about == "model":
            return self.model is not None and self.sure_until is None and self._may_fail
        if rule.about != self.about:
            return False
        if rule.code[4] == "0":
            return self.source is not None
        return self.model is not None and (self.sure_until is None or rule.code[4] in "12")

    def measure(self, *, compute: bool = True) -> str:
        """Measure paths and muscles, or recall the results; return the reason of a failure.

        Returns:
            The reason why nothing was measured; empty on success.
        """
        return measure_subject(self, compute=compute)

    def find_obstacles(self, *, compute: bool = True) -> str:
        """Build the model, or recall the reasons against it; return why neither was done.

        Returns:
            The reason why the model was not built; empty on success.
        """
        return find_obstacles(self, compute=compute)

    @cached_property
    def _may_fail(self) -> bool:
        return may_fail(self)

    @cached_property
    def folder(self) -> Path | None:
        """Folder of the model file; None for a model without a file."""
        return (
            Path(self.file).parent if self.file is not None and Path(self.file).is_file() else None
        )

    @cached_property
    def tree(self) -> Tree:
        """Component tree of the model."""
        assert self.model is not None
        # A model that was read for this check alone is not tied to its tree in a cycle, which only
        # the garbage collector could undo.
        return self.model.tree() if self.source is None else Tree(self.model)

    @property
    def by_class(self) -> dict[type[Object], list[Object]]:
        """Objects of the model by their exact class, in tree order.

        Returns:
            Lists of objects by class; empty if no model could be read.
        """
        return {} if self.model is None else self.tree.by_class

    @cached_property
    def _by_base(self) -> dict[str, list[list[Object]]]:
        """The lists of `by_class` by the name of the class and of each that it derives from.

        Dozens of rules ask for the objects of a class, and most models have none of it.
        """
        result: dict[str, list[list[Object]]] = {}
        for cls, items in self.by_class.items():
            for name in get_class_names(cls):
                result.setdefault(name, []).append(items)
        return result

    def find_instances(self, cls: type[T]) -> Iterator[T]:
        """Yield every object of a class or of a derived one.

        Returns:
            An iterator over the objects.
        """
        return cast("Iterator[T]", self.find_by_class(cls.__name__))

    def find_by_class(self, cls: str) -> Iterator[Any]:
        """Yield every object of the class with this name or of a derived one; the class need not be imported.

        Returns:
            An iterator over the objects.
        """
        return chain.from_iterable(self._by_base.get(cls, ()))

    @cached_property
    def uses(self) -> list[Use]:
        """References of the model, in tree order."""
        return list(self.tree.uses())

    @cached_property
    def _resolutions(self) -> dict[int, Resolution]:
        # The uses are kept alive by `uses`, so that their identities stay theirs.
        resolve = self.tree.resolve
        return {id(use): resolve(use) for use in self.uses}

    def resolution(self, use: Use) -> Resolution:
        """Return the resolution of a reference."""
        resolution = self._resolutions.get(id(use))
        return self.tree.resolve(use) if resolution is None else resolution

    @cached_property
    def has_unknown(self) -> bool:
        """True if parts of the model have unknown classes, so its tree has gaps."""
        return Unknown in self.by_class

    def owner(self, item: Object) -> Component:
        """Return the component that an object belongs to; the model, for an object that OpenSim ignores."""
        try:
            # Objects that OpenSim ignores belong to no component.
            return self.tree.owner_of(item)
        except KeyError:
            assert self.model is not None
            return self.model

    def path(self, item: Object | None) -> str:
        """Return the absolute path of the component that an object belongs to."""
        if item is None or self.model is None:
            return ""
        return self.tree.path_of(self.owner(item)) or ""

    def describe(self, item: Object) -> str:
        """Return the name of an object for messages, such as ``Body 'pelvis'``; that of its owner if it has no name."""
        owner = self.owner(item)
        return describe_object(item if item.name and item is not owner else owner)

    def describe_property(self, item: Object, spec: FieldSpec) -> str:
        """Return the name of a property for messages, such as ``mass of Body 'pelvis'``.

        Args:
            item: object of the model.
            spec: property of the object.
        """
        return f"{spec.tag} of {describe_object(item) if item.name else self.describe(item)}"

    def describe_part(self, item: Object) -> str:
        """Return the name of a part for messages, such as ``the SimmSpline of Coordinate 'knee'``."""
        return (
            describe_object(item)
            if item.name
            else f"the {describe_object(item)} of {describe_object(self.owner(item))}"
        )

    def target_of(self, owner: Component, tag: str) -> Component | None:
        """Return the component that a single reference of `owner` resolves to; None without one.

        Args:
            owner: component that has the reference.
            tag: tag of the property.
        """
        spec = type(owner).field_specs().get(tag)
        value = None if spec is None else getattr(owner, spec.name)
        return self.tree.resolve(Use(owner, owner, spec, value)).target if spec and value else None

    def word_at(self, item: Object, tag: str, index: int) -> tuple[str | None, int]:
        """Return a word of a list in the text, and how many equal words precede it.

        Args:
            item: object of the model.
            tag: tag of the property.
            index: index of the word.

        Returns:
            The word or None, and the count.
        """
        element = self.element_of(item, tag)
        if element is None or self.source is None:
            return None, 0
        span = self.source.spans[element]
        # OpenSim accepts commas between the words of a list.
        words = self.source.text[span.tag_end : span.inner_end].replace(",", " ").split()
        if index >= len(words):
            return None, 0
        return words[index], words[:index].count(words[index])

    def notes_of(self, kind: str) -> list[tuple[Note, Object]]:
        """Return the notes of the reader of one kind about objects, with the objects."""
        return [
            (note, note.owner)
            for note in self.notes
            if note.kind == kind and note.owner is not None
        ]

    def has_note(self, item: Object, spec: FieldSpec) -> bool:
        """Return whether the reader made a note about the text of this property.

        Args:
            item: object of the model.
            spec: property of the object.
        """
        return (id(item), spec.name) in self._noted

    @cached_property
    def _noted(self) -> set[tuple[int, str]]:
        return {
            (id(note.owner), note.spec.name)
            for note in self.notes
            if note.owner is not None and note.spec
        }

    def element_of(self, item: Object, tag: str) -> int | None:
        """Return the index in the text of the element of a property; None if the text has none.

        Args:
            item: object of the model.
            tag: tag of the property.
        """
        if self.source is None or item._index is None:
            return None
        return self.source.child(item._index, tag)

    def position(
        self,
        item: Object | None,
        *,
        tag: str | None = None,
        word: str | None = None,
        nth: int = 0,
        attribute: str | None = None,
        number: int | None = None,
    ) -> Position | None:
        """Return the position of an object, a property, a word or an attribute in the text.

        Args:
            item: object of the model; without other arguments the position is that of its start
                tag.
            tag: tag of a property, for the position of its text; if the text has no such property,
                the position is that of the start tag of the object.
            word: word in the text of the property or element, for its position.
            nth: index of the occurrence of the word, from 0.
            attribute: name of an attribute, for the position of its value.
            number: index of an element in the text, instead of `item`.
        """
        if self.source is None:
            return None
        if number is None:
            number = self._find_element_index(item)
            if number is None:
                return None
            if tag is not None:
                property_index = self.source.child(number, tag)
                if property_index is None:
                    return self.source.locate_tag(number)
                return self.source.locate_text(property_index, word, nth)
        if number >= len(self.source.spans):
            return None
        if attribute is not None:
            return self.source.locate_attribute(number, attribute)
        if word is not None:
            return self.source.locate_text(number, word, nth)
        return self.source.locate_tag(number)

    def list_outside_paths(self) -> list[str] | None:
        """Return every path outside the text that findings may depend on; None if that is unknown."""
        if self.needs_remeasuring or any(note.kind == "include" for note in self.notes):
            # Included files and special files (pipes, devices) have no time of modification to
            # compare.
            return None
        if any(isinstance(fault, SpecialFileError) for fault in self.faults):
            return None
        folder = self.folder
        if folder is None or self.model is None:
            return []
        # OpenSim looks for data files in the working folder as well.
        folders = [
            os.path.abspath(folder / folder_name)
            for folder_name in (".", "Geometry", *self.config.mesh_paths)
        ]
        folders.append(os.getcwd())
        result: dict[str, None] = {}
        for cls, items in self.by_class.items():
            for spec in get_file_specs(cls, "file"):
                for item in items:
                    name = getattr(item, spec.name)
                    if name:
                        paths = [os.path.join(folder, name) for folder in folders]
                        result |= dict.fromkeys(paths)
                        if not any(map(os.path.isfile, paths)):
                            # Another file in the same folder may be what was meant.
                            result |= dict.fromkeys(map(os.path.dirname, paths))
        return list(result)

    def has_explicit_name(self, item: Object) -> bool:
        """Return whether the text gives an object its name; True for a model made in Python."""
        if self.source is None:
            return True
        if item._index is None:
            # Objects that the reader adds, such as default frames, have no element.
            return False
        return "name" in self.source.get_attributes(item._index)

    def attribute_name(self, number: int, name: str) -> Position | None:
        """Return the position of the name of an attribute.

        Args:
            number: index of the element.
            name: name of the attribute.
        """
        if self.source is None:
            return None
        attribute = self.source.get_attributes(number).get(name)
        return (
            self.source.position(attribute.start, len(name))
            if attribute
            else self.source.locate_tag(number)
        )

    def _find_element_index(self, item: Object | None) -> int | None:
        """Return the index in the text of the element that contains an object most closely.

        Args:
            item: object of the model, or None.

        Returns:
            Index of the element of the object. For an object that the reader has added, such as a
            default frame, that of the nearest component above it; None without one.
        """
        while item is not None:
            element_index = cast("int | None", item._index)
            if element_index is not None:
                return element_index
            # First from a part, such as a function, to its component, then from component to
            # component: only components have a parent in the tree.
            component = self.owner(item)
            item = component if component is not item else self._find_parent(component)
        return None

    def _find_parent(self, component: Component) -> Component | None:
        """Return the component above a component; None for the model."""
        return self.tree.parent_of(component)
