"""OSIM6xx: functions given by points, and the paths of muscles and springs."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import cast

from osimlite.lint.engine import ERROR, INFO, WARNING, Found, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import called, quantity, times
from osimlite.schema.base import Object
from osimlite.schema.functions import GCVSpline, PiecewiseConstantFunction, PiecewiseLinearFunction, SimmSpline
from osimlite.schema.paths import ConditionalPathPoint, GeometryPath, PathPoint
from osimlite.schema.wrapping import WrapObject

Tabulated = SimmSpline | GCVSpline | PiecewiseLinearFunction | PiecewiseConstantFunction


@rule("OSIM601", "unsorted-abscissae", severity=ERROR)
def unsorted_abscissae(subject: Subject, found: Found) -> None:
    """The x values of a function do not rise.

    ## What it does
    Reports the first x that is smaller than the one before it, and of splines also the first that is equal to it.

    ## Why is this bad
    A GCVSpline is refused. A SimmSpline divides by the difference without a word and gives values in the millions;
    piecewise functions take the wrong piece. A moment arm or a moving point is then anywhere.

    ## Example
    ```xml
    <PinJoint name="knee">
        <socket_parent_frame>/bodyset/thigh</socket_parent_frame>
        <socket_child_frame>/bodyset/shank</socket_child_frame>
        <coordinates>
            <Coordinate name="knee_angle">
                <prescribed_function>
                    <SimmSpline> <x>0 0.5 0.5 1</x> <y>0 -0.4 -0.5 -1</y> </SimmSpline>
                </prescribed_function>
                <prescribed>true</prescribed>
            </Coordinate>
        </coordinates>
    </PinJoint>
    ```

    ## Use instead
    ```xml
    <PinJoint name="knee">
        <socket_parent_frame>/bodyset/thigh</socket_parent_frame>
        <socket_child_frame>/bodyset/shank</socket_child_frame>
        <coordinates>
            <Coordinate name="knee_angle">
                <prescribed_function>
                    <SimmSpline> <x>0 0.5 0.6 1</x> <y>0 -0.4 -0.5 -1</y> </SimmSpline>
                </prescribed_function>
                <prescribed>true</prescribed>
            </Coordinate>
        </coordinates>
    </PinJoint>
    ```
    """
    for function in _tabulated(subject):
        strictly = isinstance(function, (SimmSpline, GCVSpline))
        for index in range(1, len(function.x)):
            before, here = function.x[index - 1], function.x[index]
            if here < before or (strictly and here == before):
                fate = "OpenSim refuses it" if isinstance(function, GCVSpline) else "its values are wrong"
                relation = "repeats" if here == before else "is smaller than"
                word, nth = subject.word_at(function, "x", index)
                found(
                    f"x of {subject.called_with(function)}: number {index + 1}, {quantity(here)}, {relation} the one "
                    f"before; {fate}",
                    function,
                    tag="x",
                    word=word,
                    nth=nth,
                )
                break


@rule("OSIM602", "unequal-points", severity=ERROR)
def unequal_points(subject: Subject, found: Found) -> None:
    """A function has not as many y values as x values.

    ## What it does
    Reports tabulated functions whose lists are of different length. Too many y are a warning.

    ## Why is this bad
    Where y is missing OpenSim reads beyond the end of the list, whatever is in memory there; a GCVSpline is refused.
    Too many y are ignored.

    ## Example
    ```xml
    <PinJoint name="knee">
        <socket_parent_frame>/bodyset/thigh</socket_parent_frame>
        <socket_child_frame>/bodyset/shank</socket_child_frame>
        <coordinates>
            <Coordinate name="knee_angle">
                <prescribed_function> <SimmSpline> <x>0 0.5 1</x> <y>0 -0.4</y> </SimmSpline> </prescribed_function>
                <prescribed>true</prescribed>
            </Coordinate>
        </coordinates>
    </PinJoint>
    ```

    ## Use instead
    ```xml
    <PinJoint name="knee">
        <socket_parent_frame>/bodyset/thigh</socket_parent_frame>
        <socket_child_frame>/bodyset/shank</socket_child_frame>
        <coordinates>
            <Coordinate name="knee_angle">
                <prescribed_function> <SimmSpline> <x>0 0.5 1</x> <y>0 -0.4 -1</y> </SimmSpline> </prescribed_function>
                <prescribed>true</prescribed>
            </Coordinate>
        </coordinates>
    </PinJoint>
    ```
    """
    for function in _tabulated(subject):
        xs, ys = len(function.x), len(function.y)
        if xs == ys:
            continue
        fate = "OpenSim reads beyond the end of the list" if ys < xs else "the rest is ignored"
        found(
            f"{subject.called_with(function)} has {xs} x and {ys} y: {fate}",
            function,
            tag="y",
            severity=None if ys < xs else WARNING,
        )


@rule("OSIM603", "too-few-points", severity=ERROR)
def too_few_points(subject: Subject, found: Found) -> None:
    """A function has too few points.

    ## What it does
    Reports a SimmSpline of fewer than two points, a GCVSpline of fewer than twice its half order, and piecewise
    functions without any.

    ## Why is this bad
    A SimmSpline is then NaN everywhere, a GCVSpline is refused, and a piecewise function returns what is in memory.

    ## Example
    ```xml
    <PinJoint name="knee">
        <socket_parent_frame>/bodyset/thigh</socket_parent_frame>
        <socket_child_frame>/bodyset/shank</socket_child_frame>
        <coordinates>
            <Coordinate name="knee_angle">
                <prescribed_function> <SimmSpline> <x>0</x> <y>-1</y> </SimmSpline> </prescribed_function>
                <prescribed>true</prescribed>
            </Coordinate>
        </coordinates>
    </PinJoint>
    ```

    ## Use instead
    ```xml
    <PinJoint name="knee">
        <socket_parent_frame>/bodyset/thigh</socket_parent_frame>
        <socket_child_frame>/bodyset/shank</socket_child_frame>
        <coordinates>
            <Coordinate name="knee_angle">
                <prescribed_function> <Constant> <value>-1</value> </Constant> </prescribed_function>
                <prescribed>true</prescribed>
            </Coordinate>
        </coordinates>
    </PinJoint>
    ```
    """
    for function in _tabulated(subject):
        least = 1
        if isinstance(function, SimmSpline):
            least = 2
        elif isinstance(function, GCVSpline):
            least = 2 * function.half_order
        if len(function.x) < least:
            fate = "OpenSim refuses it" if isinstance(function, GCVSpline) else "it has no value"
            given = times(len(function.x), "point")
            found(f"{subject.called_with(function)} has {given} and needs {least}: {fate}", function, tag="x")


@rule("OSIM611", "short-path", severity=ERROR)
def short_path(subject: Subject, found: Found) -> None:
    """A path has fewer than two points.

    ## What it does
    Reports geometry paths with no point, or with one.

    ## Why is this bad
    OpenSim refuses the model.

    ## Example
    ```xml
    <PathSpring name="spring">
        <GeometryPath name="path">
            <PathPointSet>
                <objects>
                    <PathPoint name="start"> <socket_parent_frame>/bodyset/thigh</socket_parent_frame> </PathPoint>
                </objects>
            </PathPointSet>
        </GeometryPath>
        <resting_length>0.1</resting_length> <stiffness>100</stiffness> <dissipation>0</dissipation>
    </PathSpring>
    ```

    ## Use instead
    ```xml
    <PathSpring name="spring">
        <GeometryPath name="path">
            <PathPointSet>
                <objects>
                    <PathPoint name="start"> <socket_parent_frame>/bodyset/thigh</socket_parent_frame> </PathPoint>
                    <PathPoint name="end"> <socket_parent_frame>/bodyset/shank</socket_parent_frame> </PathPoint>
                </objects>
            </PathPointSet>
        </GeometryPath>
        <resting_length>0.1</resting_length> <stiffness>100</stiffness> <dissipation>0</dissipation>
    </PathSpring>
    ```
    """
    for path in subject.each(GeometryPath):
        points = path.path_point_set.objects
        if len(points) < 2 and path._index is not None:
            owner = subject.tree.parent_of(path)
            found(f"the path of {called(owner or path)} has {times(len(points), 'point')} and needs two", path)


@rule("OSIM612", "coincident-path-points", severity=WARNING)
def coincident_path_points(subject: Subject, found: Found) -> None:
    """Two points of a path that follow each other are in the same place.

    ## What it does
    Reports a point fixed at the same place of the same frame as the point before it.

    ## Why is this bad
    The piece between them has no length and no direction; if it is the whole path, the length of the muscle is 0.
    Usually one point was copied and not moved.

    ## Example
    ```xml
    <PathSpring name="spring">
        <GeometryPath name="path">
            <PathPointSet>
                <objects>
                    <PathPoint name="a"> <socket_parent_frame>/bodyset/thigh</socket_parent_frame> </PathPoint>
                    <PathPoint name="b"> <socket_parent_frame>/bodyset/thigh</socket_parent_frame> </PathPoint>
                    <PathPoint name="c"> <socket_parent_frame>/bodyset/shank</socket_parent_frame> </PathPoint>
                </objects>
            </PathPointSet>
        </GeometryPath>
        <resting_length>0.1</resting_length> <stiffness>100</stiffness> <dissipation>0</dissipation>
    </PathSpring>
    ```

    ## Use instead
    ```xml
    <PathSpring name="spring">
        <GeometryPath name="path">
            <PathPointSet>
                <objects>
                    <PathPoint name="a"> <socket_parent_frame>/bodyset/thigh</socket_parent_frame> </PathPoint>
                    <PathPoint name="c"> <socket_parent_frame>/bodyset/shank</socket_parent_frame> </PathPoint>
                </objects>
            </PathPointSet>
        </GeometryPath>
        <resting_length>0.1</resting_length> <stiffness>100</stiffness> <dissipation>0</dissipation>
    </PathSpring>
    ```
    """
    for path in subject.each(GeometryPath):
        points: list[Object] = list(path.path_point_set.objects)
        for before, point in pairwise(points):
            if type(before) is not PathPoint or type(point) is not PathPoint or before.location != point.location:
                continue
            frame = subject.target_of(point, "socket_parent_frame")
            if frame is not None and frame is subject.target_of(before, "socket_parent_frame"):
                owner = subject.tree.parent_of(path)
                found(
                    f"{called(point)} of {called(owner or path)} is in the same place as '{before.name}' before it",
                    point,
                    tag="location",
                )


@rule("OSIM613", "inverted-point-range", severity=WARNING)
def inverted_point_range(subject: Subject, found: Found) -> None:
    """A conditional path point is never in the path.

    ## What it does
    Reports conditional points whose range ends before it begins.

    ## Why is this bad
    The coordinate is never inside, so that the path always leaves the point out.

    ## Example
    ```xml
    <PathSpring name="spring">
        <GeometryPath name="path">
            <PathPointSet>
                <objects>
                    <PathPoint name="a"> <socket_parent_frame>/bodyset/thigh</socket_parent_frame> </PathPoint>
                    <ConditionalPathPoint name="b">
                        <socket_parent_frame>/bodyset/thigh</socket_parent_frame> <location>0 -0.1 0</location>
                        <socket_coordinate>/jointset/knee/knee_angle</socket_coordinate> <range>0 -2</range>
                    </ConditionalPathPoint>
                    <PathPoint name="c"> <socket_parent_frame>/bodyset/shank</socket_parent_frame> </PathPoint>
                </objects>
            </PathPointSet>
        </GeometryPath>
        <resting_length>0.1</resting_length> <stiffness>100</stiffness> <dissipation>0</dissipation>
    </PathSpring>
    ```

    ## Use instead
    ```xml
    <PathSpring name="spring">
        <GeometryPath name="path">
            <PathPointSet>
                <objects>
                    <PathPoint name="a"> <socket_parent_frame>/bodyset/thigh</socket_parent_frame> </PathPoint>
                    <ConditionalPathPoint name="b">
                        <socket_parent_frame>/bodyset/thigh</socket_parent_frame> <location>0 -0.1 0</location>
                        <socket_coordinate>/jointset/knee/knee_angle</socket_coordinate> <range>-2 0</range>
                    </ConditionalPathPoint>
                    <PathPoint name="c"> <socket_parent_frame>/bodyset/shank</socket_parent_frame> </PathPoint>
                </objects>
            </PathPointSet>
        </GeometryPath>
        <resting_length>0.1</resting_length> <stiffness>100</stiffness> <dissipation>0</dissipation>
    </PathSpring>
    ```
    """
    for point in subject.each(ConditionalPathPoint):
        low, high = point.range
        if low > high:
            found(
                f"the range of {called(point)} runs from {quantity(low)} down to {quantity(high)}: it never counts",
                point,
                tag="range",
            )


@rule("OSIM614", "unused-wrap-object", severity=INFO)
def unused_wrap_object(subject: Subject, found: Found) -> None:
    """No path wraps around a wrap surface.

    ## What it does
    Reports wrap objects that no path names.

    ## Why is this bad
    They have no effect; often a path was meant to use them.

    ## Example
    ```xml
    <Body name="thigh">
        <WrapObjectSet>
            <objects> <WrapSphere name="condyle"> <radius>0.03</radius> </WrapSphere> </objects>
        </WrapObjectSet>
        <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia>
    </Body>
    ```

    ## Use instead
    ```xml
    <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    surfaces = list(subject.each(WrapObject))
    if not surfaces or subject.has_unknown:
        return
    used = {id(subject.resolution(use).target) for use in subject.uses if use.reference.target == "WrapObject"}
    for surface in surfaces:
        if id(surface) not in used:
            found(f"no path wraps around {called(surface)}", surface, attribute="name")


def _tabulated(subject: Subject) -> Iterator[Tabulated]:
    for cls in (SimmSpline, GCVSpline, PiecewiseLinearFunction, PiecewiseConstantFunction):
        for function in subject.each(cls):
            if function._index is not None or subject.source is None:
                yield cast("Tabulated", function)
