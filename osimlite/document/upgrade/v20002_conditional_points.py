"""To 20002: a conditional path point depends on one coordinate."""

from __future__ import annotations

from osimlite.document.upgrade.draft import Draft, step


@step(below=20002)
def conditional_coordinates(draft: Draft) -> None:
    """<coordinates> of a conditional point is called <coordinate>."""
    for point in draft.tagged("ConditionalPathPoint"):
        if draft.rename_child(point, "coordinates", "coordinate"):
            draft.changed(point)
