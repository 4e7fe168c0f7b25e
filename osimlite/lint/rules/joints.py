"""OSIM4xx: single joints, their frames, coordinates and rotations."""

from __future__ import annotations

from osimlite.base.text import format_count, join_words
from osimlite.lint.axes import axes_refused, coordinates_of, names_on_axes
from osimlite.lint.placement import turning_axes
from osimlite.lint.registry import ERROR, INFO, WARNING, FindingSink, rule
from osimlite.lint.skeleton import base_of, skeleton
from osimlite.lint.subject import Subject
from osimlite.lint.words import a, called
from osimlite.mechanics.laws.vectors import dot
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.frames import Ground
from osimlite.schema.joints import Joint


@rule("OSIM402", "joint-to-itself", severity=ERROR)
def joint_to_itself(subject: Subject, report: FindingSink) -> None:
    """A joint connects a body to itself.

    Reports joints whose two frames are the same or are fixed to the same body.

    OpenSim refuses the model.

    ```xml
    - <WeldJoint name="strange">
    + <Body name="foot"> <mass>1</mass> <inertia>0.01 0.01 0.01 0 0 0</inertia> </Body>
    + <WeldJoint name="ankle">
          <socket_parent_frame>/bodyset/shank</socket_parent_frame>
    -     <socket_child_frame>/bodyset/shank</socket_child_frame>
    +     <socket_child_frame>/bodyset/foot</socket_child_frame>
      </WeldJoint>
    ```
    """
    for link in skeleton(subject).links:
        if link.child_base is not None and link.parent_base is link.child_base:
            report(
                f"both frames of {called(link.joint)} are fixed to {called(link.child_base)}; OpenSim refuses this",
                link.joint,
                tag="socket_child_frame",
            )


@rule("OSIM405", "wrong-coordinate-count", severity=ERROR)
def wrong_coordinate_count(subject: Subject, report: FindingSink) -> None:
    """A joint has not as many coordinates as it needs.

    Reports joints with more or fewer coordinates than their class moves by, custom joints with a
    coordinate that none of their axes uses, and (as a warning) joints with none at all.

    OpenSim refuses the model. Where `<coordinates>` is left out it makes coordinates up, with a
    name such as `_coord_0` and the value 0.

    ```xml
      <PinJoint name="knee">
          <socket_parent_frame>/bodyset/thigh</socket_parent_frame>
          <socket_child_frame>/bodyset/shank</socket_child_frame>
    -     <coordinates> <Coordinate name="knee_angle" /> <Coordinate name="knee_twist" /> </coordinates>
    +     <coordinates> <Coordinate name="knee_angle" /> </coordinates>
      </PinJoint>
    ```
    """
    for custom in subject.named("CustomJoint"):
        names, declared_names = (
            names_on_axes(custom),
            [coordinate.name for coordinate in coordinates_of(custom)],
        )
        if axes_refused(custom) and all(name in declared_names for name in names):
            unused = [f"'{name}'" for name in declared_names if name not in names]
            reason = f"no axis of {called(custom)} uses {join_words(unused)}"
            if not unused:
                reason = f"{called(custom)} declares more coordinates than its axes use"
            report(
                f"{reason}: OpenSim refuses the model",
                custom,
                number=subject.element_of(custom, "coordinates"),
            )
        if not names and not declared_names:
            report(
                f"{called(custom)} has no coordinate: OpenSim crashes; a joint that does not move is a WeldJoint",
                custom,
            )
    for joint in subject.each(Joint):
        if joint.motion_types is None:
            continue
        wanted = len(joint.motion_types)
        given = len(coordinates_of(joint))
        declared = "coordinates" in joint.model_fields_set and (
            given > 0 or _says_none(subject, joint)
        )
        if not declared and wanted and subject.source is not None:
            report(
                f"{called(joint)} gives no coordinates; OpenSim makes {wanted} up, called '_coord_0'"
                + (f" to '_coord_{wanted - 1}'" if wanted > 1 else ""),
                joint,
                severity=WARNING,
            )
        elif given != wanted and (declared or given):
            report(
                f"{called(joint)} has {format_count(given, 'coordinate')}, {a(type(joint).tag)} has {wanted}: "
                "OpenSim refuses the model",
                joint,
                number=subject.element_of(joint, "coordinates"),
            )


