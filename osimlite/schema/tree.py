"""Component tree of a model: its paths, its objects by class, and the targets of its references.

The rules by which a text resolves to a component are in :mod:`osimlite.schema.resolution`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import copy
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, cast
from weakref import WeakSet

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass
from osimlite.base.text import suggest_name
from osimlite.errors import ModelError
from osimlite.schema.base import Component, Object, put_model
from osimlite.schema.fields import ObjectField, ObjectList, Reference
from osimlite.schema.resolution import EVERYWHERE, PATH_RULES, RULES, get_last_name, normalize_path
from osimlite.schema.resolution import ILLEGAL_CHARACTERS as ILLEGAL_CHARACTERS
from osimlite.schema.resolution import Failure as Failure
from osimlite.schema.resolution import Resolution as Resolution
from osimlite.schema.resolution import is_a as is_a
from osimlite.schema.specs import (
    FieldSpec,
    ObjectHolder,
    get_field_specs,
    get_name_spec,
    get_reference_specs,
    list_holding_properties,
)

if TYPE_CHECKING:
    from osimlite.schema.model import Model


@dataclass(frozen=True, slots=True)
class RenamedComponent:
    """Component that OpenSim renames because a sibling has the same name."""

    component: Component
    name: str
    first: Component


class Use(NamedTuple):
    """Reference in a model.

    Attributes:
        holder: object that has the property.
        owner: component that the holder belongs to.
        spec: declaration of the property.
        value: text of the reference, or the component itself.
        position: index of the word in a list, else None.
    """

    holder: Object
    owner: Component
    spec: FieldSpec
    value: str | Component
    position: int | None = None

    @property
    def reference(self) -> Reference:
        """Type of the property."""
        return self.spec.reference

    @property
    def text(self) -> str:
        """Text of the reference, or the name of a component that is given itself."""
        return self.value if isinstance(self.value, str) else self.value.name


@contextmanager
def lend_tree(tree: Tree) -> Iterator[None]:
    """Give a model a tree for a while, so that it builds none itself."""
    if getattr(tree.model, "_tree", None) is not None:
        yield
        return
    object.__setattr__(tree.model, "_tree", tree)
    try:
        yield
    finally:
        object.__delattr__(tree.model, "_tree")


class Tree:
    """Index of one model: components by path, paths by component, children, and the names each rule looks up."""

    def __init__(self, model: Model, previous: Tree | None = None) -> None:
        self.is_current = True
        self.snapshots: WeakSet[Snapshot] = WeakSet()
        """Snapshots that have to copy the model before it changes."""
        self.cached: dict[Any, Any] = {}
        """Results derived from the model in its present state, by key; cleared when it changes."""
        self._others: WeakSet[Tree] = WeakSet()
        if previous is not None:
            self._others.update(other for other in previous._others if other.is_current)
        # A model that shares objects with another must claim them again after each change.
        self._is_renewable = not self._others
        self.model = model
        self.components: list[Component] = []
        self.by_path: dict[str, Component] = {}
        self.by_class: dict[type[Object], list[Object]] = {}
        """Every object of the model by its exact class, in tree order.

        Left out are the parts that OpenSim adds itself, and default objects that were never
        accessed, unless something in them has a path or names another.
        """
        self.renamed: list[RenamedComponent] = []
        self._paths: dict[int, str] = {}
        self._parents: dict[int, Component] = {}
        self._owners: dict[int, Component] = {}
        self._referring: list[tuple[Object, Component]] = []
        # By class: the list of its objects, whether they can refer to others, and the properties
        # that hold objects.
        self._shelves: dict[type[Object], tuple[list[Object], bool, tuple[ObjectHolder, ...]]] = {}
        self._spellings: dict[tuple[str, str], list[str]] = {}
        self._of_class: dict[str, list[Component]] = {}
        self._names: dict[str, dict[str, Component]] = {}
        self._resolved: dict[tuple[str, str, str], Resolution] = {}
        self._parts: dict[int, tuple[Component, list[Component]]] = {}
        self._previous_parts = previous._parts if previous is not None else {}
        self._internal: set[int] = set()
        self._below: dict[int, list[Component]] = {}
        self._register_branch(model, "")
        self._previous_parts = {}

    def outdate(self, *, numbers_only: bool = False) -> None:
        """Mark the index as outdated before a change of the model.

        Args:
            numbers_only: whether only a number or a switch changes, so that paths and names stay valid.
        """
        for tree in (self, *self._others):
            if tree.is_current:
                for snapshot in list(tree.snapshots):
                    _ = snapshot.model
                tree.is_current = False
                tree.cached.clear()
            tree._is_renewable &= numbers_only

    def renew(self) -> Tree:
        """Return the tree of the model in its present state; paths are reused if only numbers have changed."""
        # A changed number leaves paths and names as they are, so a copy of the index is enough.
        if not self._is_renewable:
            return Tree(self.model, self)
        tree = copy(self)
        tree.is_current, tree.snapshots, tree.cached = True, WeakSet(), {}
        return tree

    def _claim(self, owner: Any) -> Model:
        """Return this model for an object last seen in `owner`, and note a model that shares the object."""
        previous_model = None if owner is None else owner.model
        if previous_model is not None and previous_model is not self.model:
            other_tree = getattr(previous_model, "_tree", None)
            if other_tree is not None:
                self._is_renewable = other_tree._is_renewable = False
                if other_tree.is_current:
                    self._others.add(other_tree)
        return self.model

    def path_of(self, component: Object) -> str | None:
        """Return the absolute path of a component; None if it is not in this tree."""
        return self._paths.get(id(component))

    def parent_of(self, component: Component) -> Component | None:
        """Return the component above another; None for the model."""
        return self._parents.get(id(component))

    def owner_of(self, item: Object) -> Component:
        """Return the component that an object without a path belongs to; a component owns itself."""
        if item.is_component:
            return cast("Component", item)
        if id(item) not in self._owners:
            # It is a default object, made by its first access after the tree was built.
            for owner in self.components:
                self._assign_owners(owner, owner)
        return self._owners[id(item)]

    def is_internal(self, component: Component) -> bool:
        """Return whether OpenSim adds the component itself: it has a path but no element in a file."""
        return id(component) in self._internal

    def find(self, path: str) -> Component:
        """Return the component at a path, absolute or relative to the model.

        Raises:
            ModelError: the path does not exist; the message names the nearest one.
        """
        result = self.by_path.get(
            normalize_path(path if path.startswith("/") else "/" + path) or ""
        )
        if result is None:
            namesakes = [
                component_path
                for component_path in self.by_path
                if get_last_name(component_path) == get_last_name(f"/{path}")
            ]
            better = suggest_name(
                path, namesakes or self.by_path, cutoff=0.0 if namesakes else 60.0
            )
            raise ModelError(f"no component at '{path}'{better}")
        return result

    def uses(self) -> Iterator[Use]:
        """Yield every reference of the model that has a value or requires one, in tree order."""
        for holder, owner in self._referring:
            cls = type(holder)
            if cls.name_reference is not None and holder.name:
                yield Use(holder, owner, get_name_spec(cls), holder.name)
            # Read values from the instance dictionary; getattr takes several times as long.
            state = holder.__dict__
            for spec in get_reference_specs(cls):
                value = state[spec.name]
                if isinstance(value, tuple):
                    for position, word in enumerate(value):
                        yield Use(holder, owner, spec, word, position)
                elif value or (value is not None and spec.reference.required):
                    yield Use(holder, owner, spec, value)

    def resolve(self, use: Use) -> Resolution:
        """Resolve one reference by OpenSim's rule for its property.

        Returns:
            The component that is named, or the reason for the failure.
        """
        if isinstance(use.value, str):
            return self.lookup(use.reference, use.value, use.owner)
        is_in_tree = self.path_of(use.value) is not None
        return self._check_type(use.value if is_in_tree else None, use.reference.target)

    def lookup(self, reference: Reference, text: str, owner: Component) -> Resolution:
        """Resolve a text as the value of a reference.

        Args:
            reference: type of the property.
            text: text of the reference.
            owner: component that has the property.

        Returns:
            The component that is named, or the reason for the failure.
        """
        # Only ASCII white space is removed: for OpenSim a no-break space is a letter.
        text, rule, target = text.strip(" \t\n\r\f\v"), reference.rule, reference.target
        if not text.startswith("/") or rule not in PATH_RULES or target == "Frame":
            return RULES[rule](self, text, owner, target)
        # An absolute path leads to the same component from everywhere, and often hundreds of points name
        # one body, so cache the result.
        resolution = self._resolved.get((rule, target, text))
        if resolution is None:
            resolution = self._resolved[rule, target, text] = RULES[rule](self, text, owner, target)
        return resolution

    def target(self, owner: Component, name: str, value: str | Component) -> Component:
        """Return the component that a property leads to.

        Args:
            owner: component that has the property.
            name: attribute of the property.
            value: value of the property.

        Raises:
            ModelError: the value leads to no component.
        """
        spec = get_field_specs(type(owner))[name]
        use = Use(owner, owner, spec, value)
        resolution = self.resolve(use)
        result = resolution.target
        if result is None:
            text = use.text
            if not text:
                raise ModelError(
                    f"{type(owner).__name__} '{self.path_of(owner) or owner.name}': {name} is missing or empty; "
                    "'osimlite validate' lists every such place"
                )
            advice = suggest_name(text, self.list_spellings(use))
            if resolution.failure == "illegal":
                advice = (
                    "; a path must not contain white space, '\\', '*' or '+': rename the component, "
                    "and change the paths that name it"
                )
            raise ModelError(
                f"{type(owner).__name__} '{self.path_of(owner) or owner.name}': {name} names '{text}', "
                f"but the model has no such {use.reference.target}{advice}"
            )
        return result

    def format_reference(self, owner: Component, reference: Reference, component: Component) -> str:
        """Return the text by which a property names a component, as OpenSim writes it.

        Args:
            owner: component that has the property.
            reference: type of the property.
            component: component of the model.

        Raises:
            ModelError: the component is not in the model.
        """
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
        name = path.rsplit("/", 1)[1]
        set_names = {
            "contactgeometry-path-or-name": "contactgeometryset",
            "frame-path-or-body-name": "bodyset",
        }
        if reference.rule in set_names and (
            parent is None or self.path_of(parent) != "/" + set_names[reference.rule]
        ):
            return path
        return name

    @cached_property
    def by_name(self) -> dict[str, list[Component]]:
        """Components by the name at the end of their path, the first one of each class.

        Returns:
            Lists of components, each of another class, by name.
        """
        result: dict[str, dict[type[Component], Component]] = {}
        for component in self.components:
            result.setdefault(get_last_name(self._paths[id(component)]), {}).setdefault(
                type(component), component
            )
        return {name: list(components.values()) for name, components in result.items()}

    def list_spellings(self, use: Use) -> list[str]:
        """Return every valid text for a reference, for each component its shortest form."""
        reference = use.reference
        key = reference.rule, reference.target
        if key in self._spellings:
            return self._spellings[key]
        names = set()
        for component in self._list_instances(reference.target):
            if (
                reference.rule == "own-joint-coordinate"
                and self._parents.get(id(component)) is not use.owner
            ):
                continue
            text = self.format_reference(use.owner, reference, component)
            # A bare name may lead to an earlier component of the same name.
            if self.lookup(reference, text, use.owner).target is component:
                names.add(text)
        spellings = sorted(names)
        if reference.rule in EVERYWHERE:
            self._spellings[key] = spellings
        return spellings

    def _register_branch(self, component: Component, path: str) -> None:
        """Register a component at `path` ("" for the model), its objects, and everything below it."""
        self._register(component, path or "/")
        children: list[tuple[str, Component]] = []
        self._register_object(component, component, children)
        if not children and not component.internal:
            return
        below = self._below[id(component)] = []
        siblings: dict[str, Component] = {}
        if component.internal:
            for part in self._get_internal_parts(component):
                siblings[part.name] = part
                below.append(part)
                self._parents[id(part)] = component
                self._register(part, f"{path}/{part.name}")
        counts: dict[str, int] = {}
        for name, child in children:
            unique = name
            # OpenSim appends _0, _1 ... to the name of a component whose sibling has it already.
            if name in siblings:
                number = counts.get(name, 0)
                while (unique := f"{name}_{number}") in siblings:
                    number += 1
                counts[name] = number + 1
                self.renamed.append(RenamedComponent(child, unique, siblings[name]))
            siblings[unique] = child
            below.append(child)
            self._parents[id(child)] = component
            self._register_branch(child, f"{path}/{unique}")

    def _register(self, component: Component, path: str) -> None:
        put_model(component, self._claim(component._model))
        self.components.append(component)
        self.by_path[path] = component
        self._paths[id(component)] = path

    def _register_object(
        self, holder: Object, owner: Component, children: list[tuple[str, Component]]
    ) -> None:
        """Register an object of the model and objects without a path in it, which add no level.

        The components in it are added to `children`, with their names.
        """
        cls = type(holder)
        shelf = self._shelves.get(cls)
        if shelf is None:
            instances = self.by_class[cls] = []
            shelf = self._shelves[cls] = instances, _can_refer(cls), list_holding_properties(cls)
        instances, can_refer, properties = shelf
        instances.append(holder)
        if holder is not owner:
            put_model(holder, self._claim(holder._model))
        if can_refer:
            self._referring.append((holder, owner))
        state = holder.__dict__
        for spec, name, is_list, is_plain in properties:
            value = state.get(name)
            if value is None:
                # A default that was never accessed is an empty list, or a plain object without
                # components and references: neither matters here.
                if is_list or is_plain or name in state:
                    continue
                value = getattr(holder, name)
            if isinstance(value, ObjectList):
                value.owner = self._claim(getattr(value, "owner", None))
            for child in value if isinstance(value, list) else (value,):
                if child.is_component:
                    children.append((_get_name_in_tree(spec, child), child))
                else:
                    self._owners[id(child)] = owner
                    self._register_object(child, owner, children)

    def _assign_owners(self, holder: Object, owner: Component) -> None:
        for _, item in holder.list_owned_objects():
            if not item.is_component:
                self._owners[id(item)] = owner
                self._assign_owners(item, owner)

    def _get_internal_parts(self, owner: Component) -> list[Component]:
        """Return the parts that OpenSim adds itself; the same objects for the same owner."""
        cached = self._previous_parts.get(id(owner))
        if cached is None or cached[0] is not owner:
            cached = owner, [part.build({"name": name}, set()) for name, part in owner.internal]
        self._parts[id(owner)] = cached
        self._internal.update(map(id, cached[1]))
        return cached[1]

    def _check_type(self, component: Component | None, target: str) -> Resolution:
        if component is None:
            return Resolution(None, "missing")
        if not is_a(component, target) and type(component).__name__ != "Unknown":
            return Resolution(None, "wrong-type", component)
        return Resolution(component)

    def walk(self, text: str, base: str, target: str) -> Resolution:
        """Return the component at a path, or the reason why the path does not lead to one.

        Args:
            text: absolute path, or path relative to `base`.
            base: absolute path; "" for the model.
            target: class that the component must have.
        """
        path: str | None = text if text.startswith("/") else f"{base}/{text}"
        plain = self.by_path.get(path or "")
        if plain is not None:
            return self._check_type(plain, target)
        path = normalize_path(path or "")
        if path is None:
            return Resolution(None, "illegal")
        return self._check_type(self.by_path.get(path), target)

    def index_by_name(
        self, key: str, members: Callable[[], Iterator[tuple[str, Component]]]
    ) -> dict[str, Component]:
        """Return components by name, the first one of equal names; cached for each `key`.

        Args:
            key: key of the cache.
            members: yields names and components.

        Returns:
            Components by name.
        """
        if key not in self._names:
            names: dict[str, Component] = {}
            for name, component in members():
                names.setdefault(name, component)
            self._names[key] = names
        return self._names[key]

    def find_by_class(self, target: str) -> dict[str, Component]:
        """Return the components of a class, the first one of equal names.

        Returns:
            Components by name.
        """
        return self.index_by_name(
            target,
            lambda: (
                (get_last_name(self._paths[id(component)]), component)
                for component in self._list_instances(target)
            ),
        )

    def _list_instances(self, target: str) -> list[Component]:
        """Return the components of a class."""
        if target not in self._of_class:
            self._of_class[target] = [
                component for component in self.components if is_a(component, target)
            ]
        return self._of_class[target]

    def list_members(self, path: str, target: str) -> dict[str, Component]:
        """Return the components of a class directly below a path.

        Args:
            path: absolute path of a component.
            target: name of the class.

        Returns:
            Components by name.
        """
        holder = self.by_path.get(path)

        def list_below() -> Iterator[tuple[str, Component]]:
            for component in self._below.get(id(holder), ()):
                if is_a(component, target):
                    yield get_last_name(self._paths[id(component)]), component

        return self.index_by_name(f"{path}:{target}", list_below)


@cache
def _can_refer(cls: type[Object]) -> bool:
    """Return whether an object of this class can name a component."""
    return cls.name_reference is not None or bool(get_reference_specs(cls))


def _get_name_in_tree(spec: FieldSpec, item: Component) -> str:
    form = cast("ObjectField", spec.kind).form
    if form == "single":
        return spec.tag
    if form == "unnamed" and is_a(item, "ModelComponentSet"):
        return type(item).__name__.lower()
    return item.name or str(getattr(item, "class_name", "") or type(item).tag).lower()


class Snapshot:
    """Model in its present state; it is copied on first access, or just before it changes.

    Args:
        tree: tree of the model.
    """

    def __init__(self, tree: Tree) -> None:
        self._tree: Tree | None = tree
        self._copy: Model | None = None
        tree.snapshots.add(self)

    @property
    def model(self) -> Model:
        """Copy of the model, always the same one."""
        if self._copy is None:
            assert self._tree is not None
            self._copy, self._tree = self._tree.model.copy_deep(), None
        return self._copy
