"""To 40600: a controller names its actuators by path."""

from __future__ import annotations

from osimlite.io.document.lexical import split
from osimlite.io.document.upgrade.draft import Draft, having, members, path_of, plain, step


@step(below=40600)
def controller_actuators(draft: Draft) -> None:
    """The names in <actuator_list> become paths in <socket_actuators>.

    A name that no actuator has stays, as a path to nothing, where OpenSim drops it without a word.
    """
    if next(draft.root.iter("actuator_list"), None) is None:
        return
    listed = [*having(draft.every("Controller"), "actuator_list")]
    if not listed:
        return
    actuators = [
        (path_of(actuator), actuator.get("name", "")) for actuator in draft.every("Actuator")
    ]
    forces = [
        (path_of(force), force.get("name", ""))
        for force_set in draft.tagged("ForceSet")
        for force in members(force_set)
    ]
    by_name: dict[str, str] = {}
    for path, name in (*actuators, *forces):
        by_name.setdefault(name, path)
    for controller, names in listed:
        words = split(plain(names))
        lost = None
        if any(word.lower() == "all" for word in words):
            paths = [path for path, _ in actuators]
            if draft.model is None:
                lost = (
                    "that it drives all actuators, which a document without the model cannot name"
                )
        else:
            paths = [by_name.get(word, f"/forceset/{word}") for word in words]
            known = [path for path in paths if path in {*by_name.values()}]
            if len({*known}) < len(known):
                draft.refuse(controller, names, "a controller names an actuator twice")
        names.text = " ".join(dict.fromkeys(paths))
        draft.rename(names, "socket_actuators")
        draft.changed(controller, lost=lost)
