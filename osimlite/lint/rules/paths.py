"""OSIM61x: the paths of muscles and springs."""

from __future__ import annotations

import math
from itertools import pairwise
from math import pi, radians

from osimlite.base.text import format_count
from osimlite.lint.registry import ERROR, INFO, REFUSES, WARNING, FindingCollector, Threshold, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object, format_quantity
from osimlite.schema.base import Object
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.joints import Joint
from osimlite.schema.paths import ConditionalPathPoint, GeometryPath, PathPoint
from osimlite.schema.states import list_motions
from osimlite.schema.wrapping import WrapObject


@rule("OSIM611", "short-path", severity=ERROR, consequences=(REFUSES,))
def report_short_path(subject: Subject, report: FindingCollector) -> None:
    """A path has fewer than two points.

    Reports geometry paths with fewer than two points, and muscles and springs without a path. Also
    reports a Scholz2015GeometryPath that begins or ends with an obstacle.

    OpenSim rejects the model.

    ```xml
      <PathPointSet>
          <objects>
              <PathPoint name="start"> <socket_parent_frame>/bodyset/thigh</socket_parent_frame> </PathPoint>
    +         <PathPoint name="end"> <socket_parent_frame>/bodyset/shank</socket_parent_frame> </PathPoint>
          </objects>
      </PathPointSet>
    ```
    """
    for path in subject.find_instances(GeometryPath):
        points = path.path_point_set.objects
        owner = subject.tree.parent_of(path)
        if len(points) > 1 or owner is None:
            continue
        # A path that the upgrade added is reported at its owner.
        if path._index is not None or subject.source is None:
            report(
                f"the path of {describe_object(owner)} has {format_count(len(points), 'point')}, but "
                "needs two",
                path,
            )
        # An element that was not read may be the path, and has a finding.
        elif not any(note.owner is owner and note.kind in _NOT_READ for note in subject.notes):
            report(f"{describe_object(owner)} has no path: OpenSim rejects the model", owner)
    for path in subject.find_by_class("Scholz2015GeometryPath"):
        elements = path.path_elements
        count = sum(item.tag == _CABLE_POINT for item in elements)
        owner = subject.tree.parent_of(path) or path
        if count < 2:
            report(
                f"the path of {describe_object(owner)} has {format_count(count, 'point')}, but needs two",
                path,
            )
            continue
        for item, end in ((elements[0], "begins"), (elements[-1], "ends")):
            if item.tag != _CABLE_POINT:
                report(
                    f"the path of {describe_object(owner)} {end} with an obstacle: OpenSim "
                    "rejects the model",
                    item,
                )


_CABLE_POINT = "Scholz2015GeometryPathPoint"
_NOT_READ = frozenset(("unknown-tag", "wrong-name", "wrong-class", "unknown-class", "empty"))
"""Kinds of notes about unread elements that may have been meant as the path."""


DISTANCE = Threshold(
    "path-point-distance", 0.0, "m", "points of a path at this distance or nearer count as one"
)


@rule("OSIM612", "coincident-path-points", severity=WARNING, thresholds=(DISTANCE,))
def report_coincident_path_points(subject: Subject, report: FindingCollector) -> None:
    """Two consecutive points of a path coincide.

    Reports a point if the point before it is in the same frame at the same location.

    The segment between the two points has no length and no direction. If the path has no other
    segment, the length of the muscle is 0. Usually a point was copied and not moved.

    ```xml
      <PathPointSet>
          <objects>
              <PathPoint name="a"> <socket_parent_frame>/bodyset/thigh</socket_parent_frame> </PathPoint>
    -         <PathPoint name="b"> <socket_parent_frame>/bodyset/thigh</socket_parent_frame> </PathPoint>
              <PathPoint name="c"> <socket_parent_frame>/bodyset/shank</socket_parent_frame> </PathPoint>
          </objects>
      </PathPointSet>
    ```
    """
    min_distance = subject.config.value_of(DISTANCE)
    for path in subject.find_instances(GeometryPath):
        points: list[Object] = list(path.path_point_set.objects)
        for previous_point, point in pairwise(points):
            # Conditional and moving points are not always there.
            if type(previous_point) is not PathPoint or type(point) is not PathPoint:
                continue
            if (
                previous_point.location != point.location
                # `not >` includes NaN.
                and not math.dist(previous_point.location, point.location) <= min_distance
            ):
                continue
            frame = subject.target_of(point, "socket_parent_frame")
            # Equal coordinates in different frames are different points.
            if frame is not None and frame is subject.target_of(
                previous_point, "socket_parent_frame"
            ):
                owner = subject.tree.parent_of(path)
                report(
                    f"{describe_object(point)} of {describe_object(owner or path)} is at the same "
                    f"location as '{previous_point.name}' before it",
                    point,
                    tag="location",
                )


