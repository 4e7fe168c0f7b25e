"""To 30500: every component has a name, and no name has white space."""

from __future__ import annotations

from osimlite.base.text import unused
from osimlite.io.document.upgrade.draft import Draft, Element, families, plain, step

_PROSE = {
    "credits",
    "publications",
    "data_file",
    "datafile",
    "file_name",
    "filename",
    "geometry_file",
    "mesh_file",
}
"""Elements whose text is never the name of a component."""

_LISTS = {
    "actuator_list",
    "coordinates",
    "geometry",
    "independent_coordinate_names",
    "members",
    "muscle_list",
}
"""Elements whose text may be several names."""


@step(below=30500)
def names(draft: Draft) -> None:
    """Names lose their white space, and whatever used such a name follows.

    OpenSim changes the name but not the places that use it.
    """
    renamed: dict[str, str] = {}
    for component in draft.every("Component"):
        name = component.get("name")
        parent = component.getparent()
        if name is None:
            if parent is not None and not families(parent.tag):
                component.set("name", component.tag.lower())
                draft.changed(component)
        elif any(space in name for space in " \t\n\r"):
            new = "".join(name.split())
            siblings = (
                () if parent is None else (other for other in parent if other is not component)
            )
            taken = {sibling.get("name") for sibling in siblings}
            free = unused(new, taken, 0)
            component.set("name", free)
            renamed.setdefault(" ".join(name.split()), free)
            draft.changed(component)
    if renamed:
        _follow(draft, renamed)


def _follow(draft: Draft, renamed: dict[str, str]) -> None:
    for element in draft.root.iter("*"):
        if len(element) == 0:
            text = plain(element)
            if " " in text and element.tag not in _PROSE:
                new = renamed.get(text) or (
                    _in_list(text, renamed) if element.tag in _LISTS else text
                )
                if new != text:
                    element.text = new
                    draft.changed(_owner(element), at=element)
        name = element.get("name")
        if name is not None and " ".join(name.split()) in renamed and families(element.tag):
            # Not a component: an object whose own name says which component it is about.
            element.set("name", renamed[" ".join(name.split())])


def _in_list(text: str, renamed: dict[str, str]) -> str:
    for old, new in sorted(renamed.items(), key=lambda pair: -len(pair[0])):
        text = f" {text} ".replace(f" {old} ", f" {new} ").strip()
    return text


def _owner(element: Element) -> Element:
    parent = element.getparent()
    return element if parent is None else parent
