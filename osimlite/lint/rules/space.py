"""Faults that need positions of frames: frames through points, contact, lengths."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import combinations

from osimlite.base.text import join_words
from osimlite.lint.placement import FramePose, compute_default_poses, locate_frame, make_offset
from osimlite.lint.registry import (
    ERROR,
    INFO,
    NAN,
    REFUSES,
    WARNING,
    FindingCollector,
    Threshold,
    rule,
)
from osimlite.lint.skeleton import find_base
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object, format_quantity
from osimlite.schema.base import Component, Object
from osimlite.schema.contact import START_DEPTH_M, START_DEPTH_SHARE, ContactGeometry
from osimlite.schema.contact_types import ContactHalfSpace, ContactSphere
from osimlite.schema.fields import Value
from osimlite.schema.frames import Body, PhysicalOffsetFrame, StationDefinedFrame
from osimlite.schema.joints import Joint
from osimlite.schema.markers import Station
from osimlite.schema.specs import FieldSpec, get_value_specs
from osimlite.schema.tree import is_a

POINTS = ("socket_point_a", "socket_point_b", "socket_point_c", "socket_origin_point")
"""Sockets of a frame that is defined by stations."""


@rule("OSIM411", "degenerate-frame", severity=ERROR, consequences=(REFUSES,))
def report_degenerate_frame(subject: Subject, report: FindingCollector) -> None:
    """The points of a frame do not define a frame.

    Reports StationDefinedFrames in which two of the three stations that define the axes coincide,
    or in which stations are on different bodies. Also reports offset frames that are fixed to
    themselves, or to each other in a cycle.

    OpenSim rejects the model. It hangs if a joint refers to one of several frames in a cycle.

    ```xml
      <ComponentSet>
          <objects>
              <Station name="a"> <socket_parent_frame>/bodyset/thigh</socket_parent_frame> </Station>
    -         <Station name="b"> <socket_parent_frame>/bodyset/thigh</socket_parent_frame> </Station>
    +         <Station name="b">
    +             <socket_parent_frame>/bodyset/thigh</socket_parent_frame> <location>0.1 0 0</location>
    +         </Station>
              <Station name="c">
                  <socket_parent_frame>/bodyset/thigh</socket_parent_frame> <location>0 0.1 0</location>
              </Station>
              <StationDefinedFrame name="segment">
                  <socket_point_a>/componentset/a</socket_point_a> <socket_point_b>/componentset/b</socket_point_b>
                  <socket_point_c>/componentset/c</socket_point_c>
                  <socket_origin_point>/componentset/a</socket_origin_point>
              </StationDefinedFrame>
          </objects>
      </ComponentSet>
    ```
    """
    # Each frame is followed once, so that long chains do not take quadratic time.
    followed: set[int] = set()
    for offset in subject.find_instances(PhysicalOffsetFrame):
        visited: dict[int, PhysicalOffsetFrame] = {}
        current: Component | None = offset
        while isinstance(current, PhysicalOffsetFrame) and id(current) not in followed:
            followed.add(id(current))
            visited[id(current)] = current
            current = subject.target_of(current, "socket_parent")
        # The chain ends on itself: the frames since the first visit of the current one form the cycle.
        cycle = (
            list(visited.values())[list(visited).index(id(current)) :]
            if id(current) in visited
            else []
        )
        end = _describe_frame_cycle(subject, cycle) if cycle else ""
        for link in cycle:
            report(
                f"{describe_object(link)} is fixed to {end}; give its socket_parent the path "
                "of a body",
                link,
                tag="socket_parent",
            )
    station_defined_frames = list(subject.find_instances(StationDefinedFrame))
    ids_in_cycles = _find_frames_in_cycles(subject, station_defined_frames)
    for frame in station_defined_frames:
        if id(frame) in ids_in_cycles:
            report(
                f"{describe_object(frame)} is defined by a point that is fixed to this frame: "
                "OpenSim hangs",
                frame,
            )
            continue
        points = [subject.target_of(frame, tag) for tag in POINTS]
        stations = [point for point in points if isinstance(point, Station)]
        locations = [
            locate_frame(subject, subject.target_of(station, "socket_parent_frame"))
            for station in stations
        ]
        # Missing or wrong sockets have rules of their own.
        if len(stations) < 4:
            continue
        fixed_to = [
            find_base(subject, subject.target_of(station, "socket_parent_frame"))
            for station in stations
        ]
        stray_index = next(
            (n for n, base in enumerate(fixed_to) if base is not None and base is not fixed_to[0]),
            None,
        )
        if fixed_to[0] is not None and stray_index is not None:
            report(
                f"{describe_object(stations[stray_index])} of {describe_object(frame)} is fixed to "
                f"{describe_object(fixed_to[stray_index] or frame)}, {describe_object(stations[0])} to "
                f"{describe_object(fixed_to[0])}: OpenSim rejects the model",
                frame,
                tag=POINTS[stray_index],
            )
            continue
        points_in_frame = [
            location[1].transform_point(station.location) if location else None
            for location, station in zip(locations, stations, strict=True)
        ]
        # Exactly equal locations: points that are near to each other still define a frame.
        for first, second in combinations(range(3), 2):
            if (
                points_in_frame[first] is not None
                and points_in_frame[first] == points_in_frame[second]
            ):
                report(
                    f"{POINTS[first]} and {POINTS[second]} of {describe_object(frame)} are at the "
                    "same location: OpenSim rejects the model",
                    frame,
                    tag=POINTS[second],
                )
                break


def _describe_frame_cycle(subject: Subject, cycle: Sequence[PhysicalOffsetFrame]) -> str:
    """Return the end of a sentence: what the frames of a cycle are fixed to, and what OpenSim 4.6 does.

    Measured: OpenSim hangs if a joint leads into a cycle of several frames. It rejects a frame that
    is its own parent, and cycles to which no joint leads.
    """
    if len(cycle) == 1:
        return "itself: OpenSim rejects the model"
    names = join_words([f"'{frame.name}'" for frame in cycle])
    through = f"itself, through {names}"
    members = {id(frame) for frame in cycle}
    for joint in subject.find_instances(Joint):
        for tag in ("socket_parent_frame", "socket_child_frame"):
            frame = subject.target_of(joint, tag)
            seen_frames: set[int] = set()
            while isinstance(frame, PhysicalOffsetFrame) and id(frame) not in seen_frames:
                if id(frame) in members:
                    return f"{through}: OpenSim hangs"
                seen_frames.add(id(frame))
                frame = subject.target_of(frame, "socket_parent")
    return f"{through}: OpenSim rejects the model"


DEPTH = Threshold(
    "contact-depth",
    START_DEPTH_M,
    "m",
    "largest accepted depth of a sphere inside a surface at the start",
)
RELATIVE_DEPTH = Threshold(
    "contact-depth-share",
    START_DEPTH_SHARE,
    "of the radius",
    "the same depth, as a share of the radius; a finding needs both depths to be exceeded",
)
LENGTH = Threshold("largest-length", 10.0, "m", "largest plausible length on a body")


@rule("OSIM521", "starts-in-contact", severity=INFO, thresholds=(DEPTH, RELATIVE_DEPTH))
def report_starts_in_contact(subject: Subject, report: FindingCollector) -> None:
    """Contact surfaces are inside each other in the default pose.

    Computes the default pose. Reports spheres that start inside a half-space or another sphere of
    their contact force, by more than 1 mm and by more than a tenth of the radius. The finding is a
    warning if the centre of the sphere is inside. Only bodies on joints of plain rotations and
    translations, or on custom joints without a GCVSpline, are checked. Meshes and other shapes are
    not.

    The contact acts with full force from the start: the model is thrown up, and the integrator
    takes tiny steps. Often the position of the floor or a default value is wrong.

    ```xml
      <ContactSphere name="heel">
    -     <socket_frame>/bodyset/shank</socket_frame> <location>0 -0.38 0</location> <radius>0.05</radius>
    +     <socket_frame>/bodyset/shank</socket_frame> <location>0 -0.2 0</location> <radius>0.05</radius>
      </ContactSphere>
    ```
    """
    min_depth = subject.config.value_of(DEPTH)
    min_relative_depth = subject.config.value_of(RELATIVE_DEPTH)
    for force, surfaces in _find_contact_groups(subject):
        for surface, other_surface in combinations(surfaces, 2):
            # The pair is tried in both orders: a force may name the half-space first or second.
            ball, against = (
                (surface, other_surface)
                if isinstance(surface, ContactSphere)
                else (other_surface, surface)
            )
            if not isinstance(ball, ContactSphere):
                continue
            depth = _compute_depth(subject, ball, against)
            # `not >` excludes NaN.
            if depth is None or not depth > max(min_depth, min_relative_depth * ball.radius):
                continue
            sunk = isinstance(against, ContactHalfSpace) and depth > ball.radius
            report(
                f"{describe_object(ball)} starts {1000 * depth:.3g} mm inside "
                f"{describe_object(against)} ({describe_object(force)} acts between them)"
                + (
                    "; even its centre is inside: the radius is "
                    f"{format_quantity(1000 * ball.radius, 'mm')}"
                    if sunk
                    else ""
                ),
                ball,
                attribute="name",
                severity=WARNING if sunk else None,
            )


@rule("OSIM522", "lengths-in-millimetres", severity=WARNING, thresholds=(LENGTH,))
def report_lengths_in_millimetres(subject: Subject, report: FindingCollector) -> None:
    """A length on a body is longer than ten metres.

    Reports lengths, and positions in the frame of a body, of more than 10 m. Objects fixed to
    ground may be far away, and prescribed or infinite values are not checked.

    OpenSim works in metres. A position in millimetres becomes a thousand times too far away, and so
    does the lever arm.

    ```xml
      <Marker name="asis">
    -     <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> <location>15 20 128</location>
    +     <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> <location>0.015 0.02 0.128</location>
      </Marker>
    ```
    """
    longest = subject.config.value_of(LENGTH)
    for cls, items in subject.by_class.items():
        specs = _list_lengths(cls)
        for item in items if specs else ():
            for spec in specs:
                value = item.__dict__[spec.name]
                numbers = (
                    value
                    if isinstance(value, tuple)
                    else (value,)
                    if isinstance(value, float)
                    else ()
                )
                # Almost all are small; with NaN among them no comparison need be true.
                if not numbers or (-longest <= min(numbers) and max(numbers) <= longest):
                    continue
                # Infinity is reported by OSIM205.
                if not any(
                    longest < abs(number) < math.inf for number in numbers
                ) or not _is_on_body(subject, item):
                    continue
                better = " ".join(f"{number / 1000:.6g}" for number in numbers)
                report(
                    f"{subject.describe_property(item, spec)} is {format_quantity(value, 'm')}; "
                    "is it in millimetres?",
                    item,
                    tag=spec.tag,
                    suggestion=better,
                )


@cache
def _list_lengths(cls: type[Object]) -> tuple[FieldSpec, ...]:
    """Return the properties of a class that are lengths or positions in metres."""
    return tuple(
        spec
        for spec in get_value_specs(cls)
        if isinstance(spec.kind, Value) and spec.kind.unit == "m" and spec.kind.scalar == "double"
    )


@rule("OSIM415", "no-direction", severity=ERROR, consequences=(NAN,))
def report_no_direction(subject: Subject, report: FindingCollector) -> None:
    """A direction vector is zero.

    Reports lines, axes and directions of constraints and actuators that are 0 0 0. The default line
    of a PointOnLineConstraint is zero. For an actuator with `appliesForce` false, the finding is a
    warning.

    OpenSim normalises the direction to NaN, whatever the force: every acceleration is NaN, without
    a message.

    ```xml
      <PointActuator name="push">
    -     <body>thigh</body> <direction>0 0 0</direction>
    +     <body>thigh</body> <direction>1 0 0</direction>
      </PointActuator>
    ```
    """
    for cls, tag in (
        ("PointOnLineConstraint", "line_direction_vec"),
        ("PointActuator", "direction"),
        ("TorqueActuator", "axis"),
    ):
        for item in subject.find_by_class(cls):
            if not any(getattr(item, tag)):
                is_off = not getattr(item, "appliesForce", True)
                consequence = (
                    "it does not act" if is_off else "accelerations become NaN, without a message"
                )
                report(
                    f"{subject.describe_property(item, type(item).field_specs()[tag])} is 0 0 0: "
                    f"{consequence}",
                    item,
                    tag=tag,
                    severity=WARNING if is_off else None,
                )


def _find_frames_in_cycles(subject: Subject, frames: Sequence[Component]) -> set[int]:
    """Return the identities of frames and stations that depend on themselves.

    R. Tarjan's strongly connected components (1972), each looked at once.
    """
    result: set[int] = set()
    number: dict[int, int] = {}
    lowest: dict[int, int] = {}
    path: list[Component] = []
    open_ids: set[int] = set()
    # Without recursion, since chains of frames may be deeper than Python's stack allows.
    for start in frames:
        pending: list[tuple[Component, Iterator[Component]]] = []
        entering: Component | None = None if id(start) in number else start
        while entering is not None or pending:
            # 1. Enter a component: give it a number, and put it on the path.
            if entering is not None:
                component_id = id(entering)
                number[component_id] = lowest[component_id] = len(number)
                path.append(entering)
                open_ids.add(component_id)
                pending.append((entering, _list_supports(subject, entering)))
            # 2. Look at the next component that it depends on.
            owner, below = pending[-1]
            entering = next(
                (item for item in below if id(item) not in number or id(item) in open_ids), None
            )
            # 3. One on the path closes a cycle; a component that depends on itself is a cycle of
            # one.
            if entering is not None and id(entering) in open_ids:
                lowest[id(owner)] = min(lowest[id(owner)], number[id(entering)])
                result |= {id(owner)} if entering is owner else set()
                entering = None
            # 4. All are seen: the component above inherits the lowest number that can be reached.
            elif entering is None:
                pending.pop()
                if pending:
                    above = id(pending[-1][0])
                    lowest[above] = min(lowest[above], lowest[id(owner)])
                # 5. If nothing earlier can be reached, what lies above on the path is one component
                # of the graph.
                if lowest[id(owner)] == number[id(owner)]:
                    size = next(k for k in range(1, len(path) + 1) if path[-k] is owner)
                    cycle = {id(item) for item in path[-size:]}
                    del path[-size:]
                    open_ids -= cycle
                    result |= cycle if size > 1 else set()
    return result


def _list_supports(subject: Subject, item: Component) -> Iterator[Component]:
    """Yield the components that a frame or a station is fixed to."""
    for tag in (*POINTS, "socket_parent_frame", "socket_parent"):
        target = subject.target_of(item, tag)
        if target is not None:
            yield target


def _is_on_body(subject: Subject, item: Object) -> bool:
    """Return whether an object is fixed to a body, so that no length of it can reach ten metres."""
    owner: Component | None = subject.owner(item)
    if isinstance(owner, Body):
        return True
    for tag in ("socket_parent_frame", "socket_parent", "socket_frame"):
        if owner is not None and tag in type(owner).field_specs():
            return isinstance(find_base(subject, subject.target_of(owner, tag)), Body)
    # No muscle, ligament or spring along a path is as long either.
    if owner is not None and any(is_a(owner, cls) for cls in ("Muscle", "Ligament", "PathSpring")):
        return True
    # Wrap objects of a body are in the WrapObjectSet of the body.
    above = owner
    while above is not None and not isinstance(above, Body):
        above = subject.tree.parent_of(above)
    return above is not None


def _find_contact_groups(subject: Subject) -> Iterator[tuple[Component, list[ContactGeometry]]]:
    """Yield the surfaces of each contact force."""
    forces = {
        id(force)
        for kind in ("HuntCrossleyForce", "SmoothSphereHalfSpaceForce")
        for force in subject.find_by_class(kind)
    }
    groups: dict[int, tuple[Component, list[ContactGeometry]]] = {}
    for use in subject.uses if forces else ():
        if id(use.owner) in forces:
            target = subject.resolution(use).target
            if isinstance(target, ContactGeometry):
                group = groups.setdefault(id(use.owner), (use.owner, []))[1]
                if not any(surface is target for surface in group):
                    group.append(target)
    yield from groups.values()


def _compute_depth(subject: Subject, ball: ContactSphere, other: ContactGeometry) -> float | None:
    """Return the depth of a sphere in another surface (m), negative if apart; None if unknown."""
    inner, outer = _locate_surface(subject, ball), _locate_surface(subject, other)
    if inner is None or outer is None or inner[0] is outer[0]:
        # Surfaces on one body do not move against each other.
        return None
    centre = inner[1].position
    if isinstance(other, ContactHalfSpace):
        # It fills the side of its frame where x is positive.
        return outer[1].inverse().transform_point(centre)[0] + ball.radius
    if isinstance(other, ContactSphere):
        return ball.radius + other.radius - math.dist(centre, outer[1].position)
    return None


def _locate_surface(
    subject: Subject, surface: ContactGeometry
) -> tuple[Component, FramePose] | None:
    """Return the body of a surface, and the pose of the surface in ground; None if unknown."""
    location = locate_frame(subject, subject.target_of(surface, "socket_frame"))
    pose = compute_default_poses(subject).get(id(location[0])) if location is not None else None
    if location is None or pose is None:
        return None
    return location[0], pose.compose(location[1]).compose(
        make_offset(surface.orientation, surface.location)
    )
