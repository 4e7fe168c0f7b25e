"""To 30508, 30510 and 30517: how a component writes down what its sockets are connected to."""

from __future__ import annotations

import re

from osimlite.io.document.upgrade.draft import (
    Draft,
    Element,
    elements,
    having,
    members,
    path_of,
    plain,
    step,
)

_SUFFIX = re.compile(r"((?:socket|input)_.*)_connectee_names?")


@step(below=30508, order=30499)
def connectors(draft: Draft) -> None:
    """The entries of <connectors> become one element each.

    This and the next two come before the steps that write sockets, so that those find one spelling
    only.
    """
    for component, old in having(draft.every("Component"), "connectors"):
        if not all(re.fullmatch(r"\w+", connector.get("name", "")) for connector in elements(old)):
            continue
        # OpenSim puts each before those it has made already: of two for one socket the last counts.
        for connector in reversed(elements(old)):
            connectee = connector.find("connectee_name")
            text = "" if connectee is None else plain(connectee)
            draft.add(component, f"socket_{connector.get('name', '')}", text, source=connector)
        draft.changed(component, at=old)
        draft.remove(old)


@step(below=30510, order=30499)
def connectors_renamed(draft: Draft) -> None:
    """What was a connector is a socket."""
    for component in draft.every("Component"):
        for child in elements(component):
            if child.tag.startswith("connector_"):
                draft.rename(child, child.tag.replace("connector", "socket", 1))
                draft.changed(component, at=child)


@step(below=30517, order=30499)
def connectee_names(draft: Draft) -> None:
    """Sockets and inputs lose the ending _connectee_name."""
    for component in draft.every("Component"):
        for child in elements(component):
            match = _SUFFIX.fullmatch(child.tag)
            if match is not None:
                draft.rename(child, match[1])
                draft.changed(component, at=child)


@step(below=30517)
def set_levels(draft: Draft) -> None:
    """Paths to bodies that leave out the sets on the way get them.

    So they were written while version 4 was made; OpenSim 4.6 finds nothing there.
    """
    paths = {"ground": "/ground"}
    for _, bodies in draft.of_model("BodySet"):
        paths.update(
            (name, f"/bodyset/{name}") for body in members(bodies) if (name := body.get("name"))
        )
    for component in draft.every("Component"):
        for child in elements(component):
            if not child.tag.startswith("socket_") or component.find(child.tag) is not child:
                continue
            text = plain(child)
            last = text.rpartition("/")[2]
            if (
                last in paths
                and not text.startswith("/")
                and not _leads_somewhere(component, text, paths)
            ):
                child.text = paths[last]
                draft.changed(component, at=child)


def _leads_somewhere(component: Element, text: str, paths: dict[str, str]) -> bool:
    """Whether a relative path leads to a body as it stands, or to a frame that the component has itself."""
    here = path_of(component).split("/")[1:]
    for word in text.split("/"):
        if word != "..":
            here.append(word)
        elif here:
            here.pop()
    if "/" + "/".join(here) in paths.values():
        return True
    own = (piece for tag in ("frames", "components") for piece in _elements_of(component.find(tag)))
    return any(piece.get("name") == text for piece in own)


def _elements_of(parent: Element | None) -> list[Element]:
    """The child elements of an element that may not be there."""
    return [] if parent is None else elements(parent)
