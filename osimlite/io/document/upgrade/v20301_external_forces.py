"""To 20301: measured forces name their columns by what the labels begin with."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import Draft, Element, members, plain, step

_IDENTIFIERS = {
    "forceFunctions": "force_identifier",
    "pointFunctions": "point_identifier",
    "torqueFunctions": "torque_identifier",
}


@step(below=20301, order=20300)
def external_forces(draft: Draft) -> None:
    """A PrescribedForce among ExternalLoads is an ExternalForce in ground."""
    for loads in draft.tagged("ExternalLoads"):
        for force in list(members(loads)):
            if force.tag != "PrescribedForce":
                draft.refuse(
                    loads,
                    force,
                    f"{force.tag} is not known among ExternalLoads of a version before 20301",
                )
                continue
            body = force.find("body")
            draft.add(force, "applied_to_body", "" if body is None else plain(body), source=force)
            for frame in ("force", "point"):
                draft.add(force, f"{frame}_expressed_in_body", "ground", source=force)
            for tag, identifier in _IDENTIFIERS.items():
                functions = _functions(force, tag)
                first = (
                    ""
                    if functions is None
                    else next((f.get("name", "") for f in members(functions)), "")
                )
                if first.startswith("#"):
                    draft.changed(
                        force,
                        at=functions,
                        lost=f"the columns from {first} on, which have no name: name them",
                    )
                    first = ""
                draft.add(force, identifier, first[:-1], source=force)
                if functions is not None:
                    draft.remove(functions)
            if body is not None:
                draft.remove(body)
            draft.refuse(
                loads,
                force,
                "a PrescribedForce among ExternalLoads, as old versions wrote them, is refused",
            )
            draft.rename(force, "ExternalForce")
            draft.changed(force)


def _functions(force: Element, name: str) -> Element | None:
    """The set of functions that a property holds, by its name."""
    return next(
        (child for child in force.findall("FunctionSet") if child.get("name") == name), None
    )
