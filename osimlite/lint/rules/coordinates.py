"""OSIM51x: values and ranges of coordinates, and angles that are in degrees."""

from __future__ import annotations

import math

from osimlite.io.document.lexical import format_shortest
from osimlite.lint.fixes import replace_text
from osimlite.lint.registry import (
    ERROR,
    FAILS,
    REFUSES,
    RUNS,
    WARNING,
    FindingCollector,
    Threshold,
    rule,
)
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object, format_quantity
from osimlite.schema.base import Object
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.function_types import PolynomialFunction
from osimlite.schema.functions import Constant, LinearFunction, MultiplierFunction
from osimlite.schema.joints import Joint
from osimlite.schema.splines import (
    GCVSpline,
    PiecewiseConstantFunction,
    PiecewiseLinearFunction,
    SimmSpline,
)
from osimlite.schema.states import list_motions

ANGLE = Threshold(
    "largest-angle",
    10 * math.pi,
    "rad",
    "larger angles of a coordinate are assumed to be in degrees",
)
UNBOUNDED = Threshold(
    "unbounded-angle",
    1000.0,
    "rad",
    "a range with a bound this large or larger has no limit",
)
_ASSEMBLY_ACCURACY = 1e-10
"""Difference from the default value (rad or m) up to which OpenSim 4.6 takes a locked coordinate."""

ORIENTATION = Threshold(
    "largest-orientation",
    2 * math.pi,
    "rad",
    "larger angles of a frame are assumed to be in degrees",
)


@rule("OSIM511", "inverted-range", severity=WARNING, fixes="unsafe", consequences=(REFUSES,))
def report_inverted_range(subject: Subject, report: FindingCollector) -> None:
    """The range of a coordinate ends before it begins.

    Reports ranges whose first number is larger than the second. The finding is an error if the
    coordinate is clamped.

    If the coordinate is clamped, OpenSim rejects the model. Otherwise OpenSim does not check the
    range, but user interfaces and solvers that use the range misbehave.

    ```xml
      <PinJoint name="knee">
          <socket_parent_frame>/bodyset/thigh</socket_parent_frame>
          <socket_child_frame>/bodyset/shank</socket_child_frame>
    -     <coordinates> <Coordinate name="knee_angle"> <range>0 -2.1</range> </Coordinate> </coordinates>
    +     <coordinates> <Coordinate name="knee_angle"> <range>-2.1 0</range> </Coordinate> </coordinates>
      </PinJoint>
    ```
    """
    for coordinate in subject.find_instances(Coordinate):
        low, high = coordinate.range
        if low > high:
            rejected = (
                ": OpenSim rejects a clamped coordinate like this" if coordinate.clamped else ""
            )
            report(
                f"the range of {describe_object(coordinate)} runs from {format_quantity(low)} "
                f"down to {format_quantity(high)}{rejected}",
                coordinate,
                tag="range",
                severity=ERROR if coordinate.clamped else None,
                suggestion=(better := f"{format_shortest(high)} {format_shortest(low)}"),
                fix=replace_text(
                    subject.source, subject.position(coordinate, tag="range"), better, safe=False
                ),
            )


@rule("OSIM512", "default-outside-range", severity=WARNING, consequences=(REFUSES,))
def report_default_outside_range(subject: Subject, report: FindingCollector) -> None:
    """The default value of a coordinate lies outside its range.

    Reports default values outside the range. The finding is an error if the coordinate is clamped.

    If the coordinate is clamped, OpenSim rejects the model. Otherwise the model starts in a pose
    outside the range. Often the range or the default value is in degrees.

    ```xml
    - <Coordinate name="knee_angle"> <default_value>0.3</default_value> <range>-2.1 0</range> </Coordinate>
    + <Coordinate name="knee_angle"> <default_value>-0.3</default_value> <range>-2.1 0</range> </Coordinate>
    ```
    """
    for coordinate in subject.find_instances(Coordinate):
        low, high = coordinate.range
        # Defaults at a bound may differ from it by rounding.
        slack = (
            1e-9 * max(abs(low), abs(high), 1.0)
            if math.isfinite(low) and math.isfinite(high)
            else 0.0
        )
        # Reversed ranges have OSIM511.
        if low <= high and not low - slack <= coordinate.default_value <= high + slack:
            if not math.isfinite(coordinate.default_value):
                continue
            rejected = (
                ": OpenSim rejects a clamped coordinate like this" if coordinate.clamped else ""
            )
            report(
                f"the default value of {describe_object(coordinate)}, "
                f"{format_quantity(coordinate.default_value)}, is outside its range, "
                f"{format_quantity(low)} to {format_quantity(high)}{rejected}",
                coordinate,
                tag="default_value",
                severity=ERROR if coordinate.clamped else None,
            )


@rule("OSIM515", "locked-and-prescribed", severity=ERROR, consequences=(REFUSES, FAILS))
def report_locked_and_prescribed(subject: Subject, report: FindingCollector) -> None:
    """A coordinate is both locked and prescribed.

    Reports such coordinates, unless the function is a constant that equals the default value.

    The lock and the function contradict each other. OpenSim rejects the model, or its integrator
    stops as soon as the function leaves the default value. Unlock the coordinate, or set
    `prescribed` to false.

    ```xml
      <Coordinate name="knee_angle">
    -     <locked>true</locked>
          <prescribed>true</prescribed>
          <prescribed_function>
              <Sine> <amplitude>-0.5</amplitude> <omega>6</omega> </Sine>
          </prescribed_function>
      </Coordinate>
    ```
    """
    for coordinate in subject.find_instances(Coordinate):
        function = coordinate.prescribed_function
        if not (coordinate.locked and coordinate.prescribed) or function is None:
            continue
        # A constant function at the locked value is no contradiction.
        value = get_constant_value(function)
        if value is None or abs(value - coordinate.default_value) > _ASSEMBLY_ACCURACY:
            report(
                f"{describe_object(coordinate)} is locked and prescribed: OpenSim rejects the "
                "model, or stops as soon as the function leaves the default value",
                coordinate,
                tag="locked",
            )


