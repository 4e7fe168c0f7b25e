"""OSIM54x: forces between two places, and forces without what they need."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

from osimlite.lint.placement import Pose, default_poses, on_base
from osimlite.lint.registry import ERROR, FindingSink, rule
from osimlite.lint.skeleton import base_of
from osimlite.lint.subject import Subject
from osimlite.lint.words import called
from osimlite.mechanics.laws.vectors import norm, plus, times
from osimlite.schema.base import Component
from osimlite.schema.tree import is_a

NO_LENGTH_M = 1e-14
"""Distance of two ends below which OpenSim 4.6 divides by zero; 1e-9 m is computed with (measured)."""


@rule("OSIM541", "ends-in-one-place", severity=ERROR)
def ends_in_one_place(subject: Subject, report: FindingSink) -> None:
    """Both ends of a force are in one place in the default pose.

    Reports PointToPointSprings, PointToPointActuators and ExpressionBasedPointToPointForces whose
    two points coincide in the default pose, and paths of which two points that follow each other
    are on different bodies and coincide there. Forces with `appliesForce` false are left out.

    The force has no direction. OpenSim gives no message: every acceleration of the model is NaN,
    also if the force is zero.

    ```xml
      <PointToPointSpring name="band">
          <socket_body1>/bodyset/pelvis</socket_body1>
          <socket_body2>/bodyset/thigh</socket_body2>
    -     <point2>0 0.2 0</point2>
    +     <point2>0 -0.2 0</point2>
          <stiffness>100</stiffness>
      </PointToPointSpring>
    ```
    """
    for force, first, second in _two_ended(subject):
        if not getattr(force, "appliesForce", True):
            continue
        # OpenSim takes the points in the body itself, also where a frame that is off it is named.
        ends = [
            _place_in_ground(subject, base_of(subject, frame), point)
            for frame, point in (first, second)
        ]
        if ends[0] is None or ends[1] is None:
            continue
        if norm(plus(ends[0], times(-1.0, ends[1]))) < NO_LENGTH_M:
            report(
                f"both ends of {called(force)} are in one place in the default pose: every "
                "acceleration is NaN, without a message",
                force,
                attribute="name",
            )
    for path in subject.named("GeometryPath"):
        owner = subject.owner(path)
        holder = owner if owner is not path else subject.tree.parent_of(path)
        if holder is None or not getattr(holder, "appliesForce", True):
            continue
        for before, point in pairwise(path.path_point_set.objects):
            if _coincide(subject, before, point):
                report(
                    f"'{before.name}' and '{point.name}' of the path of {called(holder)} are on "
                    "different bodies and in one place in the default pose: every acceleration is "
                    "NaN, without a message",
                    point,
                    attribute="name",
                )


@rule("OSIM542", "spring-on-one-body", severity=ERROR)
def spring_on_one_body(subject: Subject, report: FindingSink) -> None:
    """Both ends of a PointToPointSpring are on one body.

    Reports PointToPointSprings whose two frames are the same or are fixed to the same body, also
    those with `appliesForce` false.

    OpenSim refuses the model. Other forces between two points may have both on one body, where
    they do nothing.

    ```xml
      <PointToPointSpring name="band">
          <socket_body1>/bodyset/thigh</socket_body1>
    -     <socket_body2>/jointset/knee/thigh_offset</socket_body2>
    +     <socket_body2>/bodyset/shank</socket_body2>
          <point1>0.02 0 0</point1>
          <stiffness>100</stiffness>
      </PointToPointSpring>
    ```
    """
    for spring in subject.named("PointToPointSpring"):
        first, second = (
            base_of(subject, subject.target_of(spring, f"socket_body{number}")) for number in (1, 2)
        )
        if first is not None and first is second:
            report(
                f"both ends of {called(spring)} are on {called(first)}: OpenSim refuses the model",
                spring,
                tag="socket_body2",
            )


@rule("OSIM543", "external-force-in-model", severity=ERROR)
def external_force_in_model(subject: Subject, report: FindingSink) -> None:
    """An ExternalForce stands in a model.

    Reports ExternalForces of a model; their place is a document of ExternalLoads, which names the
    file with the measured forces.

    OpenSim refuses the model, since the force has no data. This is so with `appliesForce` false
    too.

    ```xml
    - <ExternalForce name="plate">
    -     <applied_to_body>shank</applied_to_body> <force_identifier>ground_force_v</force_identifier>
    - </ExternalForce>
    + <SpringGeneralizedForce name="plate">
    +     <coordinate>pelvis_ty</coordinate> <stiffness>100</stiffness>
    + </SpringGeneralizedForce>
    ```
    """
    for force in subject.named("ExternalForce"):
        report(
            f"{called(force)} stands in a model, where it has no data: OpenSim refuses the model; "
            "move it to a document of ExternalLoads",
            force,
        )


@rule("OSIM544", "reflex-without-muscle", severity=ERROR)
def reflex_without_muscle(subject: Subject, report: FindingSink) -> None:
    """A ToyReflexController drives what is no muscle.

    Reports the actuators of ToyReflexControllers that are no muscles.

    A reflex answers to the lengthening of a muscle; of others there is none. OpenSim refuses the
    model.

    ```xml
      <CoordinateActuator name="motor"> <coordinate>knee_angle</coordinate> </CoordinateActuator>
    - <ToyReflexController name="reflex">
    -     <socket_actuators>/forceset/motor</socket_actuators> <gain>1</gain>
    - </ToyReflexController>
    ```
    """
    for use in subject.uses:
        if use.reference.rule and is_a(use.owner, "ToyReflexController"):
            if use.spec.tag != "socket_actuators":
                continue
            target = subject.resolution(use).target
            if target is not None and not is_a(target, "Muscle"):
                report(
                    f"{called(use.owner)} drives {called(target)}, which is no muscle: OpenSim refuses the model",
                    use.owner,
                    tag="socket_actuators",
                    word=use.text,
                )


_End = tuple[Component | None, Any]


def _two_ended(subject: Subject) -> Iterator[tuple[Component, _End, _End]]:
    """Yield each force between two points with the frame and the place of both."""
    for force in subject.named("PointToPointSpring"):
        first, second = (subject.target_of(force, f"socket_body{number}") for number in (1, 2))
        yield force, (first, force.point1), (second, force.point2)
    for force in subject.named("ExpressionBasedPointToPointForce"):
        first, second = (subject.target_of(force, f"body{number}") for number in (1, 2))
        yield force, (first, force.point1), (second, force.point2)
    for force in subject.named("PointToPointActuator"):
        first, second = (subject.target_of(force, f"body{letter}") for letter in "AB")
        ground = subject.model.ground if subject.model is not None else None
        if force.points_are_global:
            first, second = ground, ground
        yield force, (first, force.pointA), (second, force.pointB)


def _place_in_ground(subject: Subject, frame: Component | None, point: Any) -> Any:
    """Return where a point of a frame is in ground in the default pose; None if it is not known."""
    end = on_base(subject, frame)
    if end is None:
        return None
    base, pose = end
    carrier: Pose | None = default_poses(subject).get(id(base))
    return None if carrier is None else carrier.then(pose).of(point)


def _coincide(subject: Subject, before: Any, point: Any) -> bool:
    """Return whether two points of a path are fixed to different bodies and in one place."""
    frames = []
    for item in (before, point):
        if not is_a(item, "PathPoint"):
            return False
        frame = subject.target_of(item, "socket_parent_frame")
        if frame is None:
            return False
        frames.append(frame)
    if base_of(subject, frames[0]) is base_of(subject, frames[1]):
        return False
    first = _place_in_ground(subject, frames[0], before.location)
    second = _place_in_ground(subject, frames[1], point.location)
    if first is None or second is None:
        return False
    return norm(plus(first, times(-1.0, second))) < NO_LENGTH_M
