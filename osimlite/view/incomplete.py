"""Models with faults: the part that can be shown, and the reasons why the rest cannot."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later
from osimlite.base.text import format_count
from osimlite.errors import ModelError, UnsupportedError
from osimlite.lint import Finding, Severity
from osimlite.mechanics.multibody import Mechanism, build_mechanism
from osimlite.schema.base import Component
from osimlite.schema.model import Model

MAX_REMARKS = 12
"""Largest number of parts that are named; the number of the others is given."""

MAX_SAME = 3
"""Largest number of parts with the same reason that are named."""

MISSING_MESH = "the mesh file"
"""Beginning of the reason why a mesh is not drawn if its file is missing."""
_QUOTED_PATH = compile_later(r"'(/[^']+)'")


class ShowableModel(NamedTuple):
    """A model whose mechanism can be built, with the paths of parts left out and the reasons."""

    model: Model
    mechanism: Mechanism
    left_out: list[tuple[str, str]]


def build_showable(model: Model) -> ShowableModel:
    """Build the mechanism of a model without the joints and constraints that cannot be built.

    These parts are removed from a copy, so that the model of the caller stays complete. A body that
    loses its joint this way moves freely, as OpenSim's bodies without a joint do; it is shown at
    ground.

    Returns:
        Model without the parts that cannot be built, its mechanism, and paths and reasons of these
        parts.

    Raises:
        ModelError: the model is invalid, and no single part of it is the cause.
        UnsupportedError: the model is unsupported, and no single part of it is the cause.
    """
    left_out: list[tuple[str, str]] = []
    first: ModelError | UnsupportedError | None = None
    copy = model
    while True:
        try:
            return ShowableModel(copy, build_mechanism(copy), left_out)
        except (ModelError, UnsupportedError) as error:
            # If nothing can be left out, the first error is the one that concerns the user's own
            # model.
            first = first or error
            if copy is model:
                # The caller's model stays complete.
                copy = model.copy_deep()
            path = _take_out(copy, error.message)
            if path is None:
                raise first from None
            left_out.append((path, error.message))


def _take_out(model: Model, message: str) -> str | None:
    """Remove the first member of a set that a message names.

    Returns:
        Path of the removed member; None if the message names none.
    """
    tree = model.tree()
    for path in _QUOTED_PATH.findall(message):
        # '/jointset/hip/hip_offset' is part of the joint '/jointset/hip', which is of no use
        # without it.
        member = "/".join(path.split("/")[:3])
        component = tree.by_path.get(member)
        if component is not None and member.count("/") == 2 and _remove_component(model, component):
            return member
    return None


def _remove_component(model: Model, component: Component) -> bool:
    """Remove a component from the list that holds it.

    Returns:
        Whether a list holds it.
    """
    for owner in model.walk():
        for spec, member in owner.list_owned_objects():
            siblings = getattr(owner, spec.name)
            if member is component and isinstance(siblings, list):
                siblings.remove(component)
                return True
    return False


def describe_errors(findings: Iterable[Finding], parts: Sequence[tuple[str, str]]) -> list[str]:
    """Return one sentence per error of the model, without errors of the omitted components.

    Args:
        findings: findings of the validator.
        parts: path of each omitted component, with the reason.
    """
    omitted = [path for path, _ in parts]
    errors = [
        finding
        for finding in findings
        if finding.severity is Severity.ERROR
        and not any(f"{finding.component}/".startswith(f"{path}/") for path in omitted)
    ]
    lines = []
    for finding in errors[:MAX_REMARKS]:
        hint = f"; did you mean '{finding.suggestion}'?" if finding.suggestion else ""
        lines.append(f"error: {finding.component or 'the document'}: {finding.message}{hint}")
    hidden_count = len(errors) - len(lines)
    return (
        [*lines, f"{format_count(hidden_count, 'more error')}; 'osimlite validate' lists all"]
        if hidden_count
        else lines
    )


def describe_left_out(
    parts: Sequence[tuple[str, str]], *, with_meshes: bool = True
) -> Iterator[str]:
    """Yield sentences about parts that are not shown.

    Args:
        parts: path of each omitted component, with the reason.
        with_meshes: whether there is a sentence about missing mesh files.
    """
    # Parts with the same reason are one sentence: a model may have a hundred paths without points.
    groups: dict[str, list[tuple[str, str]]] = {}
    for path, reason in parts:
        key = MISSING_MESH if reason.startswith(MISSING_MESH) else reason
        groups.setdefault(key, []).append((path, reason))
    # Missing files are the most frequent reason, and the least surprising one: they come last.
    meshes = groups.pop(MISSING_MESH, [])
    rows = [
        row
        for group in groups.values()
        for row in ([group] if len(group) > MAX_SAME else [[part] for part in group])
    ]
    yield from map(_describe_group, rows[:MAX_REMARKS])
    hidden_count = sum(map(len, rows[MAX_REMARKS:]))
    if hidden_count:
        yield f"not shown: {format_count(hidden_count, 'more part')}"
    if meshes and with_meshes:
        yield _describe_group(meshes)


def _describe_group(parts: Sequence[tuple[str, str]]) -> str:
    """Return one sentence about parts that are not shown for the reason of the first."""
    path, reason = parts[0]
    more = f" (and {format_count(len(parts) - 1, 'similar part')})" if len(parts) > 1 else ""
    return f"not shown: {path}{more}: {reason}"