@rule("OSIM613", "inverted-point-range", severity=WARNING)
def report_inverted_point_range(subject: Subject, report: FindingCollector) -> None:
    """A conditional path point is never in the path.

    Reports conditional points whose range ends before it begins, or lies outside of the range of
    the coordinate, and points without a range. If both ends would lie in the range of the
    coordinate after conversion to radians, the rule asks whether they are in degrees.

    The coordinate is never inside the range, so the path never uses the point.

    ```xml
      <ConditionalPathPoint name="via">
          <socket_coordinate>/jointset/knee/knee_angle</socket_coordinate>
    -     <range>0 -2.1</range>
    +     <range>-2.1 0</range>
      </ConditionalPathPoint>
    ```
    """
    for point in subject.find_instances(ConditionalPathPoint):
        low, high = point.range
        if low > high:
            report(
                f"the range of {describe_object(point)} runs from {format_quantity(low)} down to "
                f"{format_quantity(high)}: the point is never active",
                point,
                tag="range",
            )
        elif "range" in point.model_fields_set:
            _report_unreachable(subject, report, point)
        else:
            report(
                f"{describe_object(point)} has no range: it is active only where the coordinate "
                "is exactly 0",
                point,
                tag="range",
            )


def _report_unreachable(
    subject: Subject, report: FindingCollector, point: ConditionalPathPoint
) -> None:
    """Report the range of a conditional point that no value of its coordinate reaches."""
    coordinate = subject.target_of(point, "socket_coordinate")
    if not isinstance(coordinate, Coordinate) or "range" not in coordinate.model_fields_set:
        return
    low, high = sorted(coordinate.range)
    range_start, range_end = point.range
    joint = subject.tree.parent_of(coordinate)
    motion = (
        list_motions(joint).get(coordinate.name)
        if isinstance(joint, Joint) and joint.motion_types
        else None
    )
    # Where the function of the joint is unknown, the coordinate is taken for an angle.
    is_angle = motion != "translational"
    # Two per cent of the range allow for rounded numbers of degrees.
    slack = 0.02 * (high - low) + 1e-5
    # An end that is the coordinate's own, in radians, is not converted with the other.
    start, end = (
        value if abs(value - bound) < 1e-4 else radians(value)
        for value, bound in ((range_start, low), (range_end, high))
    )
    fits = (
        is_angle
        # An angle beyond half a turn is unusual in radians.
        and max(abs(range_start), abs(range_end)) > pi
        and low - slack <= start
        and end <= high + slack
    )
    is_never_active = range_end < low - 1e-5 or range_start > high + 1e-5
    # A range in degrees may begin at 0 or end there, which is in the range in radians too.
    # Two turns: no joint's range in radians reaches so far.
    if is_never_active or (fits and max(abs(range_start), abs(range_end)) > 4.0 * pi):
        unit = "rad" if is_angle else "m"
        verb = "lies outside of" if is_never_active else "goes far beyond"
        report(
            f"the range of {describe_object(point)}, {format_quantity(range_start)} to "
            f"{format_quantity(range_end, unit)}, {verb} that of '{coordinate.name}', "
            f"{format_quantity(low)} to {format_quantity(high, unit)}"
            + (": the point is never active" if is_never_active else "")
            + ("; is it in degrees?" if fits else ""),
            point,
            tag="range",
            suggestion=f"{start:.6g} {end:.6g}" if fits else None,
        )


@rule("OSIM614", "unused-wrap-object", severity=INFO)
def report_unused_wrap_object(subject: Subject, report: FindingCollector) -> None:
    """A wrap surface is not used by any path.

    Reports wrap objects that no path names.

    Such a surface has no effect. Often a path should use it.

    ```xml
      <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia>
    -     <WrapObjectSet>
    -         <objects> <WrapSphere name="ball"> <radius>0.03</radius> </WrapSphere> </objects>
    -     </WrapObjectSet>
      </Body>
    ```
    """
    surfaces = list(subject.find_instances(WrapObject))
    # An unknown class may be a path.
    if not surfaces or subject.has_unknown:
        return
    used_surfaces = {
        id(subject.resolution(use).target)
        for use in subject.uses
        if use.reference.target == "WrapObject"
    }
    for surface in surfaces:
        if id(surface) not in used_surfaces:
            report(f"no path wraps around {describe_object(surface)}", surface, attribute="name")


@rule("OSIM615", "moving-point-coordinates", severity=ERROR, consequences=(REFUSES,))
def report_moving_point_coordinates(subject: Subject, report: FindingCollector) -> None:
    """The location of a moving path point depends on more than one coordinate.

    Reports moving path points whose x, y and z follow different coordinates.

    OpenSim rejects the model. A moving point follows a curve on the bone as one joint rotates, as
    the patellar tendon does at the knee. It cannot follow two joints.

    ```xml
      <MovingPathPoint name="patella">
          <socket_x_coordinate>/jointset/knee/knee_angle</socket_x_coordinate>
    -     <socket_y_coordinate>/jointset/hip/hip_flexion</socket_y_coordinate>
    +     <socket_y_coordinate>/jointset/knee/knee_angle</socket_y_coordinate>
          <socket_z_coordinate>/jointset/knee/knee_angle</socket_z_coordinate>
      </MovingPathPoint>
    ```
    """
    for point in subject.find_by_class("MovingPathPoint"):
        tags = ("socket_x_coordinate", "socket_y_coordinate", "socket_z_coordinate")
        x_coordinate, *other_coordinates = (subject.target_of(point, tag) for tag in tags)
        # Missing sockets have rules of their own.
        for tag, other_coordinate in zip(tags[1:], other_coordinates, strict=True):
            if (
                x_coordinate is not None
                and other_coordinate is not None
                and other_coordinate is not x_coordinate
            ):
                report(
                    f"{describe_object(point)} follows {describe_object(x_coordinate)} along x and "
                    f"{describe_object(other_coordinate)} along {tag[7]}: OpenSim rejects the model",
                    point,
                    tag=tag,
                )
