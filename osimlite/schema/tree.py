"""The component tree of a model: paths, and the rules by which a text resolves to a component.

Every rule is OpenSim 4.6's (``schemas/references.json`` names the source of each): sockets walk exactly, other
properties look a bare name up in one set, and nothing searches.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Literal, NamedTuple, cast

from osimlite.errors import ModelError
from osimlite.schema.base import (
    Component,
    FieldSpec,
    Holding,
    Object,
    field_specs,
    holding,
    name_spec,
    reference_specs,
)
from osimlite.schema.fields import Held, Reference, epoch
from osimlite.text import did_you_mean

if TYPE_CHECKING:
    from osimlite.schema.model import Model

Failure = Literal["missing", "wrong-type", "empty", "illegal"]

ILLEGAL_CHARACTERS = "\\*+ \t\n/"
"""Characters OpenSim refuses in the name of a component."""

_NEVER_IN_PATHS = frozenset(ILLEGAL_CHARACTERS) - {"/"}


class Resolution(NamedTuple):
    """What a reference leads to.

    `target` is the component, or None with the `failure`: nothing there, a component of another class (`found`), no
    text, or a text that is not a path.
    """

    target: Component | None
    failure: Failure | None = None
    found: Component | None = None


@dataclass(frozen=True, slots=True)
class Renamed:
    """A component that OpenSim renames because a sibling has the same name."""

    component: Component
    name: str
    first: Component


class Use(NamedTuple):
    """One reference in a model: `holder` has the property, `owner` is the component that holds `holder`.

    `position` is the index of the word in a list, else None.
    """

    holder: Object
    owner: Component
    spec: FieldSpec
    value: str | Component
    position: int | None = None

    @property
    def reference(self) -> Reference:
        """The kind of the reference."""
        return cast("Reference", self.spec.kind)


class Tree:
    """Index of one model: component by path, path by component, children, and the names each rule looks up."""

    def __init__(self, model: Model, previous: Tree | None = None) -> None:
        self.epoch = epoch.count
        self.model = model
        self.components: list[Component] = []
        self.by_path: dict[str, Component] = {}
        self.by_class: dict[type[Object], list[Object]] = {}
        """Every object of the model by its exact class, in tree order.

        Left out are the parts that OpenSim makes for itself, and default objects that no one has asked for, unless
        something in them has a path or names another.
        """
        self.renamed: list[Renamed] = []
        self._paths: dict[int, str] = {}
        self._parents: dict[int, Component] = {}
        self._owners: dict[int, Component] = {}
        self._naming: list[tuple[Object, Component]] = []
        # By class: what its objects are put into, whether they can name others, and what they can hold.
        self._shelves: dict[type[Object], tuple[list[Object], bool, tuple[Holding, ...]]] = {}
        self._names: dict[str, dict[str, Component]] = {}
        self._resolved: dict[tuple[str, str, str], Resolution] = {}
        self._parts: dict[int, tuple[Component, list[Component]]] = {}
        self._known_parts = previous._parts if previous is not None else {}
        self._internal: set[int] = set()
        self._below: dict[int, list[Component]] = {}
        self._place(model, "")
        self._known_parts = {}

    def path_of(self, component: Object) -> str | None:
        """The absolute path of a component, None if it is not in this tree."""
        return self._paths.get(id(component))

    def parent_of(self, component: Component) -> Component | None:
        """The component above, None for the model."""
        return self._parents.get(id(component))

    def owner_of(self, item: Object) -> Component:
        """The component that an object without a path belongs to; a component owns itself."""
        if item.is_component:
            return cast("Component", item)
        if id(item) not in self._owners:
            # It was made when someone asked for it.
            for owner in self.components:
                self._own(owner, owner)
        return self._owners[id(item)]

    def is_internal(self, component: Component) -> bool:
        """Whether the component is a part that OpenSim makes for itself: it has a path and stands in no file."""
        return id(component) in self._internal

    def at(self, path: str) -> Component:
        """The component at `path`, absolute or from the model; ModelError with the nearest path if none is there."""
        found = self.by_path.get(normalised(path if path.startswith("/") else "/" + path) or "")
        if found is None:
            named = [known for known in self.by_path if _last(known) == _last(f"/{path}")]
            better = f"; did you mean '{named[0]}'?" if named else did_you_mean(path, self.by_path)
            raise ModelError(f"no component at '{path}'{better}")
        return found

    def uses(self) -> Iterator[Use]:
        """Yield every reference of the model that has a text or a component or must have one, in tree order."""
        for holder, owner in self._naming:
            cls = type(holder)
            if cls.name_reference is not None and holder.name:
                yield Use(holder, owner, name_spec(cls), holder.name)
            # Plain values are in the dictionary of their object; through getattr they would cost several times as much.
            state = holder.__dict__
            for spec in reference_specs(cls):
                value = state[spec.name]
                if isinstance(value, tuple):
                    for position, word in enumerate(value):
                        yield Use(holder, owner, spec, word, position)
                elif value or (value is not None and cast("Reference", spec.kind).required):
                    yield Use(holder, owner, spec, value)

    def resolve(self, use: Use) -> Resolution:
        """Follow one reference by OpenSim's rule for its property."""
        if isinstance(use.value, str):
            return self.lookup(use.reference, use.value, use.owner)
        known = self.path_of(use.value) is not None
        return self._typed(use.value if known else None, use.reference.target)

    def lookup(self, reference: Reference, text: str, owner: Component) -> Resolution:
        """Follow `text` as the value of a property of `owner` with this kind of reference."""
        text, rule, target = text.strip(" \t\n\r\f\v"), reference.rule, reference.target
        if not text.startswith("/") or rule not in _PATH_RULES or target == "Frame":
            return _RULES[rule](self, text, owner, target)
        # An absolute path leads to the same component from everywhere, and hundreds of points name one body.
        known = self._resolved.get((rule, target, text))
        if known is None:
            known = self._resolved[rule, target, text] = _RULES[rule](self, text, owner, target)
        return known

    def target(self, owner: Component, name: str, value: str | Component) -> Component:
        """The component that property `name` of `owner` leads to, for code that needs it to be there.

        Raises:
            ModelError: it leads nowhere.
        """
        spec = field_specs(type(owner))[name]
        use = Use(owner, owner, spec, value)
        found = self.resolve(use).target
        if found is None:
            text = value if isinstance(value, str) else value.name
            raise ModelError(
                f"{type(owner).__name__} '{self.path_of(owner) or owner.name}': {name} names '{text}', "
                f"but the model has no such {use.reference.target}{did_you_mean(text, self.spellings(use))}"
            )
        return found

    def text_for(self, owner: Component, reference: Reference, component: Component) -> str:
        """The text by which a property of `owner` names `component`, as OpenSim writes it."""
        path = self.path_of(component)
        if path is None:
            raise ModelError(
                f"'{owner.name}' names {type(component).__name__} '{component.name}', which is not in the model; "
                "add it to the model first"
            )
        if reference.rule in ("socket", "owner-path"):
            base = self.path_of(owner) or "/"
            return path[len(base) + 1 :] if path.startswith(base + "/") and base != "/" else path
        if reference.rule in ("model-path", "file", "input"):
            return path
        parent = self.parent_of(component)
        bare = path.rsplit("/", 1)[1]
        wanted = {"contactgeometry-path-or-name": "contactgeometryset", "frame-path-or-body-name": "bodyset"}
        if reference.rule in wanted and (parent is None or self.path_of(parent) != "/" + wanted[reference.rule]):
            return path
        return bare

    def spellings(self, use: Use) -> list[str]:
        """Every text that would be right in this place, the shortest form of each component."""
        reference = use.reference
        names = set()
        for component in self.components:
            if reference.rule == "own-joint-coordinate" and self._parents.get(id(component)) is not use.owner:
                continue
            if is_a(component, reference.target):
                text = self.text_for(use.owner, reference, component)
                if self.lookup(reference, text, use.owner).target is component:
                    names.add(text)
        return sorted(names)

    def _place(self, component: Component, path: str) -> None:
        """Enter a component at `path` ("" for the model), what belongs to it, and all that is below it."""
        self._put(component, path or "/")
        children: list[tuple[str, Component]] = []
        self._enter(component, component, children)
        if not children and not component.internal:
            return
        below = self._below[id(component)] = []
        taken: dict[str, Component] = {}
        if component.internal:
            for part in self._internal_parts(component):
                taken[part.name] = part
                below.append(part)
                self._parents[id(part)] = component
                self._put(part, f"{path}/{part.name}")
        for name, child in children:
            unique = name
            if name in taken:
                unique = self._unique(name, taken)
                self.renamed.append(Renamed(child, unique, taken[name]))
            taken[unique] = child
            below.append(child)
            self._parents[id(child)] = component
            self._place(child, f"{path}/{unique}")

    def _put(self, component: Component, path: str) -> None:
        self.components.append(component)
        self.by_path[path] = component
        self._paths[id(component)] = path

    def _enter(self, holder: Object, owner: Component, children: list[tuple[str, Component]]) -> None:
        """Enter an object of the model, and those without a path in it, which add no level.

        The components in it are added to `children`, with their names.
        """
        cls = type(holder)
        shelf = self._shelves.get(cls)
        if shelf is None:
            items = self.by_class[cls] = []
            shelf = self._shelves[cls] = items, _names_others(cls), holding(cls)
        items, names_others, holds = shelf
        items.append(holder)
        if names_others:
            self._naming.append((holder, owner))
        state = holder.__dict__
        for spec, name, is_list, is_plain in holds:
            value = state.get(name)
            if value is None:
                # Of what no one has asked for, lists are empty and plain objects have no part in the tree.
                if is_list or is_plain or name in state:
                    continue
                value = getattr(holder, name)
            for item in value if isinstance(value, list) else (value,):
                if item.is_component:
                    children.append((_name_in_tree(spec, item), item))
                else:
                    self._owners[id(item)] = owner
                    self._enter(item, owner, children)

    def _own(self, holder: Object, owner: Component) -> None:
        for _, item in holder.objects_held():
            if not item.is_component:
                self._owners[id(item)] = owner
                self._own(item, owner)

    @staticmethod
    def _unique(name: str, taken: dict[str, Component]) -> str:
        unique, count = name, 0
        while unique in taken:
            unique, count = f"{name}_{count}", count + 1
        return unique

    def _internal_parts(self, owner: Component) -> list[Component]:
        """The parts that OpenSim makes for itself; the same ones for the same owner, as long as it lives."""
        known = self._known_parts.get(id(owner))
        if known is None or known[0] is not owner:
            known = owner, [part.build({"name": name}, set()) for name, part in owner.internal]
        self._parts[id(owner)] = known
        self._internal.update(map(id, known[1]))
        return known[1]

    def _typed(self, found: Component | None, target: str) -> Resolution:
        if found is None:
            return Resolution(None, "missing")
        if not is_a(found, target) and type(found).__name__ != "Unknown":
            return Resolution(None, "wrong-type", found)
        return Resolution(found)

    def _walk(self, text: str, base: str, target: str) -> Resolution:
        path: str | None = text if text.startswith("/") else f"{base}/{text}"
        plain = self.by_path.get(path or "")
        if plain is not None:
            return self._typed(plain, target)
        path = normalised(path or "")
        if path is None:
            return Resolution(None, "illegal")
        return self._typed(self.by_path.get(path), target)

    def _named(self, key: str, members: Callable[[], Iterator[tuple[str, Component]]]) -> dict[str, Component]:
        if key not in self._names:
            names: dict[str, Component] = {}
            for name, component in members():
                names.setdefault(name, component)
            self._names[key] = names
        return self._names[key]

    def _of_class(self, target: str) -> dict[str, Component]:
        return self._named(target, lambda: ((_last(self._paths[id(c)]), c) for c in self.components if is_a(c, target)))

    def _members(self, path: str, target: str) -> dict[str, Component]:
        holder = self.by_path.get(path)

        def members() -> Iterator[tuple[str, Component]]:
            for component in self._below.get(id(holder), ()):
                if is_a(component, target):
                    yield _last(self._paths[id(component)]), component

        return self._named(f"{path}:{target}", members)

    def _wrap_objects(self) -> dict[str, Component]:
        return self._of_class("WrapObject")