@rule("OSIM513", "prescribed-without-function", severity=ERROR, consequences=(RUNS,))
def report_prescribed_without_function(subject: Subject, report: FindingCollector) -> None:
    """A prescribed coordinate has no function.

    Reports coordinates with `<prescribed>true</prescribed>` and no `<prescribed_function>`.

    OpenSim disables the prescription without a message, and the coordinate moves freely.

    ```xml
      <Coordinate name="knee_angle">
    +     <prescribed_function> <Constant> <value>-0.5</value> </Constant> </prescribed_function>
          <prescribed>true</prescribed>
      </Coordinate>
    ```
    """
    for coordinate in subject.find_instances(Coordinate):
        if coordinate.prescribed and coordinate.prescribed_function is None:
            report(
                f"{describe_object(coordinate)} is prescribed without a prescribed_function: "
                "OpenSim lets it move freely",
                coordinate,
                tag="prescribed",
            )


@rule(
    "OSIM514", "degrees-for-radians", severity=WARNING, thresholds=(ANGLE, UNBOUNDED, ORIENTATION)
)
def report_degrees_for_radians(subject: Subject, report: FindingCollector) -> None:
    """An angle seems to be in degrees.

    Reports rotational coordinates whose default value or range, read in radians, is beyond five
    turns. A coordinate of a CustomJoint is rotational if it drives a rotation by a linear function
    with a slope of 1 or -1. Also reports frames, surfaces and wrap objects that are rotated by more than one turn.

    OpenSim reads these angles in radians, in which 90 is more than fourteen turns. (Only the limits
    of a CoordinateLimitForce are in degrees.)

    ```xml
      <PinJoint name="knee">
          <socket_parent_frame>/bodyset/thigh</socket_parent_frame>
          <socket_child_frame>/bodyset/shank</socket_child_frame>
    -     <coordinates> <Coordinate name="knee_angle"> <range>-120 0</range> </Coordinate> </coordinates>
    +     <coordinates> <Coordinate name="knee_angle"> <range>-2.0943951 0</range> </Coordinate> </coordinates>
      </PinJoint>
    ```
    """
    max_angle, unbounded = subject.config.value_of(ANGLE), subject.config.value_of(UNBOUNDED)
    for joint in subject.find_instances(Joint):
        motions = list_motions(joint)
        for coordinate in joint.coordinates:
            if motions.get(coordinate.name) != "rotational" or not isinstance(
                coordinate, Coordinate
            ):
                continue
            largest = max(
                (abs(bound) for bound in coordinate.range if math.isfinite(bound)), default=0.0
            )
            # Numbers such as 99999.9 mean "no bound".
            if max_angle < largest < unbounded:
                report(
                    f"the range of {describe_object(coordinate)}, "
                    f"{format_quantity(coordinate.range)}, is read in radians; is it in degrees?",
                    coordinate,
                    tag="range",
                    suggestion=" ".join(f"{math.radians(bound):.6g}" for bound in coordinate.range),
                )
            if max_angle < abs(coordinate.default_value) < math.inf:
                report(
                    f"the default value of {describe_object(coordinate)}, "
                    f"{format_quantity(coordinate.default_value)}, is read in radians; is it in "
                    "degrees?",
                    coordinate,
                    tag="default_value",
                    suggestion=f"{math.radians(coordinate.default_value):.6g}",
                )
    largest = subject.config.value_of(ORIENTATION)
    for cls, items in subject.by_class.items():
        specs = cls.field_specs()
        for spec in (specs[tag] for tag in ("orientation", "xyz_body_rotation") if tag in specs):
            for item in items:
                angles = getattr(item, spec.name)
                if any(largest < abs(angle) < math.inf for angle in angles):
                    report(
                        f"{subject.describe_property(item, spec)}, {format_quantity(angles)}, is "
                        "read in radians; is it in degrees?",
                        item,
                        tag=spec.tag,
                        suggestion=" ".join(f"{math.radians(angle):.6g}" for angle in angles),
                    )


def get_constant_value(function: Object | None) -> float | None:
    """Return the value of a function that is constant; None if it changes, or is not known."""
    match function:
        case Constant():
            return function.value
        case MultiplierFunction():
            inner = get_constant_value(function.function)
            return None if inner is None else function.scale * inner
        # The first coefficient is the slope, the second the constant.
        case LinearFunction() if len(function.coefficients) > 1:
            return None if function.coefficients[0] else function.coefficients[1]
        case PolynomialFunction() if function.coefficients:
            return None if any(function.coefficients[:-1]) else function.coefficients[-1]
        case (
            SimmSpline() | GCVSpline() | PiecewiseLinearFunction() | PiecewiseConstantFunction()
        ) if function.y:
            return function.y[0] if len({*function.y}) == 1 else None
    return None
