"""The rules by which the text of a reference resolves to a component.

Every rule is OpenSim 4.6's (``schemas/references.json`` names the source of each): sockets walk
exactly, other properties look a bare name up in one set, and nothing searches.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Literal

from osimlite.base.named_tuples import NamedTuple
from osimlite.schema.base import Component, Object
from osimlite.schema.patterns import Pattern, PatternError, UnsupportedPatternError
from osimlite.schema.states import find_variables

if TYPE_CHECKING:
    from osimlite.schema.tree import Tree

Failure = Literal["missing", "wrong-type", "empty", "illegal"]

ILLEGAL_CHARACTERS = "\\*+ \t\n/"
"""Characters that OpenSim rejects in the name of a component."""

_NEVER_IN_PATHS = frozenset(ILLEGAL_CHARACTERS) - {"/"}


class Resolution(NamedTuple):
    """Result of resolving a reference.

    Attributes:
        target: named component; None on failure.
        failure: reason: nothing at the path, a component of another class, an empty text, or a text
            that is not a path.
        wrong_target: component of another class to which the text leads.
    """

    target: Component | None
    failure: Failure | None = None
    wrong_target: Component | None = None


def is_a(component: Object, target: str) -> bool:
    """Return whether the class of a component is `target` or derives from it.

    Args:
        component: object to test.
        target: name of a class.
    """
    return derives_from(type(component), target)


@cache
def derives_from(cls: type[Object], target: str) -> bool:
    """Return whether a class is `target` or derives from it; the module of `target` need not be imported.

    Args:
        cls: class to test.
        target: name of a class.
    """
    return any(base.__name__ == target for base in cls.__mro__)


def normalize_path(path: str) -> str | None:
    """Return an absolute path without doubled slashes, ``.`` and ``..``; None if it climbs above the root."""
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
    """Return the name at the end of a path."""
    return path.rsplit("/", 1)[1] or "/"


def _resolve_socket(tree: Tree, text: str, owner: Component, target: str) -> Resolution:
    """Resolve the path of a socket, relative to its owner or absolute.

    Returns:
        The component, or the reason of the failure.
    """
    if _is_illegal_path(text):
        return Resolution(None, "illegal")
    if target == "Frame":
        # OpenSim connects each geometry of a frame to that frame, whatever path the file gives. This does
        # not apply to geometry among the frame's subcomponents.
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


def _is_illegal_path(text: str) -> bool:
    """Return whether OpenSim cannot parse a text as a path.

    OpenSim parses the text of every socket when it loads a file, so such a model does not load.
    """
    if not _NEVER_IN_PATHS.isdisjoint(text):
        return True
    return text.startswith("/") and normalize_path(text) is None


def _resolve_model_path(tree: Tree, text: str, owner: Component, target: str) -> Resolution:
    return tree.walk(text, "", target) if text else Resolution(None, "empty")


def _make_path_or_member_rule(*set_paths: str) -> Callable[[Tree, str, Component, str], Resolution]:
    """Return a rule that tries a path from the model, then the text appended to the paths of sets."""

    def rule(tree: Tree, text: str, owner: Component, target: str) -> Resolution:
        if not text:
            return Resolution(None, "empty")
        tried = [
            tree.walk(f"{path}{text}", "", target)
            for path in ("", *(f"{path}/" for path in set_paths))
        ]
        return min(
            tried,
            key=lambda candidate: (candidate.target is None, candidate.failure != "wrong-type"),
        )

    return rule


def _make_bare_name_rule(
    members: Callable[[Tree, Component, str], dict[str, Component]],
) -> Callable[..., Resolution]:
    """Return a rule that looks a name up among components; a path is not a name."""

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
    """Resolve the name of a state, a control or a generalized force.

    Returns:
        The component with the variable, or the reason for the failure: ``missing`` or ``empty``.
    """
    result = find_variables(tree, target).get(text)
    return Resolution(result, None if result is not None else "missing" if text else "empty")


def _resolve_pattern(tree: Tree, text: str, owner: Component, target: str) -> Resolution:
    """Resolve a regular expression, which must match the complete name of at least one variable.

    Returns:
        The component of the first variable that matches, or the reason for the failure. A pattern with
        syntax that only OpenSim reads counts as resolved.
    """
    try:
        pattern = Pattern(text)
    except UnsupportedPatternError:
        # OpenSim supports more syntax than this matcher, so the pattern may be valid.
        return Resolution(owner)
    except PatternError:
        return Resolution(None, "illegal")
    result = next(
        (item for name, item in find_variables(tree, target).items() if pattern.fullmatch(name)),
        None,
    )
    return Resolution(result, None if result is not None else "missing")


def skip_resolution(tree: Tree, text: str, owner: Component, target: str) -> Resolution:
    """Resolve a text that names nothing in the component tree: a file, a column, a position.

    Args:
        tree: tree of the model.
        text: text of the property.
        owner: component that has the property.
        target: class of the named component; not used.

    Returns:
        The owner, so that the text counts as resolved.
    """
    return Resolution(owner)


PATH_RULES = frozenset(("socket", "owner-path", "model-path"))
"""Rules by which an absolute path leads to the same component from everywhere."""

EVERYWHERE = frozenset(
    f"{kind}-name" for kind in ("coordinate", "body", "joint", "actuator", "muscle", "wrap-object")
)
"""Rules by which a bare name leads to the same component from everywhere."""

RULES: dict[str, Callable[[Tree, str, Component, str], Resolution]] = {
    "socket": _resolve_socket,
    "owner-path": _resolve_socket,
    "model-path": _resolve_model_path,
    "coordinate-name": _make_bare_name_rule(
        lambda tree, owner, target: tree.find_by_class("Coordinate")
    ),
    "body-name": _make_bare_name_rule(
        lambda tree, owner, target: tree.list_members("/bodyset", "Body")
    ),
    "body-name-or-com": _make_bare_name_rule(
        lambda tree, owner, target: tree.list_members("/bodyset", "Body")
    ),
    "joint-name": _make_bare_name_rule(
        lambda tree, owner, target: tree.list_members("/jointset", "Joint")
    ),
    "actuator-name": _make_bare_name_rule(
        lambda tree, owner, target: tree.list_members("/forceset", "Actuator")
    ),
    "muscle-name": _make_bare_name_rule(
        lambda tree, owner, target: tree.list_members("/forceset", "Muscle")
    ),
    "wrap-object-name": _make_bare_name_rule(
        lambda tree, owner, target: tree.find_by_class("WrapObject")
    ),
    "own-joint-coordinate": _make_bare_name_rule(
        lambda tree, owner, target: tree.list_members(tree.path_of(owner) or "/", "Coordinate")
    ),
    "marker-name": _make_bare_name_rule(
        lambda tree, owner, target: tree.list_members("/markerset", "Marker")
    ),
    "set-member": _make_bare_name_rule(
        lambda tree, owner, target: tree.list_members(tree.path_of(owner) or "/", "Component")
    ),
    "frame-path-or-body-name": _make_path_or_member_rule("/bodyset"),
    "frame-path-or-member": _make_path_or_member_rule("/bodyset", "/jointset"),
    "contactgeometry-path-or-name": _make_path_or_member_rule("/contactgeometryset"),
    "input": skip_resolution,
    "file": skip_resolution,
    "output-file": skip_resolution,
    "input-folder": skip_resolution,
    "output-folder": skip_resolution,
    "column": skip_resolution,
    "state-path": _resolve_variable,
    "pattern": _resolve_pattern,
    "external-force-name": skip_resolution,
    "positional": skip_resolution,
    "point-index": skip_resolution,
}
"""Functions by rule; each takes the tree, the text, its owner and the class of the target."""
