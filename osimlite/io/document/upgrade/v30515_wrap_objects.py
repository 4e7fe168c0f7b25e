"""To 30515: a wrap object has an appearance."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import Draft, Element, plain, reals, step, text_of


@step(below=30515)
def wrap_appearance(draft: Draft) -> None:
    """Colour and display preference of a wrap object become its <Appearance>."""
    for wrap in draft.every("WrapObject"):
        visible = wrap.find("VisibleObject")
        color, own = wrap.find("color"), wrap.find("display_preference")
        outer = None if visible is None else visible.find("display_preference")
        representation, hidden, set_by = "3", False, color
        for preference in (own, outer):
            word = "" if preference is None else plain(preference)
            if word == "0":
                hidden, set_by = True, preference
            elif word in ("1", "2", "3") and representation == "3":
                representation, set_by = word, preference
        if set_by is not None:
            _appearance(draft, wrap, set_by, color, representation, hidden)
        for part in (color, own, visible):
            if part is not None:
                draft.remove(part)
        if set_by is not None or visible is not None:
            lost = (
                "where the shown surface stood off the wrap object"
                if _stands_off(wrap, visible)
                else None
            )
            draft.changed(wrap, lost=lost)


def _appearance(
    draft: Draft,
    wrap: Element,
    source: Element,
    color: Element | None,
    representation: str,
    hidden: bool,
) -> None:
    appearance = draft.add(wrap, "Appearance", source=source)
    if hidden:
        draft.add(appearance, "visible", "false", source=source)
    text = "0 1 1" if color is None else plain(color)
    draft.add(appearance, "color", text, source=source if color is None else color)
    draft.add(appearance, "opacity", "0.5", source=source)
    surface = draft.add(appearance, "SurfaceProperties", source=source)
    draft.add(surface, "representation", representation, source=source)


def _stands_off(wrap: Element, visible: Element | None) -> bool:
    """Whether the surface was shown elsewhere than where the wrap object is."""
    shown = None if visible is None else reals(text_of(visible, "transform"), 6)
    angles, place = (
        reals(text_of(wrap, tag), 3) or [0.0] * 3 for tag in ("xyz_body_rotation", "translation")
    )
    here = [*angles, *place]
    return (
        shown is not None
        and any(shown)
        and any(abs(a - b) > 1e-4 for a, b in zip(shown, here, strict=True))
    )
