"""OSIM4xx: connections of bodies and joints."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from osimlite.base.text import join_words
from osimlite.lint.diagnostic import Consequence
from osimlite.lint.registry import ERROR, NAN, REFUSES, RUNS, WARNING, FindingCollector, rule
from osimlite.lint.skeleton import (
    JointLink,
    Skeleton,
    build_skeleton,
    grow_tree,
    has_unknown_joints,
)
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object
from osimlite.schema.base import Component, Object
from osimlite.schema.custom_joint import CustomJoint
from osimlite.schema.frames import Body
from osimlite.schema.joint_types import FreeJoint
from osimlite.schema.joints import Joint, WeldJoint


@rule("OSIM401", "unconnected-body", severity=ERROR, consequences=(REFUSES,))
def report_unconnected_body(subject: Subject, report: FindingCollector) -> None:
    """A body is not connected to ground.

    Reports bodies that no chain of joints connects to ground.

    OpenSim adds a free joint to ground, and the body falls freely; the finding is then a warning.
    If the body has no mass, OpenSim rejects the model. The added joint can also disturb the order in
    which OpenSim builds other joints, from ground outwards. If offset frames or further joints are
    on the bodies of these other joints, OpenSim may then reject the model, or crash.

    ```xml
      <Body name="ball"> <mass>1</mass> <inertia>0.1 0.1 0.1 0 0 0</inertia> </Body>
    + <FreeJoint name="ball_free">
    +     <socket_parent_frame>/ground</socket_parent_frame>
    +     <socket_child_frame>/bodyset/ball</socket_child_frame>
    +     <coordinates>
    +         <Coordinate name="ball_rx" /> <Coordinate name="ball_ry" /> <Coordinate name="ball_rz" />
    +         <Coordinate name="ball_tx" /> <Coordinate name="ball_ty" /> <Coordinate name="ball_tz" />
    +     </coordinates>
    + </FreeJoint>
    ```
    """
    bones = build_skeleton(subject)
    # A joint of an unknown class may be the connection.
    if not bones.complete or has_unknown_joints(subject):
        return
    groups = _Groups()
    for link in bones.links:
        groups.join(link.parent_base, link.child_base)
    loose: dict[int, list[Body]] = {}
    for body in bones.bodies:
        if groups.find_root(body) != groups.find_root(bones.ground):
            loose.setdefault(groups.find_root(body), []).append(body)
    if not loose:
        return
    # OpenSim connects loose bodies by free joints, which needs a mass.
    massless = any(not any(body.mass for body in group) for group in loose.values())
    fails = massless or grow_tree(subject).fails
    for body, *other_bodies in loose.values():
        message = f"no joint connects {describe_object(body)}"
        if other_bodies:
            names = join_words((f"'{other_body.name}'" for other_body in other_bodies), max_count=3)
            message = f"{describe_object(body)} is not connected to ground; joints connect it only to {names}"
        elif bones.find_joints(body):
            message = (
                f"{describe_object(body)} is not connected to ground; a joint connects it to itself"
            )
        consequence = "adds a FreeJoint to ground" if not fails else "rejects the model"
        report(
            f"{message}; OpenSim {consequence}",
            body,
            attribute="name",
            severity=None if fails else WARNING,
        )


@rule("OSIM403", "closed-loop", severity=ERROR, consequences=(REFUSES, RUNS))
def report_closed_loop(subject: Subject, report: FindingCollector) -> None:
    """Joints form a closed loop.

    Reports each joint that connects bodies that earlier joints already connect.

    OpenSim cuts the loop: it splits a body, and welds the halves with a constraint. That adds
    coordinates and multipliers that are not in the file. The halves together have another mass or
    inertia than the body, so the model moves differently even if the loop closes. If the loop does
    not close in the default pose, or the joint is a CustomJoint, OpenSim rejects the model. Use a
    constraint instead of the joint.

    ```xml
    - <WeldJoint name="strut">
    -     <socket_parent_frame>/bodyset/pelvis</socket_parent_frame>
    -     <socket_child_frame>/bodyset/shank</socket_child_frame>
    - </WeldJoint>
    + <ConstantDistanceConstraint name="strut">
    +     <socket_body_1>/bodyset/pelvis</socket_body_1>
    +     <socket_body_2>/bodyset/shank</socket_body_2> <constant_distance>0.5</constant_distance>
    + </ConstantDistanceConstraint>
    ```
    """
    bones = build_skeleton(subject)
    pairs = Counter(map(_make_pair, bones.links))
    for link in grow_tree(subject).loops:
        # Parallel joints have OSIM404.
        if pairs[_make_pair(link)] == 1 and link.child_base is not None:
            other_joints = (
                other.joint
                for other in bones.links
                if other is not link and other.child_base is link.child_base
            )
            first_joint = next(other_joints, None)
            other = (
                f", which {describe_object(first_joint)} already places"
                if first_joint is not None
                else ""
            )
            description, consequence = _describe_loop(bones, link)
            report(
                f"{describe_object(link.joint)} closes a loop at "
                f"{describe_object(link.child_base)}{other}; {description}",
                link.joint,
                consequence=consequence,
                tag="socket_child_frame",
            )


@rule("OSIM404", "parallel-joints", severity=ERROR, consequences=(REFUSES, RUNS))
def report_parallel_joints(subject: Subject, report: FindingCollector) -> None:
    """Two joints connect the same two bodies.

    Reports the second joint between one pair of bodies.

    OpenSim splits the child, lets each joint carry one half, and welds the halves with a
    constraint. The model then has more coordinates than the mechanism needs, and inertias that are
    not in the file. OpenSim replaces a second WeldJoint by a constraint. It ignores a second
    FreeJoint, but counts the mass of the child twice. It rejects the model if the second joint is a
    CustomJoint, if its child is ground, or if it is a WeldJoint or a FreeJoint to ground.

    ```xml
    - <PinJoint name="hip_again">
    + <Body name="trunk"> <mass>30</mass> <inertia>1 1 1 0 0 0</inertia> </Body>
    + <PinJoint name="back">
          <socket_parent_frame>/bodyset/pelvis</socket_parent_frame>
    -     <socket_child_frame>/bodyset/thigh</socket_child_frame>
    -     <coordinates> <Coordinate name="hip_flexion_again" /> </coordinates>
    +     <socket_child_frame>/bodyset/trunk</socket_child_frame>
    +     <coordinates> <Coordinate name="lumbar_extension" /> </coordinates>
      </PinJoint>
    ```
    """
    bones = build_skeleton(subject)
    first: dict[frozenset[int], Joint] = {}
    loops = grow_tree(subject).loops
    # Joints of the tree come first, as OpenSim keeps them and cuts the others.
    for link in bones.links:
        if link not in loops:
            first.setdefault(_make_pair(link), link.joint)
    for link in loops:
        if (before := first.setdefault(_make_pair(link), link.joint)) is not link.joint:
            description, consequence = _describe_loop(bones, link)
            report(
                f"{describe_object(link.joint)} connects the same two bodies as "
                f"{describe_object(before)}; {description}",
                link.joint,
                consequence=consequence,
                attribute="name",
            )


@rule("OSIM407", "massless-leaf", severity=ERROR, consequences=(REFUSES, NAN))
def report_massless_leaf(subject: Subject, report: FindingCollector) -> None:
    """A body without mass is the last of its chain.

    Reports bodies of mass 0 that can move and carry no body with mass.

    A force on such a body gives it an infinite acceleration: the mass matrix is singular. OpenSim
    rejects the model, or computes NaN (at a CustomJoint). A massless body is fine between two
    bodies with mass, or welded to one.

    ```xml
    - <Body name="shank"> <mass>0</mass> </Body>
    + <Body name="shank"> <mass>3</mass> <inertia>0.05 0.05 0.005 0 0 0</inertia> </Body>
    ```
    """
    bones = build_skeleton(subject)
    if not bones.complete or has_unknown_joints(subject):
        return
    # A massless body behind another joint makes the mass matrix singular.
    for body, members, joint in _find_massless_leaves(bones):
        welded = (
            f" with the bodies welded to it ({join_words(item.name for item in members)})"
            if members
            else ""
        )
        description, consequence = (
            ("computes NaN", NAN)
            if isinstance(joint, CustomJoint)
            else ("rejects the model", REFUSES)
        )
        report(
            f"{describe_object(body)}{welded} has no mass and is the last of its chain: OpenSim {description}",
            body,
            consequence=consequence,
            tag="mass",
        )


def _make_pair(link: JointLink) -> frozenset[int]:
    return frozenset((id(link.parent_base), id(link.child_base)))


def _describe_loop(bones: Skeleton, link: JointLink) -> tuple[str, Consequence | None]:
    """Return what OpenSim does with a joint between bodies that other joints already connect.

    Returns:
        Description and consequence; None if that depends on the default pose.
    """
    kind = type(link.joint)
    # These cases are measured with OpenSim 4.6.
    to_ground = link.parent_base is bones.ground and issubclass(kind, WeldJoint | FreeJoint)
    if to_ground or link.child_base is bones.ground or issubclass(kind, CustomJoint):
        return "OpenSim rejects the model", REFUSES
    if issubclass(kind, WeldJoint):
        return (
            "OpenSim replaces it by a constraint, and counts the mass of the child twice",
            RUNS,
        )
    if issubclass(kind, FreeJoint):
        return (
            "OpenSim counts the mass of the child twice, and the copy moves independently",
            RUNS,
        )
    return (
        "OpenSim splits the child, gives the halves another inertia, and welds them with a "
        "constraint; if the halves do not meet in the default pose, it rejects the model",
        None,
    )


class _Groups:
    """Groups of connected components (union-find by identity)."""

    def __init__(self) -> None:
        self._up: dict[int, int] = {}

    def find_root(self, item: Object) -> int:
        key = id(item)
        # Chains of parents are short, as models have at most some hundred bodies.
        while self._up.get(key, key) != key:
            key = self._up[key]
        return key

    def join(self, first: Object | None, second: Object | None) -> None:
        if first is not None and second is not None:
            self._up[self.find_root(first)] = self.find_root(second)


def _find_massless_leaves(bones: Skeleton) -> Iterator[tuple[Body, list[Body], Joint]]:
    """Yield each rigid group of massless bodies on one moving joint: first body, other bodies, joint."""
    groups = _Groups()
    # Bodies that are welded move as one, and share their mass.
    for link in bones.links:
        if isinstance(link.joint, WeldJoint):
            groups.join(link.parent_base, link.child_base)
    members: dict[int, list[Component]] = {}
    for base in (bones.ground, *bones.bodies):
        members.setdefault(groups.find_root(base), []).append(base)
    for key, group in members.items():
        bodies = [base for base in group if isinstance(base, Body)]
        # A group with ground or with any mass is no massless leaf.
        if len(bodies) != len(group) or any(body.mass != 0 for body in bodies):
            continue
        moving = [
            link
            for link in bones.links
            if not isinstance(link.joint, WeldJoint)
            and key
            in {
                groups.find_root(base)
                for base in (link.parent_base, link.child_base)
                if base is not None
            }
        ]
        # With two moving joints the group is in the middle of a chain, where mass follows.
        if len(moving) == 1:
            yield bodies[0], bodies[1:], moving[0].joint
