"""To 40000: what the programs of old wrote and no program of version 4 reads."""

from __future__ import annotations

from osimlite.document.upgrade.draft import Draft, elements, families, step

MEANINGLESS = {
    "Coordinate": "initial_value keys max_restraint_function min_restraint_function restraint_active "
    "restraint_function stiffness",
    "Joint": "use_euler_angles",
    "MovingPathPoint": "location",
}
"""Elements that have lost their meaning, by the class they stand in."""


@step(below=40000)
def meaningless(draft: Draft) -> None:
    """Elements without a meaning in the current format go."""
    for visible in draft.tagged("VisibleObject"):
        parent = visible.getparent()
        if parent is not None and families(parent.tag):
            draft.changed(parent, number=draft.numbers[visible])
            draft.remove(visible)
    for family, tags in MEANINGLESS.items():
        names = frozenset(tags.split())
        for owner in draft.every(family):
            for child in elements(owner):
                if child.tag in names:
                    draft.changed(owner, number=draft.numbers[child])
                    draft.remove(child)
