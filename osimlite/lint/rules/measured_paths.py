"""OSIM631 to OSIM634: lengths of paths, measured over the ranges of the coordinates."""

from __future__ import annotations

from osimlite.base.text import join_words
from osimlite.lint.measures import MEASURES, MovingPoint, measures_of
from osimlite.lint.registry import ERROR, INFO, WARNING, FindingSink, Threshold, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import called

SHOWN = 5e-6
"""Less (m) is no error of the default pose."""

OFF = Threshold(
    "wrapping-error",
    0.001,
    "m",
    "so far may OpenSim's length of a path be from that along geodesics",
)


@rule("OSIM631", "wrong-wrapping", severity=WARNING, thresholds=(OFF,), about=MEASURES)
def wrong_wrapping(subject: Subject, report: FindingSink) -> None:
    """OpenSim computes a path around surfaces wrongly.

    Reports paths whose length in OpenSim is a millimetre or more off that along geodesics, the
    shortest ways on the surfaces, in the default pose, at one of nine values of each coordinate
    over its range, the others as in the default pose, or in one of 64 poses in which all
    coordinates are anywhere in their ranges. A negative number is how much too short OpenSim has
    the path. Paths of OSIM633 are left out.

    Around several surfaces OpenSim looks for the way in rounds, but measures straight pieces
    between tangent points of an earlier round: paths are shorter than they can be, and their forces
    have a moment that nothing bears. Around one surface it goes another way than the shortest on an
    ellipsoid and a torus, and along a cylinder. The moment arm is not the derivative of the length
    then, so that the muscle's work is not what its force and its length say. `osimlite muscles` and
    `osimlite simulate` compute the right lengths with `--wrapping geodesic`.

    ```xml
      <Body name="shank"> <mass>3</mass> <inertia>0.05 0.05 0.005 0 0 0</inertia>
          <WrapObjectSet name="wrapobjectset">
              <objects>
                  <WrapCylinder name="high">
                      <translation>-0.01 -0.12 0</translation> <radius>0.04</radius> <length>0.2</length>
                  </WrapCylinder>
    -             <WrapCylinder name="low">
    -                 <translation>-0.01 -0.28 0</translation> <radius>0.04</radius> <length>0.2</length>
    -             </WrapCylinder>
              </objects>
          </WrapObjectSet>
      </Body>
      <PathPoint name="a"> <socket_parent_frame>/bodyset/shank</socket_parent_frame> </PathPoint>
      <PathPoint name="b"> <location>0 -0.4 0</location> </PathPoint>
      <PathWrapSet>
          <objects>
              <PathWrap name="around_high"> <wrap_object>high</wrap_object> </PathWrap>
    -         <PathWrap name="around_low"> <wrap_object>low</wrap_object> </PathWrap>
          </objects>
      </PathWrapSet>
    ```
    """
    most, measures = subject.config.value_of(OFF), measures_of(subject)
    told = {item.owner for item in measures.on_surfaces}
    for wrapping in measures.wrappings:
        if abs(wrapping.worst) >= most and wrapping.owner not in told:
            owner, surfaces = (
                subject.tree.at(wrapping.owner),
                join_words([f"'{name}'" for name in wrapping.surfaces]),
            )
            by_default = f"{1000.0 * wrapping.default:.3g} mm in the default pose and by "
            default = by_default if wrapping.pose.values and abs(wrapping.default) >= SHOWN else ""
            report(
                f"OpenSim's length of the path of {called(owner)} around {surfaces} is off by {default}"
                f"{1000.0 * wrapping.worst:.3g} mm {wrapping.pose}",
                owner,
            )


JUMP = Threshold(
    "path-jump", 0.001, "m", "so far may a path jump; less than 0.001 is not looked for"
)


@rule("OSIM632", "path-jump", severity=WARNING, thresholds=(JUMP,), about=MEASURES)
def path_jump(subject: Subject, report: FindingSink) -> None:
    """The length of a path jumps.

    Reports paths whose length jumps by a millimetre or more where a coordinate takes a value within
    its range, the others being as in the default pose: since a conditional point comes or goes, or
    since OpenSim finds another way around a surface. Each path is reported once, with its greatest
    jump. Nine values of each coordinate are looked at, the ends of the ranges of conditional
    points, and what lies between two values where the length changes otherwise than next to them.

    The muscle's force jumps there, and so do accelerations: integrators take ever smaller steps,
    optimisations have no derivative, and a fiber is torn at once by as much as the path jumps. The
    moment arm tells nothing of it. A wrap surface, or a moving point, in place of the conditional
    point makes the length continuous.

    ```xml
      <ConditionalPathPoint name="via">
          <socket_coordinate>/jointset/knee/knee_angle</socket_coordinate>
    -     <range>-2.1 -1</range>
    +     <range>-2.1 0</range>
      </ConditionalPathPoint>
    ```
    """
    for jump in measures_of(subject).jumps:
        if jump.size < subject.config.value_of(JUMP):
            continue
        owner = subject.tree.at(jump.owner)
        parts = join_words([f"'{part}'" for part in jump.parts])
        why = (
            f"{parts} {'come or go' if len(jump.parts) > 1 else 'comes or goes'}"
            if parts
            else "its way changes"
        )
        length = f"the length of the path of {called(owner)}"
        report(f"{length} jumps by {1000.0 * jump.size:.3g} mm {jump.pose}, where {why}", owner)


