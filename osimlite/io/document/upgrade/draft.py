"""A document on its way from an old format to the current one: the element tree, and where each element came from."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cached_property
from typing import NamedTuple

from lxml import etree

from osimlite.io.document.lexical import Unclean, real, split
from osimlite.io.document.names import as_written
from osimlite.schema.registry import by_tags, class_for

Element = etree._Element

_FAMILY_OF_MEMBERS = {
    "ConstraintSet": "Constraint",
    "ContactGeometrySet": "ContactGeometry",
    "ControllerSet": "Controller",
    "ForceSet": "Force",
    "JointSet": "Joint",
    "PathPointSet": "AbstractPathPoint",
    "ProbeSet": "Probe",
    "WrapObjectSet": "WrapObject",
}
"""What an object of an unknown class (a plug-in) must be, going by the set it stands in."""


class Change(NamedTuple):
    """One thing an upgrade did."""

    step: str  # the name of the step
    below: int  # the version it leads to
    what: str  # what that step does, in one line
    where: str  # class and name of the component concerned
    number: int  # the element it was found at, in document order
    lost: str | None = None  # what the current format cannot say, if that was more than a default


class Refusal(NamedTuple):
    """Something over which OpenSim's own upgrade of a document fails, where osimlite's does not."""

    # the object that OpenSim is bringing up to date then; of one that it never reads nothing is
    # asked
    owner: int
    number: int  # the element concerned, in document order
    message: str  # what is wrong, in one clause


class Refused(Exception):
    """A document says something that no step can carry over.

    Attributes:
        message: one plain sentence.
        number: the element concerned, in document order.
    """

    def __init__(self, message: str, number: int) -> None:
        super().__init__(message)
        self.message = message
        self.number = number


class Step(NamedTuple):
    """One step of the upgrade, for documents of a version `below` its own."""

    below: int
    order: int
    name: str
    what: str
    apply: Callable[[Draft], None]


REGISTERED: list[Step] = []
"""Every step whose module has been imported."""


def step(
    *, below: int, order: int | None = None
) -> Callable[[Callable[[Draft], None]], Callable[[Draft], None]]:
    """Register a function as the step that documents of a version under `below` need.

    The first line of its docstring says what it does to a document. `order` stands in for `below`
    where a step must run sooner than its number says.
    """

    def register(function: Callable[[Draft], None]) -> Callable[[Draft], None]:
        what = (function.__doc__ or "").strip().splitlines()[0].rstrip(".")
        REGISTERED.append(
            Step(below, below if order is None else order, function.__name__, what, function)
        )
        return function

    return register


@by_tags
def families(tag: str) -> frozenset[str]:
    """The names of the class that a tag stands for and of its bases; none for a tag that is no class."""
    cls = class_for(as_written(tag))
    return frozenset() if cls is None else frozenset(base.__name__ for base in cls.__mro__)


class Draft:
    """The element tree of an old document, changed step by step. `version` is that of the document as it was."""

    def __init__(self, root: Element, version: int) -> None:
        self.root = root
        self.version = version
        self.touched: dict[Element, None] = {}
        self.step: Step | None = None
        self.refusals: list[Refusal] = []
        self._changes: list[tuple[Step, Element, Element, str | None]] = []
        if self.moves:
            # Now or never: the steps to come move elements about.
            assert self.numbers

    @property
    def moves(self) -> bool:
        """Whether steps move elements; those of version 4 leave every element in its place."""
        return self.version < 40000

    @cached_property
    def numbers(self) -> dict[Element, int]:
        """The number of every element in the document as it was.

        An element that a step makes has the number of the element it was made from.
        """
        return {element: number for number, element in enumerate(self.root.iter(etree.Element))}

    @cached_property
    def _tags(self) -> dict[str, set[str]]:
        """Every tag that there is or was, by the families of its class."""
        result: dict[str, set[str]] = {}
        for tag in {element.tag for element in self.numbers}:
            for family in families(tag):
                result.setdefault(family, set()).add(tag)
        return result

    def _know(self, tag: str) -> None:
        for family in families(tag):
            self._tags.setdefault(family, set()).add(tag)

    @property
    def changes(self) -> list[Change]:
        """What the steps have done, in the order of the document."""
        result = [
            Change(step.name, step.below, step.what, describe(owner), self.numbers[place], lost)
            for step, owner, place, lost in self._changes
        ]
        return sorted(result, key=lambda change: change.number)

    def wrap(self, tag: str) -> None:
        """Put a new root around the tree."""
        made = etree.Element(tag)
        self.numbers[made] = self.numbers[self.root]
        made.append(self.root)
        self.root = made

    @property
    def model(self) -> Element | None:
        """The model, if the document holds one."""
        return self.root.find("Model")

    def of_model(self, tag: str) -> list[tuple[Element, Element]]:
        """The model and its first child with a tag, or nothing: for whoever does something if both are there."""
        return [] if self.model is None else [*having([self.model], tag)]

    def every(self, *kinds: str) -> list[Element]:
        """Every element of the classes named or of classes derived from them, in document order.

        Objects of unknown classes count as what the set they stand in says.
        """
        tags = {tag for kind in kinds for tag in self._tags.get(kind, ())}
        sets = [
            owner
            for owner, kind in _FAMILY_OF_MEMBERS.items()
            if kind in kinds and owner in self._tags
        ]
        result = list(self.root.iter(*tags)) if tags else []
        if sets:
            strange = [
                member
                for owner in self.root.iter(*sets)
                for member in members(owner)
                if not families(member.tag)
            ]
            if strange:
                result = sorted(
                    dict.fromkeys([*result, *strange]), key=lambda element: self.numbers[element]
                )
        return result

    def tagged(self, *tags: str) -> list[Element]:
        """Every element with one of these tags, in document order."""
        return list(self.root.iter(*tags))

    def add(
        self,
        parent: Element,
        tag: str,
        text: str | None = None,
        *,
        source: Element,
        name: str | None = None,
    ) -> Element:
        """Append a new element made from `source`."""
        made = etree.SubElement(parent, tag)
        made.text = text
        if name is not None:
            made.set("name", name)
        self.numbers[made] = self.numbers[source]
        self._know(tag)
        self.touched[made] = None
        return made

    def rename(self, element: Element, tag: str) -> None:
        """Give an element another tag."""
        element.tag = tag
        self._know(tag)
        self.touched[element] = None

    def move(self, element: Element, parent: Element) -> None:
        """Make an element the last child of another."""
        element.tail = None
        parent.append(element)
        self.touched[element] = None

    def remove(self, element: Element) -> None:
        """Take an element out."""
        parent = element.getparent()
        assert parent is not None
        parent.remove(element)

    def rename_child(self, parent: Element, old: str, new: str) -> bool:
        """Give the first child `old` the tag `new`; whether there was one."""
        child = parent.find(old)
        if child is None:
            return False
        self.rename(child, new)
        return True

    def list_in(self, parent: Element, tag: str, *, source: Element) -> Element:
        """The child that lists objects, made if it is not there."""
        result = parent.find(tag)
        return self.add(parent, tag, source=source) if result is None else result

    def is_a(self, element: Element, family: str) -> bool:
        """Whether an element is of a class or one derived from it; of an unknown class, by the set it stands in."""
        if families(element.tag):
            return family in families(element.tag)
        objects = element.getparent()
        owner = None if objects is None or objects.tag != "objects" else objects.getparent()
        return owner is not None and _FAMILY_OF_MEMBERS.get(owner.tag) == family

    def refuse(self, owner: Element, element: Element, message: str) -> None:
        """Record that OpenSim fails over an element when it brings its owner up to date."""
        self.refusals.append(Refusal(self.numbers[owner], self.numbers[element], message))

    def changed(
        self, element: Element, *, at: Element | None = None, lost: str | None = None
    ) -> None:
        """Record that the current step changed an element, at which place inside, and what was lost."""
        assert self.step is not None
        self._changes.append((self.step, element, element if at is None else at, lost))


def describe(element: Element) -> str:
    """An element as a reader knows it: its class and its name."""
    name = element.get("name")
    tag = as_written(element.tag)
    return f"{tag} '{name}'" if name else tag


def members(owner: Element) -> Iterator[Element]:
    """The objects of a set."""
    objects = owner.find("objects")
    if objects is not None:
        yield from (child for child in objects if isinstance(child.tag, str))


def having(owners: Iterable[Element], tag: str) -> Iterator[tuple[Element, Element]]:
    """Elements, each with its first child of a tag; those without one are left out."""
    for owner in owners:
        child = owner.find(tag)
        if child is not None:
            yield owner, child


def elements(parent: Element) -> list[Element]:
    """The child elements, without comments."""
    return [child for child in parent if isinstance(child.tag, str)]


def text_of(parent: Element, tag: str) -> str | None:
    """The text of the first child with a tag, white space collapsed; None if there is none."""
    child = parent.find(tag)
    return None if child is None else plain(child)


def plain(element: Element) -> str:
    """The text of an element, white space collapsed."""
    return " ".join(split("".join([element.text or "", *(node.tail or "" for node in element)])))


def reals(text: str | None, count: int) -> list[float] | None:
    """The numbers in a text, or None unless there are exactly `count`."""
    words = split(text or "")
    if len(words) != count:
        return None
    try:
        return [real(word) for word in words]
    except Unclean:
        return None


def is_true(text: str) -> bool:
    """A switch as OpenSim converts it; what cannot be read is false."""
    return text.lower() in ("true", "1")


def body_path(name: str) -> str:
    """The path of a body in a document of version 4, from its name."""
    return "/ground" if name == "ground" else f"/bodyset/{name}"


def path_of(component: Element) -> str:
    """The path of a component, by the rules of version 4; unnamed ones go by their class."""
    words: list[str] = []
    here: Element | None = component
    while here is not None and here.tag != "Model":
        kinds = families(here.tag)
        if "ModelComponentSet" in kinds:
            words.append(here.tag.lower())
        elif "Component" in kinds or here is component:
            words.append(here.get("name") or here.tag.lower())
        here = here.getparent()
    return "/" + "/".join(reversed(words))
