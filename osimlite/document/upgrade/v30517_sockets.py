"""To 30508, 30510 and 30517: how a component writes down what its sockets are connected to."""

from __future__ import annotations

import re

from osimlite.document.upgrade.draft import Draft, elements, plain, step

_SUFFIX = re.compile(r"((?:socket|input)_.*)_connectee_names?")


@step(below=30508, order=30499)
def connectors(draft: Draft) -> None:
    """The entries of <connectors> become one element each.

    This and the next two come before the steps that write sockets, so that those find one spelling only.
    """
    for component in draft.every("Component"):
        old = component.find("connectors")
        if old is None:
            continue
        for connector in elements(old):
            connectee = connector.find("connectee_name")
            text = "" if connectee is None else plain(connectee)
            draft.add(component, f"socket_{connector.get('name', '')}", text, source=connector)
        draft.changed(component, number=draft.numbers[old])
        draft.remove(old)


@step(below=30510, order=30499)
def connectors_renamed(draft: Draft) -> None:
    """What was a connector is a socket."""
    for component in draft.every("Component"):
        for child in elements(component):
            if "connector" in child.tag:
                draft.rename(child, child.tag.replace("connector", "socket", 1))
                draft.changed(component, number=draft.numbers[child])


@step(below=30517, order=30499)
def connectee_names(draft: Draft) -> None:
    """Sockets and inputs lose the ending _connectee_name."""
    for component in draft.every("Component"):
        for child in elements(component):
            match = _SUFFIX.fullmatch(child.tag)
            if match is not None:
                draft.rename(child, match[1])
                draft.changed(component, number=draft.numbers[child])
