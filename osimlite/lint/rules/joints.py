"""OSIM4xx: single joints, their frames, coordinates and rotations."""

from __future__ import annotations

from osimlite.base.text import add_article, format_count, join_words
from osimlite.lint.axes import list_axis_names, list_coordinates, refuses_axes
from osimlite.lint.placement import find_rotation_axes
from osimlite.lint.registry import ERROR, INFO, NAN, REFUSES, RUNS, WARNING, FindingCollector, rule
from osimlite.lint.skeleton import build_skeleton, find_base
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object
from osimlite.mechanics.laws.vectors import dot
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.frames import Ground
from osimlite.schema.joint_types import EllipsoidJoint
from osimlite.schema.joints import Joint


@rule("OSIM402", "joint-to-itself", severity=ERROR, consequences=(REFUSES,))
def report_joint_to_itself(subject: Subject, report: FindingCollector) -> None:
    """A joint connects a body to itself.

    Reports joints whose two frames are the same or are fixed to the same body.

    OpenSim rejects the model.

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
    for link in build_skeleton(subject).links:
        if link.child_base is not None and link.parent_base is link.child_base:
            report(
                f"both frames of {describe_object(link.joint)} are fixed to "
                f"{describe_object(link.child_base)}: OpenSim rejects the model",
                link.joint,
                tag="socket_child_frame",
            )


@rule("OSIM405", "wrong-coordinate-count", severity=ERROR, consequences=(REFUSES,))
def report_wrong_coordinate_count(subject: Subject, report: FindingCollector) -> None:
    """A joint has the wrong number of coordinates.

    Reports joints with more or fewer coordinates than their class has. Also reports custom joints
    with a coordinate that none of their axes uses. Joints without coordinates are a warning.

    OpenSim rejects the model if the number is wrong. If `<coordinates>` is missing, it creates
    coordinates with names such as `_coord_0` and the value 0.

    ```xml
      <PinJoint name="knee">
          <socket_parent_frame>/bodyset/thigh</socket_parent_frame>
          <socket_child_frame>/bodyset/shank</socket_child_frame>
    -     <coordinates> <Coordinate name="knee_angle" /> <Coordinate name="knee_twist" /> </coordinates>
    +     <coordinates> <Coordinate name="knee_angle" /> </coordinates>
      </PinJoint>
    ```
    """
    for custom in subject.find_by_class("CustomJoint"):
        names = list_axis_names(custom)
        declared_names = [coordinate.name for coordinate in list_coordinates(custom)]
        if refuses_axes(custom) and all(name in declared_names for name in names):
            # Names that axes use and the joint does not declare belong to other rules.
            unused_names = [f"'{name}'" for name in declared_names if name not in names]
            reason = f"no axis of {describe_object(custom)} uses {join_words(unused_names)}"
            if not unused_names:
                reason = f"{describe_object(custom)} declares more coordinates than its axes use"
            report(
                f"{reason}: OpenSim rejects the model",
                custom,
                number=subject.element_of(custom, "coordinates"),
            )
        if not names and not declared_names:
            report(
                f"{describe_object(custom)} has no coordinate: OpenSim crashes; use a WeldJoint "
                "for a joint that does not move",
                custom,
            )
    for joint in subject.find_instances(Joint):
        if joint.motion_types is None:
            continue
        expected_count = len(joint.motion_types)
        declared_count = len(list_coordinates(joint))
        # An empty element says that there are no coordinates, where a missing one leaves them to
        # OpenSim.
        declared = "coordinates" in joint.model_fields_set and (
            declared_count > 0 or _declares_none(subject, joint)
        )
        if not declared and expected_count and subject.source is not None:
            report(
                f"{describe_object(joint)} has no coordinates; OpenSim creates {expected_count}, named '_coord_0'"
                + (f" to '_coord_{expected_count - 1}'" if expected_count > 1 else ""),
                joint,
                severity=WARNING,
            )
        elif declared_count != expected_count and (declared or declared_count):
            report(
                f"{describe_object(joint)} has {format_count(declared_count, 'coordinate')}, "
                f"{add_article(type(joint).tag)} needs {expected_count}: OpenSim rejects the model",
                joint,
                number=subject.element_of(joint, "coordinates"),
            )


def _declares_none(subject: Subject, joint: Joint) -> bool:
    """Return whether a text has an element for the coordinates of a joint in the current format."""
    number = subject.element_of(joint, "coordinates")
    return (
        number is not None
        and subject.source is not None
        and subject.source.spans[number].tag == "coordinates"
    )


@rule("OSIM406", "shared-coordinate-name", severity=ERROR, consequences=(RUNS,))
def report_shared_coordinate_name(subject: Subject, report: FindingCollector) -> None:
    """Two joints have a coordinate of the same name.

    Reports the second of two coordinates with the same name, and the forces and other components
    that use this name. If no component uses the name, the finding is a warning.

    Forces, actuators and constraints find a coordinate by its name, and always find the first one.
    Two limit forces then act on one knee, and none on the other.

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
    first_by_name: dict[str, Coordinate] = {}
    tree = subject.tree
    # Forces look a coordinate up by its name, and find the first.
    for component in subject.find_instances(Coordinate):
        joint = tree.parent_of(component)
        first_coordinate = first_by_name.setdefault(component.name, component)
        # Within one joint the rule on names reports it.
        if (
            first_coordinate is component
            or not component.name
            or tree.parent_of(first_coordinate) is joint
        ):
            continue
        coordinate_uses = (use for use in subject.uses if use.reference.rule == "coordinate-name")
        users = [
            describe_object(use.owner) for use in coordinate_uses if use.value == component.name
        ]
        message = (
            f"{describe_object(component)} has the same name as a coordinate of "
            f"{describe_object(tree.parent_of(first_coordinate) or first_coordinate)}"
        )
        if users:
            message += (
                f"; {join_words(dict.fromkeys(users), max_count=3)} "
                f"{'uses' if len(users) == 1 else 'all use'} that coordinate"
            )
        report(message, component, attribute="name", severity=None if users else WARNING)


