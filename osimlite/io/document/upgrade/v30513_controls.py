"""To 30513: the bounds of a muscle's control are those of its class unless they were set on purpose."""

from __future__ import annotations

from osimlite.io.document.lexical import ABSENT, Unclean, converter
from osimlite.io.document.upgrade.draft import Draft, plain, step
from osimlite.schema.fields import Value

_USUAL = {"min_control": 0.0, "max_control": 1.0}


_READ = converter(Value("double"))


def _read_beginning(text: str) -> float | None:
    """Return the number that OpenSim reads of a text: the first of several, of a word its beginning."""
    try:
        return float(_READ(text))
    except Unclean as unclean:
        return None if unclean.value is ABSENT else float(unclean.value)


@step(below=30513)
def control_bounds(draft: Draft) -> None:
    """Control bounds of 0 and 1 give way to the bounds of the muscle's class."""
    for muscle in draft.every("Muscle"):
        touched = False
        for tag, usual in _USUAL.items():
            bound = muscle.find(tag)
            value = None if bound is None else _read_beginning(plain(bound))
            if bound is not None and value is not None and abs(value - usual) < 1e-14:
                draft.remove(bound)
                touched = True
        if touched:
            draft.changed(muscle)
