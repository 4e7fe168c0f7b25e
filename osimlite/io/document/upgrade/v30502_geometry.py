"""To 30502: geometry is attached to a frame, as meshes with an appearance."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import (
    Draft,
    Element,
    elements,
    having,
    members,
    plain,
    reals,
    step,
    text_of,
)
from osimlite.io.document.upgrade.rotation import compose


@step(below=30502)
def display_geometry(draft: Draft) -> None:
    """Each <DisplayGeometry> becomes a <Mesh>, in a frame of its own if it stands off the body."""
    for body, visible in having(draft.tagged("Body", "Ground"), "VisibleObject"):
        shown = visible.find("GeometrySet")
        if shown is not None and shown.find("objects") is not None:
            attached = draft.add(body, "attached_geometry", source=shown)
            pieces = [piece for piece in members(shown) if piece.tag == "DisplayGeometry"]
            for count, piece in enumerate(pieces, 1):
                _mesh(draft, body, visible, attached, piece, count)
            draft.changed(body, at=visible)
        draft.remove(visible)


def _mesh(
    draft: Draft, body: Element, visible: Element, attached: Element, piece: Element, count: int
) -> None:
    name = body.get("name", "")
    place = compose(text_of(visible, "transform"), text_of(piece, "transform"))
    if place is not None:
        orientation, translation = place
        source = (
            piece.find("transform")
            if piece.find("transform") is not None
            else visible.find("transform")
        )
        assert source is not None
        frame = draft.add(
            draft.list_in(body, "components", source=source),
            "PhysicalOffsetFrame",
            source=source,
            name=f"{name}_geom_frame_{count}",
        )
        draft.add(frame, "socket_parent", "..", source=source)
        draft.add(frame, "translation", translation, source=source)
        draft.add(frame, "orientation", orientation, source=source)
        attached = draft.add(frame, "attached_geometry", source=source)
    mesh = draft.add(attached, "Mesh", source=piece, name=f"{name}_geom_{count}")
    draft.add(mesh, "socket_frame", "..", source=piece)
    scale = piece.find("scale_factors")
    outer = visible.find("scale_factors")
    source = scale if scale is not None else outer if outer is not None else piece
    draft.add(mesh, "scale_factors", _product(scale, outer), source=source)
    file = piece.find("geometry_file")
    draft.add(
        mesh,
        "mesh_file",
        "" if file is None else plain(file),
        source=piece if file is None else file,
    )
    appearance = draft.add(mesh, "Appearance", source=piece)
    for child in elements(piece):
        if child.tag in ("color", "opacity"):
            draft.move(child, appearance)
        elif child.tag == "display_preference":
            preference = plain(child)
            if preference == "0":
                draft.add(appearance, "visible", "false", source=child)
            elif preference != "4":
                draft.changed(body, at=child, lost=f"display_preference {preference}")


def _product(scale: Element | None, outer: Element | None) -> str:
    """The text of two scales multiplied; a scale of one leaves the other's text as it is."""
    inner_text = "1 1 1" if scale is None else plain(scale)
    outer_text = "1 1 1" if outer is None else plain(outer)
    inner_values, outer_values = reals(inner_text, 3), reals(outer_text, 3)
    if outer_values is None or outer_values == [1, 1, 1]:
        return inner_text
    if inner_values is None or inner_values == [1, 1, 1]:
        return outer_text
    return " ".join(repr(a * b) for a, b in zip(inner_values, outer_values, strict=True))
