"""To 30513: the bounds of a muscle's control are those of its class unless they were set on purpose."""

from __future__ import annotations

from osimlite.document.lexical import split
from osimlite.document.upgrade.draft import Draft, plain, reals, step

_USUAL = {"min_control": 0.0, "max_control": 1.0}


@step(below=30513)
def control_bounds(draft: Draft) -> None:
    """Control bounds of 0 and 1 give way to the bounds of the muscle's class."""
    for muscle in draft.every("Muscle"):
        touched = False
        for tag, usual in _USUAL.items():
            bound = muscle.find(tag)
            # OpenSim takes the first of several numbers.
            values = None if bound is None else reals(" ".join(split(plain(bound))[:1]), 1)
            if bound is not None and values is not None and abs(values[0] - usual) < 1e-14:
                draft.remove(bound)
                touched = True
        if touched:
            draft.changed(muscle)
