"""OSIM54x: forces between two points, and forces that lack a required part."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

from osimlite.lint.placement import FramePose, compute_default_poses, locate_frame
from osimlite.lint.registry import ERROR, NAN, REFUSES, FindingCollector, rule
from osimlite.lint.skeleton import find_base
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object
from osimlite.mechanics.laws.vectors import norm, plus, times
from osimlite.schema.base import Component
from osimlite.schema.tree import is_a

NO_LENGTH_M = 1e-14
"""Distance of two ends below which OpenSim 4.6 divides by zero; 1e-9 m is computed with (measured)."""


@rule("OSIM541", "ends-in-one-place", severity=ERROR, consequences=(NAN,))
def report_ends_in_one_place(subject: Subject, report: FindingCollector) -> None:
    """Both ends of a force coincide in the default pose.

    Reports PointToPointSprings, PointToPointActuators and ExpressionBasedPointToPointForces whose
    two points coincide in the default pose. Also reports paths in which two consecutive points are
    on different bodies, but coincide in the default pose. Forces with `appliesForce` false are not
    checked.

    The force has no direction. OpenSim gives no message: every acceleration of the model is NaN,
    even if the force is zero.

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
    for force, first, second in _find_two_ended_forces(subject):
        if not getattr(force, "appliesForce", True):
            continue
        # OpenSim takes the points in the body itself, also where a frame that is off it is named.
        ends = [
            _locate_in_ground(subject, find_base(subject, frame), point)
            for frame, point in (first, second)
        ]
        if ends[0] is None or ends[1] is None:
            continue
        if norm(plus(ends[0], times(-1.0, ends[1]))) < NO_LENGTH_M:
            report(
                f"both ends of {describe_object(force)} are in one place in the default pose: "
                "every acceleration is NaN, without a message",
                force,
                attribute="name",
            )
    # Points of one frame have OSIM612, which does not depend on the pose.
    for path in subject.find_by_class("GeometryPath"):
        owner = subject.owner(path)
        holder = owner if owner is not path else subject.tree.parent_of(path)
        if holder is None or not getattr(holder, "appliesForce", True):
            continue
        for before, point in pairwise(path.path_point_set.objects):
            if _are_coincident(subject, before, point):
                report(
                    f"'{before.name}' and '{point.name}' of the path of {describe_object(holder)} "
                    "are on different bodies and in one place in the default pose: every "
                    "acceleration is NaN, without a message",
                    point,
                    attribute="name",
                )


@rule("OSIM542", "spring-on-one-body", severity=ERROR, consequences=(REFUSES,))
def report_spring_on_one_body(subject: Subject, report: FindingCollector) -> None:
    """Both ends of a PointToPointSpring are on one body.

    Reports PointToPointSprings whose two frames are the same or are fixed to the same body, even if
    `appliesForce` is false.

    OpenSim rejects the model. Other forces between two points may have both ends on one body, where
    they have no effect.

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
    for spring in subject.find_by_class("PointToPointSpring"):
        first, second = (
            find_base(subject, subject.target_of(spring, f"socket_body{number}"))
            for number in (1, 2)
        )
        if first is not None and first is second:
            report(
                f"both ends of {describe_object(spring)} are on {describe_object(first)}: OpenSim "
                "rejects the model",
                spring,
                tag="socket_body2",
            )


@rule("OSIM543", "external-force-in-model", severity=ERROR, consequences=(REFUSES,))
def report_external_force_in_model(subject: Subject, report: FindingCollector) -> None:
    """A model contains an ExternalForce.

    Reports ExternalForces in a model. They belong in an ExternalLoads file, which names the file
    with the measured forces.

    OpenSim rejects the model, since the force has no data. It does so even if `appliesForce` is
    false.

    ```xml
    - <ExternalForce name="plate">
    -     <applied_to_body>shank</applied_to_body> <force_identifier>ground_force_v</force_identifier>
    - </ExternalForce>
    + <SpringGeneralizedForce name="plate">
    +     <coordinate>pelvis_ty</coordinate> <stiffness>100</stiffness>
    + </SpringGeneralizedForce>
    ```
    """
    for force in subject.find_by_class("ExternalForce"):
        report(
            f"{describe_object(force)} is in a model, where it has no data: OpenSim rejects the "
            "model; move it to an ExternalLoads file",
            force,
        )


@rule("OSIM544", "reflex-without-muscle", severity=ERROR, consequences=(REFUSES,))
def report_reflex_without_muscle(subject: Subject, report: FindingCollector) -> None:
    """A ToyReflexController drives an actuator that is not a muscle.

    Reports the actuators of ToyReflexControllers that are not muscles.

    A reflex responds to the lengthening of a muscle, which other actuators do not have. OpenSim
    rejects the model.

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
                    f"{describe_object(use.owner)} drives {describe_object(target)}, which is not "
                    "a muscle: OpenSim rejects the model",
                    use.owner,
                    tag="socket_actuators",
                    word=use.text,
                )


_End = tuple[Component | None, Any]


def _find_two_ended_forces(subject: Subject) -> Iterator[tuple[Component, _End, _End]]:
    """Yield each force between two points with the frame and the position of both."""
    for force in subject.find_by_class("PointToPointSpring"):
        first, second = (subject.target_of(force, f"socket_body{number}") for number in (1, 2))
        yield force, (first, force.point1), (second, force.point2)
    for force in subject.find_by_class("ExpressionBasedPointToPointForce"):
        first, second = (subject.target_of(force, f"body{number}") for number in (1, 2))
        yield force, (first, force.point1), (second, force.point2)
    for force in subject.find_by_class("PointToPointActuator"):
        first, second = (subject.target_of(force, f"body{letter}") for letter in "AB")
        ground = subject.model.ground if subject.model is not None else None
        # OpenSim takes both points as points of ground then.
        if force.points_are_global:
            first, second = ground, ground
        yield force, (first, force.pointA), (second, force.pointB)


def _locate_in_ground(subject: Subject, frame: Component | None, point: Any) -> Any:
    """Return the position in ground of a point of a frame in the default pose; None if unknown."""
    end = locate_frame(subject, frame)
    if end is None:
        return None
    base, pose = end
    carrier: FramePose | None = compute_default_poses(subject).get(id(base))
    return None if carrier is None else carrier.compose(pose).transform_point(point)


def _are_coincident(subject: Subject, before: Any, point: Any) -> bool:
    """Return whether two points of a path coincide and are fixed to different bodies."""
    frames = []
    for item in (before, point):
        if not is_a(item, "PathPoint"):
            return False
        frame = subject.target_of(item, "socket_parent_frame")
        if frame is None:
            return False
        frames.append(frame)
    # Points on one body are left to OSIM612.
    if find_base(subject, frames[0]) is find_base(subject, frames[1]):
        return False
    first = _locate_in_ground(subject, frames[0], before.location)
    second = _locate_in_ground(subject, frames[1], point.location)
    if first is None or second is None:
        return False
    return norm(plus(first, times(-1.0, second))) < NO_LENGTH_M
