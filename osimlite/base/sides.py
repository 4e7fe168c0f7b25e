"""Sides of the body in names, such as those of ``knee_r`` and ``LHip``."""

from __future__ import annotations

from osimlite.base.patterns import compile_later

_SIDE = compile_later(
    # At the start of a word: knee_r, R.Heel, RHip, rightKnee.
    r"(?<![A-Za-z])(?:[RLrl]|(?i:right|left))(?![a-z])"
    # At the end of a word that begins with other letters: hipR, kneeRight.
    r"|(?<=[a-z0-9])(?:[RL](?![A-Za-z])|(?:Right|Left)(?![a-z]))"
)
"""Part of a name that says on which side of the body its object is."""

_OTHER_SIDES = {
    side: other
    for pair in (("r", "l"), ("R", "L"), ("right", "left"), ("Right", "Left"), ("RIGHT", "LEFT"))
    for side, other in (pair, pair[::-1])
}


def _find_side(name: str) -> str:
    """Return the side of the body that a name states last, "r" or "l"; empty if it states none."""
    sides = _SIDE.findall(name)
    return sides[-1][0].lower() if sides else ""


def group_by_side(word: str, names: list[str]) -> list[list[str]]:
    """Return groups of names to compare with a word, one after the other.

    A user who types the name of a right muscle means a right one: names of the other side are
    compared only if no other name is similar, or if the word differs in nothing but the side.

    Args:
        word: unknown name or path.
        names: known names or paths.
    """
    side = _find_side(word)
    if not side:
        return [names]
    mirrored = _SIDE.sub(lambda match: _OTHER_SIDES.get(match[0], match[0]), word).lower()
    mirror_images = [name for name in names if name.lower() == mirrored]
    same_side = [name for name in names if _find_side(name) in (side, "")]
    return [mirror_images] if mirror_images else [same_side, names]
