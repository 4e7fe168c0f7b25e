"""To 40000: every axis of a custom joint has a function."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import Draft, elements, families, step, text_of


@step(below=40000)
def axis_functions(draft: Draft) -> None:
    """An axis with an empty function moves as its coordinate does, one without any does not move."""
    for axis in draft.tagged("TransformAxis"):
        if any("Function" in families(child.tag) for child in elements(axis)):
            continue
        holder = axis.find("function")
        if holder is not None and elements(holder):
            continue
        coordinates = (text_of(axis, "coordinates") or "").split() if holder is not None else []
        if holder is None:
            holder = draft.add(axis, "function", source=axis)
        if len(coordinates) == 1:
            draft.add(
                draft.add(holder, "LinearFunction", source=holder),
                "coefficients",
                "1 0",
                source=holder,
            )
        elif not coordinates:
            draft.add(draft.add(holder, "Constant", source=holder), "value", "0", source=holder)
        else:
            continue
        draft.changed(axis)
