"""The rules by which the text of a reference resolves to a component.

Every rule is OpenSim 4.6's (``schemas/references.json`` names the source of each): sockets walk
exactly, other properties look a bare name up in one set, and nothing searches.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Literal, NamedTuple

from osimlite.schema.base import Component, Object
from osimlite.schema.patterns import Pattern, PatternError, UnsupportedPatternError
from osimlite.schema.states import find_variables

if TYPE_CHECKING:
    from osimlite.schema.tree import Tree

Failure = Literal["missing", "wrong-type", "empty", "illegal"]

ILLEGAL_CHARACTERS = "\\*+ \t\n/"
"""Characters OpenSim refuses in the name of a component."""

_NEVER_IN_PATHS = frozenset(ILLEGAL_CHARACTERS) - {"/"}


class Resolution(NamedTuple):
    """What a reference leads to.

    `target` is the component, or None with the `failure`: nothing there, a component of another
    class (`found`), no text, or a text that is not a path.
    """

    target: Component | None
    failure: Failure | None = None
    found: Component | None = None


def is_a(component: Object, target: str) -> bool:
    """Whether the component's class is `target` or derives from it."""
    return _derives_from(type(component), target)


@cache
def _derives_from(cls: type[Object], target: str) -> bool:
    return any(base.__name__ == target for base in cls.__mro__)


def normalize_path(path: str) -> str | None:
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


def get_last_name(path: str) -> str:
    """The name at the end of a path."""
    return path.rsplit("/", 1)[1] or "/"


def _resolve_socket(tree: Tree, text: str, owner: Component, target: str) -> Resolution:
    if _is_no_path(text):
        return Resolution(None, "illegal")
    if target == "Frame":
        # While connecting, a frame puts itself into the socket of every geometry it draws, whatever
        # path the file gives; not of one that it merely holds among its components.
        parent = tree.parent_of(owner)
        if (
            parent is not None
            and is_a(parent, "Frame")
            and not any(item is owner for item in parent.subcomponents)
        ):
            return Resolution(parent)
    if not text:
        return Resolution(None, "empty")
    base = tree.path_of(owner) or "/"
    return tree.walk(text, "" if base == "/" else base, target)


def _is_no_path(text: str) -> bool:
    """Whether OpenSim cannot even read the text as a path, which it does of every socket when it loads the file."""
    if not _NEVER_IN_PATHS.isdisjoint(text):
        return True
    return text.startswith("/") and normalize_path(text) is None


def _model_path(tree: Tree, text: str, owner: Component, target: str) -> Resolution:
    return tree.walk(text, "", target) if text else Resolution(None, "empty")


def _path_or_member(*set_paths: str) -> Callable[[Tree, str, Component, str], Resolution]:
    """First a path from the model, then OpenSim appends the text to the paths of the sets."""

    def rule(tree: Tree, text: str, owner: Component, target: str) -> Resolution:
        if not text:
            return Resolution(None, "empty")
        tried = [
            tree.walk(f"{path}{text}", "", target)
            for path in ("", *(f"{path}/" for path in set_paths))
        ]
        return min(tried, key=lambda each: (each.target is None, each.failure != "wrong-type"))

    return rule


def _resolve_bare_name(
    members: Callable[[Tree, Component, str], dict[str, Component]],
) -> Callable[..., Resolution]:
    """A bare name among `members`; a path is no name."""

    def rule(tree: Tree, text: str, owner: Component, target: str) -> Resolution:
        if not text:
            return Resolution(None, "empty")
        result = members(tree, owner, target).get(text)
        if result is None:
            other = next(iter(tree.by_name.get(text, ())), None)
            return Resolution(None, "missing" if other is None else "wrong-type", other)
        return Resolution(result)

    return rule


def _resolve_variable(tree: Tree, text: str, owner: Component, target: str) -> Resolution:
    """The name of a state, a control or a generalized force."""
    result = find_variables(tree, target).get(text)
    return Resolution(result, None if result is not None else "missing" if text else "empty")


def _resolve_pattern(tree: Tree, text: str, owner: Component, target: str) -> Resolution:
    """A regular expression that the whole name of one at least must match."""
    try:
        pattern = Pattern(text)
    except UnsupportedPatternError:
        # OpenSim may match names with it: nothing can be said.
        return Resolution(owner)
    except PatternError:
        return Resolution(None, "illegal")
    result = next(
        (item for name, item in find_variables(tree, target).items() if pattern.fullmatch(name)),
        None,
    )
    return Resolution(result, None if result is not None else "missing")


def nothing_to_resolve(tree: Tree, text: str, owner: Component, target: str) -> Resolution:
    """Files, columns and positions name nothing in the component tree."""
    return Resolution(owner)


PATH_RULES = frozenset(("socket", "owner-path", "model-path"))
"""The rules by which an absolute path leads to the same component from everywhere."""

EVERYWHERE = frozenset(
    f"{kind}-name" for kind in ("coordinate", "body", "joint", "actuator", "muscle", "wrap-object")
)
"""The rules by which a bare name leads to the same component from everywhere."""

RULES: dict[str, Callable[[Tree, str, Component, str], Resolution]] = {
    "socket": _resolve_socket,
    "owner-path": _resolve_socket,
    "model-path": _model_path,
    "coordinate-name": _resolve_bare_name(lambda tree, owner, target: tree.of_class("Coordinate")),
    "body-name": _resolve_bare_name(lambda tree, owner, target: tree.members("/bodyset", "Body")),
    "body-name-or-com": _resolve_bare_name(
        lambda tree, owner, target: tree.members("/bodyset", "Body")
    ),
    "joint-name": _resolve_bare_name(
        lambda tree, owner, target: tree.members("/jointset", "Joint")
    ),
    "actuator-name": _resolve_bare_name(
        lambda tree, owner, target: tree.members("/forceset", "Actuator")
    ),
    "muscle-name": _resolve_bare_name(
        lambda tree, owner, target: tree.members("/forceset", "Muscle")
    ),
    "wrap-object-name": _resolve_bare_name(lambda tree, owner, target: tree.of_class("WrapObject")),
    "own-joint-coordinate": _resolve_bare_name(
        lambda tree, owner, target: tree.members(tree.path_of(owner) or "/", "Coordinate")
    ),
    "marker-name": _resolve_bare_name(
        lambda tree, owner, target: tree.members("/markerset", "Marker")
    ),
    "set-member": _resolve_bare_name(
        lambda tree, owner, target: tree.members(tree.path_of(owner) or "/", "Component")
    ),
    "frame-path-or-body-name": _path_or_member("/bodyset"),
    "frame-path-or-member": _path_or_member("/bodyset", "/jointset"),
    "contactgeometry-path-or-name": _path_or_member("/contactgeometryset"),
    "input": nothing_to_resolve,
    "file": nothing_to_resolve,
    "output-file": nothing_to_resolve,
    "input-folder": nothing_to_resolve,
    "output-folder": nothing_to_resolve,
    "column": nothing_to_resolve,
    "state-path": _resolve_variable,
    "pattern": _resolve_pattern,
    "external-force-name": nothing_to_resolve,
    "positional": nothing_to_resolve,
    "point-index": nothing_to_resolve,
}
"""By the name of a rule, what follows a text by it: the tree, the text, its owner, the class to be found."""
