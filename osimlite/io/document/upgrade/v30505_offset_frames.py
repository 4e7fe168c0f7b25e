"""To 30505: whatever stands off a body stands in an offset frame of that body."""

from __future__ import annotations

from osimlite.base.text import unused
from osimlite.io.document.upgrade.draft import Draft, Element, body_path, plain, reals, step

_ZERO = "0 0 0"
_LINKERS = (
    "BushingForce",
    "FunctionBasedBushingForce",
    "ExpressionBasedBushingForce",
    "WeldConstraint",
)


@step(below=30505)
def joint_frames(draft: Draft) -> None:
    """Locations and orientations of a joint become an offset frame on either side.

    Both frames are made even where they coincide with the bodies, because OpenSim does so and paths
    count them.
    """
    for joint in draft.every("Joint"):
        for side in ("parent", "child"):
            draft.rename_child(joint, f"socket_{side}_body", f"socket_{side}_frame")
            socket = joint.find(f"socket_{side}_frame")
            if socket is None:
                continue
            body = plain(socket).rpartition("/")[2]
            place = [joint.find(f"{what}_in_{side}") for what in ("location", "orientation")]
            socket.text = _frame(draft, joint, body, socket, place)
        draft.changed(joint)


@step(below=30505)
def linker_frames(draft: Draft) -> None:
    """Locations and orientations of bushings and welds become offset frames, where they are not zero."""
    for linker in draft.tagged(*_LINKERS):
        touched = False
        for side in ("1", "2"):
            socket = linker.find(f"body_{side}")
            place = [linker.find(f"{what}_body_{side}") for what in ("location", "orientation")]
            if socket is None:
                continue
            touched = True
            body = plain(socket)
            draft.rename(socket, f"socket_frame{side}")
            values = [reals(plain(part), 3) for part in place if part is not None]
            # What cannot be read is kept, so that the reader can say so.
            if any(numbers is None or any(numbers) for numbers in values):
                socket.text = _frame(draft, linker, body, socket, place)
            else:
                socket.text = body_path(body)
                _drop(draft, place)
        if touched:
            draft.changed(linker)


def _frame(
    draft: Draft, owner: Element, body: str, socket: Element, place: list[Element | None]
) -> str:
    """Add an offset frame of `body` to the owner's list; return its name.

    OpenSim calls both frames of one body the same, and then finds the first for either side.
    """
    location, orientation = place
    source = next((part for part in place if part is not None), socket)
    frames = draft.list_in(owner, "frames", source=source)
    taken = {frame.get("name") for frame in frames}
    name = unused(f"{body}_offset", taken, 0)
    frame = draft.add(frames, "PhysicalOffsetFrame", source=source, name=name)
    draft.add(frame, "socket_parent", body_path(body), source=socket)
    for tag, part in (("translation", location), ("orientation", orientation)):
        text = _ZERO if part is None else plain(part)
        draft.add(frame, tag, text, source=source if part is None else part)
    _drop(draft, place)
    return name


def _drop(draft: Draft, parts: list[Element | None]) -> None:
    for part in parts:
        if part is not None:
            draft.remove(part)