def is_a(component: Object, target: str) -> bool:
    """Whether the component's class is `target` or derives from it."""
    return _derives(type(component), target)


@cache
def _derives(cls: type[Object], target: str) -> bool:
    return any(base.__name__ == target for base in cls.__mro__)


@cache
def _names_others(cls: type[Object]) -> bool:
    """Whether an object of this class can name a component."""
    return cls.name_reference is not None or bool(reference_specs(cls))


def normalised(path: str) -> str | None:
    """An absolute path without doubled slashes, ``.`` and ``..``; None if it climbs above the root."""
    parts: list[str] = []
    for part in path.split("/"):
        if part in ("", "."):
            continue
        if part == "..":
            if not parts:
                return None
            parts.pop()
        else:
            parts.append(part)
    return "/" + "/".join(parts)


def _last(path: str) -> str:
    return path.rsplit("/", 1)[1] or "/"


def _name_in_tree(spec: FieldSpec, item: Component) -> str:
    form = cast("Held", spec.kind).form
    if form == "single":
        return spec.tag
    if form == "unnamed" and is_a(item, "ModelComponentSet"):
        return type(item).__name__.lower()
    return item.name or str(getattr(item, "class_name", "") or type(item).tag).lower()


def _socket(tree: Tree, text: str, owner: Component, target: str) -> Resolution:
    if _is_no_path(text):
        return Resolution(None, "illegal")
    if target == "Frame":
        # While connecting, a frame puts itself into the socket of every geometry it draws, whatever path the file
        # gives; not of one that it merely holds among its components.
        parent = tree.parent_of(owner)
        if parent is not None and is_a(parent, "Frame") and not any(item is owner for item in parent.subcomponents):
            return Resolution(parent)
    if not text:
        return Resolution(None, "empty")
    base = tree.path_of(owner) or "/"
    return tree._walk(text, "" if base == "/" else base, target)


