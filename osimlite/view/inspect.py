"""The component tree of a model for people to look through: properties as text, findings, and where they belong."""

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

LONGEST = 400
"""Characters of a property that are shown; curves have thousands."""


def component_tree(model: Model) -> tuple[list[dict[str, Any]], dict[str, list[str]]]:
    """Describe the components of a model file for the page, each after its owner.

    A component has `path`, `name`, `kind`, `parent` (a place in the list, -1 for none), `values` of
    its properties as text, and `given`: which of them are in the file or were assigned, and are no
    mere defaults. Where a component has other properties than the first of its class, it has `tags`
    of its own.

    Returns:
        The components, and the names of the properties by class.
    """
    tree = model.tree()
    places: dict[int, int] = {}
    tags: dict[str, list[str]] = {}
    nodes: list[dict[str, Any]] = []
    for component in tree.components:
        # Components that osimlite adds are not in the file.
        if tree.is_internal(component):
            continue
        path = tree.path_of(component) or "/"
        above = tree.parent_of(component)
        kind = component.class_name if isinstance(component, Unknown) else type(component).tag
        rows = list(_list_properties(tree, component, ""))
        names = [name for name, _, _ in rows]
        node: dict[str, Any] = {
            "path": path,
            "name": path.rsplit("/", 1)[1] or model.name or "model",
            "kind": kind,
            "parent": -1 if above is None else places.get(id(above), -1),
            "values": [
                text if len(text) <= LONGEST else text[:LONGEST] + " …" for _, text, _ in rows
            ],
            "given": [index for index, (_, _, given) in enumerate(rows) if given],
        }
        # Most components of a class have the same properties, which are written once.
        if tags.setdefault(kind, names) != names:
            node["tags"] = names
        places[id(component)] = len(nodes)
        nodes.append(node)
    return nodes, tags


def _list_properties(tree: Tree, item: Object, way: str) -> Iterator[tuple[str, str, bool]]:
    """Name, text and whether it was given, of every property; those of objects without a path follow their holder."""
    if isinstance(item, Unknown):
        yield f"{way}content", item.content, True
        return
    for spec in get_field_specs(type(item)).values():
        value = getattr(item, spec.name)
        given = spec.name in item.model_fields_set
        if isinstance(spec.kind, ObjectField):
            for held in value if isinstance(value, list) else [value]:
                if isinstance(held, Object) and not isinstance(held, Component):
                    name = (
                        f"{spec.tag}.{held.name}."
                        if isinstance(value, list) and held.name
                        else f"{spec.tag}."
                    )
                    yield from _list_properties(tree, held, way + name)
        elif isinstance(spec.kind, Reference):
            yield way + spec.tag, _name_values(tree, item, spec.kind, value), given
        else:
            yield way + spec.tag, make_formatter(spec.kind, "shortest")(value).strip(), given


def _name_values(tree: Tree, item: Object, reference: Reference, value: Any) -> str:
    if isinstance(value, Component):
        try:
            return tree.format_reference(tree.owner_of(item), reference, value)
        # A reference to a component outside of the model has a name at least.
        except OsimliteError:
            return value.name
    if isinstance(value, tuple):
        return " ".join(_name_values(tree, item, reference, word) for word in value)
    return "" if value is None else str(value)


def finding_rows(findings: Sequence[Finding]) -> list[dict[str, Any]]:
    """Findings as the page shows them."""
    return [
        {
            "code": item.code,
            "severity": item.severity.value,
            "message": item.message,
            "component": item.component,
            "place": f"line {item.line}" if item.line is not None else "",
        }
        for item in findings
    ]


def place_pins(model: Model, scene: Scene, findings: Sequence[Finding]) -> list[dict[str, Any]]:
    """Return one pin for each component with findings and a position: body, point, codes and worst severity."""
    tree, mechanism = model.tree(), scene.mechanism
    results: dict[str, list[Finding]] = {}
    for item in findings:
        # Remarks have no pin: there may be hundreds.
        if item.component in tree.by_path and item.severity.rank < 2:
            results.setdefault(item.component, []).append(item)
    result = []
    for path, items in results.items():
        place = _find_point(tree, mechanism, scene, tree.by_path[path])
        if place is not None:
            worst = min(items, key=lambda item: item.severity.rank)
            result.append(
                {
                    "path": path,
                    "codes": ", ".join(dict.fromkeys(item.code for item in items)),
                    "severity": worst.severity.value,
                    "body": place[0],
                    "at": place[1].tolist(),
                }
            )
    return result


def _find_point(
    tree: Tree, mechanism: Mechanism, scene: Scene, component: Component | None
) -> tuple[int, Any] | None:
    """Return the body of a component and its point (3,) there, or those of the nearest owner that has a position."""
    # 1. What is drawn of it; 2. its place in the mechanism; 3. its owner.
    while component is not None:
        path = tree.path_of(component) or ""
        item = next((item for item in scene.items if item.path == path), None)
        if item is not None:
            return item.body, item.matrix[:3, 3]
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
            for index, mobile in enumerate(mechanism.bodies):
                if joint is not None and mobile.mobilizer.joint == tree.path_of(joint):
                    # The frame of the joint on the body that it moves.
                    own = mobile.mobilizer
                    return index, (own.parent_frame if own.reversed else own.child_frame)[:3, 3]
        if isinstance(component, PathPoint):
            try:
                frame = tree.target(component, "socket_parent_frame", component.socket_parent_frame)
                body, matrix = mechanism.placement(tree.path_of(frame) or "")
            except OsimliteError:
                return None
            return body, matrix[:3, :3] @ np.array(component.location) + matrix[:3, 3]
        above = tree.parent_of(component)
        component = (
            above
            # The model itself has no place.
            if isinstance(component, AbstractGeometryPath) or not isinstance(above, Model)
            else None
        )
    return None
