"""To 20101: what a body looks like is a list of objects, no longer a list of file names."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import Draft, having, reals, step, text_of


@step(below=20101)
def geometry_files(draft: Draft) -> None:
    """Every file in <geometry_files> becomes a <Mesh> of its own."""
    for body, visible in having(draft.tagged("Body", "Ground"), "VisibleObject"):
        attached = draft.add(body, "attached_geometry", source=visible)
        files = visible.find("geometry_files")
        source = visible if files is None else files
        scale = text_of(visible, "scale_factors") or "1 1 1"
        for count, file in enumerate((text_of(visible, "geometry_files") or "").split()):
            mesh = draft.add(
                attached, "Mesh", source=source, name=f"{body.get('name', '')}_geom_{count}"
            )
            draft.add(mesh, "socket_frame", "..", source=source)
            draft.add(mesh, "scale_factors", scale, source=source)
            draft.add(mesh, "mesh_file", file, source=source)
        placed = any(reals(text_of(visible, "transform"), 6) or ())
        draft.changed(
            body, at=visible, lost="where the shown geometry stood in the body" if placed else None
        )
        draft.remove(visible)
