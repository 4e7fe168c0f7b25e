"""OSIM631 to OSIM634: lengths of paths, measured over the ranges of the coordinates."""

from __future__ import annotations

from osimlite.base.text import join_words
from osimlite.lint.measures import MEASURES, MovingPoint, get_measures
from osimlite.lint.registry import ERROR, INFO, RUNS, WARNING, FindingCollector, Threshold, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object

MIN_DEFAULT_ERROR_M = 5e-6
"""Smallest error of a length in the default pose that messages mention, m."""

OFF = Threshold(
    "wrapping-error",
    0.001,
    "m",
    "largest accepted difference between OpenSim's path length and the length along geodesics",
)


@rule("OSIM631", "wrong-wrapping", severity=WARNING, thresholds=(OFF,), about=MEASURES)
def report_wrong_wrapping(subject: Subject, report: FindingCollector) -> None:
    """OpenSim computes the length of a path around surfaces incorrectly.

    Compares the path length that OpenSim computes with the length along geodesics, the shortest
    lines on the surfaces. Reports a path if the two lengths differ by a millimetre or more. A
    negative number means that OpenSim's path is too short. The rule tries the default pose, and
    nine values of each coordinate over its range, with all other coordinates at their defaults. It
    also tries 64 random poses within the ranges. Paths that OSIM633 reports are left out.

    For a path around several surfaces, OpenSim iterates, but measures the straight segments between
    tangent points of an earlier iteration. Such a path is shorter than possible, and its forces
    have an unbalanced moment. Around a single ellipsoid or torus, and along a cylinder, OpenSim's
    path is not the shortest line. The moment arm is then not the derivative of the length, so the
    work of the muscle does not match its force and length. `osimlite muscles` and `osimlite
    simulate` compute the right lengths with `--wrapping geodesic`.

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
    max_error, measures = subject.config.value_of(OFF), get_measures(subject)
    # Paths through a surface have OSIM633, which says more.
    reported_owners = {item.owner for item in measures.on_surfaces}
    for wrapping in measures.wrappings:
        if abs(wrapping.worst) >= max_error and wrapping.owner not in reported_owners:
            owner = subject.tree.find(wrapping.owner)
            surfaces = join_words([f"'{name}'" for name in wrapping.surfaces])
            # The default pose is mentioned only if it is not the worst pose itself.
            by_default = f"{1000.0 * wrapping.default:.3g} mm in the default pose and by "
            default = (
                by_default
                if wrapping.pose.values and abs(wrapping.default) >= MIN_DEFAULT_ERROR_M
                else ""
            )
            report(
                f"OpenSim's length of the path of {describe_object(owner)} around {surfaces} is "
                f"off by {default}{1000.0 * wrapping.worst:.3g} mm {wrapping.pose}",
                owner,
            )


JUMP = Threshold(
    "path-jump",
    0.001,
    "m",
    "largest accepted jump of a path length; the rule does not search for jumps below 0.001 m",
)


@rule("OSIM632", "path-jump", severity=WARNING, thresholds=(JUMP,), about=MEASURES)
def report_path_jump(subject: Subject, report: FindingCollector) -> None:
    """The length of a path jumps.

    Moves each coordinate through its range, with all other coordinates at their defaults. Reports a
    path if its length jumps by a millimetre or more: a conditional point starts or stops acting, or
    OpenSim finds another route around a surface. Each path is reported once, with its greatest
    jump. The rule checks nine values of each coordinate and the ends of the ranges of conditional
    points. It searches further in intervals in which the length changes differently from the
    neighbouring intervals.

    The muscle force jumps there, and so do accelerations. Integrators take ever smaller steps,
    optimisations have no derivative, and the fibers stretch suddenly by the jump. The moment arm
    does not show the jump. To make the length continuous, replace a conditional point by a wrap
    surface or a moving point.

    ```xml
      <ConditionalPathPoint name="via">
          <socket_coordinate>/jointset/knee/knee_angle</socket_coordinate>
    -     <range>-2.1 -1</range>
    +     <range>-2.1 0</range>
      </ConditionalPathPoint>
    ```
    """
    for jump in get_measures(subject).jumps:
        if jump.size < subject.config.value_of(JUMP):
            continue
        owner = subject.tree.find(jump.owner)
        changed_parts = join_words([f"'{part}'" for part in jump.parts])
        reason = (
            f"the path starts or stops using {changed_parts}"
            if changed_parts
            else "its route changes"
        )
        length = f"the length of the path of {describe_object(owner)}"
        report(f"{length} jumps by {1000.0 * jump.size:.3g} mm {jump.pose}, where {reason}", owner)


@rule("OSIM633", "length-of-wrap", severity=ERROR, about=MEASURES, consequences=(RUNS,))
def report_length_of_wrap(subject: Subject, report: FindingCollector) -> None:
    """OpenSim computes a negative path length on a surface, or finds no path.

    Reports two faults of OpenSim in the default pose and at nine values of each coordinate over its
    range. On the far side of a sphere whose `quadrant` is not `all`, OpenSim subtracts the path
    length on the surface instead of adding it. If the line between two points goes through the
    centre of a sphere, OpenSim finds no tangent points: the path goes straight through the surface.

    The path is too short by centimetres, and its length may even be negative: forces and moment
    arms are wrong. If a path goes through the centre of a sphere, its length jumps there.

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
    for item in get_measures(subject).on_surfaces:
        owner = subject.tree.find(item.owner)
        path = f"the path of {describe_object(owner)}"
        if item.length < 0.0:
            report(
                f"OpenSim computes a length of {1000.0 * item.length:.3g} mm for {path} on "
                f"'{item.surface}' {item.pose}",
                owner,
            )
        else:
            report(
                f"{path} goes straight through '{item.surface}' {item.pose}: OpenSim finds no "
                "tangent points",
                owner,
            )


