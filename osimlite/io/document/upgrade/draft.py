"""Element tree of a document during its upgrade, with a record of where each element came from."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cached_property

from lxml import etree

from osimlite.base.named_tuples import NamedTuple
from osimlite.io.document.lexical import UncleanText, parse_real, split_words
from osimlite.io.document.names import decode_name
from osimlite.schema.registry import cache_by_tags, find_class

Element = etree._Element

_MEMBER_FAMILIES = {
    "ConstraintSet": "Constraint",
    "ContactGeometrySet": "ContactGeometry",
    "ControllerSet": "Controller",
    "ForceSet": "Force",
    "JointSet": "Joint",
    "PathPointSet": "AbstractPathPoint",
    "ProbeSet": "Probe",
    "WrapObjectSet": "WrapObject",
}
"""Base class of the members of each set, for objects of unknown classes (plug-ins)."""


class Change(NamedTuple):
    """One change that an upgrade made to one component.

    Attributes:
        step: name of the upgrade step.
        below: format version that the step leads to.
        what: description of the step, one line.
        where: class and name of the component.
        number: index of the changed element in the old document.
        lost: content that the current format cannot express; None if that was only a default.
    """

    step: str
    below: int
    what: str
    where: str
    number: int
    lost: str | None = None


class Refusal(NamedTuple):
    """Element over which OpenSim's upgrade of a document fails, where osimlite's does not.

    Attributes:
        owner: index of the object that OpenSim upgrades then. OpenSim does not fail over objects
            that it never reads.
        number: index of the element in the old document.
        message: clause that says why OpenSim fails.
    """

    owner: int
    number: int
    message: str


class UpgradeError(Exception):
    """Error for content that no step can carry over to the current format.

    Attributes:
        message: sentence about the content.
        number: index of the element in the old document.
    """

    def __init__(self, message: str, number: int) -> None:
        super().__init__(message)
        self.message = message
        self.number = number


class UpgradeStep(NamedTuple):
    """One step of the upgrade.

    Attributes:
        below: documents of a version below this one need the step.
        name: name in reports and in the table of steps.
        apply: function that changes a draft. The first line of its docstring describes the change.
    """

    below: int
    name: str
    apply: Callable[[Draft], None]

    @property
    def what(self) -> str:
        """Description of the step, one line."""
        return (self.apply.__doc__ or "").strip().splitlines()[0].rstrip(".")


@cache_by_tags
def find_families(tag: str) -> frozenset[str]:
    """Return the names of the class of a tag and of its bases; none if the tag is not a class."""
    cls = find_class(decode_name(tag))
    return frozenset() if cls is None else frozenset(base.__name__ for base in cls.__mro__)


class Draft:
    """Element tree of an old document, which the steps change in place.

    Attributes:
        root: root element.
        version: format version of the old document.
        changed_elements: elements that steps created, renamed or moved, in this order.
        step: step that is running.
        refusals: elements over which OpenSim's upgrade fails.
    """

    def __init__(self, root: Element, version: int) -> None:
        self.root = root
        self.version = version
        self.changed_elements: dict[Element, None] = {}
        self.step: UpgradeStep | None = None
        self.refusals: list[Refusal] = []
        self._changes: list[tuple[UpgradeStep, Element, Element, str | None]] = []
        if self.moves_elements:
            # `cached_property`: access computes them.
            # Number the elements now, because steps move them later.
            assert self.numbers

    @property
    def moves_elements(self) -> bool:
        """True if steps move elements; those of version 4 leave every element in its position."""
        return self.version < 40000

    @cached_property
    def numbers(self) -> dict[Element, int]:
        """Index of every element in the old document.

        An element that a step creates has the index of the element it was created from.

        Returns:
            Index in the order of the text, by element.
        """
        return {element: number for number, element in enumerate(self.root.iter(etree.Element))}

    @cached_property
    def _tags(self) -> dict[str, set[str]]:
        """Return all tags that the document has or had, by the names of their classes and base classes."""
        result: dict[str, set[str]] = {}
        for tag in {element.tag for element in self.numbers}:
            for family in find_families(tag):
                result.setdefault(family, set()).add(tag)
        return result

    def _register_tag(self, tag: str) -> None:
        for family in find_families(tag):
            self._tags.setdefault(family, set()).add(tag)

    @property
    def changes(self) -> list[Change]:
        """Changes that the steps have made, in the order of the old document."""
        result = [
            Change(
                step.name,
                step.below,
                step.what,
                describe_element(owner),
                self.numbers[element],
                lost,
            )
            for step, owner, element, lost in self._changes
        ]
        return sorted(result, key=lambda change: change.number)

    # Version 1 has a model without a document around it.
    def wrap_root(self, tag: str) -> None:
        """Put a new root element around the tree."""
        new = etree.Element(tag)
        self.numbers[new] = self.numbers[self.root]
        new.append(self.root)
        self.root = new

    @property
    def model(self) -> Element | None:
        """The element of the model, or None if the document has no model."""
        return self.root.find("Model")

    def find_in_model(self, tag: str) -> list[tuple[Element, Element]]:
        """Return the model and its first child with a tag as one pair; no pair if either is missing."""
        return [] if self.model is None else [*find_with_child([self.model], tag)]

    def find_all(self, *kinds: str) -> list[Element]:
        """Return all elements of some classes or of classes derived from them, in document order.

        An object of an unknown class counts as a member of the class that its set contains.

        Args:
            kinds: names of classes.
        """
        # Tags are looked up by class, so that lxml searches once for all of them.
        tags = {tag for kind in kinds for tag in self._tags.get(kind, ())}
        set_tags = [
            owner
            for owner, kind in _MEMBER_FAMILIES.items()
            if kind in kinds and owner in self._tags
        ]
        result = list(self.root.iter(*tags)) if tags else []
        if set_tags:
            strange = [
                member
                for owner in self.root.iter(*set_tags)
                for member in list_members(owner)
                if not find_families(member.tag)
            ]
            # Objects of plug-ins belong to the family of their set; sorting puts them in document
            # order.
            if strange:
                result = sorted(
                    dict.fromkeys([*result, *strange]), key=lambda element: self.numbers[element]
                )
        return result

    def find_tagged(self, *tags: str) -> list[Element]:
        """Return all elements with one of these tags, in document order."""
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
        """Append a new element to `parent`.

        Args:
            parent: element that gets the new child.
            tag: tag of the new element.
            text: text of the element; None for no text.
            source: element of the old document that it comes from, for positions in messages.
            name: value of the attribute `name`; None for no attribute.

        Returns:
            The new element.
        """
        new = etree.SubElement(parent, tag)
        new.text = text
        if name is not None:
            new.set("name", name)
        self.numbers[new] = self.numbers[source]
        self._register_tag(tag)
        self.changed_elements[new] = None
        return new

    def rename(self, element: Element, tag: str) -> None:
        """Give an element a new tag.

        Args:
            element: element of the tree.
            tag: new tag of the element.
        """
        element.tag = tag
        self._register_tag(tag)
        self.changed_elements[element] = None

    def move(self, element: Element, parent: Element) -> None:
        """Move an element to the end of `parent`.

        Args:
            element: element to move.
            parent: new parent of the element.
        """
        # The text behind an element is layout, and would move with it.
        element.tail = None
        parent.append(element)
        self.changed_elements[element] = None

    def remove(self, element: Element) -> None:
        """Remove an element from its parent."""
        parent = element.getparent()
        assert parent is not None
        parent.remove(element)

    def rename_child(self, parent: Element, old: str, new: str) -> bool:
        """Rename the first child with the tag `old` to `new`.

        Args:
            parent: parent of the child.
            old: present tag.
            new: new tag.

        Returns:
            Whether there was such a child.
        """
        child = parent.find(old)
        if child is None:
            return False
        self.rename(child, new)
        return True

    def rename_properties(self, family: str, tags: Mapping[str, str]) -> None:
        """Rename properties of all components of a class, and record each changed component.

        Args:
            family: name of the class; components of derived classes count too.
            tags: new tags by old tags.
        """
        for component in self.find_all(family):
            # A list, not a generator: all tags of a component have to be renamed.
            if any([self.rename_child(component, old, new) for old, new in tags.items()]):
                self.record_change(component)

    def get_list(self, parent: Element, tag: str, *, source: Element) -> Element:
        """Return the child with a tag that lists objects; create it if it is missing.

        Args:
            parent: parent of the list.
            tag: tag of the list.
            source: element of the old document that a new list comes from, for positions in
                messages.
        """
        result = parent.find(tag)
        return self.add(parent, tag, source=source) if result is None else result

    def is_a(self, element: Element, family: str) -> bool:
        """Return whether an element is of a class or of a class derived from it.

        For an unknown class, the set that contains the element decides.

        Args:
            element: element to test.
            family: name of the class.
        """
        if find_families(element.tag):
            return family in find_families(element.tag)
        objects = element.getparent()
        owner = None if objects is None or objects.tag != "objects" else objects.getparent()
        return owner is not None and _MEMBER_FAMILIES.get(owner.tag) == family

    def record_refusal(self, owner: Element, element: Element, message: str) -> None:
        """Record that OpenSim fails over an element when it upgrades the owner.

        Args:
            owner: object that OpenSim upgrades then.
            element: element over which it fails.
            message: clause that says why OpenSim fails.
        """
        self.refusals.append(Refusal(self.numbers[owner], self.numbers[element], message))

    def record_change(
        self, element: Element, *, location: Element | None = None, lost: str | None = None
    ) -> None:
        """Record that the current step changed an element.

        Args:
            element: changed component.
            location: element inside that the change concerns; default the component.
            lost: content that the current format cannot express.
        """
        assert self.step is not None
        self._changes.append((self.step, element, element if location is None else location, lost))


def describe_element(element: Element) -> str:
    """Return class and name of an element for messages."""
    name = element.get("name")
    tag = decode_name(element.tag)
    return f"{tag} '{name}'" if name else tag


def list_members(owner: Element) -> Iterator[Element]:
    """Yield the objects of a set."""
    objects = owner.find("objects")
    if objects is not None:
        yield from (child for child in objects if isinstance(child.tag, str))


def find_with_child(owners: Iterable[Element], tag: str) -> Iterator[tuple[Element, Element]]:
    """Yield each owner that has a child with a tag, together with the first such child.

    Args:
        owners: elements to search.
        tag: tag of the child.
    """
    for owner in owners:
        child = owner.find(tag)
        if child is not None:
            yield owner, child


def list_elements(parent: Element) -> list[Element]:
    """Return the child elements, without comments."""
    return [child for child in parent if isinstance(child.tag, str)]


def get_child_text(parent: Element, tag: str) -> str | None:
    """Return the text of the first child with a tag, white space collapsed; None without such a child.

    Args:
        parent: element that has the child.
        tag: tag of the child.
    """
    child = parent.find(tag)
    return None if child is None else get_text(child)


def get_text(element: Element) -> str:
    """Return the text of an element, white space collapsed."""
    return " ".join(
        split_words("".join([element.text or "", *(node.tail or "" for node in element)]))
    )


def parse_reals(text: str | None, count: int) -> list[float] | None:
    """Return the numbers in a text; None unless there are exactly `count` readable numbers.

    Args:
        text: text of an element; None for none.
        count: required number of values.
    """
    words = split_words(text or "")
    if len(words) != count:
        return None
    try:
        return [parse_real(word) for word in words]
    except UncleanText:
        return None


def is_true(text: str) -> bool:
    """Return the value of a switch as OpenSim reads it; an unreadable text is false."""
    return text.lower() in ("true", "1")


def make_body_path(name: str) -> str:
    """Return the path of a body in a document of version 4."""
    return "/ground" if name == "ground" else f"/bodyset/{name}"


def make_path(component: Element) -> str:
    """Return the path of a component by the rules of version 4; a component without a name has that of its class."""
    # OpenSim's paths leave out wrappers such as <objects>, and use the tag of sets.
    names: list[str] = []
    element: Element | None = component
    while element is not None and element.tag != "Model":
        kinds = find_families(element.tag)
        if "ModelComponentSet" in kinds:
            names.append(element.tag.lower())
        elif "Component" in kinds or element is component:
            names.append(element.get("name") or element.tag.lower())
        element = element.getparent()
    return "/" + "/".join(reversed(names))
