"""To 40500: the path of a muscle, spring or cable is its property <path>."""

from __future__ import annotations

from osimlite.document.upgrade.draft import Draft, step


@step(below=40500)
def path_names(draft: Draft) -> None:
    """The <GeometryPath> of a force is called path."""
    for force in draft.every("Force"):
        path = force.find("GeometryPath")
        if path is not None:
            path.set("name", "path")
            draft.changed(path)
