"""To 40000: what the programs of old wrote and no program of version 4 reads."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import (
    Draft,
    Element,
    elements,
    families,
    plain,
    reals,
    step,
)

MEANINGLESS: dict[str, dict[str, str]] = {
    "Body": {"Joint": ""},
    "Coordinate": {
        "initial_value": "",
        "keys": "",
        "max_restraint_function": "",
        "min_restraint_function": "",
        "restraint_active": "false",
        "restraint_function": "",
        "stiffness": "0",
    },
    "ForceSet": {"datafile": ""},
    "Joint": {"use_euler_angles": ""},
    "Model": {"angle_units": "radians"},
    "MovingPathPoint": {"location": ""},
    "SimmSpline": {f"{end}_{axis}": "" for end in ("max", "min") for axis in "xyz"},
    "TransformAxis": {"is_rotation": ""},
    "Schutte1993Muscle_Deprecated": {"force_velocity_curve": ""},
    "Thelen2003Muscle": {"Vmax": "10", "Vmax0": "5", "damping": "0.05", "muscle_model": ""},
}
"""Elements that have lost their meaning, by the class they stand in.

Where a default is given, another value meant something once, and going without it counts as a loss.
"""


@step(below=40000)
def meaningless(draft: Draft) -> None:
    """Elements without a meaning in the current format go.

    In a document from before 10901 what would be a loss stays, and the document is refused for it.
    """
    for visible in draft.tagged("VisibleObject"):
        parent = visible.getparent()
        if parent is not None and families(parent.tag):
            draft.changed(parent, at=visible)
            draft.remove(visible)
    for family, usual in MEANINGLESS.items():
        for owner in draft.every(family):
            for child in elements(owner):
                if child.tag in usual:
                    lost = _loss(child, usual[child.tag])
                    if lost is None or draft.version >= 10901:
                        draft.changed(owner, at=child, lost=lost)
                        draft.remove(child)


def _loss(child: Element, usual: str) -> str | None:
    text = plain(child)
    if not usual or text == usual or not text:
        return None
    count = len(usual.split())
    given, expected = reals(text, count), reals(usual, count)
    return None if given is not None and given == expected else f"{child.tag} {text}"
