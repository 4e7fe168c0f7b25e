"""Names that readers of robot files accept.

URDF has letters, digits, ``_``, ``-`` and ``.``; MJCF has all characters that XML can hold. All
names of a file differ.
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

MAX_NAME_LENGTH = 200
"""Largest number of characters in a name; some readers cut lines that are too long."""


def legal(name: str) -> str:
    """Return a legal name for URDF.

    Args:
        name: any name.

    Returns:
        The name with ``_`` for every illegal character, beginning with a letter or ``_``, and not
        too long.
    """
    # A name begins with a letter or an underscore.
    word = re.sub(r"[^A-Za-z0-9_.-]", "_", name)[:MAX_NAME_LENGTH] or "_"
    return word if word[0].isalpha() or word[0] == "_" else f"_{word}"


def to_dotted_name(path: str) -> str:
    """Return a component path as a name, with dots in place of slashes."""
    return path.strip("/").replace("/", ".")


class UniqueNames:
    """Function that makes names legal and never returns the same name twice."""

    def __init__(self) -> None:
        self._used_names: set[str] = set()

    def __call__(self, name: str) -> str:
        """Return a legal name that was not returned before.

        Args:
            name: any name; a number is appended if necessary.
        """
        word = make_unique_name(legal(name), self._used_names)
        self._used_names.add(word)
        return word


def xml_name(name: str) -> str:
    """Return a name that XML can hold.

    Args:
        name: any name.

    Returns:
        The name with ``_`` for every character that XML cannot write; ``_`` for an empty name.
    """
    # The ranges are those of XML 1.0.
    return re.sub("[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "_", name) or "_"


def distinct(names: Sequence[str], spell: Callable[[str], str]) -> list[str]:
    """Return different names in a new spelling.

    A name that keeps its spelling has precedence over names that turn into it.

    Args:
        names: the names.
        spell: function that returns the new spelling of a name.

    Returns:
        One name for each, in the same order.
    """
    result = [*names]
    used_names = set[str]()
    # Names that keep their spelling come first, since False sorts before True.
    for index in sorted(range(len(names)), key=lambda index: spell(names[index]) != names[index]):
        result[index] = make_unique_name(spell(names[index]), used_names)
        used_names.add(result[index])
    return result


def joint_names(mechanism: Mechanism) -> list[str]:
    """Return the names of the joints that are coordinates.

    Args:
        mechanism: the mechanism.

    Returns:
        Name of each coordinate; its path with dots where coordinates share a name.
    """
    return distinct(mechanism.coordinate_names, lambda name: xml_name(to_dotted_name(name)))


def coordinate_names(robot: Robot) -> Robot:
    """Return a robot with joints named by their coordinates, and names that XML can hold.

    Args:
        robot: the robot; see :func:`joint_names`.
    """
    names = joint_names(robot.mechanism)
    new_names = {joint.name: names[index] for index, joint in robot.joint_of.items()}
    others = [joint.name for joint in robot.joints if joint.name not in new_names]
    # Coordinates without a joint may get one.
    used_names = set(names)
    for name in others:
        new_names[name] = make_unique_name(xml_name(name), used_names)
        used_names.add(new_names[name])
    links = [link.name for link in robot.links]
    return _make_unique(robot, dict(zip(links, distinct(links, xml_name), strict=True)), new_names)


def legal_names(robot: Robot) -> Robot:
    """Return a robot with legal names.

    Links and joints share one set of names, because some readers put both into one namespace.

    Args:
        robot: the robot.
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
