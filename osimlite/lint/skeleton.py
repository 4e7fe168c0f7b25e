"""Bodies and joints of a model as a graph, as far as their references resolve."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from typing import cast

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, field
from osimlite.lint.subject import Subject, cache_per_subject
from osimlite.mechanics.multibody.topology import new_base, spanning_tree
from osimlite.schema.base import Component, Object, Unknown
from osimlite.schema.custom_joint import CustomJoint
from osimlite.schema.frames import Body, Ground, StationDefinedFrame
from osimlite.schema.joints import Joint, WeldJoint


@dataclass(slots=True)
class JointLink:
    """Joint with its frames and their bodies (or ground); None for unresolved ones."""

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
    links: list[JointLink] = field(default_factory=list)

    @property
    def complete(self) -> bool:
        """True if the frames of every joint lead to a body."""
        return all(
            link.parent_base is not None and link.child_base is not None for link in self.links
        )

    def iterate_pairs(self) -> Iterator[tuple[JointLink, Component, Component]]:
        """Yield the joints between two different bodies, with the parent and the child."""
        for link in self.links:
            parent, child = link.parent_base, link.child_base
            if parent is not None and child is not None and parent is not child:
                yield link, parent, child

    def compute_depths(self) -> dict[int, int]:
        """Return the number of joints between ground and each reachable body.

        Returns:
            Numbers by the identity (``id``) of the body.
        """
        depth = {id(self.ground): 0}
        pending: list[Component] = [self.ground]
        while pending:
            base = pending.pop(0)
            for link in self.find_joints(base):
                for body in (link.parent_base, link.child_base):
                    if body is not None and id(body) not in depth:
                        depth[id(body)] = depth[id(base)] + 1
                        pending.append(body)
        return depth

    def find_joints(self, base: Component) -> list[JointLink]:
        """Return the joints at a body."""
        return [link for link in self.links if base is link.parent_base or base is link.child_base]


class _SkeletonEdge(NamedTuple):
    """Edge of the tree of bodies: a joint, or a joint to ground that OpenSim adds; bodies by path."""

    parent: str
    child: str
    coordinates: tuple[int, ...] = (0,)
    link: JointLink | None = None


class TreeGrowth(NamedTuple):
    """Tree of bodies that OpenSim builds from a skeleton."""

    loops: list[JointLink]  # joints that close loops, in the order of the joints
    # Whether OpenSim rejects the model, or crashes, because of bodies that no joint connects to
    # ground. OpenSim gives each of them, or one of each group, a joint to ground. With each added
    # joint it loses the order of all joints before it, and adds these to the system last, in the
    # order of the document: too late for offset frames and joints on the bodies that they carry.
    fails: bool


@cache_per_subject
def grow_tree(subject: Subject) -> TreeGrowth:
    """Return the tree of bodies that OpenSim builds from a skeleton."""
    bones = build_skeleton(subject)
    ground = subject.path(bones.ground)
    masses = {subject.path(body): body.mass for body in bones.bodies}
    edges = [
        # OpenSim asks an empty joint of the class how many coordinates it has.
        _SkeletonEdge(
            subject.path(parent),
            subject.path(child),
            () if isinstance(link.joint, WeldJoint | CustomJoint) else (0,),
            link,
        )
        for link, parent, child in bones.iterate_pairs()
    ]
    joined_paths = {path for edge in edges for path in edge[:2]}
    edges += [_SkeletonEdge(ground, path) for path in masses if path not in joined_paths]
    order: dict[str, _SkeletonEdge] = {}
    while True:
        branches, loops = spanning_tree(edges, ground, masses)
        for branch in branches:
            order.setdefault(branch.outer, branch.link)
        loose = [path for path in masses if path not in order]
        if not loose:
            break
        edges.append(_SkeletonEdge(ground, new_base(loose, edges)))
    closing = [edge.link for edge in loops if edge.link is not None]
    return TreeGrowth(
        closing, any(edge.link is None for edge in edges) and _fails_to_build(subject, edges, order)
    )


def _fails_to_build(
    subject: Subject, edges: list[_SkeletonEdge], order: dict[str, _SkeletonEdge]
) -> bool:
    """Return whether OpenSim fails with the joints that it adds, since it adds them too late."""
    paths = [*order]
    last = max(index for index, edge in enumerate(order.values()) if edge.link is None)
    late = {*paths[:last]}
    frames = chain(
        subject.find_by_class("PhysicalOffsetFrame"), subject.find_by_class("StationDefinedFrame")
    )
    framed = {
        subject.path(base) for frame in frames if (base := find_base(subject, frame)) is not None
    }
    if not late.isdisjoint(framed) or any(
        not late.isdisjoint(order[path][:2]) for path in paths[last:]
    ):
        return True
    carried = {id(edge): path for path, edge in order.items() if path in late}
    for edge in edges:
        if (outer := carried.get(id(edge))) is not None:
            if (edge.parent if outer == edge.child else edge.child) in late:
                return True
            late.remove(outer)
    return False


@cache_per_subject
def build_skeleton(subject: Subject) -> Skeleton:
    """Return the skeleton of a model."""
    assert subject.model is not None
    bones = Skeleton([*subject.find_instances(Body)], subject.model.ground)
    for joint in subject.tree.components:
        if not isinstance(joint, Joint):
            continue
        parent = subject.target_of(joint, "socket_parent_frame")
        child = subject.target_of(joint, "socket_child_frame")
        bones.links.append(
            JointLink(joint, parent, child, find_base(subject, parent), find_base(subject, child))
        )
    return bones


def has_unknown_joints(subject: Subject) -> bool:
    """Return whether a joint or a body has an unknown class, so the graph has gaps."""
    model = subject.model
    assert model is not None
    members: list[Object] = [
        *model.joint_set.objects,
        *model.body_set.objects,
        *model.subcomponents,
    ]
    return any(isinstance(item, Unknown) for item in [*members, *model.component_set.objects])


def find_base(subject: Subject, frame: Component | None) -> Component | None:
    """Return the body or ground that a frame is fixed to through offset frames; cached for each frame."""
    known_bases = cast("dict[int, Component | None]", subject.cache.setdefault("bases", {}))
    passed_frames: set[int] = set()
    while (
        frame is not None and not isinstance(frame, (Body, Ground)) and id(frame) not in known_bases
    ):
        if id(frame) in passed_frames:
            frame = None
            break
        passed_frames.add(id(frame))
        if isinstance(frame, StationDefinedFrame):
            station = subject.target_of(frame, "socket_point_a")
            frame = (
                subject.target_of(station, "socket_parent_frame") if station is not None else None
            )
        else:
            is_laid = "socket_parent" in type(frame).field_specs()
            frame = subject.target_of(frame, "socket_parent") if is_laid else None
    base = known_bases.get(id(frame), frame)
    # All frames of the chain are fixed to the same base.
    known_bases.update(dict.fromkeys(passed_frames, base))
    return base
