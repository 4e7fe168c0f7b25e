"""To 30512: frames of the model are components of it like any other."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import Draft, members, step


@step(below=30512)
def frame_set(draft: Draft) -> None:
    """The members of <FrameSet> go into the model's <components>."""
    for model, old in draft.of_model("FrameSet"):
        listed = draft.list_in(model, "components", source=old)
        for frame in list(members(old)):
            draft.move(frame, listed)
        draft.changed(model, at=old)
        draft.remove(old)
