"""To 30516: a path has an appearance."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import Draft, Element, having, plain, step, text_of

_COLORS = {"Muscle": ".8 .1 .1", "Ligament": "0 1 0"}
"""The colour of a path that says none, by what the path is of."""


@step(below=30516)
def path_appearance(draft: Draft) -> None:
    """Colour and display preference of a path become its <Appearance>; muscles are red, ligaments green."""
    usual = {
        path: color
        for family, color in _COLORS.items()
        for _, path in having(draft.every(family), "GeometryPath")
    }
    for path in draft.tagged("GeometryPath"):
        color = path.find("default_color")
        visible = path.find("VisibleObject")
        appearance = path.find("Appearance")
        if appearance is None:
            appearance = draft.add(path, "Appearance", source=path)
        if visible is not None:
            _hide(draft, appearance, visible)
        if appearance.find("color") is None:
            if color is not None:
                draft.add(appearance, "color", plain(color), source=color)
            elif path in usual:
                draft.add(appearance, "color", usual[path], source=path)
        for part in (color, visible):
            if part is not None:
                draft.remove(part)
        draft.changed(path)


def _hide(draft: Draft, appearance: Element, visible: Element) -> None:
    preference = text_of(visible, "display_preference")
    if preference == "0" and appearance.find("visible") is None:
        draft.add(appearance, "visible", "false", source=visible)