def _is_no_path(text: str) -> bool:
    """Whether OpenSim cannot even read the text as a path, which it does of every socket when it loads the file."""
    if not _NEVER_IN_PATHS.isdisjoint(text):
        return True
    return text.startswith("/") and normalised(text) is None


def _model_path(tree: Tree, text: str, owner: Component, target: str) -> Resolution:
    return tree._walk(text, "", target) if text else Resolution(None, "empty")


def _path_or_member(set_path: str) -> Callable[[Tree, str, Component, str], Resolution]:
    """First a path from the model, then OpenSim appends the text to the path of the set."""

    def rule(tree: Tree, text: str, owner: Component, target: str) -> Resolution:
        if not text:
            return Resolution(None, "empty")
        first = tree._walk(text, "", target)
        if first.target is not None:
            return first
        second = tree._walk(f"{set_path}/{text}", "", target)
        return second if second.target is not None or second.failure == "wrong-type" else first

    return rule


def _bare(members: Callable[[Tree, Component, str], dict[str, Component]]) -> Callable[..., Resolution]:
    """A bare name among `members`; a path is no name."""

    def rule(tree: Tree, text: str, owner: Component, target: str) -> Resolution:
        if not text:
            return Resolution(None, "empty")
        found = members(tree, owner, target).get(text)
        if found is None:
            other = next((c for c in tree.components if _last(tree.path_of(c) or "/") == text), None)
            return Resolution(None, "missing" if other is None else "wrong-type", other)
        return Resolution(found)

    return rule


