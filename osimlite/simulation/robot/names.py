"""Names that readers take: those of URDF letters, digits, ``_``, ``-`` and ``.``, those of MJCF what XML can hold.

No two are alike.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from osimlite.base.records import replace
from osimlite.base.text import make_unique_name
from osimlite.simulation.robot.robot import WORLD, Robot

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.mechanism import Mechanism

LONGEST = 200
"""Characters in a name; some readers cut lines that are too long."""


def legal(name: str) -> str:
    """The name with every illegal character replaced by ``_``, starting with a letter or ``_``, and not too long."""
    word = re.sub(r"[^A-Za-z0-9_.-]", "_", name)[:LONGEST] or "_"
    return word if word[0].isalpha() or word[0] == "_" else f"_{word}"


def dotted_name(path: str) -> str:
    """A component path as a name."""
    return path.strip("/").replace("/", ".")


class UniqueNames:
    """Gives out legal names, none of them twice."""

    def __init__(self) -> None:
        self._taken: set[str] = set()

    def __call__(self, name: str) -> str:
        """The name made legal, with a number behind it if it was given out before."""
        word = make_unique_name(legal(name), self._taken)
        self._taken.add(word)
        return word


def xml_name(name: str) -> str:
    """The name with ``_`` for every character that XML has no way to write, and ``_`` for none at all."""
    return re.sub("[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "_", name) or "_"


def distinct(names: Sequence[str], spell: Callable[[str], str]) -> list[str]:
    """The names as they are spelt, no two alike; one that keeps its spelling comes before those that turn into it."""
    result, taken = [*names], set[str]()
    for place in sorted(range(len(names)), key=lambda place: spell(names[place]) != names[place]):
        result[place] = make_unique_name(spell(names[place]), taken)
        taken.add(result[place])
    return result


def joint_names(mechanism: Mechanism) -> list[str]:
    """Of the joints that are coordinates: the coordinate's name, its path with dots where coordinates share a name."""
    return distinct(mechanism.coordinate_names, lambda name: xml_name(dotted_name(name)))


def coordinate_names(robot: Robot) -> Robot:
    """The same robot with joints named by their coordinates (see :func:`joint_names`), and names that XML can hold."""
    names = joint_names(robot.mechanism)
    own = {joint.name: names[place] for place, joint in robot.joint_of.items()}
    others = [joint.name for joint in robot.joints if joint.name not in own]
    # Coordinates without a joint may get one.
    taken = set(names)
    for name in others:
        own[name] = make_unique_name(xml_name(name), taken)
        taken.add(own[name])
    links = [link.name for link in robot.links]
    return _make_unique(robot, dict(zip(links, distinct(links, xml_name), strict=True)), own)


def legal_names(robot: Robot) -> Robot:
    """The same robot with legal names.

    Links and joints share one set of names, because some readers put both into one namespace.
    """
    names = [link.name for link in robot.links] + [joint.name for joint in robot.joints]
    renamed = dict(zip(names, distinct(names, legal), strict=True))
    assert renamed[WORLD] == WORLD
    return _make_unique(robot, renamed, renamed)


def _make_unique(robot: Robot, links: Mapping[str, str], joints: Mapping[str, str]) -> Robot:
    if all(old == new for old, new in (*links.items(), *joints.items())):
        return robot
    return replace(
        robot,
        links=tuple(replace(link, name=links[link.name]) for link in robot.links),
        joints=tuple(
            replace(
                joint, name=joints[joint.name], parent=links[joint.parent], child=links[joint.child]
            )
            for joint in robot.joints
        ),
    )
