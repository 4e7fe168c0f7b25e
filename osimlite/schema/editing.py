"""Renaming and removing of components, with updates of all references."""

from __future__ import annotations

from typing import Any

from osimlite.base.text import join_words
from osimlite.errors import ModelError
from osimlite.schema.base import Component, Object
from osimlite.schema.fields import Reference
from osimlite.schema.model import Model
from osimlite.schema.resolution import RULES, skip_resolution
from osimlite.schema.tree import ILLEGAL_CHARACTERS, Tree, Use

_NAME_NOTHING = frozenset(rule for rule, follow in RULES.items() if follow is skip_resolution) - {
    "input"
}

_OF_INPUT = Reference("socket", "Component")
"""Reference by which the text of an input names a component, before the bar and the output."""


def describe_illegal_name(name: str) -> str:
    """Return why a component cannot have a name, as ``"it has a blank"``; "" if it can."""
    if not name:
        return "it is empty"
    characters = [
        _CHARACTER_NAMES.get(character, f"'{character}'")
        for character in dict.fromkeys(name)
        if character in ILLEGAL_CHARACTERS
    ]
    return f"it has {join_words(characters)}" if characters else ""


_CHARACTER_NAMES = {" ": "a blank", "\t": "a tab", "\n": "a line break"}
"""Names of the illegal characters that cannot be seen."""


def rename_component(model: Model, component: Component, name: str) -> None:
    """Rename a component, and rewrite every reference to it or to components below it.

    A reference keeps its form (relative stays relative) where the new text still leads to the same
    component.

    Args:
        model: model that contains the component.
        component: component to rename.
        name: new name of the component.

    Raises:
        ModelError: the component is not in the model, the name is illegal, or a sibling has it.
    """
    tree = model.tree()
    path = _get_path(model, component)
    if reason := describe_illegal_name(name):
        raise ModelError(f"'{name}' is not a legal name of a component: {reason}")
    parent = tree.parent_of(component)
    new_path = f"{'' if parent is None else path.rsplit('/', 1)[0]}/{name}"
    occupant = tree.by_path.get(new_path)
    if parent is not None and occupant is not None and occupant is not component:
        raise ModelError(f"cannot rename '{path}': its parent has a '{name}' already")
    texts = [
        (use, find_named_component(tree, use)) for use in tree.uses() if isinstance(use.value, str)
    ]
    component.name = name
    tree = model.tree()
    for use, target in texts:
        # A reference that still leads to its component keeps its text.
        if target is None or find_named_component(tree, use) is target:
            continue
        assert isinstance(use.value, str)
        if use.reference.rule == "input":
            _, bar, output = use.value.partition("|")
            _set_value(use, f"{tree.format_reference(use.owner, _OF_INPUT, target)}{bar}{output}")
        else:
            _set_value(use, tree.format_reference(use.owner, use.reference, target))


def remove_component(model: Model, component: Component) -> None:
    """Remove a component and everything below it from the model.

    Args:
        model: model that contains the component.
        component: component to remove.

    Raises:
        ModelError: the component is not in the model, is required (the ground, a set), or others name
            it; the message lists them.
    """
    tree = model.tree()
    path = _get_path(model, component)
    removed_ids = {id(item) for item in component.walk()}
    users = sorted(
        {
            tree.path_of(use.owner) or use.owner.name
            for use in tree.uses()
            if id(use.holder) not in removed_ids
            and _is_at_or_below(_find_target_path(tree, use), path)
        }
    )
    if users:
        raise ModelError(
            f"cannot remove '{path}': {join_words(users)} {'names' if len(users) == 1 else 'name'} it"
        )
    for holder in model.walk():
        for spec, item in holder.list_owned_objects():
            members = getattr(holder, spec.name)
            if item is component and isinstance(members, list):
                members.remove(component)
                return
    raise ModelError(f"cannot remove '{path}': every model has one")


def find_named_component(tree: Tree, use: Use) -> Component | None:
    """Return the component that a reference names; for an input, the one that has the output.

    Args:
        tree: tree of the model.
        use: reference in the model.
    """
    if use.reference.rule in _NAME_NOTHING:
        return None
    if use.reference.rule == "input" and isinstance(use.value, str):
        path, bar, _ = use.value.partition("|")
        return tree.lookup(_OF_INPUT, path, use.owner).target if bar else None
    return tree.resolve(use).target


def _get_path(model: Model, component: Object) -> str:
    path = model.tree().path_of(component)
    if path is None:
        raise ModelError(f"'{component.name}' is not in the model")
    return path


def _find_target_path(tree: Tree, use: Use) -> str | None:
    target = find_named_component(tree, use)
    return None if target is None else tree.path_of(target)


def _is_at_or_below(path: str | None, top: str) -> bool:
    """Return whether a path is `top` or below it.

    Paths are compared because OpenSim's internal parts can be named, but no property holds them.
    """
    return path is not None and (path == top or path.startswith(top + "/"))


def _set_value(use: Use, text: str) -> None:
    value: Any = text
    if use.position is not None:
        words = list(getattr(use.holder, use.spec.name))
        words[use.position] = text
        value = tuple(words)
    setattr(use.holder, use.spec.name, value)
