"""OSIM416: joints that have lost a direction to turn in where the model starts."""

from __future__ import annotations

from osimlite.lint.axes import coordinates_of
from osimlite.lint.engine import ERROR, FindingSink, rule
from osimlite.lint.placement import turning_axes
from osimlite.lint.subject import Subject
from osimlite.lint.words import called
from osimlite.mechanics.laws.vectors import dot
from osimlite.schema.joints import Joint

_LOCKED = 1e-8
"""Sine of the angle between an axis and the plane of the others; below it OpenSim 4.6 computes NaN (measured)."""


@rule("OSIM416", "gimbal-lock", severity=ERROR)
def gimbal_lock(subject: Subject, found: FindingSink) -> None:
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
                found(
                    f"{called(joint)} starts in gimbal lock: {first} and {third} turn about one axis, and "
                    "accelerations are NaN or without bounds",
                    second,
                    tag="default_value",
                )
