"""To 30000: a moving path point has a function for each part of its location."""

from __future__ import annotations

from osimlite.document.upgrade.draft import Draft, step

_RENAMED = {"XAttachment": "x_location", "YAttachment": "y_location", "ZAttachment": "z_location"}


@step(below=30000)
def moving_locations(draft: Draft) -> None:
    """<XAttachment> and its like are called <x_location>."""
    for point in draft.tagged("MovingPathPoint"):
        if any([draft.rename_child(point, old, new) for old, new in _RENAMED.items()]):
            draft.changed(point)