MADE_UP = Threshold(
    "made-up-path",
    0.001,
    "m",
    "largest accepted distance by which extrapolated functions move a path point",
)
RATE = Threshold(
    "resting-point",
    0.005,
    "m/rad, or m/m",
    "largest accepted speed, relative to the coordinate, of a path point at an end of the range",
)


@rule("OSIM634", "moving-point-range", severity=WARNING, thresholds=(MADE_UP, RATE), about=MEASURES)
def report_moving_point_range(subject: Subject, report: FindingCollector) -> None:
    """A moving path point is not defined over the range of its coordinate.

    Reports moving points whose functions end before the range of their coordinate, if extrapolation
    moves the point by a millimetre or more up to the end of the range. As an info, the rule reports
    points that still move by 5 mm per radian or more at an end of the range. It does so only if
    nothing limits the coordinate: no CoordinateLimitForce acts on it, and it is neither locked nor
    prescribed.

    OpenSim extrapolates functions beyond their ends: a GCVSpline roughly by a parabola, other
    splines by a straight line. The point soon leaves the bone. Outside the range of the coordinate,
    OpenSim keeps a moving point in place. But it computes the speed of the path, the moment arm and
    the work as if the point moved: they contradict the length, and energy is not conserved. In a
    simulation nothing keeps a coordinate in its range, not even `clamped`.

    ```xml
      <MovingPathPoint name="patella">
          <socket_x_coordinate>/jointset/knee/knee_angle</socket_x_coordinate>
    -     <x_location> <SimmSpline> <x>-1 -0.5 0</x> <y>0.02 0.03 0.05</y> </SimmSpline> </x_location>
    +     <x_location> <SimmSpline> <x>-2.1 -1 0</x> <y>0.018 0.02 0.05</y> </SimmSpline> </x_location>
      </MovingPathPoint>
    ```
    """
    made_up, rate = subject.config.value_of(MADE_UP), subject.config.value_of(RATE)
    # A limit force keeps the coordinate in its range, so that the rate beyond does not matter.
    limits = subject.find_by_class("CoordinateLimitForce")
    limited_names = {
        item.name
        for force in limits
        if (item := subject.target_of(force, "coordinate")) is not None
    }
    worst: dict[tuple[str, str], MovingPoint] = {}
    for point in get_measures(subject).moving_points:
        if point.displacement >= made_up or (
            point.rate >= rate and point.end.coordinate not in limited_names
        ):
            # One finding for each point: the largest motion, then the largest rate.
            worst_point = worst.setdefault((point.owner, point.point), point)
            worst[point.owner, point.point] = max(
                worst_point,
                point,
                key=lambda candidate: (
                    candidate.displacement >= made_up,
                    candidate.displacement,
                    candidate.rate,
                ),
            )
    for point in worst.values():
        owner = subject.tree.find(point.owner)
        end = point.end
        names = f"'{point.point}' of {describe_object(owner)}"
        if point.displacement >= made_up:
            report(
                f"the location functions of {names} end {end.format_value(point.beyond, 3)} "
                f"before the range does, at {end}: OpenSim extrapolates them, which "
                f"moves the point by {1000.0 * point.displacement:.3g} mm",
                owner,
            )
        else:
            report(
                f"when '{end.coordinate}' is outside its range, OpenSim keeps {names} fixed, but "
                "computes path speeds and moment arms as if the point moved, by "
                f"{1000.0 * point.rate:.3g} mm per {end.unit or 'unit'} at {end}; keep the "
                "coordinate in its range with a CoordinateLimitForce",
                owner,
                severity=INFO,
            )
