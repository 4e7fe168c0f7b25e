"""To 30507: a joint lists its coordinates without a set, and contact geometry has an appearance."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import Draft, having, members, plain, step, text_of


@step(below=30507)
def joint_coordinates(draft: Draft) -> None:
    """The <CoordinateSet> of a joint becomes its <coordinates>."""
    for joint, old in having(draft.every("Joint"), "CoordinateSet"):
        # Also what is no coordinate, so that the reader can say so.
        coordinates = list(members(old))
        if coordinates:
            listed = draft.add(joint, "coordinates", source=old)
            for coordinate in coordinates:
                draft.move(coordinate, listed)
        groups = old.find("groups")
        lost = "groups of coordinates" if groups is not None and len(groups) else None
        draft.changed(joint, at=old, lost=lost)
        draft.remove(old)


@step(below=30507)
def contact_appearance(draft: Draft) -> None:
    """Colour and display preference of contact geometry become its <Appearance>."""
    for geometry in draft.every("ContactGeometry"):
        color, preference = geometry.find("color"), geometry.find("display_preference")
        if color is None and preference is None:
            continue
        first = color if color is not None else preference
        assert first is not None
        appearance = draft.add(geometry, "Appearance", source=first)
        if color is None:
            draft.add(appearance, "color", "0 1 1", source=first)
        else:
            draft.move(color, appearance)
        if preference is not None:
            word = text_of(geometry, "display_preference") or ""
            if word == "0":
                draft.add(appearance, "visible", "false", source=preference)
            else:
                surface = draft.add(appearance, "SurfaceProperties", source=preference)
                text = "3" if word == "4" else plain(preference)
                draft.add(surface, "representation", text, source=preference)
            draft.remove(preference)
        draft.changed(geometry)
