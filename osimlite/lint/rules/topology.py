"""OSIM4xx: how bodies and joints hang together."""

from __future__ import annotations

from collections.abc import Iterator

from osimlite.lint.engine import ERROR, WARNING, Found, rule
from osimlite.lint.skeleton import Skeleton, has_unknown_joints, skeleton
from osimlite.lint.subject import Subject
from osimlite.lint.words import called
from osimlite.schema.base import Component, Object
from osimlite.schema.frames import Body
from osimlite.schema.joints import Joint, WeldJoint
from osimlite.text import listed


@rule("OSIM401", "unconnected-body", severity=ERROR)
def unconnected_body(subject: Subject, found: Found) -> None:
    """A body is not connected to ground.

    Reports bodies that no chain of joints connects to ground.

    OpenSim says that it adds a free joint and then crashes, or ends with an invalid body index, as soon as the model
    has two joints. With fewer the body falls freely, which the file does not say.

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
    bones = skeleton(subject)
    if not bones.complete or has_unknown_joints(subject):
        return
    groups = _Groups()
    for link in bones.links:
        groups.join(link.parent_base, link.child_base)
    loose: dict[int, list[Body]] = {}
    for body in bones.bodies:
        if groups.of(body) != groups.of(bones.ground):
            loose.setdefault(groups.of(body), []).append(body)
    # Measured on 160 random models: OpenSim fails unless the joint it adds comes before all others.
    first = not bones.of(bones.ground) and sum(len(group) > 1 for group in loose.values()) < 2
    alone = len(bones.links) < 2 and all(
        link.parent is link.parent_base and link.child is link.child_base for link in bones.links
    )
    fate = "adds a FreeJoint to ground" if first or alone else "crashes or refuses the model"
    for body, *others in loose.values():
        message = f"no joint connects {called(body)}"
        if others:
            names = listed((f"'{other.name}'" for other in others), most=3)
            message = f"{called(body)} is not connected to ground, nor {names}, which joints connect with it"
        elif bones.of(body):
            message = f"{called(body)} is not connected to ground, only with itself"
        found(f"{message}; OpenSim {fate}", body, attribute="name", severity=WARNING if first or alone else None)


@rule("OSIM403", "closed-loop", severity=ERROR)
def closed_loop(subject: Subject, found: Found) -> None:
    """Joints form a closed loop.

    Reports each joint that connects bodies which earlier joints have connected already.

    OpenSim cuts the loop: it splits a body and welds the halves with a constraint. That adds coordinates and
    multipliers that the file does not mention, and the halves together have another mass or inertia than the body, so
    the model moves otherwise than it says even where the loop closes. Where it does not close in the default pose,
    OpenSim refuses the model. Say what is meant with a constraint.

    ```xml
    - <WeldJoint name="strut">
    -     <socket_parent_frame>/bodyset/pelvis</socket_parent_frame>
    -     <socket_child_frame>/bodyset/shank</socket_child_frame>
    - </WeldJoint>
    + <WeldConstraint name="strut">
    +     <socket_frame1>/bodyset/pelvis</socket_frame1>
    +     <socket_frame2>/bodyset/shank</socket_frame2>
    + </WeldConstraint>
    ```
    """
    groups = _Groups()
    moved_by: dict[int, Joint] = {}
    pairs: set[frozenset[int]] = set()
    for link, parent, child in skeleton(subject).pairs():
        pair = frozenset((id(parent), id(child)))
        if groups.of(parent) == groups.of(child) and pair not in pairs:
            before = moved_by.get(id(child))
            other = f", which {called(before)} has placed already" if before is not None else ""
            found(
                f"{called(link.joint)} closes a loop at {called(child)}{other}; "
                "OpenSim splits a body, with inertias of its own, and adds a constraint, or refuses the model",
                link.joint,
                tag="socket_child_frame",
            )
        groups.join(parent, child)
        pairs.add(pair)
        moved_by.setdefault(id(child), link.joint)


@rule("OSIM404", "parallel-joints", severity=ERROR)
def parallel_joints(subject: Subject, found: Found) -> None:
    """Two joints connect the same two bodies.

    Reports the second joint between one pair of bodies.

    OpenSim adds a hidden body and welds it with a constraint: more coordinates, and a joint that is much stiffer than
    either. If one of the two is ground and the second joint is a weld, free, or the other way round, it refuses the
    model.

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
    first: dict[frozenset[int], Joint] = {}
    bones = skeleton(subject)
    for link, parent, child in bones.pairs():
        pair = frozenset((id(parent), id(child)))
        if pair in first:
            found(
                f"{called(link.joint)} connects the same two bodies as {called(first[pair])}: OpenSim "
                + ("refuses the model, or " if id(bones.ground) in pair else "")
                + "welds a hidden body between them",
                link.joint,
                attribute="name",
            )
        first.setdefault(pair, link.joint)


@rule("OSIM407", "massless-leaf", severity=ERROR)
def massless_leaf(subject: Subject, found: Found) -> None:
    """A body without mass is the last of its chain.

    Reports bodies of mass 0 that move and carry nothing with mass.

    A force on such a body would accelerate it without bounds: the mass matrix is singular, and OpenSim refuses the
    model, or (at a CustomJoint) computes NaN. Between two bodies with mass, or welded to one, a massless body is fine.

    ```xml
    - <Body name="shank"> <mass>0</mass> </Body>
    + <Body name="shank"> <mass>3</mass> <inertia>0.05 0.05 0.005 0 0 0</inertia> </Body>
    ```
    """
    bones = skeleton(subject)
    if not bones.complete or has_unknown_joints(subject):
        return
    for body, members in _massless_leaves(bones):
        welded = f" with the bodies welded to it ({listed(item.name for item in members)})" if members else ""
        found(
            f"{called(body)}{welded} is massless and the end of its chain: OpenSim refuses the model or computes NaN",
            body,
            tag="mass",
        )


class _Groups:
    """Which components belong together (a union-find by identity)."""

    def __init__(self) -> None:
        self._up: dict[int, int] = {}

    def of(self, item: Object) -> int:
        key = id(item)
        while self._up.get(key, key) != key:
            key = self._up[key]
        return key

    def join(self, one: Object | None, other: Object | None) -> None:
        if one is not None and other is not None:
            self._up[self.of(one)] = self.of(other)


def _massless_leaves(bones: Skeleton) -> Iterator[tuple[Body, list[Body]]]:
    """Each rigid group of bodies that has no mass and hangs on one moving joint: its first body and the others."""
    groups = _Groups()
    for link in bones.links:
        if isinstance(link.joint, WeldJoint):
            groups.join(link.parent_base, link.child_base)
    members: dict[int, list[Component]] = {}
    for base in (bones.ground, *bones.bodies):
        members.setdefault(groups.of(base), []).append(base)
    for key, group in members.items():
        bodies = [base for base in group if isinstance(base, Body)]
        if len(bodies) != len(group) or any(body.mass != 0 for body in bodies):
            continue
        moving = [
            link
            for link in bones.links
            if not isinstance(link.joint, WeldJoint)
            and key in {groups.of(base) for base in (link.parent_base, link.child_base) if base is not None}
        ]
        if len(moving) == 1:
            yield bodies[0], bodies[1:]