@rule("OSIM408", "ground-as-child", severity=INFO)
def report_ground_as_child(subject: Subject, report: FindingCollector) -> None:
    """A joint has ground as its child.

    Reports joints whose child frame is fixed to ground.

    OpenSim allows this: it reverses the joint internally, and the coordinate keeps its meaning from
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
    for link in build_skeleton(subject).links:
        if isinstance(link.child_base, Ground) and link.parent_base is not link.child_base:
            report(
                f"the child of {describe_object(link.joint)} is ground; OpenSim reverses the joint",
                link.joint,
                tag="socket_child_frame",
            )


@rule("OSIM409", "stray-joint-frame", severity=WARNING, consequences=(REFUSES,))
def report_stray_joint_frame(subject: Subject, report: FindingCollector) -> None:
    """A joint contains an unrelated frame.

    Reports frames in the `<frames>` of a joint that are fixed to neither of the bodies that the
    joint connects. The finding is an error if the body of such a frame is further from ground than
    the child of the joint.

    OpenSim builds joints from ground outwards, and each joint with its frames. If the body of a
    frame is not built yet, OpenSim stops with a message about an invalid index. Usually a socket
    names the wrong frame.

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
    # Joints that cannot be resolved leave the depths unknown.
    bones = build_skeleton(subject)
    if not bones.complete:
        return
    depth = bones.compute_depths()
    for link in bones.links:
        for frame in link.joint.frames:
            base = find_base(subject, frame)
            if base is None or base is link.parent_base or base is link.child_base:
                continue
            deepest = max(depth.get(id(end), 0) for end in (link.parent_base, link.child_base))
            # OpenSim adds bodies in the order of their distance from ground; one that is too deep
            # does not exist yet.
            late = depth.get(id(base), 0) > deepest
            report(
                f"{describe_object(frame)} of {describe_object(link.joint)} is fixed to "
                f"{describe_object(base)}, which the joint does not connect"
                + ("; OpenSim rejects the model" if late else ""),
                frame,
                tag="socket_parent",
                severity=ERROR if late else None,
            )