@rule("OSIM633", "length-of-wrap", severity=ERROR, about=MEASURES)
def length_of_wrap(subject: Subject, report: FindingSink) -> None:
    """OpenSim computes a negative length of a path on a surface, or none.

    Reports wraps of which OpenSim subtracts the length of the path on the surface instead of adding
    it, which happens on the far side of a sphere whose `quadrant` is not all of it; and wraps for
    which it finds no points, so that the path goes straight through the surface, which happens
    where the line between the points goes through the middle of a sphere. Looked at are the default
    pose, and nine values of each coordinate over its range.

    The path is too short, by centimetres and perhaps below zero; forces and moment arms are those
    of another path. Where a path goes through the middle of a sphere its length jumps.

    ```xml
      <PathPoint name="band_a"> <location>-0.039 -0.18 0</location> </PathPoint>
      <PathPoint name="band_b">
          <socket_parent_frame>/bodyset/thigh</socket_parent_frame> <location>-0.039 -0.22 0.001</location>
      </PathPoint>
      <WrapSphere name="condyle">
    -     <quadrant>x</quadrant> <translation>0 -0.2 0</translation> <radius>0.04</radius>
    +     <quadrant>-x</quadrant> <translation>0 -0.2 0</translation> <radius>0.04</radius>
      </WrapSphere>
    ```
    """
    for item in measures_of(subject).on_surfaces:
        owner = subject.tree.at(item.owner)
        path = f"the path of {called(owner)}"
        if item.length < 0.0:
            report(
                f"OpenSim counts {path} on '{item.surface}' as {1000.0 * item.length:.3g} mm {item.pose}",
                owner,
            )
        else:
            report(
                f"{path} goes straight through '{item.surface}' {item.pose}: OpenSim finds no points",
                owner,
            )


MADE_UP = Threshold(
    "made-up-path",
    0.001,
    "m",
    "a moving point may move by so much where its functions are not given",
)
RATE = Threshold(
    "resting-point",
    0.005,
    "m per rad or m",
    "a point that rests outside a range may be said to move so",
)


@rule("OSIM634", "moving-point-range", severity=WARNING, thresholds=(MADE_UP, RATE), about=MEASURES)
def moving_point_range(subject: Subject, report: FindingSink) -> None:
    """A moving path point has no place for all values of its coordinate.

    Reports moving points whose functions end before the range of their coordinate does, and make
    the point move on by a millimetre or more from there to the end of the range. As an info it
    reports those whose place would go on changing at an end of the range by 5 mm per radian or
    more, if nothing keeps the coordinate within: that is, if no CoordinateLimitForce acts on it and
    it is neither locked nor prescribed.

    Where functions are not given OpenSim prolongs them: a spline by a straight line, a GCVSpline by
    a parabola or so, which soon leads off the bone. Outside the range of the coordinate a moving
    point rests in OpenSim, while the speed of the path, its moment arm and its work go on as if the
    point moved: the length and its rate contradict each other, and energy is not conserved. Nothing
    keeps a coordinate in its range in a simulation, `clamped` neither.

    ```xml
      <MovingPathPoint name="patella">
          <socket_x_coordinate>/jointset/knee/knee_angle</socket_x_coordinate>
    -     <x_location> <SimmSpline> <x>-1 -0.5 0</x> <y>0.02 0.03 0.05</y> </SimmSpline> </x_location>
    +     <x_location> <SimmSpline> <x>-2.1 -1 0</x> <y>0.018 0.02 0.05</y> </SimmSpline> </x_location>
      </MovingPathPoint>
    ```
    """
    made_up, rate = subject.config.value_of(MADE_UP), subject.config.value_of(RATE)
    limits = subject.named("CoordinateLimitForce")
    kept = {
        item.name
        for force in limits
        if (item := subject.target_of(force, "coordinate")) is not None
    }
    worst: dict[tuple[str, str], MovingPoint] = {}
    for point in measures_of(subject).moving_points:
        if point.moved >= made_up or (point.rate >= rate and point.end.coordinate not in kept):
            other = worst.setdefault((point.owner, point.point), point)
            worst[point.owner, point.point] = max(
                other, point, key=lambda it: (it.moved >= made_up, it.moved, it.rate)
            )
    for point in worst.values():
        owner, end = subject.tree.at(point.owner), point.end
        names = f"'{point.point}' of {called(owner)}"
        if point.moved >= made_up:
            report(
                f"the functions of the place of {names} end {end.sized(point.beyond, 3)} before the range of "
                f"'{end.coordinate}': OpenSim lets it move on by {1000.0 * point.moved:.3g} mm, to its place at {end}",
                owner,
            )
        else:
            report(
                f"beyond the range of '{end.coordinate}', which nothing keeps it in, {names} rests and OpenSim goes on "
                f"as if it moved, by {1000.0 * point.rate:.3g} mm per {end.unit or 'unit'} at {end}",
                owner,
                severity=INFO,
            )