def _nothing_to_resolve(tree: Tree, text: str, owner: Component, target: str) -> Resolution:
    """Files, columns and positions name nothing in the component tree."""
    return Resolution(owner)


_PATH_RULES = frozenset(("socket", "owner-path", "model-path"))

_RULES: dict[str, Callable[[Tree, str, Component, str], Resolution]] = {
    "socket": _socket,
    "owner-path": _socket,
    "model-path": _model_path,
    "coordinate-name": _bare(lambda tree, owner, target: tree._of_class("Coordinate")),
    "body-name": _bare(lambda tree, owner, target: tree._members("/bodyset", "Body")),
    "joint-name": _bare(lambda tree, owner, target: tree._members("/jointset", "Joint")),
    "actuator-name": _bare(lambda tree, owner, target: tree._members("/forceset", "Actuator")),
    "muscle-name": _bare(lambda tree, owner, target: tree._members("/forceset", "Muscle")),
    "wrap-object-name": _bare(lambda tree, owner, target: tree._wrap_objects()),
    "own-joint-coordinate": _bare(lambda tree, owner, target: tree._members(tree.path_of(owner) or "/", "Coordinate")),
    "set-member": _bare(lambda tree, owner, target: tree._members(tree.path_of(owner) or "/", "Component")),
    "frame-path-or-body-name": _path_or_member("/bodyset"),
    "contactgeometry-path-or-name": _path_or_member("/contactgeometryset"),
    "input": _nothing_to_resolve,
    "file": _nothing_to_resolve,
    "column": _nothing_to_resolve,
    "positional": _nothing_to_resolve,
    "point-index": _nothing_to_resolve,
}