_LOCK_SINE = 1e-8
"""Sine of the angle between an axis and the plane of the others; below it OpenSim 4.6 computes NaN (measured)."""


@rule("OSIM416", "gimbal-lock", severity=ERROR, consequences=(NAN,))
def report_gimbal_lock(subject: Subject, report: FindingCollector) -> None:
    """A joint is in gimbal lock in the default pose.

    Reports GimbalJoints, and CustomJoints with three rotations, whose second angle is a right angle
    in the default pose. The third axis is then parallel to the first.

    The joint loses one direction of rotation, and the mass matrix is singular. Every acceleration
    of the model is NaN, or beyond 1e12 rad/s^2 because of rounding, even if the coordinates are
    locked. Inverse kinematics works, but the first and the third angle are arbitrary. Change the
    default value of the second angle by 0.001 rad, or use a BallJoint, which has no gimbal lock.

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
    for joint in subject.find_instances(Joint):
        rotation_axes = find_rotation_axes(subject, joint)
        # With fewer rotations there is no gimbal lock.
        if len(rotation_axes) == 3:
            # The triple product is the volume that the three unit vectors span: 0 if they are in a
            # plane.
            (first_name, first_axis), (_, second_axis), (third_name, third_axis) = rotation_axes
            normal = (
                second_axis[1] * third_axis[2] - second_axis[2] * third_axis[1],
                second_axis[2] * third_axis[0] - second_axis[0] * third_axis[2],
                second_axis[0] * third_axis[1] - second_axis[1] * third_axis[0],
            )
            if abs(dot(first_axis, normal)) < _LOCK_SINE:
                second_coordinate = next(
                    item for item in list_coordinates(joint) if item.name == rotation_axes[1][0]
                )
                report(
                    f"{describe_object(joint)} starts in gimbal lock: {first_name} and {third_name} rotate "
                    "about the same axis, and accelerations are NaN or unbounded",
                    second_coordinate,
                    tag="default_value",
                )


@rule("OSIM417", "nimble-ellipsoid", severity=WARNING)
def report_nimble_ellipsoid(subject: Subject, report: FindingCollector) -> None:
    """An ellipsoid joint was made for nimblephysics, which moves it differently from OpenSim.

    Reports ellipsoid joints whose coordinates are abduction, elevation and upward rotation, in this
    order. Also reports all ellipsoid joints of models that AddBiomechanics wrote.

    AddBiomechanics, SKEL and BioAMASS use nimblephysics, which rotates by Ry(q0) Rx(-q1) Rz(q2).
    OpenSim rotates by Rx(q0) Ry(q1) Rz(q2). In OpenSim, the child body is therefore decimetres away
    from where it should be. `osimlite modify --from nimble` writes a model that moves in OpenSim as
    in nimblephysics.

    ```xml
      <Body name="scapula"> <mass>1</mass> <inertia>0.01 0.01 0.01 0 0 0</inertia> </Body>
    - <EllipsoidJoint name="scapulothoracic">
    + <EllipsoidJoint name="ankle">
          <socket_parent_frame>/bodyset/shank</socket_parent_frame>
          <socket_child_frame>/bodyset/scapula</socket_child_frame>
          <coordinates>
    -         <Coordinate name="scapula_abduction" />
    -         <Coordinate name="scapula_elevation" />
    -         <Coordinate name="scapula_upward_rot" />
    +         <Coordinate name="ankle_rx" />
    +         <Coordinate name="ankle_ry" />
    +         <Coordinate name="ankle_rz" />
          </coordinates>
          <radii_x_y_z>0.1 0.2 0.1</radii_x_y_z>
      </EllipsoidJoint>
    ```
    """
    name = "" if subject.model is None else subject.model.name
    for joint in subject.find_instances(EllipsoidJoint):
        # Imported here, because few models have such joints.
        from osimlite.io.nimble import is_nimble_ellipsoid

        if is_nimble_ellipsoid(joint, name):
            report(
                f"{describe_object(joint)} seems to be made for nimblephysics, which rotates it in another order "
                "than OpenSim; 'osimlite modify --from nimble' rewrites it",
                joint,
            )
