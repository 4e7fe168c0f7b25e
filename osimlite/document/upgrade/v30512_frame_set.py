"""To 30512: frames of the model are components of it like any other."""

from __future__ import annotations

from osimlite.document.upgrade.draft import Draft, members, step


@step(below=30512)
def frame_set(draft: Draft) -> None:
    """The members of <FrameSet> go into the model's <components>."""
    model = draft.model
    old = None if model is None else model.find("FrameSet")
    if model is None or old is None:
        return
    frames = list(members(old))
    listed = draft.list_in(model, "components", source=old)
    for frame in frames:
        draft.move(frame, listed)
    draft.changed(model, at=old)
    draft.remove(old)