def _says_none(subject: Subject, joint: Joint) -> bool:
    """Whether a text has an element for the coordinates of a joint; an empty one of an older format says nothing."""
    number = subject.element_of(joint, "coordinates")
    return (
        number is not None
        and subject.source is not None
        and subject.source.spans[number].tag == "coordinates"
    )


@rule("OSIM406", "shared-coordinate-name", severity=ERROR)
def shared_coordinate_name(subject: Subject, report: FindingSink) -> None:
    """Two joints have a coordinate of the same name.

    Reports the second coordinate of a name, with the forces and others that look the name up.
    Without any it is a warning.

    Forces, actuators and constraints find a coordinate by its bare name, and always find the first:
    two limit forces then act on one knee, and none on the other.

    ```xml
      <PinJoint name="knee">
          <socket_parent_frame>/bodyset/thigh</socket_parent_frame>
          <socket_child_frame>/bodyset/shank</socket_child_frame>
    -     <coordinates> <Coordinate name="hip_flexion" /> </coordinates>
    +     <coordinates> <Coordinate name="knee_angle" /> </coordinates>
      </PinJoint>
    - <CoordinateLimitForce name="knee_limit"> <coordinate>hip_flexion</coordinate> </CoordinateLimitForce>
    ```
    """
    first: dict[str, Coordinate] = {}
    tree = subject.tree
    for component in subject.each(Coordinate):
        joint = tree.parent_of(component)
        known = first.setdefault(component.name, component)
        if known is component or not component.name or tree.parent_of(known) is joint:
            continue
        named = (use for use in subject.uses if use.reference.rule == "coordinate-name")
        users = [called(use.owner) for use in named if use.value == component.name]
        message = f"{called(component)} has the name of a coordinate of {called(tree.parent_of(known) or known)}"
        if users:
            message += f"; {join_words(dict.fromkeys(users), most=3)} {'finds' if len(users) == 1 else 'all find'} that one"
        report(message, component, attribute="name", severity=None if users else WARNING)


@rule("OSIM408", "ground-as-child", severity=INFO)
def ground_as_child(subject: Subject, report: FindingSink) -> None:
    """A joint has ground as its child.

    Reports joints whose child frame is fixed to ground.

    It is allowed: OpenSim turns the joint round inside, and the coordinate keeps its meaning from
    parent to child. But other programs expect chains that start at ground.

    ```xml
      <PlanarJoint name="ground_pelvis">
    -     <socket_parent_frame>/bodyset/pelvis</socket_parent_frame>
    -     <socket_child_frame>/ground</socket_child_frame>
    +     <socket_parent_frame>/ground</socket_parent_frame>
    +     <socket_child_frame>/bodyset/pelvis</socket_child_frame>
          <coordinates>
              <Coordinate name="pelvis_rz" /> <Coordinate name="pelvis_tx" />
    -         <Coordinate name="pelvis_ty"> <default_value>-1</default_value> </Coordinate>
    +         <Coordinate name="pelvis_ty"> <default_value>1</default_value> </Coordinate>
          </coordinates>
      </PlanarJoint>
    ```
    """
    for link in skeleton(subject).links:
        if isinstance(link.child_base, Ground) and link.parent_base is not link.child_base:
            report(
                f"the child of {called(link.joint)} is ground; OpenSim turns the joint round",
                link.joint,
                tag="socket_child_frame",
            )


