"""Spanning tree of joints: which joint carries which body, and which joints close loops.

The rules are those of Simbody's multibody graph maker, so that bodies are in OpenSim's order.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Generic, Protocol, TypeVar

from osimlite.base.named_tuples import NamedTuple


class JointEdge(Protocol):
    """Joint between two bodies (or ground), which are named by absolute paths."""

    @property
    def parent(self) -> str:
        """Path of the body of the joint's parent frame."""

    @property
    def child(self) -> str:
        """Path of the body of the joint's child frame."""

    @property
    def coordinates(self) -> tuple[int, ...]:
        """Indices of its coordinates, empty for a weld.

        Returns:
            Indices in the mechanism.
        """


L = TypeVar("L", bound=JointEdge)


class Branch(NamedTuple, Generic[L]):
    """Joint in the tree."""

    link: L  # the joint
    outer: str  # path of the body that it adds
    reversed: bool  # whether it leads from its child to its parent


def new_base(unjoined_bodies: Sequence[str], links: Sequence[JointEdge]) -> str:
    """Return the body that OpenSim connects to ground, of bodies without connection to it.

    It is a body that is no child of a joint, if there is such a body, and of these the parent of
    most joints.

    Args:
        unjoined_bodies: paths of the bodies.
        links: joints between bodies or ground.
    """
    children = {link.child for link in links}
    parents = [link.parent for link in links]
    return max(unjoined_bodies, key=lambda path: (path not in children, parents.count(path)))


def spanning_tree(
    links: Sequence[L], ground: str, masses: Mapping[str, float]
) -> tuple[list[Branch[L]], list[L]]:
    """Return the joints that carry bodies, and the joints that only close loops.

    The tree grows level by level from ground, within a level in the order of the joints. Where a
    joint would move a body without mass, the branch continues at once to the heaviest neighbour,
    until a body with mass ends it.

    Args:
        links: joints between bodies or ground.
        ground: path of ground.
        masses: mass of each body, by path (kg).

    Returns:
        Branches, each after the one that carries its inner body; and joints that close loops.
    """
    levels = {ground: 0}
    branches: list[Branch[L]] = []
    used: set[int] = set()

    def add(index: int) -> str:
        """Add a joint to the tree.

        Returns:
            Path of the body that the joint carries.
        """
        link = links[index]
        backward = link.parent not in levels
        inner, outer = (link.child, link.parent) if backward else (link.parent, link.child)
        used.add(index)
        levels[outer] = levels[inner] + 1
        branches.append(Branch(link, outer, backward))
        return outer

    def onward(inner: str) -> int | None:
        """Return the index of the joint to the heaviest body beyond, or None.

        Forward joints come first, and joints to bodies without mass last.
        """
        result: list[tuple[float, bool, int]] = []
        for index, link in enumerate(links):
            if index not in used and inner in (link.parent, link.child):
                backward = link.child == inner
                outer = link.parent if backward else link.child
                if outer not in levels:
                    result.append((masses.get(outer, 0.0), not backward, -index))
        heavy = [item for item in result if item[0] > 0.0]
        best = (
            max(heavy, key=lambda item: (item[1], item[0], item[2]))
            if heavy
            else max(result, default=None)
        )
        return None if best is None else -best[2]

    level = 0
    while level in levels.values():
        for index, link in enumerate(links):
            if index in used or (link.parent in levels) == (link.child in levels):
                continue
            if levels.get(link.parent, levels.get(link.child)) != level:
                continue
            outer = add(index)
            # A massless body needs a body with mass beyond it, or its coordinates could not be
            # solved for.
            while links[index].coordinates and not masses.get(outer, 0.0) > 0.0:
                following = onward(outer)
                if following is None:
                    break
                index = following
                outer = add(index)
                if masses.get(outer, 0.0) > 0.0:
                    break
        level += 1
    return branches, [
        link
        for index, link in enumerate(links)
        if index not in used and link.parent in levels and link.child in levels
    ]
