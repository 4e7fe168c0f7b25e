"""To 20302: a muscle has a path, which has the points and the wraps."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import Draft, step


@step(below=20302)
def muscle_paths(draft: Draft) -> None:
    """The points and wraps of a muscle belong to its <GeometryPath>."""
    for muscle in draft.every("Muscle"):
        if muscle.find("GeometryPath") is not None:
            continue
        parts = [
            part
            for tag in ("PathPointSet", "PathWrapSet")
            if (part := muscle.find(tag)) is not None
        ]
        path = draft.add(muscle, "GeometryPath", source=parts[0] if parts else muscle)
        for part in parts:
            draft.move(part, path)
        draft.changed(muscle)
