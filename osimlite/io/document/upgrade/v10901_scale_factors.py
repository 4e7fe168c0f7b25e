"""To 10901: what scales a function is a function, not a property of the joint or point around it."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import (
    Draft,
    Element,
    elements,
    having,
    plain,
    reals,
    step,
    text_of,
)

_POINT = ("XAttachment", "YAttachment", "ZAttachment")


@step(below=10901, order=10902)
def scale_factors(draft: Draft) -> None:
    """<scale_factors> of custom joints and moving points multiply their functions of place.

    Along an axis that is none of x, y, z the factors count as far as the axis goes that way, as
    OpenSim scales now. A translation without a function, or one equal to its coordinate, is not
    scaled.
    """
    for joint, factors in having(draft.tagged("CustomJoint"), "scale_factors"):
        scales = reals(plain(factors), 3)
        if scales is None:
            continue
        for axis in joint.iter("TransformAxis"):
            direction = reals(text_of(axis, "axis"), 3)
            if axis.get("name", "").startswith("translation") and direction is not None:
                x, y, z = (
                    abs(part) * factor for part, factor in zip(direction, scales, strict=True)
                )
                _multiply(draft, axis.find("function"), x + y + z, factors)
        draft.changed(joint, at=factors)
        draft.remove(factors)
    for point, factors in having(draft.tagged("MovingPathPoint"), "scale_factors"):
        scales = reals(plain(factors), 3)
        if scales is None:
            continue
        for tag, scale in zip(_POINT, scales, strict=True):
            _multiply(draft, point.find(tag), scale, factors)
        draft.changed(point, at=factors)
        draft.remove(factors)


def _multiply(draft: Draft, holder: Element | None, scale: float, source: Element) -> None:
    """Put the function in `holder` inside one that multiplies it."""
    functions = [] if holder is None else elements(holder)
    if holder is None or not functions or scale == 1.0:
        return
    function = functions[0]
    if function.tag == "LinearFunction" and reals(text_of(function, "coefficients"), 2) == [
        1.0,
        0.0,
    ]:
        return
    product = draft.add(holder, "MultiplierFunction", source=function)
    draft.move(function, draft.add(product, "function", source=function))
    draft.add(product, "scale", repr(scale), source=source)
