"""To 30500: a body has one inertia."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import Draft, plain, reals, step

_INERTIA = {"xx": "1", "yy": "1", "zz": "1", "xy": "0", "xz": "0", "yz": "0"}


@step(below=30500)
def body_inertia(draft: Draft) -> None:
    """Six numbers of inertia become one <inertia>."""
    for body in draft.tagged("Body"):
        if body.get("name") == "ground":
            continue
        parts = {axes: body.find(f"inertia_{axes}") for axes in _INERTIA}
        given = [part for part in parts.values() if part is not None]
        words = [
            default if (part := parts[axes]) is None else plain(part)
            for axes, default in _INERTIA.items()
        ]
        # The place of one that cannot be read, so that it can be found.
        odd = next(
            (part for part in given if reals(plain(part), 1) is None), given[0] if given else body
        )
        draft.add(body, "inertia", " ".join(words), source=odd)
        for part in given:
            draft.remove(part)
        draft.changed(body, at=given[0] if given else body)
