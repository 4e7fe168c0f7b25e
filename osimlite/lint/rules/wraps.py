"""OSIM616 and following: paths that wrap around surfaces."""

from __future__ import annotations

import math

from osimlite.base.text import format_count
from osimlite.lint.placement import FramePose, locate_frame, make_offset
from osimlite.lint.registry import ERROR, FAILS, WARNING, FindingCollector, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object
from osimlite.mechanics.laws.vectors import Vector
from osimlite.schema.base import Component
from osimlite.schema.paths import ConditionalPathPoint, GeometryPath, PathPoint, PathWrap
from osimlite.schema.wrap_types import WrapCylinder, WrapEllipsoid, WrapSphere
from osimlite.schema.wrapping import WrapObject


def _list_wraps(path: GeometryPath) -> list[PathWrap]:
    # Objects that do not belong there have a finding of another rule.
    return [wrap for wrap in path.path_wrap_set.objects if isinstance(wrap, PathWrap)]


@rule("OSIM616", "swallowed-point", severity=WARNING)
def report_swallowed_point(subject: Subject, report: FindingCollector) -> None:
    """A point of a path lies inside a surface that the path wraps around.

    Reports points inside a cylinder (taken as infinitely long), a sphere or an ellipsoid that is
    fixed to the same body. Only points within the `range` of the wrap count.

    OpenSim does not wrap a segment that begins or ends inside the surface. The path goes straight
    through it, in every pose and without a message. The point may be inside by less than a
    millimetre, for example after scaling.

    ```xml
      <PathPoint name="band_a"> <location>0.02 0 0.02</location> </PathPoint>
    - <WrapSphere name="condyle"> <radius>0.03</radius> </WrapSphere>
    + <WrapSphere name="condyle"> <radius>0.028</radius> </WrapSphere>
    ```
    """
    for path in subject.find_instances(GeometryPath):
        points = path.path_point_set.objects
        for wrap in _list_wraps(path):
            surface = subject.target_of(wrap, "wrap_object")
            base = (
                _locate_wrap(subject, surface)
                if isinstance(surface, WrapObject) and surface.active
                else None
            )
            if base is None:
                continue
            assert isinstance(surface, WrapObject)
            body, pose = base
            first_point, last_point = wrap.range
            for point in points[max(first_point, 1) - 1 : last_point if last_point > 0 else None]:
                location = locate_frame(subject, subject.target_of(point, "socket_parent_frame"))
                if not isinstance(point, PathPoint) or location is None or location[0] is not body:
                    continue
                depth = _compute_depth(
                    surface,
                    pose.inverse().transform_point(location[1].transform_point(point.location)),
                )
                if depth > 0:
                    owner = subject.tree.parent_of(path)
                    report(
                        f"{describe_object(point)} of {describe_object(owner or path)} is "
                        f"{1000 * depth:.3g} mm inside {describe_object(surface)}: the path does "
                        "not wrap between it and its neighbours",
                        point,
                        tag="location",
                    )


@rule("OSIM617", "wrap-range", severity=WARNING, consequences=(FAILS,))
def report_wrap_range(subject: Subject, report: FindingCollector) -> None:
    """The range of a wrap contains no segment of the path.

    Reports wraps whose `range` ends at the point where it begins, or before it. A range that ends
    beyond the last point is an error.

    The path never wraps around the surface. If the range ends before it begins, OpenSim also
    ignores all later wraps of the path. If the range ends beyond the last point, OpenSim fails when
    it computes the path length, and its message names no wrap. If the range of an earlier wrap has
    only conditional points, OpenSim fails only in poses in which one of these points is active.
    Points count from 1, and -1 stands for either end.

    ```xml
    - <PathWrap name="around"> <wrap_object>condyle</wrap_object> <range>2 1</range> </PathWrap>
    + <PathWrap name="around"> <wrap_object>condyle</wrap_object> <range>1 2</range> </PathWrap>
    ```
    """
    for path in subject.find_instances(GeometryPath):
        points = path.path_point_set.objects
        count = len(points)
        owner = subject.tree.parent_of(path)
        has_inverted_range = False
        may_leave = False
        for wrap in _list_wraps(path):
            first, last = wrap.range
            surface = subject.target_of(wrap, "wrap_object")
            is_off = isinstance(surface, WrapObject) and not surface.active
            range_text = (
                f"the range of {describe_object(wrap)} of {describe_object(owner or path)}, "
                f"{first} {last},"
            )
            start = max(first, 1)
            end = last if last > 0 else count
            if end > count and start <= end and not (has_inverted_range or is_off):
                consequence = "OpenSim fails when it computes the length of the path"
                consequence += (
                    ", unless all points in the range of an earlier wrap are inactive conditional points"
                    if may_leave
                    else ""
                )
                report(
                    f"{range_text} ends beyond the {format_count(count, 'point')} of the path: {consequence}",
                    wrap,
                    tag="range",
                    # OpenSim does not compute the length for a disabled force.
                    severity=WARNING
                    if may_leave or getattr(owner, "appliesForce", True) is False
                    else ERROR,
                )
            elif start >= end or end > count:
                ignored_note = (
                    ", and OpenSim ignores the wraps after it" if start > end and not is_off else ""
                )
                report(
                    f"{range_text} contains no segment of the path: the path never wraps around this surface{ignored_note}",
                    wrap,
                    tag="range",
                )
            has_inverted_range = has_inverted_range or (start > end and not is_off)
            covered_points = points[start - 1 : end]
            may_leave = may_leave or not (
                is_off
                or any(not isinstance(point, ConditionalPathPoint) for point in covered_points)
            )


def _locate_wrap(subject: Subject, surface: WrapObject) -> tuple[Component, FramePose] | None:
    """Return the body that a surface is fixed to, and its pose there; None if unknown."""
    holder = subject.tree.parent_of(surface)
    location = locate_frame(subject, subject.tree.parent_of(holder) if holder is not None else None)
    return location and (
        location[0],
        location[1].compose(make_offset(surface.xyz_body_rotation, surface.translation)),
    )


def _compute_depth(surface: WrapObject, point: Vector) -> float:
    """Return the depth of a point inside a surface in its frame, m; 0 where OpenSim would wrap."""
    x, y, z = point
    match surface:
        case WrapCylinder():
            return surface.radius - math.hypot(x, y)
        case WrapSphere():
            return surface.radius - math.hypot(x, y, z)
        case WrapEllipsoid() if min(surface.dimensions) > 0:
            size = math.hypot(
                *(
                    coordinate / half
                    for coordinate, half in zip(point, surface.dimensions, strict=True)
                )
            )
            if size * size < 1 - 1e-4:
                return math.hypot(x, y, z) * (1 / size - 1) if size > 0 else min(surface.dimensions)
    return 0.0
