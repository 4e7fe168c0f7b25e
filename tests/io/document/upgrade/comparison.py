"""Compare an upgraded model with OpenSim's, except for differences that OpenSim itself causes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from osimlite.schema.base import Object
from osimlite.schema.fields import ObjectField, Reference
from osimlite.schema.model import Model
from osimlite.schema.specs import FieldSpec
from osimlite.schema.tree import Tree, Use

SIX_DIGITS = 1e-5
"""Relative accuracy of a number that OpenSim has printed with six digits."""

ROUNDED = {
    ("Body", "inertia"),
    ("Mesh", "scale_factors"),
    ("PhysicalOffsetFrame", "translation"),
    ("PhysicalOffsetFrame", "orientation"),
}
"""Properties that OpenSim's upgrade writes with six digits.

OpenSim's printer does the same with the arrays of functions.
"""


def differences(ours: Model, theirs: Model) -> list[str]:
    """Return a description of every property in which the models differ, except for OpenSim's own reasons."""
    tree, other_tree = ours.tree(), theirs.tree()
    return [
        f"{mine.tag} {mine.name}.{spec.name}: {getattr(mine, spec.name)!r} is {getattr(other, spec.name)!r} to OpenSim"
        for mine, other, spec in properties(ours, theirs)
        if not equal(mine, other, spec, tree, other_tree) and not excepted(mine, other, spec, ours)
    ]


def properties(ours: Object, theirs: Object) -> Iterator[tuple[Object, Object, FieldSpec]]:
    """Yield every property of two objects and of their parts, in pairs.

    Classes and numbers of objects must be equal.
    """
    assert type(ours) is type(theirs), f"{ours!r} is {theirs!r} to OpenSim"
    for spec in type(ours).field_specs().values():
        if not isinstance(spec.kind, ObjectField):
            yield ours, theirs, spec
            continue
        mine, other = held(ours, spec), held(theirs, spec)
        assert len(mine) == len(other), (
            f"{ours!r} holds {len(mine)} in {spec.name}, {len(other)} for OpenSim"
        )
        for one, two in zip(mine, other, strict=True):
            yield from properties(one, two)


def held(item: Object, spec: FieldSpec) -> list[Object]:
    value = getattr(item, spec.name)
    return value if isinstance(value, list) else [] if value is None else [value]


def equal(mine: Object, other: Object, spec: FieldSpec, ours: Tree, theirs: Tree) -> bool:
    left, right = getattr(mine, spec.name), getattr(other, spec.name)
    if isinstance(spec.kind, Reference) and spec.name.startswith("socket_") and left != right:
        # OpenSim writes all paths in one form, therefore compare the components to which they lead.
        return led(mine, spec, ours) == led(other, spec, theirs)
    rounded = (type(mine).__name__, spec.name) in ROUNDED or (
        spec.legacy and isinstance(left, tuple)
    )
    return same(left, right, SIX_DIGITS if rounded else 0.0)


def led(item: Object, spec: FieldSpec, tree: Tree) -> str | None:
    target = tree.resolve(Use(item, tree.owner_of(item), spec, getattr(item, spec.name))).target
    return None if target is None else tree.path_of(target)


def same(left: Any, right: Any, tolerance: float) -> bool:
    if isinstance(left, tuple) and isinstance(right, tuple):
        return len(left) == len(right) and all(
            same(a, b, tolerance) for a, b in zip(left, right, strict=True)
        )
    if isinstance(left, float) and isinstance(right, float):
        near = math.isclose(left, right, rel_tol=tolerance, abs_tol=1e-12 if tolerance else 0.0)
        return near or (left != left and right != right)
    return bool(left == right)


def excepted(mine: Object, other: Object, spec: FieldSpec, model: Model) -> bool:
    """Return whether OpenSim differs for its own reason, which applies to files of the current version too."""
    left, right = getattr(mine, spec.name), getattr(other, spec.name)
    match type(mine).__name__, spec.name:
        case "FrameGeometry" | "Sphere", "socket_frame":
            # OpenSim sets it when it connects the geometry of a frame, whatever the file says.
            return (left, right) == ("", "..")
        case "WrapTorus" | "WrapCylinder" | "WrapSphere" | "WrapEllipsoid", "quadrant":
            # OpenSim writes the value for which the default stands.
            return (left, right) == ("Unassigned", "all")
        case "ActiveForceLengthCurve", "minimum_value":
            # An equilibrium muscle with damping sets the minimum of its curve itself.
            return (left, right) == (0.1, 0.0)
        case "Appearance", "color":
            # OpenSim paints every ligament green, whatever colour the file has; osimlite keeps the
            # file's colour.
            paths = [
                force.geometry_path
                for force in model.components()
                if type(force).__name__ == "Ligament"
            ]
            return right == (0.0, 1.0, 0.0) and any(mine is path.appearance for path in paths)
        case "PointActuator", "force_is_global":
            # OpenSim sets it to true for a file before version 10905, and omits it when it prints.
            return (left, right) == (True, False) and model.document_version < 10905
        case "ObjectGroup", "members":
            # OpenSim drops members that the set does not have, without a message.
            names = {force.name for force in model.force_set.objects}
            return right == tuple(name for name in left if name in names)
    return False
