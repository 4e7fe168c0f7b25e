"""Component tree of a model for the page: properties as text, findings and their positions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from osimlite.errors import OsimliteError
from osimlite.io.document.lexical import make_formatter
from osimlite.lint.diagnostic import Finding
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.schema.base import Component, Object, Unknown
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.fields import ObjectField, Reference
from osimlite.schema.joints import Joint
from osimlite.schema.model import Model
from osimlite.schema.paths import AbstractGeometryPath, PathPoint
from osimlite.schema.specs import get_field_specs
from osimlite.schema.tree import Tree
from osimlite.view.scene import Scene

MAX_PROPERTY_LENGTH = 400
"""Number of characters of a property that are shown; curves have thousands."""


def component_tree(model: Model) -> tuple[list[dict[str, Any]], dict[str, list[str]]]:
    """Describe the components of a model file for the page, each after its owner.

    A component has `path`, `name`, `kind` (the class), `parent` (index in the list, -1 for none)
    and `values`, the texts of its properties. `given` has the indices of the properties that are in
    the file or were assigned; the others have their defaults. A component whose properties differ
    from those of the first component of its class also has `tags`, their names.

    Returns:
        The components, and the names of the properties by class.
    """
    tree = model.tree()
    index_by_id: dict[int, int] = {}
    tags: dict[str, list[str]] = {}
    nodes: list[dict[str, Any]] = []
    for component in tree.components:
        # Components that osimlite adds are not in the file.
        if tree.is_internal(component):
            continue
        path = tree.path_of(component) or "/"
        parent = tree.parent_of(component)
        class_tag = component.class_name if isinstance(component, Unknown) else type(component).tag
        rows = list(_list_properties(tree, component, ""))
        names = [name for name, _, _ in rows]
        node: dict[str, Any] = {
            "path": path,
            "name": path.rsplit("/", 1)[1] or model.name or "model",
            "kind": class_tag,
            "parent": -1 if parent is None else index_by_id.get(id(parent), -1),
            "values": [
                text if len(text) <= MAX_PROPERTY_LENGTH else text[:MAX_PROPERTY_LENGTH] + " …"
                for _, text, _ in rows
            ],
            "given": [index for index, (_, _, is_explicit) in enumerate(rows) if is_explicit],
        }
        # Most components of a class have the same properties, which are written once.
        if tags.setdefault(class_tag, names) != names:
            node["tags"] = names
        index_by_id[id(component)] = len(nodes)
        nodes.append(node)
    return nodes, tags


def _list_properties(tree: Tree, owner: Object, prefix: str) -> Iterator[tuple[str, str, bool]]:
    """Yield name, text and whether it was set, of every property, also of nested objects."""
    if isinstance(owner, Unknown):
        yield f"{prefix}content", owner.content, True
        return
    for spec in get_field_specs(type(owner)).values():
        value = getattr(owner, spec.name)
        is_explicit = spec.name in owner.model_fields_set
        if isinstance(spec.kind, ObjectField):
            for member in value if isinstance(value, list) else [value]:
                if isinstance(member, Object) and not isinstance(member, Component):
                    name = (
                        f"{spec.tag}.{member.name}."
                        if isinstance(value, list) and member.name
                        else f"{spec.tag}."
                    )
                    yield from _list_properties(tree, member, prefix + name)
        elif isinstance(spec.kind, Reference):
            yield prefix + spec.tag, _name_values(tree, owner, spec.kind, value), is_explicit
        else:
            yield (
                prefix + spec.tag,
                make_formatter(spec.kind, "shortest")(value).strip(),
                is_explicit,
            )


def _name_values(tree: Tree, owner: Object, reference: Reference, value: Any) -> str:
    if isinstance(value, Component):
        try:
            return tree.format_reference(tree.owner_of(owner), reference, value)
        # Of a component outside of the model, only the name is known.
        except OsimliteError:
            return value.name
    if isinstance(value, tuple):
        return " ".join(_name_values(tree, owner, reference, member) for member in value)
    return "" if value is None else str(value)


def finding_rows(findings: Sequence[Finding]) -> list[dict[str, Any]]:
    """Return the findings as records for the page."""
    return [
        {
            "code": finding.code,
            "severity": finding.severity.value,
            "message": finding.message,
            "component": finding.component,
            "place": f"line {finding.line}" if finding.line is not None else "",
        }
        for finding in findings
    ]


def place_pins(model: Model, scene: Scene, findings: Sequence[Finding]) -> list[dict[str, Any]]:
    """Return a pin (body, point, codes, worst severity) per component with findings and position."""
    tree = model.tree()
    mechanism = scene.mechanism
    results: dict[str, list[Finding]] = {}
    for finding in findings:
        # Remarks have no pin: there may be hundreds.
        if finding.component in tree.by_path and finding.severity.rank < 2:
            results.setdefault(finding.component, []).append(finding)
    result = []
    for path, component_findings in results.items():
        body_and_point = _find_point(tree, mechanism, scene, tree.by_path[path])
        if body_and_point is not None:
            worst = min(component_findings, key=lambda finding: finding.severity.rank)
            result.append(
                {
                    "path": path,
                    "codes": ", ".join(
                        dict.fromkeys(finding.code for finding in component_findings)
                    ),
                    "severity": worst.severity.value,
                    "body": body_and_point[0],
                    "at": body_and_point[1].tolist(),
                }
            )
    return result


def _find_point(
    tree: Tree, mechanism: Mechanism, scene: Scene, component: Component | None
) -> tuple[int, Any] | None:
    """Return the body of a component and its point (3,) there, or those of the nearest owner that has a position."""
    # 1. A drawn part of the component; 2. its place in the mechanism; 3. its owner.
    while component is not None:
        path = tree.path_of(component) or ""
        drawn_item = next(
            (drawn_item for drawn_item in scene.items if drawn_item.path == path), None
        )
        if drawn_item is not None:
            return drawn_item.body, drawn_item.matrix[:3, 3]
        line = next((line for line in scene.lines if line.path == path), None)
        if line is not None:
            return line.start
        if path in mechanism.stations:
            return mechanism.stations[path]
        if path in mechanism.frames:
            body, matrix = mechanism.frames[path]
            return body, matrix[:3, 3]
        if isinstance(component, Coordinate | Joint):
            joint = component if isinstance(component, Joint) else tree.parent_of(component)
            for index, moving_body in enumerate(mechanism.bodies):
                if joint is not None and moving_body.mobilizer.joint == tree.path_of(joint):
                    # The frame of the joint on the body that it moves.
                    mobilizer = moving_body.mobilizer
                    return index, (
                        mobilizer.parent_frame if mobilizer.reversed else mobilizer.child_frame
                    )[:3, 3]
        if isinstance(component, PathPoint):
            try:
                frame = tree.target(component, "socket_parent_frame", component.socket_parent_frame)
                body, matrix = mechanism.placement(tree.path_of(frame) or "")
            except OsimliteError:
                return None
            return body, matrix[:3, :3] @ np.array(component.location) + matrix[:3, 3]
        parent = tree.parent_of(component)
        component = (
            parent
            # The model itself has no place.
            if isinstance(component, AbstractGeometryPath) or not isinstance(parent, Model)
            else None
        )
    return None
