"""To 10901: a custom joint has six axes, three of rotation and three of translation, whether it uses them or not."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import (
    Draft,
    Element,
    Refused,
    having,
    is_true,
    members,
    reals,
    step,
    text_of,
)
from osimlite.mechanics.laws.vectors import Vector, cross, norm, vector

_UNIT = ("1 0 0", "0 1 0", "0 0 1")


@step(below=10901)
def transform_axes(draft: Draft) -> None:
    """<TransformAxisSet> becomes a <SpatialTransform> of six axes."""
    for joint, old in having(draft.tagged("CustomJoint"), "TransformAxisSet"):
        given: dict[str, list[Element]] = {"rotation": [], "translation": []}
        for axis in members(old):
            given[
                "rotation" if is_true(text_of(axis, "is_rotation") or "") else "translation"
            ].append(axis)
        spatial = draft.add(joint, "SpatialTransform", source=old)
        for kind, axes in given.items():
            if len(axes) > 3:
                raise Refused(
                    f"joint '{joint.get('name')}' has {len(axes)} axes of {kind}; a joint can keep three, "
                    "the others would be lost",
                    draft.numbers[axes[3]],
                )
            directions = _directions([text_of(axis, "axis") for axis in axes])
            for index, direction in enumerate(directions):
                name = f"{kind}{index + 1}"
                if index < len(axes):
                    _carry(draft, axes[index], spatial, name)
                else:
                    padding = draft.add(spatial, "TransformAxis", source=old, name=name)
                    draft.add(padding, "axis", direction, source=old)
        draft.remove(old)
        draft.changed(joint, at=old)


def _carry(draft: Draft, axis: Element, spatial: Element, name: str) -> None:
    axis.set("name", name)
    draft.rename_child(axis, "coordinate", "coordinates")
    flag = axis.find("is_rotation")
    if flag is not None:
        draft.remove(flag)
    draft.move(axis, spatial)


def _directions(given: list[str | None]) -> list[str]:
    """The texts of three independent directions, of which the first are given."""
    known = [
        vector(reals(text, 3) or reals(unit, 3), 0)
        for text, unit in zip(given, _UNIT, strict=False)
    ]
    texts = [text or unit for text, unit in zip(given, _UNIT, strict=False)]
    if not known:
        return [*_UNIT]
    if len(known) == 1:
        second = (0.0, 1.0, 0.0) if abs(abs(known[0][1]) - 1) >= 1e-4 else (0.0, 0.0, 1.0)
        known.append(second)
        texts.append(" ".join(f"{value:g}" for value in second))
        texts.append(_normal(second, known[0]))
    elif len(known) == 2:
        texts.append(_normal(known[0], known[1]))
    return texts


def _normal(left: Vector, right: Vector) -> str:
    normal = cross(left, right)
    length = norm(normal)
    return " ".join(repr(value / length + 0.0) for value in normal) if length else "0 0 1"
