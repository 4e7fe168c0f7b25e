"""Names that every URDF reader takes: letters, digits, ``_``, ``-`` and ``.``, and no two alike."""

from __future__ import annotations

import re

from osimlite.records import replace
from osimlite.robot.robot import WORLD, Robot
from osimlite.text import unused

LONGEST = 200
"""Characters in a name; some readers cut lines that are too long."""


def legal(name: str) -> str:
    """The name with every illegal character replaced by ``_``, starting with a letter or ``_``, and not too long."""
    word = re.sub(r"[^A-Za-z0-9_.-]", "_", name)[:LONGEST] or "_"
    return word if word[0].isalpha() or word[0] == "_" else f"_{word}"


def dotted(path: str) -> str:
    """A component path as a name."""
    return path.strip("/").replace("/", ".")


class UniqueNames:
    """Gives out legal names, none of them twice."""

    def __init__(self) -> None:
        self._taken: set[str] = set()

    def __call__(self, name: str) -> str:
        """The name made legal, with a number behind it if it was given out before."""
        word = unused(legal(name), self._taken)
        self._taken.add(word)
        return word


def coordinate_names(robot: Robot) -> Robot:
    """The same robot with joints named by their coordinates: by its path with dots where coordinates share a name."""
    names = robot.mechanism.coordinate_names
    own = {joint.name: dotted(names[place]) for place, joint in robot.joint_of.items()}
    taken = set(own.values())
    for joint in robot.joints:
        if joint.name not in own:
            own[joint.name] = unused(joint.name, taken)
            taken.add(own[joint.name])
    return replace(robot, joints=tuple(replace(joint, name=own[joint.name]) for joint in robot.joints))


def legal_names(robot: Robot) -> Robot:
    """The same robot with legal names.

    Links and joints share one set of names, because some readers put both into one namespace.
    """
    unique = UniqueNames()
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