@rule("OSIM409", "stray-joint-frame", severity=WARNING)
def stray_joint_frame(subject: Subject, report: FindingSink) -> None:
    """A joint holds a frame that has nothing to do with it.

    Reports frames in the `<frames>` of a joint that are fixed to neither of the bodies it connects.
    It is an error if that body is further from ground than the joint's child.

    OpenSim builds joints from ground outwards, and the frames of a joint with it: a frame on a body
    that is not there yet ends in a message about an invalid index. Usually a socket names the wrong
    frame.

    ```xml
      <PinJoint name="hip">
          <socket_parent_frame>/bodyset/pelvis</socket_parent_frame>
    -     <socket_child_frame>/bodyset/thigh</socket_child_frame>
    +     <socket_child_frame>thigh_offset</socket_child_frame>
          <coordinates> <Coordinate name="hip_flexion" /> </coordinates>
          <frames>
    -         <PhysicalOffsetFrame name="shank_offset">
    -             <socket_parent>/bodyset/shank</socket_parent>
    +         <PhysicalOffsetFrame name="thigh_offset">
    +             <socket_parent>/bodyset/thigh</socket_parent>
              </PhysicalOffsetFrame>
          </frames>
      </PinJoint>
    ```
    """
    bones = skeleton(subject)
    if not bones.complete:
        return
    depth = bones.depths()
    for link in bones.links:
        for frame in link.joint.frames:
            base = base_of(subject, frame)
            if base is None or base is link.parent_base or base is link.child_base:
                continue
            deepest = max(depth.get(id(end), 0) for end in (link.parent_base, link.child_base))
            late = depth.get(id(base), 0) > deepest
            report(
                f"{called(frame)} of {called(link.joint)} is fixed to {called(base)}, which the joint does not connect"
                + ("; OpenSim refuses the model" if late else ""),
                frame,
                tag="socket_parent",
                severity=ERROR if late else None,
            )


_LOCKED = 1e-8
"""Sine of the angle between an axis and the plane of the others; below it OpenSim 4.6 computes NaN (measured)."""


@rule("OSIM416", "gimbal-lock", severity=ERROR)
def gimbal_lock(subject: Subject, report: FindingSink) -> None:
    """Two of the three rotations of a joint are about one axis in the default pose.

    Reports GimbalJoints, and CustomJoints with three rotations, whose second rotation has by
    default a right angle that lays the third axis on the first.

    The joint cannot turn about the direction that is lost, its mass matrix has no inverse there,
    and every acceleration of the model is NaN, or beyond 1e12 rad/s^2 where rounding leaves a
    little, also where the coordinates are locked. Inverse kinematics goes on, but the two angles
    may take any value. A default a thousandth away is enough; a BallJoint has no such pose.

    ```xml
      <Body name="foot"> <mass>1</mass> <inertia>0.01 0.01 0.01 0 0 0</inertia> </Body>
      <GimbalJoint name="ankle">
          <socket_parent_frame>/bodyset/shank</socket_parent_frame>
          <socket_child_frame>/bodyset/foot</socket_child_frame>
          <coordinates>
              <Coordinate name="ankle_rx" />
    -         <Coordinate name="ankle_ry"> <default_value>1.5707963267948966</default_value> </Coordinate>
    +         <Coordinate name="ankle_ry"> <default_value>1.57</default_value> </Coordinate>
              <Coordinate name="ankle_rz" />
          </coordinates>
      </GimbalJoint>
    ```
    """
    for joint in subject.each(Joint):
        turns = turning_axes(subject, joint)
        if len(turns) == 3:
            (first, one), (_, two), (third, three) = turns
            across = (
                two[1] * three[2] - two[2] * three[1],
                two[2] * three[0] - two[0] * three[2],
                two[0] * three[1] - two[1] * three[0],
            )
            if abs(dot(one, across)) < _LOCKED:
                second = next(item for item in coordinates_of(joint) if item.name == turns[1][0])
                report(
                    f"{called(joint)} starts in gimbal lock: {first} and {third} turn about one axis, and "
                    "accelerations are NaN or without bounds",
                    second,
                    tag="default_value",
                )
