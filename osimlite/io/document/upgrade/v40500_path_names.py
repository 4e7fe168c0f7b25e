"""To 40500: the path of a muscle, spring or cable is its property <path>."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import Draft, step


@step(below=40500)
def path_names(draft: Draft) -> None:
    """The <GeometryPath> of a force is called path."""
    for path in draft.tagged("GeometryPath"):
        force = path.getparent()
        if force is not None and force.find("GeometryPath") is path and draft.is_a(force, "Force"):
            path.set("name", "path")
            draft.changed(path)
