"""Names that every URDF reader takes: letters, digits, ``_``, ``-`` and ``.``, and no two alike."""

from __future__ import annotations

import re
from dataclasses import replace

from osimlite.translate.robot import WORLD, Robot

LONGEST = 200
"""Characters in a name; some readers cut lines that are too long."""


def legal(name: str) -> str:
    """The name with every illegal character replaced by ``_``, starting with a letter or ``_``, and not too long."""
    word = re.sub(r"[^A-Za-z0-9_.-]", "_", name)[:LONGEST] or "_"
    return word if word[0].isalpha() or word[0] == "_" else f"_{word}"


def legal_names(robot: Robot) -> Robot:
    """The same robot with legal names.

    Links and joints share one set of names, because some readers put both into one namespace.
    """
    taken: set[str] = set()

    def unique(name: str) -> str:
        word, count = legal(name), 1
        base = word
        while word in taken:
            word, count = f"{base}_{count}", count + 1
        taken.add(word)
        return word

    # Names that are legal already keep their spelling, whatever others turn into.
    names = [link.name for link in robot.links] + [joint.name for joint in robot.joints]
    renamed = {name: unique(name) for name in names if legal(name) == name}
    renamed |= {name: unique(name) for name in names if name not in renamed}
    if renamed == {name: name for name in names}:
        return robot
    assert renamed[WORLD] == WORLD
    return replace(
        robot,
        links=tuple(replace(link, name=renamed[link.name]) for link in robot.links),
        joints=tuple(
            replace(joint, name=renamed[joint.name], parent=renamed[joint.parent], child=renamed[joint.child])
            for joint in robot.joints
        ),
    )
