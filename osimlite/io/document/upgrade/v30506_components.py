"""To 30506: geometry is one of the components a component has."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import Draft, elements, having, plain, step


@step(below=30505)
def hidden_appearance(draft: Draft) -> None:
    """An appearance whose representation is 0 is not visible."""
    for appearance, representation in having(draft.tagged("Appearance"), "representation"):
        if plain(representation) == "0" and appearance.find("visible") is None:
            draft.add(appearance, "visible", "false", source=representation)
        draft.remove(representation)
        draft.changed(appearance)


@step(below=30506)
def geometry_lists(draft: Draft) -> None:
    """The <geometry> of a component goes into its <components>."""
    for component, geometry in having(draft.every("ModelComponent"), "geometry"):
        # Contact forces have a <geometry> too, which is a list of names.
        if not elements(geometry):
            continue
        listed = draft.list_in(component, "components", source=geometry)
        for piece in elements(geometry):
            draft.move(piece, listed)
        draft.remove(geometry)
        draft.changed(component)
