"""The bodies and joints of a model as a graph, as far as the references between them lead anywhere."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import cast

from osimlite.lint.subject import Subject, once
from osimlite.schema.base import Component, Object, Unknown
from osimlite.schema.frames import Body, Ground, StationDefinedFrame
from osimlite.schema.joints import Joint


@dataclass(slots=True)
class Link:
    """A joint with the frames it connects and the bodies (or ground) these are fixed to; None where unresolved."""

    joint: Joint
    parent: Component | None
    child: Component | None
    parent_base: Component | None
    child_base: Component | None


@dataclass(slots=True)
class Skeleton:
    """Bodies, ground, and the joints between them in document order."""

    bodies: list[Body]
    ground: Ground
    links: list[Link] = field(default_factory=list)

    @property
    def complete(self) -> bool:
        """Whether every joint's frames lead to a body."""
        return all(link.parent_base is not None and link.child_base is not None for link in self.links)

    def pairs(self) -> Iterator[tuple[Link, Component, Component]]:
        """The joints that connect two bodies, with the parent and the child."""
        for link in self.links:
            parent, child = link.parent_base, link.child_base
            if parent is not None and child is not None and parent is not child:
                yield link, parent, child

    def depths(self) -> dict[int, int]:
        """How many joints lie between ground and each body (by identity); bodies that none reach are left out."""
        depth = {id(self.ground): 0}
        pending: list[Component] = [self.ground]
        while pending:
            base = pending.pop(0)
            for link in self.of(base):
                for end in (link.parent_base, link.child_base):
                    if end is not None and id(end) not in depth:
                        depth[id(end)] = depth[id(base)] + 1
                        pending.append(end)
        return depth

    def of(self, base: Component) -> list[Link]:
        """The joints at a body."""
        return [link for link in self.links if base is link.parent_base or base is link.child_base]


@once
def skeleton(subject: Subject) -> Skeleton:
    """The skeleton of a model."""
    assert subject.model is not None
    bones = Skeleton([*subject.each(Body)], subject.model.ground)
    for joint in subject.each(Joint):
        parent = subject.target_of(joint, "socket_parent_frame")
        child = subject.target_of(joint, "socket_child_frame")
        bones.links.append(Link(joint, parent, child, base_of(subject, parent), base_of(subject, child)))
    return bones


def has_unknown_joints(subject: Subject) -> bool:
    """Whether a joint or a body is of a class that is not known, so that the graph has gaps."""
    model = subject.model
    assert model is not None
    members: list[Object] = [*model.joint_set.objects, *model.body_set.objects, *model.subcomponents]
    return any(isinstance(item, Unknown) for item in [*members, *model.component_set.objects])


def base_of(subject: Subject, frame: Component | None) -> Component | None:
    """The body or ground that a frame is fixed to, through any number of offset frames; looked for once per frame."""
    known = cast("dict[int, Component | None]", subject.kept.setdefault("bases", {}))
    way: set[int] = set()
    while frame is not None and not isinstance(frame, (Body, Ground)) and id(frame) not in known:
        if id(frame) in way:
            frame = None
            break
        way.add(id(frame))
        if isinstance(frame, StationDefinedFrame):
            station = subject.target_of(frame, "socket_point_a")
            frame = subject.target_of(station, "socket_parent_frame") if station is not None else None
        else:
            is_laid = "socket_parent" in type(frame).field_specs()
            frame = subject.target_of(frame, "socket_parent") if is_laid else None
    base = known.get(id(frame), frame)
    # All that were passed on the way are fixed to the same.
    known.update(dict.fromkeys(way, base))
    return base
